"""The required edges by formula, without a render: levels and slopes on both sides, and what a change of them does.

Across an edge the image is A + m_a x for x < 0 and B + m_b x for x > 0, blurred with all variances together S^2. The
second derivative vanishes at x = S^2 (m_b - m_a) / (B - A): shading shifts an edge by that. The variance of a point is
as 1 / (B - A)^2. A further step D anywhere near shifts it by at most exp(-1/2) S |D / (B - A)|.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imaging.features.locator import edge_blur
from imaging.features.measurand import measurands
from imaging.features.projected_edges import circles, straight
from imaging.geometry.projection import edge_points, facing, project_ideal
from imaging.light.appearance import face_signal
from imaging.pictures import Pictures
from render.phenomena.base import Effect, Influence, largest
from scenes import Curved, Scene

NEAR_STEP = float(np.exp(-0.5))
_FRACTIONS = np.linspace(0.03, 0.97, 24)
_STAND_INS = 4  # straight edges that stand for a circle
_MOST = 50  # edges that stand for the part
_INWARD = 1e-3  # of the object's size: how far inside a face its slope is taken


class Sides(NamedTuple):
    """Both sides of E edges at n points in S settings; levels above darkness.

    ``levels``, ``slopes`` (grey levels a px, into the face) have shape (S, E, 2, n); ``lit``, whether the face is seen
    and turned to the light, too. ``points`` (scene units, (E, n, 3)) and ``normals`` ((E, 2, 3)) say where.
    """

    levels: np.ndarray
    slopes: np.ndarray
    lit: np.ndarray
    points: np.ndarray
    normals: np.ndarray

    @property
    def contrast(self) -> np.ndarray:
        """B - A, shape (S, E, n)."""
        return self.levels[:, :, 1] - self.levels[:, :, 0]

    def shift(self, variance: float) -> np.ndarray:
        """Where shading puts the edge, px towards the second face, shape (S, E, n)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return variance * self.slopes.sum(2) / self.contrast


def brightest(pictures: Pictures) -> float:
    """Highest level above darkness beside a required edge, or on a facet of a required curved surface."""
    scene, solid = pictures.scene, pictures.scene.solid
    found = sides(pictures).levels.max() if required(scene) else 0.0
    walls = [solid.round(name) for name in circles(scene)]
    facets = [face for wall in walls if isinstance(wall, Curved) for face in wall.faces]
    shown = np.isin(solid.triangle_faces, facets)
    if not shown.any():
        return float(found)
    faces = solid.triangle_faces[shown]
    levels = face_signal(pictures, solid.triangles[shown].mean(1), faces, 1)
    return float(max(found, np.where(facing(solid, pictures.viewpoint)[..., faces], levels, 0.0).max()))


def sides(pictures: Pictures, *, fall_off: bool = True) -> Sides:
    """Levels and slopes of a scene's required edges, without cast shadows, before a black background."""
    return pictures.once(("sides", fall_off), lambda: _sides(pictures, fall_off))


def _sides(pictures: Pictures, fall_off: bool) -> Sides:
    scene, solid, names = pictures.scene, pictures.scene.solid, required(pictures.scene)
    points = edge_points(solid, names, _FRACTIONS)
    faces = np.array([solid.edge(name).faces for name in names])
    inner = points[:, None] + _inward(scene, faces)[:, :, None]
    seen = facing(solid, pictures.viewpoint)[..., faces, None]
    here = [
        np.where(seen, face_signal(pictures, p, faces[:, :, None], 3, fall_off=fall_off), 0.0)
        for p in (np.broadcast_to(points[:, None], inner.shape), inner)
    ]
    there = (project_ideal(p.reshape(-1, 3), pictures.sensors, scene.camera) for p in (inner, points))
    inside, edge = (
        p.reshape(len(p), *shape, 2) for p, shape in zip(there, (inner.shape[:-1], points.shape[:-1]), strict=True)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = (here[1] - here[0]) / np.linalg.norm(inside - edge[:, :, None], axis=-1)
    lit = here[0] > 0
    return Sides(here[0], np.where(lit, slopes, 0.0), lit, points, solid.normals[faces])


def compare(pictures: Pictures, other: Scene) -> Influence:
    """Bound of how another scene's distances differ, its shading being all that differs."""
    variance = total_variance(pictures.scene)
    first, second = sides(pictures), sides(pictures.with_scene(other))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs((first.contrast / second.contrast) ** 2 - 1)
        ratio = np.maximum(ratio, np.abs((second.contrast / first.contrast) ** 2 - 1))
    moved = np.abs(first.shift(variance) - second.shift(variance)).max(-1)
    return largest((lever(pictures) * moved).sum(-1), ratio.max((-1, -2)))


class Shading(Effect):
    """An effect on what surfaces send: its influence is that of the same scene without it."""

    def influence(self, pictures: Pictures) -> Influence:
        return compare(pictures, self.without(pictures.scene))


def added_light(pictures: Pictures, levels: np.ndarray, near: float) -> Influence:
    """Bound of what light added smoothly to either side (grey levels, shape (S, E, n)) does to the distance.

    ``near`` is the length (scene units) over which it changes by its own size.
    """
    contrast = sides(pictures).contrast
    share = np.abs(levels / np.where(contrast == 0, np.nan, contrast))
    slope = px_per_unit(pictures)[:, None, None] * near
    moved = (total_variance(pictures.scene) * share / slope).max(-1)
    return largest((lever(pictures) * moved).sum(-1), _loss(share).max((-1, -2)))


def near_steps(pictures: Pictures, levels: np.ndarray) -> Influence:
    """Bound of what an edge of a further step (grey levels, shape (S, E, n)) anywhere near does to the distance."""
    contrast = sides(pictures).contrast
    share = np.abs(levels / np.where(contrast == 0, np.nan, contrast))
    moved = (NEAR_STEP * np.sqrt(total_variance(pictures.scene)) * share).max(-1)
    return largest((lever(pictures) * moved).sum(-1), _loss(share).max((-1, -2)))


def total_variance(scene: Scene) -> float:
    """S^2: of lens, pixel and the locator's smoothing, px^2."""
    return scene.locator.scale_px**2 + edge_blur(scene.camera.most_blur_px) ** 2


def px_per_unit(pictures: Pictures) -> np.ndarray:
    """Image scale at the reference point, shape (S,)."""
    return np.full(len(pictures.sensors), pictures.scene.camera.focal_px / pictures.scene.camera.distance)


def lever(pictures: Pictures) -> np.ndarray:
    """|d value / d offset| of each required edge when all its points may move by up to 1 px, shape (S, E).

    Twice the response to shifts of both ends: extrapolating a fitted line from the points to its end at most doubles
    what moves them. The most over the lengths that are measured; angles are told in other units and do not count. For
    the edges that stand for a circle the plain bound 2.
    """
    names = required(pictures.scene)
    found = np.full((len(pictures.sensors), len(names)), 2.0)
    if not pictures.scene.features:
        return found
    known = measurands(pictures)
    lengths = np.array([not quantity.is_angle for quantity in known.quantities])
    if lengths.any() and known.view.names:
        with np.errstate(all="ignore"):
            offset, tilt = (part[:, lengths] for part in known.of_lines(known.gradient))
            tilt = tilt / known.view.lengths[:, None]
            found[:, : len(known.view.names)] = 2 * (np.abs(offset - tilt) + np.abs(tilt)).max(1)
    return found


def required(scene: Scene) -> tuple[str, ...]:
    """The straight edges that are needed, then those around the face of each circle, which stand for it.

    Of a face with none pieces of the circle itself do; nothing stands for a curved surface. The longest sharp edges
    where nothing is asked for.
    """
    solid, names = scene.solid, list(straight(scene))
    if not scene.features:
        return tuple(edge.name for edge in sorted(solid.sharp or solid.edges, key=solid.length, reverse=True)[:_MOST])
    rims = {name for circle in solid.circles for name in circle.edges}
    for name in circles(scene):
        circle = solid.round(name)
        if isinstance(circle, Curved):
            continue
        beside = [edge.name for edge in solid.edges if circle.face in edge.faces and edge.name not in rims]
        pieces = circle.edges[:: max(1, len(circle.edges) // _STAND_INS)]
        names += (beside or pieces)[:_STAND_INS]
    return tuple(dict.fromkeys(names))


def _loss(share: np.ndarray) -> np.ndarray:
    """Relative change of 1 / C^2 when the contrast may change by a share of it."""
    with np.errstate(divide="ignore"):
        return np.where(share < 1, 1 / np.maximum(1 - share, 1e-12) ** 2 - 1, np.inf)


def _inward(scene: Scene, faces: np.ndarray) -> np.ndarray:
    """Small steps (scene units) from each edge into its two faces, shape (E, 2, 3)."""
    solid = scene.solid
    steps = []
    for name, pair in zip(required(scene), faces, strict=True):
        ends = solid.vertices[list(solid.edge(name).ends)]
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        for face in pair:
            aside = np.cross(solid.normals[face], along)
            centre = solid.vertices[list(solid.faces[face])].mean(0)
            steps.append(aside * np.sign(aside @ (centre - ends[0])))
    return _INWARD * solid.extent * np.array(steps).reshape(-1, 2, 3)


def background(pictures: Pictures, points: np.ndarray) -> np.ndarray:
    """Where the sensor sees the floor behind points (E, n, 3); NaN where it does not, scene units, (S, E, n, 3)."""
    view = pictures.viewpoint.widened(2)
    places, rays = view.origins(points), -view.towards(points)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (pictures.scene.floor.height - places[..., 2]) / rays[..., 2]
    return np.where((reach > 0)[..., None], places + reach[..., None] * rays, np.nan)
