"""Where light from other surfaces may be seen, and how much of it is left where all reflect less."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

import scenes
from imaging.geometry.looked_at import looked_at
from imaging.geometry.projection import facing, project_ideal, sensor_position
from imaging.light import exchanged
from imaging.light.between import light_between, light_of_dimmed
from imaging.pictures import Pictures
from render.between import lent_to
from scenes import Picture, Scene
from tests.parts import newcomers
from tests.step_parts import flange, written
from validation.simulation import dimmed
from validation.simulation.dimmed import of_one_surface


@pytest.fixture(scope="module")
def picture():
    scene = scenes.load("bracket")
    return Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)


def test_faces_are_seen_where_they_are_projected(picture):
    """The middle of each triangle that is turned to the sensor and hidden by none; outside there is nothing."""
    bodies, sensor = picture.scene.bodies, np.array(list(picture.sensor))
    middles = bodies.triangles.mean(1)
    seen = project_ideal(middles, sensor, picture.scene.camera)
    faces, places = looked_at(picture, np.concatenate([seen, [[-500.0, -500.0]]]))
    met = np.linalg.norm(places[:-1] - middles, axis=1) < 1e-6 * bodies.extent
    assert met.sum() >= 4
    assert (faces[:-1][met] == bodies.triangle_faces[met]).all()
    assert faces[-1] == -1


def test_only_faces_within_the_hull_are_lent_light(picture):
    """A fine pixel in the middle of each triangle; before a floor those that do not look up, and the floor, as well."""
    camera, bodies, k = picture.scene.camera, picture.scene.bodies, 2
    sensor = np.array(list(picture.sensor))
    floor = picture.with_scene(picture.scene.with_(floor={"reflectance": 0.3, "height": -1.0}))
    for each, expected in ((picture, ~bodies.outer), (floor, ~bodies.outer | (bodies.normals[:, 2] < 0.999))):
        seen = project_ideal(bodies.triangles.mean(1), sensor, camera)
        faces, _ = looked_at(each, seen)
        for (x, y), face in zip(seen, faces, strict=True):
            marked = np.zeros((3, 3), bool)
            marked[1, 1] = True
            start = round((y + 0.5) * k - 0.5) - 1, round((x + 0.5) * k - 0.5) - 1
            around = looked_at(each, np.array([(x + i / k, y + j / k) for i in (-1, 0, 1) for j in (-1, 0, 1)]))[0]
            if (around == face).all() and face >= 0 and (expected[face] or _away(each, expected, (x, y)) > 3 / k):
                assert lent_to(each, marked, start, k)[1, 1] == expected[face]
        far = np.ones((1, 1), bool)
        assert lent_to(each, far, (0, 0), k)[0, 0] == (each is floor)


def _away(picture, lent, place):
    """Distance from a place of the image to the nearest edge of such a face that looks at the sensor, px."""
    bodies, camera, sensor = picture.scene.bodies, picture.scene.camera, np.array(list(picture.sensor))
    seen = lent & facing(bodies, sensor_position(camera, sensor))
    ends = np.array([edge.ends for edge in bodies.edges if seen[list(edge.faces)].any()])
    start, stop = np.moveaxis(project_ideal(bodies.vertices, sensor, camera)[ends], 1, 0)
    way = stop - start
    along = np.clip(((place - start) * way).sum(1) / (way**2).sum(1), 0, 1)
    return np.linalg.norm(start + along[:, None] * way - place, axis=1).min()


def test_a_wall_narrower_than_a_pixel_is_lent_light_though_no_middle_shows_it(tmp_path):
    """The sides of a slot, seen nearly along its walls: every fine pixel that its upper edges cross."""
    scene = newcomers(tmp_path)
    picture, k = Picture.of(scene, (20, 0), (20, 45)), 2
    ends = scene.solid.vertices[[list(scene.solid.edge(name).ends) for name in ("e10", "e12")]]
    points = ends[:, None, 0] + np.linspace(0.02, 0.98, 40)[:, None] * (ends[:, None, 1] - ends[:, None, 0])
    at = project_ideal(points.reshape(-1, 3), np.array([20.0, 0.0]), scene.camera)
    fine = np.rint((at + 0.5) * k - 0.5).astype(int)
    marked = np.zeros((k * scene.camera.height, k * scene.camera.width), bool)
    marked[fine[:, 1], fine[:, 0]] = True
    faces, _ = looked_at(picture, (fine + 0.5) / k - 0.5)
    assert scene.bodies.outer[faces].any()  # some middles show what is lent nothing
    assert lent_to(picture, marked, (0, 0), k)[fine[:, 1], fine[:, 0]].all()


def test_what_is_left_of_light_that_met_two_surfaces_or_more(picture):
    """Less than of two of them, more than of five; of a black part's, that met no third one, of two."""
    part, inner = 0.1, np.flatnonzero(~picture.scene.bodies.outer)
    triangles = np.flatnonzero(np.isin(picture.scene.bodies.triangle_faces, inner))
    points, faces = picture.scene.bodies.triangles[triangles].mean(1), picture.scene.bodies.triangle_faces[triangles]
    before, after = light_of_dimmed(Pictures.of(picture), part, points, faces)
    lit = before > 0
    assert lit.any()
    left = after[lit] / before[lit]
    assert (left < 0.9**2).all()
    assert (left > 0.9**5).all()
    scene = picture.scene
    dark = picture.with_scene(scene.tried(material=scene.material.dimmed(0.999)))
    before, after = light_of_dimmed(Pictures.of(dark), part, points, faces)
    assert after[lit] / before[lit] == pytest.approx(0.9**2, rel=2e-3)


def test_one_surface_reflects_less_by_what_its_light_has_met(picture, monkeypatch):
    """Direct light less by a tenth, other light by what closed form tells, which is asked near what is measured."""
    scene = picture.scene
    height, width, dark = scene.camera.height, scene.camera.width, scene.noise.dark_level
    direct = np.full((height, width), dark + 50.0)
    render = direct.copy()
    y, x = np.mgrid[:height, :width]
    faces, _ = looked_at(picture, np.stack([x, y], -1).reshape(-1, 2).astype(float))
    inner = ((faces >= 0) & ~np.append(scene.bodies.outer, True)[faces]).reshape(height, width)
    near = inner & dimmed._asked(picture, (height, width))
    assert 0 < near.sum() < inner.sum()
    render[inner] += 8.0
    asked = []

    def told(_, part, points, faces):
        asked.append(len(points))
        return np.full(len(points), 8.0), np.full(len(points), 0.7 * 8.0)

    monkeypatch.setattr("validation.simulation.dimmed.light_of_dimmed", told)
    found = render + of_one_surface(picture, (render,), lambda: direct, 0.1).toarray().reshape(render.shape)
    assert found[~inner] == pytest.approx(render[~inner] - 5.0)
    assert found[near] == pytest.approx(render[near] - 5.0 - 0.3 * 8.0, abs=1e-6)
    assert asked == [near.sum()]


def test_other_scenes_are_rendered(picture):
    scene = picture.scene
    rendered = np.full((scene.camera.height, scene.camera.width), 90.0)
    floor = picture.with_scene(scene.with_(floor={"reflectance": 0.3, "height": -1.0}))
    assert of_one_surface(floor, (rendered,), lambda: rendered, 0.1) is None
    assert of_one_surface(picture, (rendered,), lambda: rendered, 0.0) is None


@pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")
def test_a_limb_that_is_measured_leaves_light_between_other_faces_as_it_is(tmp_path, monkeypatch):
    """Of a flange: walls of its holes have light from themselves, told by the same places, measured rims or not.

    Facets of the round wall whose limb is measured have a model of their own, and none here.
    """
    monkeypatch.setattr(exchanged, "measured_rims", lambda scene: ())
    file = written(flange(), tmp_path / "flange.step")
    told = {"name": "d", "kind": "diameter", "tolerance": 0.05}
    plain = scenes.load("bracket_mm").model_dump(exclude={"measurands", "settings"})
    plain |= {"object": {"kind": "step", "file": str(file)}}
    bare = Scene.model_validate(plain | {"measurands": [told | {"features": [{"circle": "c1"}]}]})
    walls = [each.name for each in bare.all_walls.curved]
    found = []
    for scene in (bare, *(_limb_measured(plain, told, name) for name in walls)):
        solid, pictures = scene.solid, replace(Pictures.of(scene, (20, 30), (30, 200)), closely=True)
        faces = np.arange(len(solid.faces))
        middles = np.array([solid.triangles[solid.triangle_faces == face].mean((0, 1)) for face in faces])
        own = [face for each in solid.curved for face in each.faces]
        found.append((light_between(pictures, middles, faces), own))
    assert walls
    (before, none), *others = found
    assert not none
    assert (before > 0).mean() > 0.1
    for after, own in others:
        assert own
        rest = np.setdiff1d(np.arange(len(before)), own)
        assert (after[own] == 0).all()
        assert after[rest] == pytest.approx(before[rest], rel=1e-9, abs=1e-9)


def _limb_measured(plain, told, name):
    return Scene.model_validate(plain | {"measurands": [told | {"features": [{"surface": name}]}]})
