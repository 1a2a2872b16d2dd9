"""Light on a plane face beside a measured rim: told in rings as paths of light tell it."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

import scenes
from imaging.light import exchange, exchanged
from imaging.light.annulus import Annulus
from imaging.light.emitters import emitters, plain
from imaging.light.places import Places
from imaging.pictures import Pictures
from scenes import Circle
from scenes.lights import GLANCE
from tests.light_paths import traced


def circle(hole=True, ends=None):
    """Of 2 mm radius about (1, 0, 0), its face looking up."""
    return Circle("c", np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), 2.0, 0, ("e",), hole, ends)


def solid(convex=True):
    """Whose edges are outer or inner ones."""
    return SimpleNamespace(edge=lambda name: SimpleNamespace(convex=convex))


def test_shares_fall_from_the_rim_to_none():
    """1 up to half the width, 0 from it on, on the side of the rim where its face is."""
    away = np.array([0.0, 0.4, 0.5, 0.75, 1.0, 2.0])
    expected = [1, 1, 1, 0.5, 0, 0]
    for hole, convex, sign in ((True, True, 1), (False, True, -1), (True, False, -1), (False, False, 1)):
        annulus = Annulus.beside(solid(convex), circle(hole), 10.0)
        points = np.stack([1 + 2 + sign * away, 0 * away, 0 * away], -1)
        assert annulus.width == 1.0
        assert annulus.share(points) == pytest.approx(expected)
        assert annulus.coordinates(points)[:, 1] == pytest.approx(np.minimum(away, 1.0))
    assert Annulus.beside(solid(), circle(), 0.3).width == 0.3  # no wider than a cell


@pytest.mark.parametrize("ends", [None, np.array([[3.0, 0, 0], [1.0, 2.0, 0]])])
def test_nodes_stand_where_their_coordinates_are(ends):
    """Each step around the rim is a node, ring by ring; beyond an arc's ends it tells nothing."""
    annulus = Annulus.beside(solid(), circle(ends=ends), 10.0)
    steps, away = annulus.coordinates(annulus.nodes()).T.reshape(2, annulus.count, -1)
    assert steps == pytest.approx(np.repeat(np.arange(annulus.count)[:, None], annulus.rings.size, 1), abs=1e-9)
    assert away == pytest.approx(np.repeat([np.maximum(annulus.rings, 0.01)], annulus.count, 0))
    assert annulus.share(np.array([[-1.0, 0, 0]])) == pytest.approx(1.0 if ends is None else 0.0)


@pytest.fixture(scope="module")
def cup(tmp_path_factory):
    """A picture from above of a bore of 2 mm radius in the ground of a pocket of 4 mm, 6 mm deep, which light at 35
    degrees reaches in part, and the bore's rim."""
    profile = [(0, 0), (12, 0), (12, 12), (4, 12), (4, 6), (2, 6), (2, 2), (0, 2)]
    return _turned(profile, 6.0, 35.0, tmp_path_factory.mktemp("part"))


def _turned(profile, height, polar, folder):
    """A picture from above of a part of this profile, its rim of 2 mm radius at a height, light from a polar angle."""
    file = folder / "part.ply"
    trimesh.creation.revolve(profile, sections=48).export(file)
    data = scenes.load("plate").model_dump(exclude={"measurands", "settings"})
    data["object"] = {"kind": "mesh", "file": str(file), "units": "mm"}
    part = scenes.Mesh.model_validate(data["object"]).solid
    rim = next(c for c in part.circles if c.radius < 3 and abs(c.centre[2] - height) < 1e-3)
    camera = {"width": 128, "height": 128, "focal_px": 8000.0, "distance": 400.0, "blur_px": 0.3, "exposure": 150.0,
              "look_at": [0.0, 0.0, 6.0]}  # fmt: skip
    asked = [{"name": "d", "kind": "diameter", "features": [{"circle": rim.name}]}]
    data |= {"units": "mm", "camera": camera, "light": {"kind": "point", "distance": 400.0}, "measurands": asked}
    scene = scenes.Scene.model_validate(data)
    return scenes.Picture.of(scene, (0.0, 0.0), (polar, 20.0)), scene.solid.circle(rim.name)


def test_the_ground_beside_a_rim_has_the_light_that_paths_tell(cup, monkeypatch):
    """A tenth of a millimetre from it, all around; by a face's own nodes and even patches it is farther off."""
    picture, rim = cup
    scene, pictures = picture.scene, Pictures.of(picture)
    (shining,) = tuple(map(plain, emitters(scene, pictures.lights, GLANCE)))
    points = rim.centre + (rim.radius + 0.1) * rim.spokes(rim.angles(24))
    faces, white = np.full(24, rim.face), scene.material.diffuse()
    paths = traced(scene.solid, white, np.array(shining.at), points, rim.axis, 1 << 11, np.random.default_rng(1))
    expected = paths * shining.power

    def off():
        for each in (exchanged.exchanged, exchange.exchange_of):
            each.cache_clear()
        return exchanged.exchanged(scene, (shining,)).at(points, faces) / expected - 1

    assert np.sqrt(np.mean(off() ** 2)) < 0.06  # margin: twice what is measured; 2.8 %
    monkeypatch.setattr(exchanged, "measured_rims", lambda scene: ())
    assert np.sqrt(np.mean(off() ** 2)) > 0.07  # margin: 9 %


# a pin in a groove as deep as it is high, in a pocket 72 mm wide
_PIN = [(0, 0), (40, 0), (40, 16), (36, 16), (36, 6), (3.5, 6), (3.5, 4), (2, 4), (2, 6), (0, 6)]


def test_the_ground_about_an_inner_edge_has_the_light_that_paths_tell(tmp_path):
    """0.15 mm from a pin's foot; by rings within the rim, in the pin, all light is that of the edge: 12.5 % off."""
    picture, rim = _turned(_PIN, 4.0, 45.0, tmp_path)
    scene = picture.scene
    (shining,) = tuple(map(plain, emitters(scene, Pictures.of(picture).lights, GLANCE)))
    points = rim.centre + (rim.radius + 0.15) * rim.spokes(rim.angles(24))
    white, rng = scene.material.diffuse(), np.random.default_rng(1)
    paths = traced(scene.solid, white, np.array(shining.at), points, rim.axis, 1 << 13, rng) * shining.power
    told = exchanged.exchanged(scene, (shining,)).at(points, np.full(24, rim.face))
    assert np.sqrt(np.mean((told / paths - 1) ** 2)) < 0.075  # margin: twice what is measured; 3.6 %


def test_light_that_met_several_faces_is_as_paths_tell(tmp_path, monkeypatch):
    """A tenth of a millimetre from a pin's foot in its groove, of a part of eight measured rims, most of them wide.

    Patches of 15 places send their light evenly, and what is dark in the corner as much as what is not: 6.3 % off.
    """
    picture, rim = _turned(_PIN, 4.0, 20.0, tmp_path)
    scene = picture.scene
    (shining,) = tuple(map(plain, emitters(scene, Pictures.of(picture).lights, GLANCE)))
    points = rim.centre + (rim.radius + 0.1) * rim.spokes(rim.angles(24))
    white, rng = scene.material.diffuse(), np.random.default_rng(1)
    paths = traced(scene.solid, white, np.array(shining.at), points, rim.axis, 1 << 13, rng).mean() * shining.power
    monkeypatch.setattr(exchanged, "measured_rims", lambda scene: scene.solid.rims)
    exchanged.exchanged.cache_clear()
    light = exchanged.exchanged(scene, (shining,))
    exchanged.exchanged.cache_clear()
    met = light.exchange.met(points, np.broadcast_to(rim.axis, points.shape), 1 << 12)
    told = light.gathered(met, 24, 1 << 12).mean()
    assert told == pytest.approx(paths, rel=0.03)  # margin: five times what is measured; 0.6 %


def test_places_are_denser_about_a_rim():
    """Of those that are added three times as many lie within a radius of it as of even ones, which stay."""
    part = scenes.load("bracket_mm").solid
    faces, rim = np.arange(len(part.faces)), part.circles[0]
    even = Places.spread(part, faces, 2000)
    both = even.beside(part, faces, 2000, rim.around(32), np.full(32, rim.radius))
    near = np.linalg.norm(both.points - rim.centre, axis=1) < 2 * rim.radius
    assert len(both.points) > 3000
    assert near[2000:].mean() > 3 * near[:2000].mean() > 0
    assert (both.points[:2000] == even.points).all()
