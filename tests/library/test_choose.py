from dataclasses import replace

import numpy as np
import pytest

from lubdub.geometry.frames import Similarity
from lubdub.library import similar
from lubdub.library.choose import Choice, choose
from lubdub.library.similar import SimilaritySettings, landmark_start
from lubdub.results import Landmark, Reference
from tests.bodies import Shape
from tests.overlays import STILL, clean_scan, clicked, degrees_apart, motion, reference_of, seen_from_front

SHAPES = {
    "thin adult": Shape(belly=0.1, breadth=0.92),
    "stout adult": Shape(breast=0.3, belly=0.8, breadth=1.08),
    "thin child": Shape(size=0.6, belly=0.1, breadth=0.92),
    "stout child": Shape(size=0.6, breast=0.05, belly=0.7, breadth=1.05),
    "newborn": Shape(size=0.34, belly=0.5),
}


@pytest.fixture(scope="module")
def references() -> list[Reference]:
    return [reference_of(name, shape) for name, shape in SHAPES.items()]


def nearly(shape: Shape) -> Shape:
    """The same kind of person, another one."""
    return replace(shape, size=shape.size * 1.02, belly=shape.belly + 0.05)


@pytest.mark.parametrize("name", SHAPES)
def test_the_body_most_like_the_scan_is_chosen(name: str, references: list[Reference]) -> None:
    person = nearly(SHAPES[name])
    choice = choose(clean_scan(seen_from_front(person), noise_mm=1.0), clicked(person), references)
    assert choice.selected.id == name
    assert choice.ranked[0].id == name
    assert choice.ranked[0].chamfer_mm < 4
    assert {r.id for r in choice.ranked} == set(SHAPES)
    assert sum(r.weight for r in choice.ranked) == pytest.approx(1)
    assert [r.weight for r in choice.ranked] == sorted((r.weight for r in choice.ranked), reverse=True)


@pytest.mark.parametrize("name", ["thin adult", "stout child"])
def test_it_is_chosen_without_landmarks_too(name: str, references: list[Reference]) -> None:
    person, leaning = nearly(SHAPES[name]), motion(14, (1, 1, 0), (20, 10, -30))
    choice = choose(clean_scan(seen_from_front(person), leaning, 1.0), {}, references)
    assert choice.selected.id == name
    assert degrees_apart(choice.start, leaning) < 3


def test_a_choice_is_the_same_every_time(references: list[Reference]) -> None:
    person = nearly(SHAPES["thin adult"])
    scan = clean_scan(seen_from_front(person), noise_mm=1.0)
    first, second = (choose(scan, clicked(person), references[:2]) for _ in range(2))
    assert [r.id for r in first.ranked] == [r.id for r in second.ranked]
    assert first.ranked[0].chamfer_mm == pytest.approx(second.ranked[0].chamfer_mm, abs=1e-6)
    assert np.allclose(first.start.matrix(), second.start.matrix(), atol=1e-6)


def flipped(monkeypatch: pytest.MonkeyPatch, degrees: float, with_landmarks: bool) -> Choice:
    """A choice in which the overlay by shape alone ends turned about the front-back axis."""
    turn = motion(degrees, (0, 0, 1), (0, -400, 0))
    monkeypatch.setattr(similar, "icp", lambda source, target, start, settings: turn)
    person = SHAPES["thin adult"]
    landmarks = clicked(person) if with_landmarks else {}
    return choose(clean_scan(seen_from_front(person)), landmarks, [reference_of("it", person)])


def test_a_flipped_overlay_is_caught_and_done_again_from_the_landmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    choice = flipped(monkeypatch, 180, with_landmarks=True)
    assert choice.overlays[0].route == "landmarks"
    assert degrees_apart(choice.start, STILL) < 1
    assert choice.overlays[0].landmark_residual_mm == pytest.approx(0, abs=1e-6)
    assert any("landmarks" in note for note in choice.notes)


def test_a_slid_overlay_is_caught_by_its_landmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    assert flipped(monkeypatch, 0, with_landmarks=True).overlays[0].route == "landmarks"


def test_a_flipped_overlay_is_noticed_without_landmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    choice = flipped(monkeypatch, 180, with_landmarks=False)
    assert choice.overlays[0].route == "frame"
    assert any("upright" in note for note in choice.notes)


def test_being_scaled_counts_against_a_body() -> None:
    person = SHAPES["newborn"]
    scan = clean_scan(seen_from_front(person))
    same_shape = reference_of("grown", replace(person, size=1.0))
    overlay = choose(scan, clicked(person), [same_shape]).overlays[0]
    assert overlay.start.scale == pytest.approx(0.34, rel=0.01)
    assert overlay.chamfer_mm < 4
    assert overlay.score_mm(SimilaritySettings()) == pytest.approx(overlay.chamfer_mm + 20 * np.log(1 / 0.34), rel=0.01)


def test_landmarks_of_the_midline_alone_give_place_and_size_but_no_turn() -> None:
    body = reference_of("it", SHAPES["thin adult"])
    moved = Similarity(0.7, np.eye(3), np.array([10.0, 20, 30]))
    middle = {
        name: Landmark(moved.apply(body.landmarks[name]), "given", 3.0)
        for name in ("suprasternal_notch", "xiphisternum", "navel")
    }
    found = landmark_start(body, middle, SimilaritySettings())
    assert found is not None
    assert np.allclose(found.matrix(), moved.matrix(), atol=1e-6)


def test_one_landmark_alone_is_no_start() -> None:
    body = reference_of("it", SHAPES["thin adult"])
    only = {"navel": Landmark(body.landmarks["navel"], "given", 3.0)}
    assert landmark_start(body, only, SimilaritySettings()) is None


def test_half_a_scan_is_compared_on_what_it_shows(references: list[Reference]) -> None:
    person = SHAPES["stout adult"]
    whole = seen_from_front(person)
    upper = whole.kept(whole.vertices[:, 1] > -260)
    choice = choose(clean_scan(upper, noise_mm=1.0), clicked(person), references)
    assert choice.selected.id == "stout adult"
    assert choice.ranked[0].chamfer_mm < 4


def test_progress_is_told_and_an_empty_library_refused(references: list[Reference]) -> None:
    person = SHAPES["newborn"]
    scan = clean_scan(seen_from_front(person, 60, 60))
    heard: list[float] = []
    choose(scan, clicked(person), references[:2], on_reference=heard.append)
    assert heard == [0.5, 1.0]
    with pytest.raises(ValueError, match="no reference"):
        choose(scan, {}, [])


def test_of_a_large_library_only_a_part_is_laid_on_and_the_most_like_is_among_it() -> None:
    shapes = [Shape(size=size, belly=belly) for size in np.linspace(0.4, 1.1, 8) for belly in (0.1, 0.4, 0.8)]
    library = [reference_of(str(number), shape) for number, shape in enumerate(shapes)]
    person, heard = nearly(shapes[13]), list[float]()
    scan, settings = clean_scan(seen_from_front(person)), SimilaritySettings(most_laid=12)
    choice = choose(scan, clicked(person), library, settings, heard.append)
    assert choice.selected.id == "13"
    assert len(choice.overlays) == len({one.reference.id for one in choice.overlays}) == 12
    assert heard == sorted(heard)
    assert heard[-1] == 1.0
    assert "12 of 24" in choice.notes[0]
