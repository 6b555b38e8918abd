import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.surface import Surface
from lubdub.report.marks import STYLES, circle, diamond, rounded_square, triangle
from lubdub.report.picture import FRAMING, PAPER, SKIN, draw, framed, skin, trunk_mm
from lubdub.report.render import View, look
from lubdub.results import AREA_NAMES, Area, AreaName, Fit, Outcome, Reason
from tests.bodies import Shape, areas_of, landmarks_of, torso_surface
from tests.overlays import clean_scan, clicked, seen_from_front

SHAPE = Shape(belly=0.4)
SIZE = (600, 450)
REFUSAL = Reason("mirrored_scan", "This scan looks mirrored.", "Scan again with the app’s mirror setting off.")


def areas_on(surface: Surface) -> dict[AreaName, Area]:
    caster = SkinCaster(surface)
    places = {name: caster.hit(p + [0, 0, 300], np.array([0.0, 0, -1])) for name, p in areas_of(SHAPE).items()}
    return {
        name: Area(place, np.array([0.0, 0, 1]), 16.0, "here") for name, place in places.items() if place is not None
    }


@pytest.fixture(scope="module")
def shown() -> Outcome:
    scan = clean_scan(seen_from_front(SHAPE))
    body = torso_surface(SHAPE, 60, 60)
    fit = Fit(body, landmarks_of(SHAPE), areas_of(SHAPE), 1.0, 1.0, 0.5)
    return Outcome("show", (), areas_on(scan.display), clicked(SHAPE), scan, fit, (), "it", None, {}, {})


def opened(png: bytes) -> np.ndarray:
    image = Image.open(io.BytesIO(png))
    assert image.format == "PNG"
    return np.asarray(image.convert("RGB")).astype(int)


def near(pixels: np.ndarray, colour: tuple[int, int, int], tolerance: int = 40) -> np.ndarray:
    """(k, 2) columns and rows of the pixels of about this colour."""
    rows, columns = np.nonzero(np.abs(pixels - np.array(colour)).max(axis=2) < tolerance)
    return np.stack([columns, rows], axis=1)


def only_left_panel(pixels: np.ndarray) -> np.ndarray:
    out = pixels.copy()
    out[int(0.8 * len(out)) :] = PAPER
    out[:, len(out[0]) // 2 :] = PAPER
    return out


def test_each_area_is_drawn_around_its_place(shown: Outcome) -> None:
    pixels = only_left_panel(opened(draw(replace(shown, fit=None, landmarks=shown.landmarks), SIZE)))
    alone = {name: opened(draw(replace(shown, areas={name: shown.areas[name]}), SIZE)) for name in AREA_NAMES}
    middles = {}
    for name in AREA_NAMES:
        ring = near(only_left_panel(alone[name]), STYLES[name].colour, 25)
        assert len(ring) > 40
        middles[name] = (ring.min(axis=0) + ring.max(axis=0)) / 2
    assert pixels.shape == (450, 600, 3)
    scan = shown.scan
    assert scan is not None
    left_width, left_height = 274, 320
    view = framed(scan, trunk_mm(shown), left_width, left_height)
    between = (shown.areas["mitral"].position - shown.areas["aortic"].position)[:2] / view.mm_per_pixel
    drawn = middles["mitral"] - middles["aortic"]
    assert drawn[0] == pytest.approx(between[0], abs=12)
    assert -drawn[1] == pytest.approx(between[1], abs=12)


def test_the_patients_left_is_on_the_right_of_the_picture(shown: Outcome) -> None:
    mitral = opened(draw(replace(shown, areas={"mitral": shown.areas["mitral"]}, fit=None), SIZE))[:350]
    aortic = opened(draw(replace(shown, areas={"aortic": shown.areas["aortic"]}, fit=None), SIZE))[:350]
    assert near(mitral, STYLES["mitral"].colour, 25)[:, 0].mean() > 300
    assert near(aortic, STYLES["aortic"].colour, 25)[:, 0].mean() < 300


def test_a_view_turns_the_body_but_never_mirrors_it() -> None:
    for turn in (0.0, 32.0, -50.0):
        view = View(np.zeros(3), 1.0, 200, 200, turn)
        assert np.linalg.det(view.axes) == pytest.approx(1)
        head, left = view.pixels_of(np.array([[0.0, 50, 0], [50, 0, 0]]))
        assert head[1] < 100
        assert left[0] > 100


def test_what_a_pixel_shows_is_what_appears_at_that_pixel() -> None:
    view = View(np.array([0.0, -200, 0]), 4.0, 120, 150, 20.0)
    seen = look(torso_surface(SHAPE), view)
    rows, columns = np.nonzero(seen.met)
    pixels = view.pixels_of(seen.points[rows, columns])
    assert np.allclose(pixels, np.stack([columns + 0.5, rows + 0.5], axis=1), atol=0.01)
    assert (seen.normals[rows, columns] @ view.axes[2]).min() >= 0


def test_skin_is_plaster_and_the_rest_is_paper(shown: Outcome) -> None:
    assert shown.scan is not None
    view = framed(shown.scan, trunk_mm(shown), 150, 150)
    pixels, seen = skin(shown.scan.display, view)
    assert 0.3 < seen.met.mean() < 0.98
    assert (pixels[~seen.met] == PAPER).all()
    middle = np.median(pixels[seen.met], axis=0) / np.array(SKIN)
    assert 0.6 < middle.mean() < 1.1


def test_the_trunk_fills_the_frame_from_collarbones_to_navel(shown: Outcome) -> None:
    assert shown.scan is not None
    for width, height in ((300, 300), (200, 500), (500, 200)):
        view = framed(shown.scan, trunk_mm(shown), width, height)
        places = np.array([shown.landmarks[name].position for name in shown.landmarks])
        pixels = view.pixels_of(places)
        assert (pixels > 0).all()
        assert (pixels < [width, height]).all()


def test_the_fitted_body_is_drawn_when_there_is_one(shown: Outcome) -> None:
    teal = np.array([70, 160, 156])
    for outcome, there in ((shown, True), (replace(shown, fit=None), False)):
        pixels = opened(draw(outcome, SIZE))[60:330].reshape(-1, 3)
        bluish = (pixels[:, 2] > pixels[:, 0] + 12) & (np.abs(pixels - teal).max(axis=1) < 110)
        assert (bluish.mean() > 0.1) == there


def test_a_refusal_shows_its_reason_and_no_area(shown: Outcome) -> None:
    refused = replace(shown, verdict="refuse", reasons=(REFUSAL,), areas={}, fit=None)
    pixels = opened(draw(refused, SIZE))
    for style in STYLES.values():
        assert len(near(pixels, style.colour, 12)) < 5
    assert len(near(pixels, (200, 69, 47), 10)) > 100
    assert not np.array_equal(pixels, opened(draw(replace(refused, reasons=()), SIZE)))


def test_a_refusal_without_any_scan_is_still_a_picture(shown: Outcome) -> None:
    empty = replace(shown, verdict="refuse", reasons=(REFUSAL,), areas={}, fit=None, scan=None, landmarks={})
    assert opened(draw(empty, SIZE)).shape == (450, 600, 3)


def test_a_triangulated_cloud_without_landmarks_is_drawn(shown: Outcome) -> None:
    assert 200 < trunk_mm(replace(shown, landmarks={})) < 500
    assert opened(draw(replace(shown, landmarks={}, fit=None), SIZE)).shape == (450, 600, 3)


def test_the_same_outcome_gives_the_same_picture(shown: Outcome) -> None:
    assert draw(shown, (300, 225)) == draw(shown, (300, 225))


def test_noise_in_the_scan_does_not_make_the_plaster_rough() -> None:
    view = View(np.array([0.0, -180, 0]), 2.0, 120, 120)
    smooth, _ = skin(clean_scan(seen_from_front(SHAPE)).display, view)
    rough, _ = skin(clean_scan(seen_from_front(SHAPE), noise_mm=0.7).display, view)
    assert np.abs(smooth - rough).mean() < 12


@pytest.mark.parametrize("outline", [circle, rounded_square, triangle, diamond])
def test_an_outline_is_closed_around_its_middle_and_about_as_large_as_a_chestpiece(outline: object) -> None:
    at = np.linspace(-2, 2, 401)
    inside = outline(at[None, :], at[:, None]) < 0  # type: ignore[operator]
    assert inside[200, 200]
    assert 2.0 < inside.mean() * 16 < 4.2
    assert not inside[[0, -1]].any()
    assert FRAMING.shape_share * 370 == pytest.approx(18, abs=2)


def test_areas_are_told_apart_by_number_letter_and_shape() -> None:
    assert [STYLES[name].number for name in AREA_NAMES] == [1, 2, 3, 4]
    assert [STYLES[name].letter for name in AREA_NAMES] == list("APTM")
    assert len({style.outline for style in STYLES.values()}) == 4


def test_the_still_picture_uses_the_colours_of_the_live_view() -> None:
    from lubdub.views.stickers import AREA_STYLES

    for name in AREA_NAMES:
        assert STYLES[name].colour == AREA_STYLES[name].colour
        assert STYLES[name].number == AREA_STYLES[name].number
