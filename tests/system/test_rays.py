"""Random rays against Mitsuba's own integrators where their numbers are shared, and against closed forms anywhere."""

from dataclasses import replace

import numpy as np
import pytest

import render
import scenes
from render import variant
from render.build import description
from render.optics import blur_and_bin
from render.parts import Part
from render.quality import Quality
from render.renderer import window
from render.testing import assert_images_agree
from scenes import Floor, Lens, Picture

pytestmark = pytest.mark.render
SCALAR = variant.choose().startswith("scalar")
CASES = {
    "interreflection": ("grey_floor", {}, {"floor", "cast_shadow"}),
    "depth_of_field": ("macro", {}, set()),
    "light_size": ("grey_floor", {"light": {"radius": 4.0}}, {"floor", "cast_shadow"}),
}


def small(name, updates):
    """A quarter of the pixels each way."""
    scene = scenes.load(name)
    camera = scene.camera
    updates = {"camera": {"width": 64, "height": 60, "focal_px": camera.focal_px / 4}, **updates}
    parts = {part: getattr(scene, part).model_copy(update=values) for part, values in updates.items()}
    return scene.model_copy(update=parts)


def theirs(scene, setting, active, quality):
    """Mitsuba's integrator, the same many rays in every fine pixel."""
    mitsuba, k = variant.use(variant.choose()), quality.supersample
    picture = Picture.of(scene, setting.sensor, setting.light)
    rows, columns = window(picture)
    crop = tuple(slice(part.start * k, part.stop * k) for part in (rows, columns))
    size = scene.camera.width * k, scene.camera.height * k
    made = description(mitsuba, Part(picture, frozenset(active)), size, crop, quality.random_samples)
    fine = np.array(mitsuba.render(mitsuba.load_dict(made), seed=quality.seed), float)[:, :, 0]
    image = np.full((scene.camera.height, scene.camera.width), scene.noise.dark_level)
    image[rows, columns] += blur_and_bin(fine, scene.camera, k, (crop[1].start, crop[0].start))
    return image


@pytest.mark.skipif(SCALAR, reason="a scalar variant follows Mitsuba's own rays")
@pytest.mark.parametrize("effect", CASES)
def test_the_image_is_that_of_mitsubas_integrator(effect, tmp_path):
    name, updates, others = CASES[effect]
    scene, plain = small(name, updates), frozenset({"attached_shadow", "fall_off", "lens_blur", *others})
    active = plain | {effect}
    setting = scene.settings[0]
    ours = [render.image(scene, *poses(setting), Quality(seed=seed), effects=active) for seed in range(4)]
    many = [theirs(scene, setting, active, Quality(seed=seed, random_samples=256)) for seed in range(4)]
    assert_images_agree(np.array(ours), np.array(many), folder=tmp_path)
    away = np.abs(np.mean(ours, 0) - np.mean(many, 0)).max() / np.max(many)
    assert away < 0.004
    without = [render.image(scene, *poses(setting), effects=plain) for _ in range(2)]
    with pytest.raises(AssertionError):  # negative control: without the effect
        assert_images_agree(np.array(without), np.array(many), folder=tmp_path)


def poses(setting):
    return setting.sensor, setting.light


FREE = frozenset({"attached_shadow", "fall_off", "lens_blur"})
MATT = scenes.Material(specular_fraction=0.0, diffuse_reflectance=1.0)


def beside_the_corner(task1, material=MATT, **updates):
    """16 x 16 px of 0.005 cm at the origin, where the block's faces x = 0 and y = 0 and its bottom meet."""
    camera = task1.camera.model_copy(update={"width": 16, "height": 16, "focal_px": 20000.0, "blur_px": 0.1})
    return task1.model_copy(update={"material": material, "camera": camera, **updates})


def level_of_the_face(scene, light, effects, quality=Quality(4, 16, 16, 64), count=4):
    """Mean grey level above darkness of 36 px on the face x = 0, with its standard error over so many seeds."""
    qualities = [replace(quality, seed=seed) for seed in range(count)]
    images = [render.image(scene, (60, 170), light, each, effects=effects) for each in qualities]
    means = np.array([image[:6, :6].mean() - scene.noise.dark_level for image in images])
    return means.mean(), means.std(ddof=1) / np.sqrt(count)


@pytest.mark.parametrize("above", [5.0, 1.0, -2.0])
def test_a_spherical_light_that_the_horizon_of_a_face_cuts(task1, above):
    """Half-angle 11.5 degrees, its centre so many degrees above the plane: the cosine integrated over what is above."""
    sine, height = 0.2, np.radians(above)
    scene = beside_the_corner(task1, light=scenes.Light(distance=100.0, radius=100.0 * sine))
    whole = 1 - np.sqrt(1 - sine**2)  # of the sphere of directions, times 2 pi
    part = (np.arange(400) + 0.5) / 400
    z, turn = 1 - part * whole, 2 * np.pi * part  # uniform over the light as it is seen
    cosine = z[:, None] * np.sin(height) + np.sqrt(1 - z**2)[:, None] * np.cos(turn) * np.cos(height)
    expected = scene.camera.exposure * np.maximum(cosine, 0).mean() * 2 * np.pi * whole / (np.pi * sine**2)
    light = 60, 90 + np.degrees(np.arcsin(np.sin(height) / np.sin(np.radians(60))))
    found, error = level_of_the_face(scene, light, FREE | {"light_size"})
    # margin: 4 standard errors of the rays, and 1 %
    assert found == pytest.approx(expected, abs=4 * error + 0.01 * expected)
    point, _ = level_of_the_face(scene, light, FREE)
    # margin: ten times the 1 % that the right one is allowed, and as many standard errors
    assert abs(point - expected) > 0.1 * expected + 4 * error  # negative control: without the effect


def test_light_from_the_floor(task1):
    """Overhead light grazes the wall, which sees the floor alone: its irradiance integrated over directions.

    The wall reflects so little that what it sends back to the floor does not count (0.05 x 0.8 of a part).
    """
    wall, floor, distance = 0.05, 0.8, 100.0
    scene = beside_the_corner(
        task1, scenes.Material(specular_fraction=0.0, diffuse_reflectance=wall), floor=Floor(reflectance=floor)
    )
    part = (np.arange(400) + 0.5) / 400
    across, turn = np.sqrt(part)[:, None], np.pi * part  # cosine-weighted; downwards, where the floor is
    direction = np.stack(
        np.broadcast_arrays(-np.sqrt(1 - across**2), across * np.cos(turn), -across * np.sin(turn)), -1
    )
    away = np.hypot(direction[..., 0], direction[..., 1]) / -direction[..., 2] * 0.02  # of a point 0.02 cm above it
    lit = distance**3 / (distance**2 + away**2) ** 1.5
    expected = scene.camera.exposure * wall * floor * lit.mean() / 2
    active = FREE | {"floor", "cast_shadow"}
    found, error = level_of_the_face(scene, (0, 0), active | {"interreflection"})
    # margin: 4 standard errors of the rays, and 1 %
    assert found == pytest.approx(expected, abs=4 * error + 0.01 * expected)
    assert level_of_the_face(scene, (0, 0), active)[0] == pytest.approx(0, abs=0.01 * expected)  # negative control


def test_few_rays_lose_no_light_between_faces(task1):
    """Of a bright wall before a bright floor: four rays show on the mean what 64 do, which agree with closed forms."""
    bright = scenes.Material(specular_fraction=0.0, diffuse_reflectance=0.9)
    scene = beside_the_corner(task1, bright, floor=Floor(reflectance=0.8))
    active = FREE | {"floor", "interreflection"}
    many, _ = level_of_the_face(scene, (0, 0), active, Quality(1, 4, 4, 64), 16)
    few, error = level_of_the_face(scene, (0, 0), active, Quality(1, 4, 4, 4), 48)
    assert few == pytest.approx(many, rel=0.05)
    if SCALAR:  # in compiled variants all pixels have the same points: their mean is as random as one of them
        assert error < 0.01 * many  # negative control: chance hides no twentieth


def test_an_edge_out_of_focus(task1):
    """From above: a step under the disc of marginal rays, the lens's blur and the pixel, each summed on a fine grid."""
    radius, focus, depth, focal = 0.8, 60.0, 97.5, 800.0
    camera = task1.camera.model_copy(
        update={"width": 64, "height": 64, "lens": Lens(aperture_radius=radius, focus=focus)}
    )
    scene = task1.model_copy(update={"material": MATT, "camera": camera})
    disc = radius * (1 / focus - 1 / depth) * focal
    x = np.arange(-16, 16, 0.01) + 0.005  # px beyond the edge x = 0, which lies in the middle of the image
    kernels = np.sqrt(np.maximum(disc**2 - x**2, 0)), np.exp(-((x / camera.blur_px) ** 2) / 2), np.abs(x) < 0.5
    spread = np.array([1.0])
    for kernel in kernels:
        spread = np.convolve(spread, kernel / kernel.sum())
    places = 0.01 * (np.arange(spread.size) - (spread.size - 1) / 2)
    rows = np.arange(18, 46)
    expected = np.interp(rows - 31.5, places, np.cumsum(spread))

    def profile(effects):
        images = [
            render.image(scene, (0, 0), (10, 45), Quality(2, 4, 16, 64, seed), effects=effects) for seed in range(2)
        ]
        mean = np.mean(images, 0)[:, 44:60].mean(1) - scene.noise.dark_level
        return mean[rows] / mean[42:46].mean()

    # margin: chance of 64 rays a fine pixel, of 16 columns and two seeds
    assert np.abs(profile(FREE | {"depth_of_field"}) - expected).max() < 0.01
    # margin: 20 times the limit of the right one
    assert np.abs(profile(FREE) - expected).max() > 0.2  # negative control
