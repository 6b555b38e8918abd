import numpy as np
import pytest

from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.surface import Surface, cloud
from tests.bodies import Shape, torso_surface


@pytest.fixture(scope="module")
def body() -> Surface:
    return torso_surface(Shape())


@pytest.mark.parametrize("shift", [0.0, 1e5])
def test_a_ray_from_the_front_meets_the_front_skin(shift: float) -> None:
    far = Surface(torso_surface(Shape()).vertices + shift, torso_surface(Shape()).triangles)
    for x, y in ((0, -100), (60, -200), (-80, -60)):
        hit = SkinCaster(far).hit(np.array([x, y, 700.0]) + shift, np.array([0, 0, -3.0]))
        assert hit is not None
        expected = float(Shape().front(np.array(x), np.array(y)))
        assert np.allclose(hit - shift, [x, y, expected], atol=1.0)


def test_a_ray_that_goes_by_meets_nothing(body: Surface) -> None:
    assert SkinCaster(body).hit(np.array([900.0, 0, 700]), np.array([0, 0, -1.0])) is None
    assert SkinCaster(body).hit(np.array([0.0, -100, 700]), np.array([0, 0, 1.0])) is None


def test_many_rays_say_which_triangle_they_met_and_where_on_it(body: Surface) -> None:
    x = np.linspace(-300, 300, 41)
    origins = np.stack([x, np.full(41, -150.0), np.full(41, 700.0)], axis=1)
    hits = SkinCaster(body).cast(origins, np.array([0, 0, -1.0]))
    assert hits.met[20]
    assert not hits.met[0]
    assert np.isnan(hits.points[~hits.met]).all()
    corners = body.vertices[body.triangles[hits.triangle[hits.met]]]
    assert np.allclose(np.einsum("kc,kcd->kd", hits.weights[hits.met], corners), hits.points[hits.met], atol=0.01)
    assert np.allclose(hits.points[hits.met, :2], origins[hits.met, :2], atol=0.01)


def test_a_cloud_has_no_skin_to_meet(body: Surface) -> None:
    with pytest.raises(ValueError, match="triangulate"):
        SkinCaster(cloud(body.vertices))
