"""What faces can send to each other, on a block over a floor and beside a wall, from solid angles written out."""

from types import SimpleNamespace

import numpy as np
import pytest

from imaging.pictures import Pictures
from render.phenomena import EFFECTS, transport
from render.phenomena.transport import _above_floor, _clearance, _form_factor, _gain, _hides, albedo
from scenes import Floor, Material, Obstacle

WALL = Obstacle(corner=(20.0, -5.0, 0.0), size=(2.0, 10.0, 6.0))


def test_form_factor():
    """sin^2 of the elevation of the wall's highest corner over each face's plane; 0 for what lies below it."""
    points, normals = np.array([[[0.0, 0.0, 1.0], [12.0, 0.0, 1.0]]]), np.array([[[0.0, 0, 1], [1.0, 0, 0]]])
    found = _form_factor(WALL.solid, points, normals)
    corners = np.array([[x, y, z] for x in (20, 22) for y in (-5, 5) for z in (0, 6)], float)
    for n, point in enumerate(points[0]):
        away = (corners - point) / np.linalg.norm(corners - point, axis=1)[:, None]
        for f, normal in enumerate(normals[0]):
            assert found[0, f, n] == pytest.approx(max((away @ normal).max(), 0.0) ** 2)
    assert (_form_factor(WALL.solid, points, -normals[:, ::-1])[:, 0] == 0).all()


def test_form_factor_is_an_upper_bound(rng):
    """Of cosine-weighted directions from the point no larger share meets the wall (20,000 drawn, 3 sigma)."""
    point, normal = np.array([12.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    turn, share = 2 * np.pi * rng.random(20_000), rng.random(20_000)
    ways = np.column_stack([np.sqrt(1 - share), np.sqrt(share) * np.cos(turn), np.sqrt(share) * np.sin(turn)])
    met = _hides(WALL.solid, np.tile(point, (20_000, 1)), point + 1e3 * ways)
    bound = _form_factor(WALL.solid, point[None, None], np.stack([normal, normal])[None])[0, 0, 0]
    # margin: a bound that holds by its kind, and no small one; some rays meet the wall
    assert 0.05 < met.mean() < bound + 3 * np.sqrt(met.mean() / 20_000)


@pytest.mark.parametrize(
    ("start", "stop", "hidden"),
    [
        ((10, 0, 1), (30, 0, 1), True), ((10, 0, 1), (19, 0, 1), False), ((10, 0, 7), (30, 0, 7), False),
        ((10, 6, 1), (30, 6, 1), False), ((10, 0, 1), (10, 0, 9), False), ((23, 0, 1), (30, 0, 1), False),
        ((10, -6, 1), (30, 6, 1), True),
    ],
)  # fmt: skip
def test_hides(start, stop, hidden):
    assert _hides(WALL.solid, np.array([start], float), np.array([stop], float)).tolist() == [hidden]


def test_clearance_and_height():
    points = np.array([[[0.0, 0.0, 3.0], [14.0, 1.0, 2.0]]])
    assert _clearance(points, WALL.solid) == pytest.approx(6.0)
    assert _clearance(np.array([[21.0, 0.0, 3.0]]), WALL.solid) == 0
    assert _above_floor(SimpleNamespace(floor=Floor(reflectance=0.3, height=-1.5)), points) == [3.5]
    assert _above_floor(SimpleNamespace(floor=None), points) == []


def test_albedo_and_gain(task1):
    """No more is sent on than the diffuse part and all of the specular one; light is nearest at the farthest corner."""
    dull = Material(specular_fraction=0.2, diffuse_reflectance=0.5)
    glossy = Material(specular_fraction=0.2, diffuse_reflectance=0.5, refractive_index=1.5)
    assert albedo(SimpleNamespace(surfaces=SimpleNamespace(used=(dull,)))) == pytest.approx(0.4)
    assert albedo(SimpleNamespace(surfaces=SimpleNamespace(used=(dull, glossy)))) == pytest.approx(0.6)
    far = max(np.linalg.norm(v - np.array(task1.camera.look_at)) for v in task1.solid.vertices)
    assert _gain(task1) == pytest.approx((task1.light.distance / (task1.light.distance - far)) ** 2)


@pytest.mark.parametrize("walls", [(), (WALL,)])
def test_light_that_is_added(walls, task1, monkeypatch):
    """Floor and wall send on what they get, faces what they get of it; all further bounces are a geometric series."""
    asked = {}
    monkeypatch.setattr(transport, "added_light", lambda pictures, levels, near: asked.update(levels=levels, near=near))
    floor = Floor(reflectance=0.3, height=-2.0)
    scene = task1.model_copy(update={"floor": floor, "obstacles": walls})
    pictures = Pictures.of(scene, np.array([[30.0, 135.0]]), np.array([[15.0, 315.0]]))
    EFFECTS["interreflection"].influence(pictures)
    own = transport.sides(pictures)
    albedo = (1 - scene.material.specular_fraction) * scene.material.diffuse_reflectance
    white = scene.camera.exposure * _gain(scene)
    most = albedo * max(0.3, albedo if walls else 0.0) * 0.5
    for e, normals in enumerate(own.normals):
        sent = np.array([np.full(own.points.shape[1], 0.3 * (1 - normal[2]) / 2) for normal in normals])
        if walls:
            sent += albedo * _form_factor(WALL.solid, own.points, own.normals)[e]
        expected = white * (albedo * sent.max(0) + albedo * 0.3 / 2) * sum(most**k for k in range(60))
        assert asked["levels"][0, e] == pytest.approx(expected)
    heights = [own.points[..., 2].min() + 2.0, *(_clearance(own.points, wall.solid) for wall in walls)]
    assert asked["near"] == pytest.approx(min(heights))
