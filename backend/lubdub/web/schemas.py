"""The shapes of REST: what comes in is checked here, what goes out is documented here."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, FiniteFloat

from lubdub.cases.screening import may_be_pregnant
from lubdub.cases.sharing import SharingYes
from lubdub.cases.states import Status
from lubdub.cases.values import Answer, Case, Consent, NewCase, Receipt
from lubdub.web.pages.samples import Sample
from lubdub.web.problems import MEDIA_TYPE, PROBLEMS

CHILD_BELOW = 16
"""Years: pages in a portal's frame speak to the parents of the younger ones."""
Said = bool | Literal["unsure"]
Coordinate = Annotated[FiniteFloat, Field(ge=-1e7, le=1e7)]
Point = Annotated[list[Coordinate], Field(min_length=3, max_length=3, examples=[[0.01, 0.32, 0.11]])]


class Strict(BaseModel):
    """Refuses members it does not know: a misspelt landmark must not pass in silence."""

    model_config = ConfigDict(extra="forbid")


class PatientIn(Strict):
    """The person on the scan."""

    age_years: FiniteFloat = Field(ge=0, le=120, description="Age in years, with fractions for babies.")
    sex: Literal["female", "male"]
    posture: Literal["supine", "sitting"] = "supine"


class AnswersIn(Strict):
    """The three questions a scan cannot answer. A yes refuses the case; not asked counts as unsure.

    Only of a late pregnancy, not asked counts as no where there can be none: in men, and below 12 and from 60 years.
    """

    heart_on_right: Said = "unsure"
    chest_operation_or_device: Said = "unsure"
    late_pregnancy: Said = "unsure"


class ConsentIn(Strict):
    """The yes that you hold. It stays with the case and goes into its FHIR bundle."""

    version: str = Field(min_length=1, max_length=100, description="Of the words that were agreed to.")
    language: str = Field(min_length=2, max_length=35, description="In which they were read, such as `en`.")
    given_at: AwareDatetime
    child: Literal["agreed", "too_young"] | None = Field(None, description="What the child said, if it is one.")

    def to_value(self) -> Consent:
        """As the store takes it."""
        return Consent(self.version, self.language, self.given_at, self.child)


class SharingIn(Strict):
    """The family's separate yes, which you hold: the bare shape of the chest may be kept as a reference body."""

    version: str = Field(min_length=1, max_length=100, description="Of the words that were agreed to.")
    language: str = Field(min_length=2, max_length=35, description="In which they were read, such as `en`.")
    given_at: AwareDatetime

    def to_value(self) -> SharingYes:
        """As the store takes it."""
        return SharingYes(self.version, self.language, self.given_at)


class SharingOut(BaseModel):
    """The yes as it is kept, or null when nobody has agreed or it was taken back."""

    agreed: SharingIn | None

    @staticmethod
    def of(yes: SharingYes | None) -> SharingOut:
        """From the store's value."""
        if yes is None:
            return SharingOut(agreed=None)
        return SharingOut(agreed=SharingIn(version=yes.version, language=yes.language, given_at=yes.given_at))


class CaseIn(Strict):
    """A new case."""

    patient: PatientIn
    answers: AnswersIn = Field(default_factory=AnswersIn)
    external_id: str | None = Field(None, max_length=200, description="Your own number for it; no name, please.")
    consent: ConsentIn | None = None

    def to_value(self) -> NewCase:
        """As the store takes it."""
        pregnancy = _answer(self.answers.late_pregnancy)
        if pregnancy == "unsure" and not may_be_pregnant(self.patient.sex, self.patient.age_years):
            pregnancy = "no"
        return NewCase(
            age_years=self.patient.age_years,
            sex=self.patient.sex,
            posture=self.patient.posture,
            answers={
                "heart_on_right": _answer(self.answers.heart_on_right),
                "chest_operation_or_device": _answer(self.answers.chest_operation_or_device),
                "late_pregnancy": pregnancy,
            },
            external_id=self.external_id,
            person="child" if self.patient.age_years < CHILD_BELOW else "other",
            consent=None if self.consent is None else self.consent.to_value(),
        )


class LandmarksIn(Strict):
    """Points in the file's own coordinates and unit. Left and right are the patient's own. Any may be missing."""

    suprasternal_notch: Point | None = None
    xiphisternum: Point | None = None
    navel: Point | None = None
    nipple_left: Point | None = None
    nipple_right: Point | None = None

    def placed(self) -> dict[str, list[float]]:
        """Those that were given."""
        return self.model_dump(exclude_none=True)


class UnitIn(Strict):
    """The unit of the file's coordinates, as a person said."""

    unit: Literal["m", "cm", "mm"]


class ReasonOut(BaseModel):
    """Why nothing is shown: a stable code, one sentence, and what to do."""

    code: str
    message: str
    advice: str


LEAVES = ("scan", "landmarks", "events", "result", "view.html", "sheet.pdf", "scan.ply", "fhir")
"""What stands below a case's own address."""


class CaseOut(BaseModel):
    """A case as it stands."""

    id: str
    status: Status = Field(
        description="Where the case stands. in_review: its result was sent to the clinician; reviewed: it was signed; "
        "returned: the clinician asks for a new scan or other points; unusable: no places may be used."
    )
    external_id: str | None
    stage: str | None = Field(description="What is being done now: read, clean, choose, fit, judge ...")
    fraction: float = Field(description="How much of it is done, 0 to 1.")
    reason: ReasonOut | None
    method: Literal["lubdub", "paper", "rule"]
    sandbox: bool = Field(description="Whether this is a made-up case, for trying out.")
    created_at: datetime
    updated_at: datetime
    links: dict[str, str]

    @staticmethod
    def of(case: Case) -> CaseOut:
        """From the store's value."""
        own = f"/api/v1/cases/{case.id}"
        return CaseOut(
            id=case.id,
            status=case.status,
            external_id=case.external_id,
            stage=case.stage,
            fraction=case.fraction,
            reason=None if case.reason is None else ReasonOut.model_validate(case.reason),
            method=case.method,
            sandbox=case.person == "sample",
            created_at=case.created_at,
            updated_at=case.updated_at,
            links={"self": own} | {name: f"{own}/{name}" for name in LEAVES},
        )


class CasesOut(BaseModel):
    """One page of cases."""

    items: list[CaseOut]
    next_cursor: str | None = Field(description="Asks for the next page; null on the last one.")


class ReceiptOut(BaseModel):
    """Proof of a deletion."""

    id: str
    deleted_at: datetime
    sha256: str = Field(description="Hash of the line in the audit trail.")

    @staticmethod
    def of(receipt: Receipt) -> ReceiptOut:
        """From the store's value."""
        return ReceiptOut(id=receipt.id, deleted_at=receipt.deleted_at, sha256=receipt.sha256)


class SampleOut(BaseModel):
    """A made-up body."""

    name: str
    patient: PatientIn
    landmarks: LandmarksIn = Field(description="As `PUT /cases/{id}/landmarks` takes them.")
    scan: str = Field(description="Address of its file.")

    @staticmethod
    def of(sample: Sample) -> SampleOut:
        """From the sample's card."""
        who = sample.patient
        return SampleOut(
            name=sample.name,
            patient=PatientIn(age_years=who.age_years, sex=who.sex, posture=who.posture),
            landmarks=LandmarksIn.model_validate(sample.landmarks),
            scan=f"/api/v1/samples/{sample.name}/scan",
        )


class SamplesOut(BaseModel):
    """All made-up bodies, youngest first."""

    items: list[SampleOut]


class ProblemOut(BaseModel):
    """RFC 9457 problem details."""

    type: str
    title: str
    status: int
    detail: str
    instance: str | None = None
    errors: list[dict[str, Any]] | None = Field(None, description="Of `invalid-input`: where it does not fit, and why.")


def problems(*kinds: str) -> dict[int | str, dict[str, Any]]:
    """The `responses` of an endpoint that may end in these problems."""
    by_status: dict[int | str, dict[str, Any]] = {}
    for kind in kinds:
        known = PROBLEMS[kind]
        said = by_status.setdefault(
            known.status,
            {"description": "", "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/ProblemOut"}}}},
        )
        said["description"] = " or ".join(filter(None, (said["description"], f"{known.title} (`/problems/{kind}`)")))
    return by_status


def _answer(said: Said) -> Answer:
    if said == "unsure":
        return "unsure"
    return "yes" if said else "no"
