"""Curved surfaces are shaded by their own normals, whatever their facets are: in the model and in renders."""

import tracemalloc

import numpy as np
import pytest
import trimesh
from scipy.ndimage import map_coordinates

import render
import scenes
from imaging.geometry.projection import project
from imaging.light.appearance import face_signal
from imaging.pictures import Pictures
from scenes import Solid
from scenes.parts.mesh import solid
from scenes.parts.shading import corner_normals, normals_at
from tests.parts import Slot, evenly, plate

RADIUS, HEIGHT = 3.0, 5.0
UNEVEN = np.cumsum(np.tile([0.5, 1.1, 0.8, 1.2, 0.9], 12)) * 2 * np.pi / 54


def rod(angles: np.ndarray) -> Solid:
    """A cylinder about z whose facets end at some angles, rad."""
    return solid(plate(RADIUS * np.stack([np.cos(angles), np.sin(angles)], 1), HEIGHT))


def places(part: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Points (400, 3) on its facets, and these, (400,)."""
    rng = np.random.default_rng(1)
    triangle = rng.choice(np.flatnonzero(~part.plane[part.triangle_faces]), 400)
    return np.einsum("nk,nki->ni", rng.dirichlet([1, 1, 1], 400), part.triangles[triangle]), part.triangle_faces[
        triangle
    ]


def radial(points: np.ndarray, across: tuple[int, int, int]) -> np.ndarray:
    """Unit normals (n, 3) of a cylinder or a sphere about the origin."""
    out = points * across
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


@pytest.mark.parametrize(
    ("part", "across"),
    [
        (rod(evenly(48)), (1, 1, 0)),
        (rod(UNEVEN), (1, 1, 0)),
        (solid(trimesh.creation.icosphere(3, RADIUS)), (1, 1, 1)),
    ],
    ids=["cylinder", "unequal facets", "sphere"],
)
def test_facets_turn_as_their_surface_does(part, across):
    """Normals of a cylinder and of a sphere, within 0.02 degrees; those of the facets are 2 and more off."""
    points, faces = places(part)
    told, true = normals_at(part, faces, points), radial(points, across)
    off, off_flat = (np.degrees(np.linalg.norm(n - true, axis=1)).max() for n in (told, part.normals[faces]))
    assert off < 0.02
    assert off_flat > 2
    np.testing.assert_allclose(np.linalg.norm(told, axis=1), 1, atol=1e-12)


def test_plane_faces_keep_their_own():
    """Exactly, of a block and of a rod's ends, at corners and between."""
    block = scenes.load("task1").solid
    np.testing.assert_array_equal(normals_at(block, np.arange(6), block.vertices[:6]), block.normals)
    part = rod(evenly(48))
    ends = np.flatnonzero(part.plane)
    np.testing.assert_array_equal(normals_at(part, ends, part.vertices[:1]), part.normals[ends])
    flat = part.plane[part.triangle_faces]
    expected = np.repeat(part.normals[part.triangle_faces[flat]][:, None], 3, 1)
    np.testing.assert_array_equal(corner_normals(part)[flat], expected)


def test_what_is_measured_by_its_limb_has_its_exact_normals():
    """Corners of a ball's facets, to rounding."""
    ball = scenes.load("ball").solid
    (wall,) = ball.curved
    away = ball.triangles - wall.surface.centre
    np.testing.assert_allclose(corner_normals(ball), away / np.linalg.norm(away, axis=-1, keepdims=True), atol=1e-12)


def gear(teeth: int) -> Solid:
    """Of plane flanks, with a slot of round ends in its middle."""
    angles, radii = evenly(2 * teeth), np.tile([20.0, 22.0], teeth)
    outline = radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)
    return solid(plate(outline, HEIGHT, [Slot(0.0, 0.0, RADIUS, 6.0, 16, 0.0, HEIGHT)]))


def test_memory_goes_with_corners_and_not_with_surfaces_times_corners():
    """Of 150 teeth: 5 times the normals' own; it was 190 times with a row for each pair of a face and a corner."""
    part = gear(150)
    assert 0 < (~part.plane).sum() < part.plane.sum() > 300
    part.normals, part.triangles, part.areas  # noqa: B018  known of the part before
    corner_normals.cache_clear()
    tracemalloc.start()
    try:
        own = corner_normals(part).nbytes
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 40 * own


def rod_scene(folder) -> scenes.Scene:
    """A rod of 48 facets that lies before a camera, under a point of light."""
    file = folder / "rod.ply"
    angles = evenly(48)
    plate(RADIUS * np.stack([np.cos(angles), np.sin(angles)], 1), HEIGHT).export(file)
    data = scenes.load("plate").model_dump(exclude={"measurands", "settings"})
    camera = {"width": 80, "height": 60, "focal_px": 560.0, "distance": 60.0, "blur_px": 0.3, "exposure": 200.0}
    data["object"] = {"kind": "mesh", "file": str(file)}
    data |= {"units": "mm", "camera": camera | {"look_at": (0, 0, HEIGHT / 2)}}
    data["light"] = {"kind": "point", "distance": 80.0}
    asked = [{"name": "d", "kind": "diameter", "features": [{"circle": "c1"}]}]
    return scenes.Scene.model_validate(data | {"measurands": asked})


def lambert(scene: scenes.Scene, light: tuple[float, float], points: np.ndarray) -> np.ndarray:
    """Grey levels of the rod's wall at points (n, 3): white x cosine x (distance at the middle / distance)^2."""
    polar, azimuth = np.radians(light)
    way = [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    away = np.array([0, 0, HEIGHT / 2]) + scene.light.distance * np.array(way) - points
    far = np.linalg.norm(away, axis=1)
    cosine = (radial(points, (1, 1, 0)) * away).sum(1) / far
    return 200.0 * scene.material.diffuse() * cosine * (scene.light.distance / far) ** 2


def test_a_cylinder_has_the_brightness_of_its_normal(tmp_path):
    """Model and render of 48 facets a turn beside Lambert's law; flat facets are 5 and more times as far off."""
    scene, sensor, light = rod_scene(tmp_path), (85.0, 0.0), (80.0, 25.0)
    angle, height = (v.ravel() for v in np.meshgrid(np.radians(np.arange(-40, 41, 2.5)), [1.5, 2.5, 3.5]))
    points = np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), height], 1)
    expected = lambert(scene, light, points)
    pictures, part = Pictures.of(scene, sensor, light), scene.solid
    faces = (part.normals @ radial(points, (1, 1, 0)).T).argmax(0)
    told = face_signal(pictures, points, faces, 1)
    flat = face_signal(pictures, points, faces, 1, normals=part.normals[faces])
    shown = render.image(scene, sensor, light) - scene.noise.dark_level
    there = map_coordinates(shown, project(points, np.array(sensor), scene.camera).T[::-1], order=3)
    off, off_shown, off_flat = (np.abs(each / expected - 1).max() for each in (told, there, flat))
    assert off < 3e-4  # measured 1e-4
    assert off_shown < 0.012  # 0.004: its facets lie up to 0.006 mm within
    assert off_flat > 0.05  # 0.13
