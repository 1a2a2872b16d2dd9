"""Curved surfaces are shaded by their own normals, whatever their facets are: in the model, in renders, in bores."""

import numpy as np
import pytest
import trimesh

from imaging.light.appearance import face_signal
from imaging.light.bore import bores
from imaging.pictures import Pictures
from render.image import image
from scenes import Circle, Mesh, Solid, load
from scenes.parts.mesh import solid
from scenes.parts.shading import corner_normals, normals_at
from tests.parts import evenly

RADIUS, HEIGHT = 2.0, 5.0


def rod(angles: np.ndarray) -> Solid:
    """A cylinder about z whose facets end at some angles, rad."""
    outline = RADIUS * np.stack([np.cos(angles), np.sin(angles)], 1)
    polygon = trimesh.path.polygons.Polygon(outline)
    return solid(trimesh.creation.extrude_polygon(polygon, HEIGHT))


def places(part: Solid, rng: np.random.Generator, count: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) on its facets, and these, (n,)."""
    triangle = rng.choice(np.flatnonzero(~part.plane[part.triangle_faces]), count)
    points = np.einsum("nk,nki->ni", rng.dirichlet([1, 1, 1], count), part.triangles[triangle])
    return points, part.triangle_faces[triangle]


def radial(points: np.ndarray, flat: bool) -> np.ndarray:
    """Normals of a cylinder about z, or of a sphere, about the origin."""
    out = points * [1, 1, 0 if flat else 1]
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


@pytest.mark.parametrize(
    ("part", "flat"),
    [
        (rod(np.arange(48) * 2 * np.pi / 48), True),
        (rod(np.cumsum([0.05, 0.11, 0.08, 0.12] * 18)[:-1] * 2 * np.pi / 6.48), True),
        (solid(trimesh.creation.icosphere(3, RADIUS)), False),
    ],
)
def test_facets_turn_as_their_surface_does(part, flat):
    """Normals of a cylinder and a sphere, within 0.01 degrees; those of the facets are 2 and more off."""
    points, faces = places(part, np.random.default_rng(1))
    told, true = normals_at(part, faces, points), radial(points, flat)
    off, off_flat = (np.degrees(np.linalg.norm(n - true, axis=1)) for n in (told, part.normals[faces]))
    assert off.max() < 0.01
    assert off_flat.max() > 2
    np.testing.assert_allclose(np.linalg.norm(told, axis=1), 1, atol=1e-12)


def test_plane_faces_keep_their_own():
    """Exactly, of a block and of a rod's ends, at corners and between."""
    block = solid(trimesh.creation.box((2, 3, 4)))
    assert normals_at(block, np.arange(6), block.vertices[:6]) is not block.normals
    np.testing.assert_array_equal(normals_at(block, np.arange(6), block.vertices[:6]), block.normals)
    part = rod(evenly(48) if callable(evenly) else np.arange(48))
    ends = np.flatnonzero(part.plane)
    np.testing.assert_array_equal(normals_at(part, ends, part.vertices[:1]), part.normals[ends])
    flat = part.plane[part.triangle_faces]
    expected = np.repeat(part.normals[part.triangle_faces[flat]][:, None], 3, 1)
    np.testing.assert_array_equal(corner_normals(part)[flat], expected)
