"""`lubdub admin references`: from a signed case to a reference body, and away again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lubdub import cli
from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.people import People
from lubdub.cases.privacy import Privacy
from lubdub.cases.review import Reviews
from lubdub.cases.reviewing import Reviewer
from lubdub.cases.sharing import Sharing
from lubdub.cases.store import Asked, CaseStore
from lubdub.cases.values import Actor
from lubdub.cases.work import Handed, WorkDesk
from lubdub.library.load import load_library
from lubdub.library.marks import AreaMarks, Step, write_marks
from lubdub.report.archive import outcome_to_bytes
from lubdub.results import AREA_NAMES, Area, Fit, Landmark, Outcome
from lubdub.settings import Settings
from tests.cases.conftest import girl_of_six
from tests.cases.test_store import CHECKED
from tests.views import sample


def fitted_outcome() -> Outcome:
    """A result whose fitted body is a reference body: its marks lie on it."""
    girl = next(one for one in load_library().references if one.id == "girl-06")
    fit = Fit(girl.surface, {}, {}, 1.0, 1.0, 0.5)
    areas = {name: Area(girl.areas[name], girl.surface.normals[0], 10.0, "") for name in AREA_NAMES}
    landmarks = {name: Landmark(place, "given", 5.0) for name, place in girl.landmarks.items()}
    return replace(sample.outcome(), fit=fit, areas=areas, landmarks=landmarks)


class Clinic:
    """A service's data folder with one signed case, worked on from outside."""

    def __init__(self, settings: Settings) -> None:
        self.database = Database(settings.database)
        self.vault = FileVault(self.database, settings.store, settings.master_key_source)
        key, _ = People(self.database).create_key("clinic", ["cases:read", "cases:write"])
        self.portal = Actor("key", key.id, key.tenant_id)
        self.sharing = Sharing(self.database)

    def signed(self) -> str:
        store, desk, reviews = CaseStore(self.database, self.vault), WorkDesk(self.database, self.vault), self.reviews
        case, _ = store.create(self.portal, girl_of_six())
        _, check = store.receive_scan(self.portal, case.id, self.vault.seal(case.id, "scan", b"skin"), None)
        desk.hand_in(check, CHECKED)
        _, locate = store.place_landmarks(self.portal, case.id, Asked({}))
        desk.hand_in(locate, Handed("done", {"outcome.npz": outcome_to_bytes(fitted_outcome())}))
        store.send_for_review(self.portal, case.id)
        by = Reviewer(Actor("clinician", "mori", self.portal.tenant_id), "Dr. Aiko Mori")
        version = 0
        for name in AREA_NAMES:
            version = reviews.look(by, case.id, version, name).version
        reviews.sign(by, case.id, version)
        return case.id

    @property
    def reviews(self) -> Reviews:
        return Reviews(self.database, self.vault)


@pytest.fixture
def clinic(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Clinic:
    monkeypatch.setenv("LUBDUB_DATA_DIR", str(tmp_path / "data"))
    monkeypatch.setenv("LUBDUB_REFERENCES_DIR", str(tmp_path / "ours"))
    return Clinic(Settings())


def run(capfd: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = cli.main(["admin", "references", *words])
    out, err = capfd.readouterr()
    return code, out, err


def test_a_signed_case_with_the_familys_yes_becomes_a_reference_and_goes_with_it(
    clinic: Clinic, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    case = clinic.signed()
    code, _, err = run(capfd, "add", case)
    assert (code, err.count("\n")) == (2, 1)
    assert "not agreed" in err
    clinic.sharing.agree(clinic.portal, case, "en")
    code, out, _ = run(capfd, "add", case)
    name = out.split()[0]
    assert code == 0
    assert f"{name}  serves  6 years  female  placed by: Dr. Aiko Mori" in run(capfd, "list")[1]
    assert run(capfd, "check")[1].endswith(" bodies checked, 0 with faults.\n")
    assert "./lubdub benchmark references" in out
    assert run(capfd, "disable", name)[0] == 0
    assert f"{name}  disabled" in run(capfd, "list")[1]
    Privacy(clinic.database, clinic.vault).delete(clinic.portal, case)
    assert f"{name}: nobody agrees" in run(capfd, "check")[1]
    assert name not in run(capfd, "list")[1]
    assert not (tmp_path / "ours" / "bodies" / name).exists()


def test_without_a_folder_of_its_own_a_service_keeps_its_bodies_with_its_data(
    clinic: Clinic, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("LUBDUB_REFERENCES_DIR")
    assert "girl-06  serves  6 years  female  placed by: anatomy table, no clinician" in run(capfd, "list")[1]
    assert run(capfd, "disable", "girl-06")[0] == 0
    assert "girl-06  disabled" in run(capfd, "list")[1]
    assert (tmp_path / "data" / "references" / "bodies" / "girl-06").is_dir()
    assert "girl-06" in [one.id for one in load_library().references], "the shipped ones never change"
    code, _, err = run(capfd, "disable", "nobody")
    assert (code, err.count("\n")) == (2, 1)


def test_many_machines_need_a_folder_that_they_share(
    clinic: Clinic, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("LUBDUB_REFERENCES_DIR")
    monkeypatch.setenv("LUBDUB_STORE_URL", "s3://scans")
    assert "girl-06  serves" in run(capfd, "list")[1]
    code, _, err = run(capfd, "disable", "girl-06")
    assert (code, err.count("\n")) == (2, 1)
    assert "LUBDUB_REFERENCES_DIR" in err


def test_marks_are_listed_with_their_spread_and_withdrawn(
    clinic: Clinic, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    girl = next(one for one in load_library().references if one.id == "girl-06")
    for who, aside in (("mori", 0.0), ("silva", 6.0)):
        steps = tuple(Step(name, girl.areas[name] + [aside, 0.0, 0.0]) for name in AREA_NAMES)
        at = "2026-01-02T03:04:05+00:00"
        write_marks(tmp_path / "ours", AreaMarks("girl-06", girl.card["sha256"], who, f"Dr {who}", "t", steps, 4, at))
    listed = run(capfd, "list")[1]
    assert "girl-06  serves  6 years  female  placed by: Dr mori and Dr silva" in listed
    assert "    marked by Dr silva (silva), handed in 2026-01-02" in listed
    assert "    the two lie apart: aortic 6 mm, pulmonary 6 mm, tricuspid 6 mm, mitral 6 mm" in listed
    assert run(capfd, "withdraw", "girl-06", "silva")[0] == 0
    listed = run(capfd, "list")[1]
    assert "girl-06  serves  6 years  female  placed by: anatomy table" in listed
    assert "Dr silva" not in listed
    code, _, err = run(capfd, "withdraw", "girl-06", "../silva")
    assert (code, err.count("\n")) == (2, 1)


def test_a_case_that_is_not_there_is_said_in_one_line(clinic: Clinic, capfd: pytest.CaptureFixture[str]) -> None:
    code, _, err = run(capfd, "add", "nobody")
    assert (code, err.count("\n")) == (2, 1)
