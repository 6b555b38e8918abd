"""A family's way through the pages, without scripts."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from lubdub.cases.database import Database
from lubdub.cases.models import CaseRow
from lubdub.cases.values import Consent
from lubdub.report.archive import examination_to_bytes
from lubdub.results import Landmark, Reason
from lubdub.web.pages.consent import CONSENT_VERSION
from lubdub.web.pages.guide_words import APPS
from lubdub.web.pages.questions import age_years, new_case
from lubdub.web.pages.samples import all_samples
from tests.views import sample
from tests.web.family import ABOUT, Family, case_in
from tests.web.service import Service, eventually


@pytest.fixture
def family(service: Service) -> Family:
    return Family(service)


def test_emergency_signs_come_first(family: Family) -> None:
    page = family.get("/")
    assert page.index("emergency number") < page.index("None of these: start")


@pytest.mark.parametrize(
    "path",
    ["/", "/ask/who", "/static/nhsuk.css", "/static/style/lubdub.css", "/static/lib/page.js", "/static/nhsuk.js"],
)
def test_no_page_or_style_loads_from_elsewhere(family: Family, path: str) -> None:
    text = family.get(path)
    assert "assets.nhs.uk" not in text
    assert "Frutiger" not in text
    assert 'src="http' not in text
    assert "url(http" not in text


@pytest.mark.parametrize(
    "path",
    ["/static/package.json", "/static/family/ask/ask.html", "/static/../pyproject.toml", "/static/node_modules/x.js"],
)
def test_only_styles_scripts_and_drawings_are_served(family: Family, path: str) -> None:
    family.get(path, 404)


@pytest.mark.parametrize(
    ("question", "given", "field"),
    [
        ("age", {"years": "", "months": ""}, "years"),
        ("age", {"years": "six"}, "years"),
        ("age", {"years": "140"}, "years"),
        ("sex", {"sex": ""}, "sex"),
        ("who", {"who": "the cat"}, "who"),
    ],
)
def test_a_missing_answer_is_asked_for_again(family: Family, question: str, given: dict[str, str], field: str) -> None:
    family.asked()
    page = family.post(f"/ask/{question}", 422, **given).text
    assert f'href="#{field}"' in page
    assert "Nothing is lost" in page


def test_answers_are_kept_and_the_way_goes_on_where_it_was(family: Family) -> None:
    family.post("/ask/who", who="child")
    family.post("/ask/age", years="6", months="2")
    page = family.get("/")
    assert "Go on where you were" in page
    assert 'href="/ask/sex"' in page
    assert 'value="6"' in family.get("/ask/age")
    assert str(family.http.get("/ask/posture").url).endswith("/ask/sex")
    family.post("/anew")
    assert "Go on where you were" not in family.get("/")
    assert 'value="6"' not in family.get("/ask/age")


def test_pregnancy_is_asked_of_those_only_who_may_be_pregnant(family: Family) -> None:
    assert family.asked() == "/consent"
    family.get("/ask/late_pregnancy")
    assert str(family.http.get("/ask/late_pregnancy").url).endswith("/consent")
    family.post("/ask/age", years="30", months="")
    assert "pregnancy" in family.get("/ask/late_pregnancy")
    family.post("/ask/age", years="81", months="")
    assert not str(family.http.get("/ask/late_pregnancy").url).endswith("/late_pregnancy")
    family.post("/ask/age", years="30", months="")
    family.post("/ask/sex", sex="male")
    assert not str(family.http.get("/ask/late_pregnancy").url).endswith("/late_pregnancy")


@pytest.mark.parametrize("question", ["heart_on_right", "chest_operation_or_device", "late_pregnancy"])
def test_a_stop_question_answered_yes_stops_kindly_before_there_is_a_case(family: Family, question: str) -> None:
    about = {"years": "30"} if question == "late_pregnancy" else {}
    family.asked(**about)
    page = family.post(f"/ask/{question}", **{question: "yes"})
    assert page.url.path == "/stop"
    assert "We stop here" in page.text
    for too_far in ("/consent", "/consent/child"):
        assert family.http.get(too_far).url.path == "/stop"
    assert family.post("/consent", agree="yes").url.path == "/stop"
    page = family.post(f"/ask/{question}", **{question: "no"})
    assert family.http.get("/stop").url.path == "/consent"


def test_without_a_yes_no_case_is_opened(family: Family) -> None:
    family.asked()
    assert 'href="#agree"' in family.post("/consent", 422).text
    assert str(family.http.get("/consent/child").url).endswith("/consent")
    family.post("/consent", agree="yes")
    assert 'href="#child"' in family.post("/consent/child", 422).text
    assert "That is fine" in family.post("/consent/child", child="no").text
    assert "/cases/" not in family.get("/")


def test_consent_is_kept_in_the_case_with_its_version_language_and_time(family: Family) -> None:
    case = family.consented()
    with Database(family.service.settings.database).reading() as session:
        row = session.get(CaseRow, case)
        assert row is not None
        assert row.consent is not None
        assert (row.consent["version"], row.consent["language"], row.consent["child"]) == (
            CONSENT_VERSION,
            "en",
            "agreed",
        )
        assert abs(datetime.fromisoformat(row.consent["given_at"]) - datetime.now(UTC)) < timedelta(minutes=5)


@pytest.mark.parametrize(
    ("about", "words"),
    [
        ({"years": "0", "months": "5"}, "Watch how your child feels"),
        ({"years": "4"}, "like a starfish"),
        ({"years": "9"}, "Nobody at school"),
        ({"years": "15"}, "You decide who is in the room"),
    ],
)
def test_the_child_is_asked_in_words_for_its_age(family: Family, about: dict[str, str], words: str) -> None:
    family.asked(**about)
    assert words in family.post("/consent", agree="yes").text


def test_who_scans_alone_is_spoken_to_and_a_young_one_asked_for_a_grown_up(family: Family) -> None:
    family.post("/ask/who", who="self")
    assert "How old are you?" in family.get("/ask/age")
    family.asked(who="self", years="14")
    assert "A parent or carer is with me" in family.get("/consent")
    case = family.consented(who="self", years="40", sex="male")
    assert "Ask somebody you trust" in family.get(f"/cases/{case}/ready")


def test_a_grown_up_child_is_not_spoken_of_as_a_child(family: Family) -> None:
    family.asked(years="30", sex="male")
    assert "your child" not in family.get("/consent").lower()


@pytest.mark.parametrize("app", APPS)
def test_every_app_has_its_steps_and_the_way_goes_on_there(family: Family, app: str) -> None:
    case = family.consented()
    page = family.post(f"/cases/{case}/guide", app=app).text
    assert page.count("<li>") >= 3
    assert str(family.http.get(f"/cases/{case}").url).endswith(f"/guide/{app}")
    assert "photo" in page or app not in ("kiri", "polycam")


def test_an_unknown_app_is_asked_for_again(family: Family) -> None:
    case = family.consented()
    assert "Choose the one that fits best." in family.post(f"/cases/{case}/guide", 422, app="other").text
    family.get(f"/cases/{case}/guide/other", 404)


def test_the_bones_are_taught_with_a_sample_too_though_they_are_marked(family: Family) -> None:
    case = case_in(str(family.post("/samples", name="phone-child").url))
    eventually(lambda: family.where(case) == "size")
    family.vault.put(case, "examination.npz", examination_to_bytes(sample.examination()))
    assert family.post(f"/cases/{case}/size", size="right", side="left").url.path.endswith("/feel")
    page = family.post(f"/cases/{case}/feel")
    assert page.url.path.endswith("/points")
    assert "All points are answered" in page.text


def test_a_sample_is_marked_as_such_on_every_page(family: Family) -> None:
    case = case_in(str(family.post("/samples", name="phone-child").url))
    eventually(lambda: family.where(case) == "size")
    family.vault.put(case, "examination.npz", examination_to_bytes(sample.examination()))
    for path in (f"/cases/{case}", f"/cases/{case}/scan", f"/cases/{case}/remove"):
        assert "This is a sample." in family.get(path)
    assert "This is a sample." not in family.get("/")


@pytest.mark.parametrize(
    ("language", "number"), [("en-GB,en;q=0.9", "999"), ("ja", "119"), ("en-US", "911"), ("es-ES", "112")]
)
def test_the_emergency_number_is_the_countrys_own(family: Family, language: str, number: str) -> None:
    page = family.http.get("/", headers={"Accept-Language": language}).text
    assert f'href="tel:{number}"' in page


def test_what_was_not_asked_counts_as_no() -> None:
    given = ABOUT | {"heart_on_right": "no", "chest_operation_or_device": "unsure", "late_pregnancy": "yes"}
    answers = new_case(given, Consent("1", "en", datetime.now(UTC))).answers
    assert answers == {"heart_on_right": "no", "chest_operation_or_device": "unsure", "late_pregnancy": "no"}


@pytest.mark.parametrize(
    ("years", "months", "age"),
    [
        ("6", "", 6.0),
        ("0", "7", 7 / 12),
        ("", "7", 7 / 12),
        ("1", "6", 1.5),
        ("", "", None),
        ("-1", "", None),
        ("1.5", "", None),
        ("121", "0", None),
        ("٣", "", 3.0),
    ],
)
def test_an_age_is_whole_years_and_months(years: str, months: str, age: float | None) -> None:
    assert age_years({"years": years, "months": months}) == (None if age is None else pytest.approx(age))


def test_a_form_without_its_token_changes_nothing(family: Family) -> None:
    case = family.opened()
    page = family.post(f"/cases/{case}/remove", 403, token="0" * 64).text
    assert "too old" in page
    assert family.where(case) == "scan"


def test_another_familys_case_is_not_there(family: Family, service: Service) -> None:
    case = family.examined()
    other = Family(service)
    for step in ("", "/scan", "/size", "/points", "/points/panel", "/result", "/state", "/remove"):
        other.get(f"/cases/{case}{step}", 404)
    other.get(f"/view/{case}/", 404)


def test_an_empty_upload_says_what_to_do(family: Family) -> None:
    case = family.opened()
    answer = family.send(case, b"")
    assert answer.status_code == 422
    assert "Choose the file" in answer.text


def test_an_unreadable_file_ends_on_a_page_with_one_reason_and_one_fix(family: Family) -> None:
    case = family.opened()
    family.send(case, b"junk")
    eventually(lambda: family.where(case) == "refused")
    page = family.get(f"/cases/{case}/refused")
    assert "We could not read this file" in page
    assert "This file is no body scan." in page
    assert "Send another scan" in page
    assert 'name="unit"' not in page


def test_a_scan_whose_size_says_no_unit_goes_on_when_the_family_says_it(family: Family) -> None:
    case = family.opened()
    family.send(case, b"sizeless")
    eventually(lambda: family.where(case) == "refused")
    assert "We cannot tell how large this body is." in family.get(f"/cases/{case}/refused")
    family.post(f"/cases/{case}/unit", 400, unit="inch")
    family.post(f"/cases/{case}/unit", unit="cm")
    eventually(lambda: family.where(case) == "size")


def test_the_size_is_said_in_words_and_both_questions_must_be_answered(family: Family) -> None:
    case = family.examined()
    assert "24 cm wide" in family.get(f"/cases/{case}/size")
    page = family.post(f"/cases/{case}/size", 422, size="right").text
    assert 'href="#side"' in page
    assert family.where(case) == "size"


@pytest.mark.parametrize(("side", "mirror"), [("swapped", ""), ("unsure", "yes")])
def test_a_swapped_scan_is_stopped(family: Family, side: str, mirror: str) -> None:
    case = family.examined()
    page = family.post(f"/cases/{case}/size", size="right", side=side, mirror=mirror).text
    assert "swapped" in page
    assert family.where(case) == "size"


def test_who_cannot_tell_the_sides_goes_on_when_nothing_was_mirrored(family: Family) -> None:
    case = family.examined()
    family.post(f"/cases/{case}/size", 422, size="right", side="unsure")
    family.post(f"/cases/{case}/size", size="right", side="unsure", mirror="no")
    assert family.where(case) == "feel"


def test_another_unit_is_offered_only_where_a_chest_could_have_it(family: Family) -> None:
    page = family.get(f"/cases/{family.examined()}/size")
    assert 'value="cm"' not in page
    assert "No, it is another size" in page


def test_points_are_asked_one_after_the_other_and_can_be_undone(family: Family) -> None:
    case = family.confirmed()
    assert "Feel the top of the breastbone" in family.get(f"/cases/{case}/points")
    assert "Feel the lower end" in family.post(f"/cases/{case}/points", action="skip").text
    assert "Find the belly button" in family.post(f"/cases/{case}/points", action="accept").text
    assert "Feel the lower end" in family.post(f"/cases/{case}/points", action="undo").text
    assert "patient&#39;s left nipple" in family.post(f"/cases/{case}/points", action="choose", name="nipple_left").text


def test_a_kept_guess_of_a_bone_is_not_passed_off_as_felt(family: Family) -> None:
    case = family.confirmed()
    family.post(f"/cases/{case}/points", action="accept")
    family.post(f"/cases/{case}/points", action="accept")
    family.post(f"/cases/{case}/points", action="accept")
    family.locate(case)
    eventually(lambda: family.rest_status(case) == "done")
    asked = family.http.get(f"/api/v1/cases/{case}/result").json()["asked"]
    assert set(asked["landmarks"]) == {"navel"}


def test_an_accepted_point_goes_to_the_run_in_the_files_own_coordinates(family: Family) -> None:
    case = family.confirmed()
    family.post(f"/cases/{case}/points", action="choose", name="navel")
    family.post(f"/cases/{case}/points", action="accept")
    family.locate(case)
    eventually(lambda: family.rest_status(case) == "done")
    asked = family.http.get(f"/api/v1/cases/{case}/result").json()["asked"]
    metres = sample.BODY.landmarks["navel"] / 1000
    assert asked["landmarks"]["navel"] == pytest.approx(metres.tolist(), abs=1e-9)


def test_the_result_says_in_words_what_the_picture_shows(family: Family) -> None:
    case = family.done()
    page = family.get(f"/cases/{case}/result")
    for word in ("Aortic", "Pulmonary", "Tricuspid", "Mitral", "not a diagnosis", "6 years old", case[:6], "sandbox"):
        assert word in page
    assert page.index("1. Aortic") < page.index("2. Pulmonary") < page.index("3. Tricuspid") < page.index("4. Mitral")


def test_a_result_with_care_says_why(family: Family) -> None:
    reason = Reason("no_bones", "The breastbone was not felt.", "Feel it and mark it.")
    case = family.done(replace(sample.outcome(), verdict="show_with_care", reasons=(reason,)))
    page = family.get(f"/cases/{case}/result")
    assert "with care" in page
    assert "The breastbone was not felt." in page
    assert "Feel it and mark it." in page


def test_a_place_that_may_be_far_off_sends_to_the_clinician(family: Family) -> None:
    outcome = sample.outcome()
    vague = replace(outcome.areas["mitral"], radius_mm=40.0)
    case = family.done(replace(outcome, areas={**outcome.areas, "mitral": vague}))
    assert family.get(f"/cases/{case}/result").count("ask your clinician before using this one") == 1


def test_distances_are_told_from_the_marked_notch(family: Family) -> None:
    outcome = sample.outcome()
    lower = outcome.landmarks["suprasternal_notch"].position - [0, 10.0, 0]
    moved = {**outcome.landmarks, "suprasternal_notch": Landmark(lower, "given", 5.0)}
    down = -(outcome.areas["aortic"].position[1] + 10.0) / 10
    case = family.done(replace(outcome, landmarks=moved))
    assert f"<td>{down:.1f}</td>" in family.get(f"/cases/{case}/result")


def test_deleting_shows_a_receipt_and_nothing_is_left(family: Family) -> None:
    case = family.confirmed()
    family.get(f"/view/{case}/")
    page = family.post(f"/cases/{case}/remove").text
    assert "Everything is deleted" in page
    assert case in page
    family.get(f"/cases/{case}", 404)
    family.get(f"/view/{case}/", 404)


def test_samples_are_read_youngest_first(tmp_path: Path) -> None:
    for name, age in (("grown", 40), ("small", 0.5), ("child", 6)):
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}.ply").write_bytes(b"ply")
        (tmp_path / name / "patient.json").write_text(json.dumps({"age_years": age, "sex": "female"}))
    (tmp_path / "without-a-scan").mkdir()
    (tmp_path / "without-a-scan" / "patient.json").write_text(json.dumps({"age_years": 1}))
    assert [one.name for one in all_samples(tmp_path)] == ["small", "child", "grown"]


def test_patient_pages_are_kept_by_nobody(family: Family) -> None:
    case = family.confirmed()
    for path in (f"/cases/{case}/points", f"/view/{case}/", f"/cases/{case}/state"):
        assert family.http.get(path).headers["cache-control"] == "no-store"
    for stream in (f"/cases/{case}/points/live", f"/api/v1/cases/{case}/events"):
        with family.http.stream("GET", stream) as answer:
            assert answer.headers["cache-control"] == "no-store"


def test_a_page_asked_for_in_a_way_it_does_not_know_says_what_to_do(family: Family) -> None:
    answer = family.http.put("/ask/who", headers={"Accept": "text/html"})
    assert answer.status_code == 405
    assert "opened by their buttons and links" in answer.text
