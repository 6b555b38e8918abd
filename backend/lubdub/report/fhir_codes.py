"""The words of FHIR that are our own: a code for each listening area and measure, and how SNOMED CT would say it."""

from __future__ import annotations

from typing import Any

from lubdub.results import AREA_NAMES, AreaName

AREAS: dict[AreaName, str] = {
    "aortic": "Aortic listening area on the skin of the chest",
    "pulmonary": "Pulmonary listening area on the skin of the chest",
    "tricuspid": "Tricuspid listening area on the skin of the chest",
    "mitral": "Mitral listening area on the skin of the chest",
}
MEASURES: dict[str, str] = {
    "listening-area": "Place of a heart-listening area on the skin",
    "fit-quality": "How well the reference body fits the scan",
    "x": "First coordinate, in the scan's own frame and unit",
    "y": "Second coordinate, in the scan's own frame and unit",
    "z": "Third coordinate, in the scan's own frame and unit",
    "radius": "Radius of the region that holds the true place 9 times in 10",
    "distance-suprasternal-notch": "Straight distance to the upper edge of the breastbone",
    "distance-xiphisternum": "Straight distance to the lower end of the breastbone",
    "surface-residual": "Mean distance between fitted body and scan",
    "landmark-residual": "Mean distance between fitted and marked landmarks",
    "coverage": "Share of the chest that is on the scan",
    "spread": "Spread of the places between methods and references",
    "locate-areas": "Find the four heart-listening areas on a scan of the chest",
    "placement-report": "Where to put the stethoscope",
}

SNOMED = "http://snomed.info/sct"
SNOMED_SKIN: dict[AreaName, tuple[str, str]] = {
    "aortic": ("1290342004", "Structure of right half of anterior chest wall"),
    "pulmonary": ("1290343009", "Structure of left half of anterior chest wall"),
    "tricuspid": ("1290343009", "Structure of left half of anterior chest wall"),
    "mitral": ("1290343009", "Structure of left half of anterior chest wall"),
}
"""The skin on which the area lies. Never the valve: the place is where it is heard, not where it is."""
SNOMED_AUSCULTATION = ("37931006", "Auscultation")


class Codes:
    """Codings in the chosen systems. base: the first part of our systems' names, without a slash at the end."""

    def __init__(self, base: str, has_snomed: bool) -> None:
        """has_snomed: whether SNOMED CT codings are given beside our own; it needs a licence in many countries."""
        self.base = base
        self.has_snomed = has_snomed

    @property
    def areas(self) -> str:
        """The name of the code system of the four areas."""
        return f"{self.base}/CodeSystem/listening-area"

    @property
    def measures(self) -> str:
        """The name of the code system of what is measured and done."""
        return f"{self.base}/CodeSystem/measure"

    def area(self, name: AreaName) -> dict[str, Any]:
        """The CodeableConcept of an area."""
        codings = [{"system": self.areas, "code": name, "display": AREAS[name]}]
        if self.has_snomed:
            codings.append(_snomed(SNOMED_SKIN[name]))
        return {"coding": codings, "text": AREAS[name]}

    def measure(self, code: str) -> dict[str, Any]:
        """The CodeableConcept of something measured or done."""
        coding = {"system": self.measures, "code": code, "display": MEASURES[code]}
        return {"coding": [coding], "text": MEASURES[code]}

    def auscultation(self) -> dict[str, Any]:
        """What the places are for."""
        said: dict[str, Any] = {"text": "Auscultation of the heart"}
        return said | {"coding": [_snomed(SNOMED_AUSCULTATION)]} if self.has_snomed else said

    def code_systems(self) -> dict[str, dict[str, Any]]:
        """Our two code systems as FHIR resources, by their ids."""
        return {
            "listening-area": self._system("listening-area", "Heart-listening areas", dict(AREAS)),
            "measure": self._system("measure", "What Lubdub measures and does", MEASURES),
        }

    def concept_map(self) -> dict[str, Any]:
        """How our four codes relate to SNOMED CT: each is a place within that half of the chest wall."""
        elements = [
            {
                "code": name,
                "display": AREAS[name],
                "target": [{"code": code, "display": display, "equivalence": "wider"}],
            }
            for name in AREA_NAMES
            for code, display in (SNOMED_SKIN[name],)
        ]
        return {
            "resourceType": "ConceptMap",
            "id": "listening-area-to-snomed",
            "url": f"{self.base}/ConceptMap/listening-area-to-snomed",
            "name": "ListeningAreaToSnomed",
            "status": "active",
            "group": [{"source": self.areas, "target": SNOMED, "element": elements}],
        }

    def _system(self, code: str, title: str, concepts: dict[Any, str]) -> dict[str, Any]:
        return {
            "resourceType": "CodeSystem",
            "id": code,
            "url": f"{self.base}/CodeSystem/{code}",
            "name": "".join(word.title() for word in code.split("-")),
            "title": title,
            "status": "active",
            "content": "complete",
            "caseSensitive": True,
            "count": len(concepts),
            "concept": [{"code": name, "display": display} for name, display in concepts.items()],
        }


def _snomed(coded: tuple[str, str]) -> dict[str, str]:
    return {"system": SNOMED, "code": coded[0], "display": coded[1]}
