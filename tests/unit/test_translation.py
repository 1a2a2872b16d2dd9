"""Everything moved by P, and the camera looking at P: the same picture, the same prediction, the same decisions."""

from dataclasses import replace

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from scenes import Floor, Obstacle, Picture
from scenes.parts.solid import Solid
from tests.oracle import axes
from validation.hard.scenes_for import with_solid

P = np.array([40.0, -25.0, 13.0])
POSES = {"bracket": ((45, 127), (23, 3)), "grey_floor": ((30, 330), (20, 30))}  # where all edges are seen and lit
ELSEWHERE = (35, 70), (20, 200)


def moved(scene, by=None):
    """Object, obstacles, floor and what the camera looks at, moved; lights and sensor go with what is looked at.

    By P, or as high where there is a floor: its square stays about the origin, and 18 of the 130,000 rays between
    surfaces that meet something miss or reach it near its sides if the part moves along it.
    """
    by = (P if scene.floor is None else P * (0, 0, 1)) if by is None else by
    old = scene.solid
    circles = tuple(replace(circle, centre=circle.centre + by) for circle in old.circles)
    body = Solid(
        old.vertex_names, old.vertices + by, old.faces, old.edges, old.triangles + by, old.triangle_faces, circles
    )
    camera = scene.camera.model_copy(update={"look_at": tuple((np.array(scene.camera.look_at) + by).tolist())})
    floor = scene.floor and scene.floor.model_copy(update={"height": scene.floor.height + by[2]})
    obstacles = tuple(
        o.model_copy(update={"corner": tuple((np.array(o.corner) + by).tolist())}) for o in scene.obstacles
    )
    return with_solid(scene, body).model_copy(update={"camera": camera, "floor": floor, "obstacles": obstacles})


def bent(scene):
    """With all that the lens and the noise can do."""
    lens = scenes.Lens(distortion=(-0.2, 0.05, 0.002, -0.001, 0.0), aperture_radius=0.3)
    noise = scene.noise.model_copy(update={"gain": 0.2})
    return scene.model_copy(update={"camera": scene.camera.model_copy(update={"lens": lens}), "noise": noise})


SCENES = {
    **{name: scenes.load(name) for name in ("task1", "polarised", "glossy_metal", "grey_floor", "bracket", "plate")},
    "bent": bent(scenes.load("task1")),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("model", ["paper", "calibrated", "bound"])
def test_prediction_is_the_same(name, model):
    scene, poses = SCENES[name], POSES.get(name, ELSEWHERE)
    here, there = (planner.predict(s, *poses, model) for s in (scene, moved(scene)))
    assert here.status == there.status
    crowded = name in ("bracket", "grey_floor") and model != "bound"  # light between its faces; beside the upright
    assert here.status == ("clutter" if crowded else "ok")
    for value in ("value_image", "value_object", "variance_image", "variance_object"):
        assert getattr(there, value) == pytest.approx(getattr(here, value), rel=1e-9)
    assert there.corners == pytest.approx(here.corners, abs=1e-9)
    looked_elsewhere = scene.model_copy(update={"camera": moved(scene).camera})
    assert planner.predict(looked_elsewhere, *poses, model).corners != pytest.approx(here.corners, abs=1.0)


@pytest.mark.parametrize("name", ["task1", "grey_floor"])
@pytest.mark.parametrize("model", ["paper", "calibrated"])
def test_maps_and_searches_are_the_same(name, model):
    """The fast sums of the maps, and the search with its bound, are of the same numbers."""
    space, (_, light) = planner.ViewingSpace(30, (0, 90)), POSES.get(name, ELSEWHERE)
    here, there = (
        planner.variance_map(scene, light=light, space=space, model=model)
        for scene in (SCENES[name], moved(SCENES[name]))
    )
    assert np.isfinite(here).any()
    assert there == pytest.approx(here, rel=1e-9)
    plans = [
        planner.plan(scene, model=model, step_deg=15, refined=False) for scene in (SCENES[name], moved(SCENES[name]))
    ]
    assert plans[0].grid_variance == pytest.approx(plans[1].grid_variance, rel=1e-9)
    assert plans[0].poses == plans[1].poses


@pytest.mark.parametrize("name", ["task1", "grey_floor", "bent"])
def test_effects_are_decided_alike(name):
    """Their influences, too: nothing of them is about the origin."""
    scene = SCENES[name]
    here, there = (render.effects(s) for s in (scene, moved(scene)))
    for one, other in zip(here, there, strict=True):
        assert one.effect.name == other.effect.name
        assert (one.on, one.reason) == (other.on, other.reason)
        assert tuple(one.influence) == pytest.approx(tuple(other.influence), rel=1e-6)


@pytest.mark.render
@pytest.mark.parametrize("name", ["task1", "glossy_metal", "grey_floor"])
def test_rendered_image_and_measurement_are_the_same(name):
    """Single precision knows a place to 5e-6 cm: 4e-5 px, so the same rays fall on the other side of an edge at times.

    Where that makes one fine pixel more an edge's, all later ones get other random numbers (grey_floor), 64 rays each:
    2e-5 of the contrast in the mean, 0.008 at most. An image moved by 0.3 px, 6e-4 and 0.15, is told from that.
    """
    scene, quality, (sensor, light) = SCENES[name], render.Quality(2, 4), POSES.get(name, ELSEWHERE)
    effects = [e.effect.name for e in render.effects(scene) if e.on and e.effect.name != "interreflection"]
    here, there = (render.image(s, sensor, light, quality, effects=effects) for s in (scene, moved(scene)))
    contrast = np.ptp(here)
    away = np.abs(here - there) / contrast
    assert away.max() < 0.04
    assert away.mean() < 1.1e-4
    found, again = (measure.distance(i, s, sensor) for i, s in ((here, scene), (there, moved(scene))))
    assert again.value_px == pytest.approx(float(found.value_px), abs=0.003)
    aside = np.abs(here - render.image(turned(scene, sensor, 0.3), sensor, light, quality, effects=effects)) / contrast
    assert aside.mean() > 1.1e-4
    assert aside.max() > 0.04  # margin: four times what is right may be off


def turned(scene, sensor, pixels):
    """Looking so far aside that the image moves by some pixels."""
    _, right, _ = axes(sensor)
    aside = pixels * scene.camera.distance / scene.camera.focal_px * right
    return scene.model_copy(update={"camera": moved(scene, aside).camera})


def test_lights_and_sensor_stand_around_what_is_looked_at(task1):
    scene, (sensor, light) = moved(task1), ELSEWHERE
    for role, distance in (("sensor", task1.camera.distance), ("light", task1.light.distance)):
        at = scene.position(role, scenes.Pose(*sensor))
        assert at - P == pytest.approx(distance * axes(sensor)[0], abs=1e-12)
    pictures = planner.Pictures.of(Picture.of(scene, sensor, light))
    assert pictures.sensor_at == pytest.approx(P + 100 * axes(sensor)[0])
    assert pictures.lights_at[0] == pytest.approx(P + 100 * axes(light)[0])


def test_a_copy_with_another_place_is_there():
    """Whatever was asked of the first one before: floor and obstacles are where the copy says."""
    before = SCENES["grey_floor"]
    assert before.obstacles[0].solid.vertices.min(0).tolist() == [-3, 0, 0]
    scene = moved(before, P)
    assert scene.obstacles[0].solid.vertices.min(0).tolist() == [37, -25, 13]
    assert scene.bodies.vertices.min(0).tolist() == [37, -25, 13]
    assert scene.floor == Floor(reflectance=0.2, height=13.0)
    assert scene.obstacles == (Obstacle(corner=(37.0, -25.0, 13.0), size=(2.0, 7.5, 8.0)),)
