"""Signals on both sides of edges, their contrast, and the variance of the noise there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from imaging import sensor
from imaging.geometry.projection import edge_points, facing
from imaging.geometry.visibility import seen, turned
from imaging.light.appearance import face_signal, has_background, is_plain, is_separable
from imaging.light.behind import behind
from imaging.light.between import light_between
from imaging.light.irradiance import squared_distance
from imaging.pictures import Pictures
from scenes import Edge, Scene, Solid
from scenes.viewpoint import Viewpoint


class EdgeContrast(NamedTuple):
    """Squared difference of the recorded levels on both sides, and the mean variance of the noise there; (..., E, n).

    An edge locator's kernel is even across the edge, so it sees the mean of both sides' noise. ``uncut_variance`` is
    what that would be if the scale had no end.
    """

    squared: np.ndarray
    noise_variance: np.ndarray | float
    uncut_variance: np.ndarray | float


def side_signals(
    pictures: Pictures, names: tuple[str, ...], points: np.ndarray, *, fall_off: bool = True
) -> np.ndarray:
    """Signal on the two sides of each edge.

    A side is the face that meets in the edge; where that face turns away from the sensor, it is whatever the sensor
    sees behind the edge: another face, the floor, or darkness.

    Parameters
    ----------
    names : tuple of str
        E edges of the object.
    points : ndarray, shape (E, n, 3) or (..., E, n, 3)
        Points on the edges, scene units; the same for all pictures or for each its own.

    Returns
    -------
    ndarray, shape (..., E, 2, n)
        Exactly 0 for a side that is dark: darkness behind, turned away from the light, or in shadow. Both are 0 at a
        point that is hidden from the sensor.
    """
    scene, bodies = pictures.scene, pictures.scene.bodies
    edges = [scene.solid.edge(name) for name in names]
    if not edges:
        lead = np.broadcast_shapes(*(poses.shape[:-1] for poses in (pictures.sensors, *pictures.lights)))
        return np.zeros((*lead, 0, 2, points.shape[-2]))
    faces = np.array([edge.faces for edge in edges])
    if is_plain(scene):
        level = face_signal(pictures, points[..., None, :, :], faces[:, :, None], 3, fall_off=fall_off)
        return np.where(facing(bodies, pictures.viewpoint)[..., faces, None], level, 0.0)
    return np.stack([_beside(pictures, e, points[..., i, :, :], fall_off) for i, e in enumerate(edges)], -3)


def edge_contrast(pictures: Pictures, names: tuple[str, ...], fractions: np.ndarray) -> EdgeContrast:
    """Recorded contrast and noise at fractions (n,) or (..., E, n) of each edge's length in space."""
    if not names or not is_separable(pictures.scene):
        return of_sides(
            pictures.scene, side_signals(pictures, names, edge_points(pictures.scene.solid, names, fractions))
        )
    r2, strength = edge_distance2(pictures, names, fractions), side_strengths(pictures, names)
    return _separable_contrast(pictures.scene, strength, r2)


def of_sides(scene: Scene, sides: np.ndarray) -> EdgeContrast:
    """Recorded contrast and noise from the signals (..., 2, n) of both sides, shape (..., n)."""
    if scene.noise.gain == 0 and not (sides > sensor.headroom(scene.noise)).any():  # NaN of one picture is its own
        squared = (sides[..., 0, :] - sides[..., 1, :]) ** 2
        return EdgeContrast(squared, scene.noise.variance, scene.noise.variance)
    found = sensor.recorded(scene.noise, scene.noise.dark_level + sides)
    squared = (found.level[..., 0, :] - found.level[..., 1, :]) ** 2
    uncut = scene.noise.variance + sensor.shot_noise(scene.noise, sides)
    return EdgeContrast(squared, found.noise_variance.mean(-2), uncut.mean(-2))


def _separable_contrast(scene: Scene, strength: np.ndarray, r2: np.ndarray) -> EdgeContrast:
    """The same from `side_strengths` (..., E, 2) and squared distances (..., E, n); signals are formed where needed."""
    squared = ((strength[..., 0] - strength[..., 1]) ** 2)[..., None] / r2**3
    special = np.ones(squared.shape[:-1], bool)
    if scene.noise.gain == 0:
        special = np.broadcast_to(strength.max(-1) > sensor.headroom(scene.noise) * r2.min(-1) ** 1.5, special.shape)
    if not special.any():
        return EdgeContrast(squared, scene.noise.variance, scene.noise.variance)
    noise, uncut = np.full((2, *squared.shape), scene.noise.variance)
    sides = np.broadcast_to(strength, (*special.shape, 2))[special][..., None]
    sides = sides / np.broadcast_to(r2, squared.shape)[special][:, None] ** 1.5
    squared[special], noise[special], uncut[special] = of_sides(scene, sides)
    return EdgeContrast(squared, noise, uncut)


def paper_contrast2(pictures: Pictures, names: tuple[str, ...], fractions: np.ndarray) -> np.ndarray:
    """Squared contrast of eq. 10 with eq. 1's intensities: no fall-off, no end of the scale; shape (..., E, n)."""
    scene = pictures.scene
    if names and is_separable(scene):
        return (paper_step(pictures, names) ** 2)[..., None] / edge_distance2(pictures, names, fractions)
    sides = side_signals(pictures, names, edge_points(scene.solid, names, fractions), fall_off=False)
    return (sides[..., 0, :] - sides[..., 1, :]) ** 2


def side_strengths(pictures: Pictures, names: tuple[str, ...]) -> np.ndarray:
    """Signal times r^3 on both sides of each edge of a separable scene, grey levels scene units^3, shape (..., E, 2).

    On a plane, diffuse face N.(l - p) is the same for all its points p, so with r = |l - p| the signal is a constant
    over r^3: N.(l - p) / r for the cosine and 1 / r^2 for the fall-off.
    """
    return _heights(pictures, names) * pictures.emitters[0].power


def paper_step(pictures: Pictures, names: tuple[str, ...]) -> np.ndarray:
    """The paper's contrast times r, grey levels times scene units, of a separable scene; shape (..., E)."""
    heights = _heights(pictures, names)
    return np.abs(heights[..., 0] - heights[..., 1])


def edge_distance2(pictures: Pictures, names: tuple[str, ...], fractions: np.ndarray) -> np.ndarray:
    """Squared distance of the first light from points of the edges, scene units^2, shape (..., E, n)."""
    ends = np.array([pictures.scene.solid.vertices[list(pictures.scene.solid.edge(name).ends)] for name in names])
    return squared_distance(ends[:, 0], ends[:, 1], fractions, pictures.lights_at[0])


def _heights(pictures: Pictures, names: tuple[str, ...]) -> np.ndarray:
    """Exposure x reflectance x height of the light over the plane of each side that is seen, (..., E, 2)."""
    scene, solid = pictures.scene, pictures.scene.solid
    faces = np.array([solid.edge(name).faces for name in names])
    height = np.maximum(pictures.lights_at[0] @ solid.normals.T - solid.offsets, 0.0)
    return np.where(facing(solid, pictures.viewpoint), height * whites(scene)[: len(solid.faces)], 0.0)[..., faces]


def whites(scene: Scene) -> np.ndarray:
    """Signal of each face of the bodies by unit irradiance from everywhere, its diffuse part, grey levels, (F,)."""
    each = [material.diffuse(scene.camera.analyser_deg is not None) for material in scene.surfaces.materials]
    return scene.camera.exposure * np.array(each)[scene.surfaces.kinds]


def sides_of_one(pictures: Pictures, edges: Sequence[Edge], which: np.ndarray, points: np.ndarray) -> np.ndarray:
    """`side_signals` of one picture at points (n, 3), each on one of the edges, ``which`` (n,); shape (2, n)."""
    found = np.zeros((2, len(points)))
    if not edges:
        return found
    clear = _visible_on(pictures, edges, which, points)
    if clear.any():
        numbers, some = np.unique(which[clear], return_inverse=True)
        found[:, clear] = _sides(pictures, [edges[k] for k in numbers], some, points[clear], clear[clear], True)
    return found


def _beside(pictures: Pictures, edge: Edge, points: np.ndarray, fall_off: bool) -> np.ndarray:
    """The two sides (..., 2, n) of one edge at points (..., n, 3) of it."""
    which = np.zeros(points.shape[-2], int)
    return _sides(pictures, [edge], which, points, _visible_on(pictures, [edge], which, points), fall_off)


def _sides(
    pictures: Pictures, edges: Sequence[Edge], which: np.ndarray, points: np.ndarray, clear: np.ndarray, fall_off: bool
) -> np.ndarray:
    """The two sides (..., 2, n) of edges at points (..., n, 3), each on one of them, ``which`` (n,), of a scene in
    which things may hide and shade each other; 0 where the sensor has no clear view (..., n)."""
    scene, bodies = pictures.scene, pictures.scene.bodies
    faces, fractions = np.array([edge.faces for edge in edges])[which].T, _fractions(scene.solid, edges, which, points)
    lit = tuple(
        _turned_on(bodies, edges, which, at) & _seen_on(bodies, edges, which, fractions, at)[..., None, :]
        for at in (emitter.at for emitter in pictures.emitters)
    )
    level = face_signal(pictures, points[..., None, :, :], faces, 2, lit, fall_off=fall_off)
    level = level + light_between(pictures, points[..., None, :, :], faces)
    looked_at = _turned_on(bodies, edges, which, pictures.viewpoint)
    found = np.where(clear[..., None, :] & looked_at, level, 0.0)
    outward = bodies.normals[faces].sum(0)
    for side in (0, 1):
        # past an outer face that is turned away there is nothing but the background, for the ray leaves the convex hull
        wanted = clear & ~looked_at[..., side, :] & (has_background(scene) | ~bodies.outer[faces[side]])
        if wanted.any():
            past = behind(pictures, points, wanted, faces.T, outward, fall_off=fall_off)
            found[..., side, :] = np.where(wanted, past, found[..., side, :])
    return found


def _visible_on(pictures: Pictures, edges: Sequence[Edge], which: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether the sensor sees points (..., n, 3) on edges and a face there, bool (..., n)."""
    bodies, at = pictures.scene.bodies, pictures.viewpoint
    fractions = _fractions(pictures.scene.solid, edges, which, points)
    return _turned_on(bodies, edges, which, at).any(-2) & _seen_on(bodies, edges, which, fractions, at)


def _fractions(solid: Solid, edges: Sequence[Edge], which: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Of the edges' lengths at which points (..., n, 3) lie, (..., n)."""
    ends = solid.vertices[[edge.ends for edge in edges]]
    if len(edges) == 1:
        start, way = ends[0, 0], ends[0, 1] - ends[0, 0]
        return (points - start) @ way / (way @ way)
    start, way = ends[which, 0], (ends[:, 1] - ends[:, 0])[which]
    return np.einsum("...ni,ni->...n", points - start, way) / np.einsum("ni,ni->n", way, way)


def _turned_on(bodies: Solid, edges: Sequence[Edge], which: np.ndarray, at: Viewpoint | np.ndarray) -> np.ndarray:
    """`turned` at points on edges, bool (..., 2, n)."""
    found = np.stack([turned(bodies, edge, at) for edge in edges], -1)
    return found if len(edges) == 1 else found[..., which]


def _seen_on(
    bodies: Solid, edges: Sequence[Edge], which: np.ndarray, fractions: np.ndarray, at: Viewpoint | np.ndarray
) -> np.ndarray:
    """`seen` at fractions (..., n) of edges, bool (..., n)."""
    if len(edges) == 1:
        return seen(bodies, edges[0], at, fractions)
    found = np.zeros(np.broadcast_shapes((*Viewpoint.of(at).shape, 1), fractions.shape), bool)
    for number, edge in enumerate(edges):
        here = which == number
        found[..., here] = seen(bodies, edge, at, fractions[..., here])
    return found
