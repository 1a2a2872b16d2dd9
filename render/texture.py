"""The paper's reflectance as textures of plane faces, where light and sensor are known to a point.

From one place, under a light at one place, how bright a face is depends on the place in its plane alone. So in a scalar
variant, which would run `render.bsdf` as interpreted Python ray by ray, a face that is lit and seen becomes a diffuse
one whose reflectance is a table of brightness over N.L: cosine, fall-off and shadows stay the renderer's own. So does,
in any variant, a plane face that sees all of a light of some size, lit by a point in the light's middle.

A table is interpolated linearly. Every other of its nodes alone would miss the nodes between by less than 1e-4 of the
table's largest value anywhere, and by less than 4e-5 on average over any part of an eighth by an eighth of it. What is
left is a quarter of that, 1e-5 on average, or half of it along a crease of the attenuation G. A face that needs more
than _MOST nodes for it has no table: a roughness below about 0.02, a crease at grazing angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from imaging.light.appearance import signal
from imaging.light.emitters import emitters, is_point
from imaging.light.irradiance import beam
from imaging.light.sheets import Sheet
from imaging.pictures import Pictures
from render.meshes import mesh
from scenes import Brdf, Picture, Scene, Solid, as_point
from scenes.lights import SMOOTH
from scenes.materials.textures import Rectangle
from scenes.viewpoint import Viewpoint

Points = Callable[[np.ndarray, np.ndarray], np.ndarray]

_MEAN, _LARGEST = 4e-5, 1e-4  # of a table's largest value: what every other of its nodes may miss
_FEWEST, _MOST = 16, 1 << 22  # intervals along a side, nodes
_PARTS = 8  # of a side, over which errors are averaged
_LOBE = 0.5  # roughnesses that a facet's slope may differ by between neighbours of the first table, lest it miss a lobe
_AT_ONCE = 1 << 13  # points whose temporary arrays stay in the processor's cache
_GRAZING, _LOW = 1e-9, 0.02  # sines: light or sensor in the face's plane; the middle of a light of some size near it


@dataclass(frozen=True, eq=False)
class Face:
    """Part of a solid's surface with its brightness.

    Attributes
    ----------
    triangles : ndarray, shape (T, 3, 3)
        Corners, scene units.
    places : ndarray, shape (T, 3, 2)
        Where the corners lie in the table: 0 at its first and 1 at its last row and column.
    values : ndarray, shape (rows, columns)
        Brightness over N.L.
    """

    triangles: np.ndarray
    places: np.ndarray
    values: np.ndarray


def faces(
    solid: Solid,
    picture: Picture,
    materials: Sequence[Brdf] | None = None,
    uneven: Mapping[int, Sheet] = MappingProxyType({}),
) -> tuple[Face, ...] | None:
    """The solid's surface in parts, or None where a table would need too many nodes or a light's middle is too low.

    Faces that are dark or turned away share one part, of brightness 0.

    Parameters
    ----------
    solid : Solid
    picture : Picture
        Of one light, which is rendered as a point in its middle; parts that are not simulated are neutral.
    materials : sequence of Brdf, optional
        Of each face; the scene's when not given.
    uneven : mapping of int to Sheet
        Textures of faces.
    """
    found, dark = [], np.ones(len(solid.triangles), bool)
    pictures = Pictures.of(picture)
    smooth = replace(pictures, _known={"emitters": emitters(pictures.scene, pictures.lights, SMOOTH)})
    above = np.array([_over(solid, emitter.at) for emitter in pictures.emitters]).reshape(-1, len(solid.normals))
    small = is_point(pictures.scene.lights)
    lit = _over(solid, pictures.lights_at[0], _GRAZING if small else _LOW)
    seen = _over(solid, pictures.viewpoint)
    if (above.any(0) & ~lit & seen).any() and not small:
        return None  # lit from the rim of a light whose middle is below the horizon
    for index in np.flatnonzero(lit & seen):
        material = picture.scene.material if materials is None else materials[index]
        under = smooth if above[:, index].all() else pictures
        made = _face(solid, index, under, material, uneven.get(int(index)))
        if made is None:
            return None
        found.append(made)
        dark &= solid.triangle_faces != index
    rest = solid.triangles[dark]
    return (*found, Face(rest, np.zeros((*rest.shape[:2], 2)), np.zeros((2, 2))))


def _over(solid: Solid, place: Viewpoint | np.ndarray, sine: float = _GRAZING) -> np.ndarray:
    """Which faces a place is over by more than a part of its distance from the origin, bool (F,)."""
    view = Viewpoint.of(place)
    return view.height(solid.normals, solid.offsets) > sine * np.linalg.norm(view.at)


def shapes(mitsuba: Any, parts: tuple[Face, ...]) -> list[Any]:
    """Mitsuba's meshes of the parts that `faces` gives."""
    return [
        mesh(mitsuba, part.triangles, {"type": "diffuse", "reflectance": bitmap(mitsuba, part.values)}, texels(part))
        for part in parts
        if len(part.triangles)
    ]


def bitmap(mitsuba: Any, values: np.ndarray) -> dict:
    """Mitsuba's description of a table that is interpolated linearly."""
    picture = mitsuba.Bitmap(values.astype(np.float32)[..., None])
    return {"type": "bitmap", "bitmap": picture, "raw": True, "format": "variant", "wrap_mode": "clamp"}


def texels(part: Face) -> np.ndarray:
    """Where the triangles' corners lie in the table as Mitsuba counts: a node is the centre of a texel; (T, 3, 2)."""
    size = np.array(part.values.shape[::-1])
    return (0.5 + part.places * (size - 1)) / size


def uneven_part(solid: Solid, face: int, sheet: Sheet) -> Face:
    """A textured face with the factors of its diffuse reflectance."""
    triangles = solid.triangles[solid.triangle_faces == face]
    return Face(triangles, sheet.places(triangles), sheet.values)


def _face(solid: Solid, face: int, pictures: Pictures, material: Brdf, sheet: Sheet | None) -> Face | None:
    """A lit and seen plane face with its table."""
    rectangle, normal = Rectangle.of(solid, face), solid.normals[face]
    triangles = solid.triangles[solid.triangle_faces == face]
    flat = triangles @ rectangle.axes.T

    def at(across: np.ndarray, down: np.ndarray) -> np.ndarray:
        """Points of the plane at fractions of the rectangle's sides, shape (down, across, 3)."""
        return rectangle.corner + np.stack(np.meshgrid(across, down), -1) * rectangle.size @ rectangle.axes

    values = _table(at, normal, pictures, material)
    if values is not None and sheet is not None:
        values = _uneven(values, at, normal, pictures, material, sheet)
    return None if values is None else Face(triangles, (flat - flat.min((0, 1))) / rectangle.size, values)


def _uneven(values, at: Points, normal: np.ndarray, pictures: Pictures, material: Brdf, sheet: Sheet):
    """A table of brightness with the texture's factors on the diffuse part, on nodes that hold those of both."""
    counts = [
        (texture - 1) * math.ceil((table - 1) / (texture - 1))
        for texture, table in zip(sheet.values.shape[::-1], values.shape[::-1], strict=True)
    ]
    if (counts[0] + 1) * (counts[1] + 1) > _MOST:
        return None
    across, down = (np.linspace(0, 1, count + 1) for count in counts)
    share = max(_AT_ONCE // across.size, 1)
    rows = []
    for first in range(0, down.size, share):
        points = at(across, down[first : first + share])
        matt = shade(pictures, normal, points, material.matt())
        rows.append(shade(pictures, normal, points, material) + (sheet.at(points) - 1) * matt)
    return np.concatenate(rows)


def _table(at: Points, normal: np.ndarray, pictures: Pictures, material: Brdf) -> np.ndarray | None:
    """Values on a grid with as many intervals each way as they need; None if that is too many."""
    counts = _first_counts(at, normal, pictures, material.lobe_slope)
    while (counts[0] + 1) * (counts[1] + 1) <= _MOST:
        across, down = (np.linspace(0, 1, count + 1) for count in counts)
        share = max(_AT_ONCE // across.size, 1)
        rows = [down[first : first + share] for first in range(0, down.size, share)]
        values = np.concatenate([shade(pictures, normal, at(across, part), material) for part in rows])
        excess = [_excess(part) for part in (values.T, values)]
        if not np.isfinite(excess).all():
            return None
        if max(excess) <= values.max():
            return values
        more = [
            math.ceil(math.log2(max(part / values.max(), 1.0)) / 2) for part in excess
        ]  # errors fall as h^2 at best
        counts = [count << doublings for count, doublings in zip(counts, more, strict=True)]
    return None


def _first_counts(at: Points, normal: np.ndarray, pictures: Pictures, lobe_slope: float) -> list[int]:
    """Intervals across and down with which no lobe falls between two nodes, powers of two."""
    few = np.linspace(0, 1, _FEWEST + 1)
    slope = _slope(at(few, few), normal, pictures) / (_LOBE * lobe_slope)
    steps = [np.linalg.norm(np.diff(slope, axis=axis), axis=-1).max() for axis in (1, 0)]
    return [_FEWEST << max(math.ceil(math.log2(max(step, 1.0))), 0) for step in steps]


def _excess(values: np.ndarray) -> float:
    """The table's largest value with which linear interpolation of every other row would just do for those between."""
    missed = np.abs(values[1::2] - (values[:-2:2] + values[2::2]) / 2)
    parts = missed[:, 1:].reshape(_PARTS, len(missed) // _PARTS, _PARTS, -1).mean((1, 3))
    return 2 * max(missed.max() / _LARGEST, parts.max() / _MEAN)  # each direction may spend half of what is allowed


def _slope(points: np.ndarray, normal: np.ndarray, pictures: Pictures) -> np.ndarray:
    """Tangent of the angle by which a facet that mirrors the light to the sensor is tilted, as a vector in the face."""
    half = sum(_towards(place, points) for place in (Viewpoint(pictures.lights_at[0]), pictures.viewpoint))
    return half / (half @ normal)[..., None] - normal


def shade(pictures: Pictures, normal: np.ndarray, points: np.ndarray, material: Brdf | None = None) -> np.ndarray:
    """Brightness over N.L of points of a plane that is lit and seen, shape (...).

    Parameters
    ----------
    pictures : Pictures
        Of one picture with one light; N.L is that of its middle.
    normal : ndarray, shape (3,)
    points : ndarray, shape (..., 3)
        Scene units.
    material : Brdf, optional
        The scene's when not given.
    """
    scene = pictures.scene
    arriving = beam(pictures.with_scene(pointed(scene)).emitters[0], points)
    white = scene.camera.exposure * arriving.strength * (arriving.to_light @ normal)
    return signal(pictures, points, normal, points.ndim - 1, material=material) / white


def pointed(scene: Scene) -> Scene:
    """The scene with its one light as a point in its middle."""
    return scene.lit_by(as_point(scene.lights[0]))


def _towards(view: Viewpoint, points: np.ndarray) -> np.ndarray:
    """Unit vectors from points to a place, or along lines of sight."""
    away = view.towards(points)
    return away / np.linalg.norm(away, axis=-1, keepdims=True)
