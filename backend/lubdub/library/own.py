"""Reference bodies of one's own: signed cases, bent onto the shared topology by the fit, without any texture."""

from __future__ import annotations

import hashlib
import io
import json
import secrets
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lubdub.geometry.anchors import Anchors, anchored
from lubdub.geometry.surface import Surface
from lubdub.library.load import SHIPPED, bodies_home, load_library
from lubdub.library.marks import FOLDER, put_text
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, AreaName, LandmarkName, Reference

OFF_SKIN_MM = 15.0
"""A mark this far from the fitted body says that the body is not fitted there."""
STEP_MM = 1.0 / 256.0
SOURCE = "a signed case of this service, shape alone"
METHOD = "Shape: the body that was fitted to the scan. Bones as marked. Areas as the clinician signed them."


@dataclass(frozen=True)
class OwnBody:
    """A signed case as a body. surface: the fitted body, mm; landmarks, areas: name -> (3,), the areas as signed.

    All in one frame with +x the patient's left, +y head, +z front. placed_by: who signed; case: to know whose consent
    it rests on.
    """

    surface: Surface
    landmarks: Mapping[LandmarkName, np.ndarray]
    areas: Mapping[AreaName, np.ndarray]
    age_years: float
    sex: str
    placed_by: str
    case: str


def add_body(folder: Path, body: OwnBody) -> str:
    """Write the body into a folder of references and return its id; the shipped bodies come along into a new folder.

    Raises ValueError when it cannot serve, LibraryDamaged when the folder does not load.
    """
    if any(card.get("case") == body.case and not card.get("disabled") for card in cards(folder)):
        raise ValueError("This case is a reference body already.")
    begin(folder)
    library = load_library(folder)
    if len(body.surface.vertices) != len(library.basis.mean):
        raise ValueError("The fitted body has another topology than the references: run the case again.")
    missing = [name for name in LANDMARK_NAMES if name not in body.landmarks]
    if missing:
        raise ValueError(f"These points are not known on this body: {', '.join(missing)}.")
    name = f"own-{secrets.token_hex(4)}"
    home = folder / "bodies" / name
    content = _content(body)
    home.mkdir()
    (home / "body.npz").write_bytes(content)
    _write_card(home, _card(name, body, hashlib.sha256(content).hexdigest()))
    return name


def begin(folder: Path) -> None:
    """Bring the shipped bodies along into a folder that has none yet, all at once."""
    if not (folder / "bodies").is_dir():
        shutil.copytree(SHIPPED / "bodies", folder / "bodies.new", dirs_exist_ok=True)
        (folder / "bodies.new").rename(folder / "bodies")


def cards(folder: Path | None) -> list[dict[str, Any]]:
    """What each body's card says, disabled ones too. folder: None for the shipped ones."""
    home = bodies_home(folder)
    return [json.loads(path.read_text()) for path in sorted((home / "bodies").glob("*/card.json"))]


def disable(folder: Path, name: str) -> bool:
    """Let a body serve no more; its files stay. False when there is no such body."""
    begin(folder)
    if not any(card["id"] == name for card in cards(folder)):
        return False
    home = folder / "bodies" / name
    _write_card(home, json.loads((home / "card.json").read_text()) | {"disabled": True})
    return True


def remove(folder: Path, name: str) -> None:
    """Take a body's files and all marks on it away: nobody agrees to its keeping any more."""
    (folder / "bodies" / name / "card.json").unlink()  # first: a body without a card serves nobody who reads meanwhile
    shutil.rmtree(folder / "bodies" / name)
    shutil.rmtree(folder / FOLDER / name, ignore_errors=True)


def faults(reference: Reference) -> list[str]:
    """What is wrong with a body's marks, in words; empty when nothing is."""
    found = []
    marks: dict[str, np.ndarray] = dict([*reference.landmarks.items(), *reference.areas.items()])
    for name, place in marks.items():
        on_skin = anchored(reference.surface, place[None]).on(reference.surface.vertices)[0]
        if np.linalg.norm(on_skin - place) > 1.0:
            found.append(f"{name} does not lie on the skin")
    down = [marks[name][1] for name in ("suprasternal_notch", "xiphisternum", "navel")]
    if not down[0] > down[1] > down[2]:
        found.append("notch, xiphisternum and navel do not follow each other from head to foot")
    if not marks["nipple_left"][0] > marks["nipple_right"][0] or not marks["pulmonary"][0] > marks["aortic"][0]:
        found.append("left and right are swapped")
    return found


def check(folder: Path | None) -> dict[str, list[str]]:
    """Body -> its faults, for every body that serves. Raises LibraryDamaged."""
    return {reference.id: faults(reference) for reference in load_library(folder).references}


def _content(body: OwnBody) -> bytes:
    notch = body.landmarks["suprasternal_notch"]
    landmarks = _on_body(body, [body.landmarks[name] for name in LANDMARK_NAMES])
    areas = _on_body(body, [body.areas[name] for name in AREA_NAMES])
    vertices = _rounded(body.surface.vertices - notch)
    arrays = {"vertices": vertices, **_marks("landmark", landmarks, vertices), **_marks("area", areas, vertices)}
    packed = io.BytesIO()
    np.savez_compressed(packed, allow_pickle=False, **arrays)
    return packed.getvalue()


def _on_body(body: OwnBody, places: list[np.ndarray]) -> Anchors:
    points = np.array(places, float)
    anchors = anchored(body.surface, points)
    if np.linalg.norm(anchors.on(body.surface.vertices) - points, axis=1).max() > OFF_SKIN_MM:
        raise ValueError("The fitted body does not reach the marked skin; it cannot serve as a reference.")
    return anchors


def _marks(name: str, anchors: Anchors, vertices: np.ndarray) -> dict[str, np.ndarray]:
    return {
        f"{name}_positions": anchors.on(vertices.astype(float)).astype(np.float32),
        f"{name}_corners": anchors.corners.astype(np.int32),
        f"{name}_weights": anchors.weights.astype(np.float32),
    }


def _card(name: str, body: OwnBody, sha256: str) -> dict[str, Any]:
    length = float(np.linalg.norm(body.landmarks["suprasternal_notch"] - body.landmarks["xiphisternum"]))
    return {
        "id": name,
        "age_years": round(body.age_years, 1) if body.age_years < 3 else float(round(body.age_years)),
        "sex": body.sex,
        "sternum_mm": round(length, 1),
        "description": "signed case",
        "posture": "supine",
        "source": SOURCE,
        "licence": "by the family's consent, for this service alone",
        "placed_by": body.placed_by,
        "method": METHOD,
        "case": body.case,
        "sha256": sha256,
    }


def _write_card(home: Path, card: Mapping[str, Any]) -> None:
    put_text(home / "card.json", json.dumps(card, indent=2) + "\n")


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.asarray(np.round(values / STEP_MM) * STEP_MM, np.float32)
