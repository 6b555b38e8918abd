"""What a family and a portal see of a clinician's decision."""

from __future__ import annotations

import json
from collections.abc import Iterator
from html import unescape

import numpy as np
import pytest

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.review import Decision, Reviews
from lubdub.cases.reviewing import Reviewer
from lubdub.cases.values import FAMILIES, Actor
from lubdub.geometry.skin_walk import SkinWalker
from lubdub.report.result_json import result_json
from lubdub.results import AREA_NAMES
from lubdub.settings import Settings
from tests.views import sample
from tests.web.family import Family
from tests.web.pages.test_result import text_of
from tests.web.service import Service, free_port

MORI = Reviewer(Actor("clinician", "mori", FAMILIES), "Dr. Aiko Mori")


@pytest.fixture(scope="module")
def clinic(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("clinic")
    settings = Settings(
        data_dir=folder / "data", port=free_port(), requests_per_minute=100_000, job_cpu_s=1, clinic_name="Dr. Park"
    )
    running = Service(settings)
    try:
        running.start_web()
        running.start_worker()
        yield running
    finally:
        running.stop()


@pytest.fixture
def family(clinic: Service) -> Family:
    return Family(clinic)


def sent(family: Family) -> str:
    case = family.done()
    family.post(f"/cases/{case}/send")
    return case


def desk_of(family: Family) -> Reviews:
    settings = family.service.settings
    database = Database(settings.database)
    return Reviews(database, FileVault(database, settings.store, settings.master_key_source))


def signed(family: Family, moved_mm: float = 0.0, case: str | None = None) -> str:
    """A signed case, its mitral place moved so far to the patient's left."""
    case, reviews = case or sent(family), desk_of(family)
    version = reviews.read(MORI.actor, case).version
    for name in AREA_NAMES:
        version = reviews.look(MORI, case, version, name).version
    if moved_mm:
        scan = sample.clean_scan()
        walker = SkinWalker(scan.display, scan.points, scan.normals)
        place = walker.walk(sample.outcome().areas["mitral"].position, moved_mm, 0.0)
        x, y, z = scan.body_from_file.inverse().apply(place)
        version = reviews.move(MORI, case, version, "mitral", (float(x), float(y), float(z))).version
    reviews.sign(MORI, case, version)
    return case


def test_the_family_reads_who_signed_and_which_place_was_moved(family: Family) -> None:
    page = unescape(family.get(f"/cases/{signed(family, 12.0)}/result"))
    assert "Checked and signed by Dr. Aiko Mori" in page
    assert page.count("The clinician agrees with this place.") == 3
    assert page.count("The clinician put this place here.") == 1
    assert "Take it back" not in page
    assert "Move the points" not in page


def test_the_reviewed_place_is_the_one_that_is_drawn_printed_and_told(family: Family) -> None:
    plain, case = signed(family), sent(family)
    before = family.get(f"/cases/{case}/picture")
    moved = signed(family, 25.0, case)
    assert family.get(f"/cases/{moved}/picture") != before
    sheet = text_of(family.http.get(f"/api/v1/cases/{moved}/sheet.pdf").content)
    assert "Dr. Aiko Mori" in sheet
    told = [unescape(family.get(f"/cases/{case}/result")).split("4. Mitral")[1][:400] for case in (plain, moved)]
    assert told[0] != told[1]


def test_the_corrected_area_stands_beside_the_computed_one(family: Family) -> None:
    case = signed(family, 12.0)
    result = family.http.get(f"/api/v1/cases/{case}/result").json()
    review = result["review"]
    assert (review["decision"], review["by"]) == ("signed", "Dr. Aiko Mori")
    assert set(review["areas"]) == {"mitral"}
    corrected = review["areas"]["mitral"]
    assert corrected["moved_mm"] == pytest.approx(12.0, abs=1.0)
    assert corrected["by"] == "Dr. Aiko Mori"
    assert "breastbone" in corrected["instruction"]
    in_metres = np.array(corrected["position"])
    off = sample.outcome().areas["mitral"].position / 1000 - in_metres
    assert np.linalg.norm(off) == pytest.approx(corrected["moved_mm"] / 1000, abs=1e-3)


def test_a_signed_case_is_final_in_fhir_with_the_places_as_signed(family: Family) -> None:
    case = signed(family, 12.0)
    result = result_json(sample.outcome())
    family.vault.put(case, "result.json", json.dumps(result).encode())
    bundle = family.http.get(f"/api/v1/cases/{case}/fhir").json()
    resources = [entry["resource"] for entry in bundle["entry"]]
    (report,) = (one for one in resources if one["resourceType"] == "DiagnosticReport")
    assert report["status"] == "final"
    assert report["resultsInterpreter"] == [{"display": "Dr. Aiko Mori"}]
    told = family.http.get(f"/api/v1/cases/{case}/result").json()
    assert told["areas"]["mitral"]["position"] == result["areas"]["mitral"]["position"]
    sites = {one["description"] for one in resources if one["resourceType"] == "BodyStructure"}
    assert told["review"]["areas"]["mitral"]["instruction"] in sites
    assert told["areas"]["mitral"]["instruction"] not in sites


def test_a_returned_case_says_why_shows_no_place_and_takes_a_new_scan(family: Family) -> None:
    case = sent(family)
    desk_of(family).give_back(MORI, case, 0, Decision("belly_missing", "Please <b>include</b> the navel."))
    assert family.where(case) == "refused"
    page = family.get(f"/cases/{case}/refused")
    assert "Your clinician asks you to do this again" in page
    assert "A part of the chest or the belly is missing" in page
    assert "Please &lt;b&gt;include&lt;/b&gt; the navel." in page
    assert "Dr. Aiko Mori" in page
    result = family.http.get(f"/api/v1/cases/{case}/result").json()
    assert "areas" not in result
    assert result["verdict"] == "refuse"
    assert result["review"]["note"].startswith("Please <b>")
    assert family.http.get(f"/api/v1/cases/{case}/sheet.pdf").status_code == 404
    family.get(f"/cases/{case}/scan")
    assert family.send(case, b"quick").status_code == 200
    assert family.rest_status(case) != "returned"


def test_an_unusable_case_shows_no_place_anywhere(family: Family) -> None:
    case = sent(family)
    desk_of(family).mark_unusable(MORI, case, 0, Decision("other_anatomy"))
    page = family.get(f"/cases/{case}/result")
    assert "do not use these places" in page
    assert "The usual places do not fit this body." in page
    for path in ("sheet.pdf", "view.html"):
        assert family.http.get(f"/api/v1/cases/{case}/{path}").status_code == 404, path
    assert family.http.get(f"/cases/{case}/picture").status_code == 404
    assert family.rest_status(case) == "unusable"


def test_the_separate_yes_to_keeping_the_shape_is_asked_once_signed_and_can_be_taken_back(family: Family) -> None:
    waiting = sent(family)
    assert "May this shape help others?" not in family.get(f"/cases/{waiting}/result")
    family.post(f"/cases/{waiting}/share", 409, share="yes")
    case = signed(family)
    assert "Yes, keep the shape" in family.get(f"/cases/{case}/result")
    assert "Take my yes back" in family.post(f"/cases/{case}/share", share="yes").text
    assert "Yes, keep the shape" in family.post(f"/cases/{case}/share", share="no").text
    Family(family.service).post(f"/cases/{case}/share", 404, share="yes")


def test_before_the_signature_nothing_of_the_clinicians_is_shown(family: Family) -> None:
    case = sent(family)
    desk_of(family).move(MORI, case, 0, "mitral", (0.0, 0.0, 0.0))
    assert "Mori" not in family.get(f"/cases/{case}/result")
    assert "review" not in family.http.get(f"/api/v1/cases/{case}/result").json()
