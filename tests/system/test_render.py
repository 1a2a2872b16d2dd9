"""The renderer against closed forms and against exact polygon images."""

import numpy as np
import pytest

import measure
import render
from measure.features.layout import layout_of
from measure.features.shape import prepared
from render.quality import Quality
from render.renderer import window
from scenes import Floor, InvalidInput, Lens, Picture
from tests.oracle import axes, block_image, pinhole, polygon_image

pytestmark = pytest.mark.render


def brightness(scene, normal, point, light):
    """Lambertian surface under a point light: albedo x exposure x cos x (distance of the light / r)^2."""
    away = scene.light.distance * axes(light)[0] - point
    r = np.linalg.norm(away)
    return 0.9 * scene.camera.exposure * (away @ normal / r) * (scene.light.distance / r) ** 2


def behind(scene, pose, pixel):
    """Point of the top face's plane that a pixel's centre looks at."""
    (out, right, down), camera = axes(pose), scene.camera
    u, v = (pixel - np.array([camera.width - 1, camera.height - 1]) / 2) / camera.focal_px
    ray, start = -out + u * right + v * down, camera.distance * out
    return start + ray * (scene.object.size[2] - start[2]) / ray[2]


@pytest.mark.parametrize(("sensor", "light"), [((30, 135), (15, 315)), ((45, 225), (60, 45)), ((60, 315), (45, 195))])
def test_face_intensity_is_cosine_over_squared_distance(task1, sensor, light):
    """Five pixels of the top face, each against the point of the face behind its centre, to 5e-4."""
    picture = render.image(task1, sensor, light) - task1.noise.dark_level
    centre = np.rint(pinhole(np.array([[6.25, 3.75, 2.5]]), sensor, task1.camera)[0]).astype(int)
    for pixel in centre + np.array([[0, 0], [6, 0], [-6, 0], [0, 6], [0, -6]]):
        point = behind(task1, sensor, pixel)
        expected = brightness(task1, np.array([0, 0, 1.0]), point, light)
        assert picture[tuple(pixel[::-1])] == pytest.approx(expected, rel=5e-4)
        assert picture[tuple(pixel[::-1])] != pytest.approx(1.01 * expected, rel=5e-4)


def test_darkness_is_the_black_level_and_a_face_behind_is_dark(task1):
    picture = render.image(task1, (30, 90), (150, 90))
    assert picture[0, 0] == task1.noise.dark_level
    top = np.rint(pinhole(np.array([[6.0, 4.0, 2.5]]), (30, 90), task1.camera)[0]).astype(int)
    assert picture[top[1], top[0]] == task1.noise.dark_level


@pytest.mark.parametrize("sensor", [(0, 0), (0, 37)])
def test_camera_at_the_pole_against_the_exact_polygon(task1, sensor):
    """Only the top face is seen; corrected for its shading, the image is the exact blurred polygon within 1 %."""
    scene = task1.model_copy(update={"light": task1.light.model_copy(update={"distance": 1e5})})
    picture = render.image(scene, sensor, (0, 0)) - scene.noise.dark_level
    corners = np.array([scene.solid.vertex(v) for v in ("v4", "v3", "v7", "v6")])
    exact = polygon_image(pinhole(corners, sensor, scene.camera), picture.shape, 0.6, 180.0)
    assert np.abs(picture - exact).max() < 0.022 * 180


@pytest.mark.parametrize("sensor", [(0, 10), (12, 10), (31, 137)])
def test_edges_lie_where_the_exact_image_has_them(task1, sensor):
    """Noise-free distance in the render against that in the exact polygon image, light overhead and far: < 0.002 px."""
    scene = task1.model_copy(update={"light": task1.light.model_copy(update={"distance": 1e5})})
    rendered = render.image(scene, sensor, (0, 0)) - scene.noise.dark_level
    corners = np.array([scene.solid.vertex(v) for v in ("v4", "v3", "v7", "v6")])
    exact = polygon_image(pinhole(corners, sensor, scene.camera), rendered.shape, 0.6, 180.0)
    ours, oracle = (measure.distance(image, scene, sensor) for image in (rendered, exact))
    assert abs(float(ours.value_px) - float(oracle.value_px)) < 0.0025


@pytest.mark.parametrize(("sensor", "light"), [((30, 90), (15, 270)), ((45, 225), (60, 45))])
def test_lines_lie_where_the_exact_shaded_image_has_them(task1, sensor, light):
    """Each fitted line's mean place against the exact image of the shaded block: < 0.001 px; 1 px / 50 is seen."""
    rendered, exact = render.image(task1, sensor, light), block_image(task1, sensor, light)
    offsets = [_line_offsets(task1, sensor, image) for image in (rendered, exact)]
    assert np.abs(offsets[0] - offsets[1]).max() < 0.003
    shifted = task1.model_copy(update={"camera": task1.camera.model_copy(update={"distance": 100.02})})
    # margin: more than what is right may be off
    assert np.abs(_line_offsets(task1, sensor, block_image(shifted, sensor, light)) - offsets[1]).max() > 0.005


def _line_offsets(scene, sensor, image):
    """Offset of each fitted line at the middle of its edge, px."""
    tool = prepared(layout_of(Picture.of(scene, sensor)), "gradient", 12.0)
    found = tool.estimate(image[None])
    return (found.level + found.slope * [frame.length / 2 for frame in tool.calipers])[0]


def test_same_seed_is_bit_identical(task1):
    first, again = (render.image(task1, (30, 135), (15, 315)) for _ in range(2))
    assert (first == again).all()


def test_only_what_the_object_covers_is_rendered(task1):
    rows, columns = window(Picture.of(task1, (30, 135)))
    corners = pinhole(task1.solid.vertices, (30, 135), task1.camera)
    assert columns.start < corners[:, 0].min() - 4 * 0.6  # margin: a window that leaves room for the blur, by its kind
    assert rows.stop > corners[:, 1].max() + 4 * 0.6  # margin: a window that leaves room for the blur, by its kind
    assert (rows.stop - rows.start) * (columns.stop - columns.start) < 0.4 * 256 * 240


def test_a_bent_picture_does_not_depend_on_how_much_of_it_is_rendered(task1):
    """A black floor calls for the whole frame; without it only the object's window, off the middle, is rendered."""
    lens = Lens(distortion=(-1.5, 0.0, 0.01, -0.02))
    camera = task1.camera.model_copy(update={
        "width": 80, "height": 60, "focal_px": 200.0, "lens": lens, "look_at": (3.0, 12.0, 0.0),
    })  # fmt: skip
    scene = task1.model_copy(update={"camera": camera, "settings": ()})
    effects, quality = {"attached_shadow", "fall_off", "lens_blur", "lens_distortion"}, Quality(4, 4, 16)
    floored = scene.model_copy(update={"floor": Floor(reflectance=1e-9, height=-40.0)})
    part = render.image(scene, (30, 135), (15, 315), quality, effects=effects)
    whole = render.image(floored, (30, 135), (15, 315), quality, effects={*effects, "floor"})
    rows, columns = window(Picture.of(scene, (30, 135), (15, 315)))
    assert rows.start != columns.start
    assert (rows, columns) != window(Picture.of(floored, (30, 135), (15, 315)))
    assert np.abs(part - whole).max() < 0.05 * np.ptp(whole)  # other rays at the edges
    flat = render.image(scene, (30, 135), (15, 315), quality, effects=effects - {"lens_distortion"})
    assert np.abs(part - flat).max() > 0.3 * np.ptp(whole)  # negative control  # margin: the order is said


def test_object_outside_the_image_is_darkness(task1):
    camera = task1.camera.model_copy(update={"width": 16, "height": 16})
    scene = task1.model_copy(update={"camera": camera, "object": task1.object})
    away = scene.model_copy(update={"camera": camera.model_copy(update={"focal_px": 8e4, "width": 2, "height": 2})})
    assert render.image(away, (30, 135), (15, 315)).shape == (2, 2)


def test_bad_arguments(task1):
    with pytest.raises(InvalidInput, match="samples must be a square number, got 5"):
        render.Quality(samples=5)
    with pytest.raises(InvalidInput, match="supersample must be at least 1, got 0"):
        render.Quality(supersample=0)
    with pytest.raises(InvalidInput, match=r"effects must be auto, all or some of .*, got 'fog'"):
        render.image(task1, (30, 135), (15, 315), effects="fog")
    with pytest.raises(InvalidInput, match="tolerance bias_px must be at least 0, got -1"):
        render.EffectTolerance(bias_px=-1)
