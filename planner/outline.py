"""The required edges as the sensor sees them: ends, lengths, and the part of each edge that can be measured.

Near a corner another edge disturbs the locator, so an edge is trimmed until its neighbours are `locator.reach`
away: reach / sin(angle) along the edge, or reach itself where the neighbour turns away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.locator import reach
from planner.view import direction, facing, project
from scenes import Edge, Scene


@dataclass(frozen=True)
class Outline:
    """Images of the task's E edges for sensor poses of leading shape (...).

    Attributes
    ----------
    names : tuple of str
        Edge names, as `Task.edges`.
    ends : ndarray, shape (..., E, 2, 2)
        The two end points (x, y), px.
    trims : ndarray, shape (..., E, 2)
        Length to leave out at each end, px.
    visible : ndarray of bool, shape (..., E)
        Whether the sensor sees a face of the edge.
    """

    names: tuple[str, ...]
    ends: np.ndarray
    trims: np.ndarray
    visible: np.ndarray

    @property
    def lengths(self) -> np.ndarray:
        """Length of each edge's image, px, shape (..., E)."""
        return np.linalg.norm(self.ends[..., 1, :] - self.ends[..., 0, :], axis=-1)

    @property
    def usable(self) -> np.ndarray:
        """Length that is left after trimming, px, shape (..., E); not positive where nothing is left."""
        return self.lengths - self.trims.sum(-1)


def outline(scene: Scene, sensors: np.ndarray) -> Outline:
    """Project the task's edges and decide how much of each can be measured.

    Parameters
    ----------
    sensors : ndarray, shape (..., 2)
        Sensor poses, degrees.
    """
    solid, names = scene.solid, scene.task.edges
    sensors = np.asarray(sensors, float)
    corners = project(solid.vertices, sensors, scene.camera)
    seen = facing(solid, scene.camera.distance * direction(sensors))
    edges = [solid.edge(name) for name in names]
    clear = reach(scene.locator.scale_px, scene.camera.blur_px)
    trims = np.stack(
        [np.stack([_trim(solid.edges, edge, end, corners, seen, clear) for end in (0, 1)], -1) for edge in edges], -2
    )
    return Outline(
        names=names,
        ends=np.stack([corners[..., list(edge.ends), :] for edge in edges], -3),
        trims=trims,
        visible=np.stack([seen[..., list(edge.faces)].any(-1) for edge in edges], -1),
    )


def _trim(edges: tuple[Edge, ...], edge: Edge, end: int, corners: np.ndarray, seen: np.ndarray, clear: float):
    """Length to leave out at one end of an edge, shape (...)."""
    here, far = edge.ends[end], edge.ends[1 - end]
    along = corners[..., far, :] - corners[..., here, :]
    trim = np.full(along.shape[:-1], clear)
    for other in edges:
        if other is edge or here not in other.ends:
            continue
        beyond = other.ends[1 - other.ends.index(here)]
        aside = corners[..., beyond, :] - corners[..., here, :]
        cosine = np.einsum("...i,...i->...", along, aside)
        sine = np.abs(along[..., 0] * aside[..., 1] - along[..., 1] * aside[..., 0])
        with np.errstate(divide="ignore", invalid="ignore"):
            needed = np.where(cosine > 0, clear * np.hypot(cosine, sine) / sine, clear)
        trim = np.where(seen[..., list(other.faces)].any(-1), np.fmax(trim, needed), trim)
    return trim
