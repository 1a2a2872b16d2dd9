"""What Mitsuba is told of sensor, lights, floor and surfaces, with a stand-in for it that keeps what it is told."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import scenes
from render import bsdf, build, lights
from render.parts import Part
from render.rays import SURFACES
from scenes import Floor, Lens, Light, Picture, Pose
from tests.oracle import axes

SENSOR, LIGHT = (30.0, 135.0), (15.0, 315.0)


class Transform:
    """A chain of what was asked for."""

    def __init__(self, steps=()):
        self.steps = steps

    def __getattr__(self, name):
        return lambda *args, **named: Transform((*self.steps, (name, *args, *named.values())))


MITSUBA = SimpleNamespace(ScalarTransform4f=Transform)


def picture(scene):
    return Picture.of(scene, Pose(*SENSOR), Pose(*LIGHT))


def changed(scene, part, **values):
    return scene.model_copy(update={part: getattr(scene, part).model_copy(update=values)})


@pytest.mark.parametrize("blurred", [False, True])
def test_sensor(blurred, task1):
    """Field of view by the pinhole's triangle, the crop, the pose with the image's columns upright."""
    scene = changed(task1, "camera", lens=Lens(aperture_radius=0.7, focus=80.0))
    active = frozenset({"depth_of_field"} if blurred else ())
    told = build.view(MITSUBA, picture(scene), active, (512, 480), (slice(20, 60), slice(30, 130)), 9)
    out, right, down = axes(SENSOR)
    camera = scene.camera
    assert told["type"] == ("thinlens" if blurred else "perspective")
    assert (told.get("aperture_radius"), told.get("focus_distance")) == ((0.7, 80.0) if blurred else (None, None))
    assert math.tan(math.radians(told["fov"] / 2)) == pytest.approx(camera.width / 2 / camera.focal_px)
    assert told["fov_axis"] == "x"
    assert 0 < told["near_clip"] < 0.1 * camera.distance
    assert told["far_clip"] > 10 * camera.distance
    ((name, origin, target, up),) = told["to_world"].steps
    assert name == "look_at"
    assert origin == pytest.approx(camera.distance * out)
    assert target == list(camera.look_at)
    assert up == pytest.approx(-down)
    film = told["film"]
    assert (film["width"], film["height"]) == (512, 480)
    assert (film["crop_offset_x"], film["crop_offset_y"]) == (30, 20)
    assert (film["crop_width"], film["crop_height"]) == (100, 40)
    assert told["sampler"]["sample_count"] == 9
    assert np.dot(right, down) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(("radius", "seen"), [(0.7, 0.7), (0.0, None)])
def test_aperture(radius, seen, task1):
    """That of the lens where its blur is simulated; the least that can be, where it is a pinhole then; else none."""
    scene = changed(task1, "camera", lens=Lens(aperture_radius=radius))
    assert build.aperture_radius(scene, frozenset()) == 0
    found = build.aperture_radius(scene, frozenset({"depth_of_field"}))
    assert found == (seen or pytest.approx(1e-4 * scene.camera.distance))


@pytest.mark.parametrize(("radius", "kind"), [(0.0, "point"), (0.5, "disk"), (5.0, "sphere")])
def test_light(radius, kind, task1):
    """A white surface at the reference point, facing it, has the camera's exposure, whatever the light's size."""
    scene = changed(task1, "light", radius=radius)
    told = lights.description(MITSUBA, picture(scene))
    (emitter,), distance = told.values(), scene.light.distance
    place = distance * axes(LIGHT)[0]
    assert emitter["type"] == kind
    if kind == "point":
        irradiance = emitter["intensity"]["value"] / distance**2
        assert emitter["position"] == pytest.approx(place)
    else:
        irradiance = emitter["emitter"]["radiance"]["value"] * math.pi * radius**2 / distance**2
        assert emitter["bsdf"]["reflectance"]["value"] == 0
    if kind == "sphere":
        assert (emitter["radius"], emitter["center"]) == (radius, pytest.approx(place))
    if kind == "disk":
        matrix = np.array(emitter["to_world"].steps)
        assert matrix[:3, 3] == pytest.approx(place)
        matrix[:3, :3] /= radius
        assert matrix[:3, 2] == pytest.approx(-axes(LIGHT)[0])
        assert np.linalg.det(matrix) == pytest.approx(1)
    assert irradiance / math.pi == pytest.approx(scene.camera.exposure)
    (point,) = lights.description(
        MITSUBA, Part(picture(scene), frozenset({"light_size"})).reduced(frozenset()).picture
    ).values()
    assert point["type"] == "point"


@pytest.mark.parametrize("active", [(), ("polarisation",)])
def test_lamps(active, task1):
    """Only where polarisation counts; a field across the way to the reference point; the full angle of its size."""
    light = Light(distance=50.0, polarisation_deg=30.0, radius=2.0)
    scene = task1.model_copy(update={"light": light})
    found = lights.lamps(picture(scene), frozenset(active))
    assert len(found) == ("polarisation" in active)
    assert not lights.lamps(picture(task1), frozenset(active))
    for lamp in found:
        assert lamp.at == pytest.approx(50.0 * axes(LIGHT)[0])
        assert np.dot(lamp.at, lamp.polarisation) == pytest.approx(0, abs=1e-9)
        assert np.linalg.norm(lamp.polarisation) == pytest.approx(1)
        assert lamp.angle == 2 * 2.0 / 50.0


@pytest.mark.parametrize("analysed", [False, True])
def test_floor(analysed):
    told = build._floor(MITSUBA, Floor(reflectance=0.6, height=-3.0, half_side=44.0), 0.5 if analysed else 1.0)
    assert told["type"] == "rectangle"
    assert told["to_world"].steps == (("translate", [0, 0, -3.0]), ("scale", 44.0))
    assert told["bsdf"]["reflectance"]["value"] == (0.3 if analysed else 0.6)


def test_lowest_and_solids(task1):
    crowded = scenes.load("grey_floor")
    assert build._lowest(task1) == min(vertex[2] for vertex in task1.solid.vertices)
    assert build._solids(crowded, frozenset()) == [crowded.solid]
    assert len(build._solids(crowded, frozenset({"cast_shadow"}))) == 1 + len(crowded.obstacles)


def test_textures_only_where_one_direction_is_enough():
    glossy = picture(scenes.load("glossy_metal"))
    assert build.textured(glossy, frozenset({"specular_lobe"})) is not None
    for effect in build.MANY_WAYS:
        assert build.textured(glossy, frozenset({"specular_lobe", effect})) is None


@pytest.mark.parametrize("way", [0.0, 0.9e-3, 2e-3, 0.099, 0.102])
@pytest.mark.parametrize("angle", [0.0, 0.1])
def test_whether_a_way_leads_to_a_lamp(way, angle):
    """Within the angle that it spans, and what single precision makes of a cosine: 1e-6."""
    dr = SimpleNamespace(normalize=lambda v: v / np.linalg.norm(v), dot=np.dot)
    hit = SimpleNamespace(p=np.array([1.0, 2.0, 3.0]), to_local=lambda v: v)
    place = hit.p + 7 * np.array([0.6, 0.0, 0.8])
    slanted = np.cos(way) * np.array([0.6, 0.0, 0.8]) + np.sin(way) * np.array([0.0, 1.0, 0.0])
    found = bsdf._along(dr, SimpleNamespace(Point3f=lambda *v: np.array(v)), hit, place, slanted, angle)
    assert found == (way <= max(angle, 1e-3))


@pytest.mark.parametrize("active", [(), ("interreflection",)])
def test_surfaces_that_light_meets(active, task1, monkeypatch):
    """The first alone, or so many as the random numbers are made for, none ended by chance."""
    monkeypatch.setattr(build, "mesh", lambda *args, **named: None)
    crop = slice(0, 4), slice(0, 4)
    told = build.description(MITSUBA, Part(picture(task1), frozenset(active)), (8, 8), crop, 1)
    assert told["integrator"]["hide_emitters"]
    if active:
        assert told["integrator"]["type"] == "path"
        assert told["integrator"]["max_depth"] == SURFACES + 1
        assert told["integrator"]["rr_depth"] > SURFACES + 1
    else:
        assert told["integrator"]["type"] == "direct"
        assert (told["integrator"]["emitter_samples"], told["integrator"]["bsdf_samples"]) == (1, 0)
    assert {"sensor", "light0", "part0"} <= told.keys()
    assert "part1" not in told
    floor = build.description(MITSUBA, Part(picture(task1), frozenset({"floor"})), (8, 8), crop, 1)["floor"]
    assert floor["bsdf"]["reflectance"]["value"] == 0  # none is described: a black one
