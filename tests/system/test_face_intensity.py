"""The rendered face has the intensity of the closed form: diffuse, glossy and polarised, from normal to 80 degrees."""

import math

import numpy as np
import pytest

import render
from render import variant
from scenes import Material, Pose
from tests import textbook
from tests.oracle import axes

pytestmark = pytest.mark.render
MATERIALS = {
    "diffuse": Material(specular_fraction=0.1, diffuse_reflectance=1.0),
    "metal": Material(
        specular_fraction=0.5, diffuse_reflectance=0.6, refractive_index=1.8, extinction=2.0, roughness=0.2
    ),
    "glass": Material(specular_fraction=0.5, diffuse_reflectance=0.6, refractive_index=1.5, roughness=0.3),
}
ANGLES = [(0, 0), (80, 0), (0, 80), (30, 60), (80, 75)]  # of sensor and light with the face's normal, degrees
FREE = ("attached_shadow", "fall_off", "lens_blur")


@pytest.mark.parametrize("name", sorted({variant.SCALAR, variant.choose()}))
@pytest.mark.parametrize("material", MATERIALS)
def test_rendered_face_has_the_formulas_intensity(task1, name, material):
    """36 pixels inside the face x = 0, whose corner is in the image's middle: within 1e-4 of the value."""
    specular = () if material == "diffuse" else ("specular_lobe",)
    for sensor, light in ANGLES:
        scene = close(task1, MATERIALS[material])
        compare(scene, upright(sensor, 170), upright(light, 195), name, (*FREE, *specular))


def test_polarised_face_has_the_formulas_intensity(task1):
    scene = close(task1, MATERIALS["metal"], analyser_deg=30.0)
    scene = scene.model_copy(update={"light": scene.light.model_copy(update={"polarisation_deg": 60.0})})
    compare(scene, upright(50, 170), upright(40, 195), None, (*FREE, "specular_lobe", "polarisation", "analyser"))


def close(task1, material, **camera):
    """Few pixels of 0.005 cm: brightness hardly changes within one, so its centre's is its mean's."""
    camera = {"width": 16, "height": 16, "focal_px": 20000.0, "blur_px": 0.1, **camera}
    return task1.model_copy(update={"material": material, "camera": task1.camera.model_copy(update=camera)})


def upright(angle, azimuth):
    """A pose at an angle to the normal of the face x = 0, turned out of the plane of incidence a little."""
    return Pose(90.0 - angle, azimuth if 0 < angle < 80 else 180.0)


def compare(scene, sensor, light, name, effects):
    points = behind(scene, sensor)
    inside = np.s_[:6, :6]
    assert (points[inside][..., 1:] > 0).all()
    picture = render.image(scene, sensor, light, render.Quality(4, 16, 16), name, effects) - scene.noise.dark_level
    assert picture[inside] == pytest.approx(closed_form(scene, sensor, light, points)[inside], rel=1e-4)


def behind(scene, sensor):
    """Points of the plane x = 0 behind the pixels' centres, cm, shape (height, width, 3)."""
    camera, (out, right, down) = scene.camera, axes(list(sensor))
    x, y = np.meshgrid(np.arange(camera.width) - (camera.width - 1) / 2, np.arange(camera.height) - 7.5)
    rays = -out + (x[..., None] * right + y[..., None] * down) / camera.focal_px
    start = camera.distance * out
    return start - rays * (start[0] / rays[..., 0])[..., None]


def closed_form(scene, sensor, light, points):
    """Grey levels above darkness: the textbook's reflectance of the face of normal -x, and the inverse square."""
    eye, lamp = scene.camera.distance * axes(list(sensor))[0], scene.light.distance * axes(list(light))[0]
    polarisation, analyser = polarisers(scene, sensor, light)
    levels = np.empty(points.shape[:2])
    for at in np.ndindex(levels.shape):
        to_light, to_sensor = lamp - points[at], eye - points[at]
        crossed = (
            None if axis is None else np.cross(ray, np.cross(axis, ray))
            for axis, ray in ((polarisation, to_light), (analyser, to_sensor))
        )
        value = float(textbook.brightness(scene.material, (-1, 0, 0), to_light, to_sensor, *crossed))
        levels[at] = scene.camera.exposure * value * scene.light.distance**2 / (to_light @ to_light)
    return levels


def polarisers(scene, sensor, light):
    """Directions of the light's polarisation (from downwards to the right) and of the analyser (from right to down)."""
    (_, right, down), (_, across, under) = axes(list(sensor)), axes(list(light))
    turned = [
        None if angle is None else np.cos(np.radians(angle)) * first + np.sin(np.radians(angle)) * second
        for angle, first, second in (
            (scene.light.polarisation_deg, under, across), (scene.camera.analyser_deg, right, down)
        )
    ]  # fmt: skip
    return turned


def test_the_closed_form_here_is_lamberts_for_a_matt_face(task1):
    """The reference itself: cosine, albedo and inverse square, written out."""
    scene, sensor, light = close(task1, MATERIALS["diffuse"]), upright(0, 170), upright(60, 180)
    (point,) = points = np.array([[[0.0, 0.5, 0.5]]])
    to_light = np.array([-100 * np.sin(np.radians(30)), 0, 100 * np.cos(np.radians(30))]) - point[0]
    far = np.linalg.norm(to_light)
    expected = 200 * 0.9 * (-to_light[0] / far) * (100 / far) ** 2
    assert math.isclose(closed_form(scene, sensor, light, points)[0, 0], expected, rel_tol=1e-12)
