"""Levels beside straight edges as the scene shows them, and what they depend on that it is not sure of.

Outside plain scenes light from walls, shadows and what is seen past an edge make a side's level anything but a plane.
Rays of the camera tell it, as a pinhole sees it (`imaging.light.behind`), and how it changes where a surface reflects
otherwise or a light stands elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from imaging.geometry.lens import image_centre
from imaging.geometry.projection import project_ideal
from imaging.light.behind import seen_at
from imaging.models.inputs import both_ways
from imaging.pictures import Pictures
from imaging.sensor import recorded
from scenes import Picture

_STEP = 0.25  # px across an edge between places that are asked
_ROWS = 80  # along it, at most; 1 px apart where that is enough
_GOLDEN = (np.sqrt(5) - 1) / 2  # multiples of it fill a unit interval evenly


class EdgeLevels(NamedTuple):
    """Levels beside one edge, where the scene has it, in cells: the same level from one end of each to the other.

    Ends lie otherwise in each row, so that lines along the edge are told by all rows together.

    Attributes
    ----------
    along : ndarray, shape (m,)
        Rows, evenly, px from the edge's start in its own direction, beyond both of its ends.
    ends : ndarray, shape (m, T + 1)
        Of the cells, px towards the normal (-t_y, t_x); the middle one is the edge itself.
    levels : ndarray, shape (m, T)
        Recorded grey levels without blur.
    changed : ndarray, shape (k, m, T)
        By how much they change with one standard uncertainty of each input.
    """

    along: np.ndarray
    ends: np.ndarray
    levels: np.ndarray
    changed: np.ndarray

    @property
    def middles(self) -> np.ndarray:
        """Of the cells, px, shape (m, T)."""
        return middles(self.ends)


@dataclass(frozen=True, eq=False)
class SceneLevels:
    """Of one picture whose lights are known."""

    picture: Picture

    def beside(self, name: str, half_width: float) -> EdgeLevels:
        """Levels up to ``half_width`` px beside an edge, by its name."""
        pictures = Pictures.of(self.picture)
        return pictures.once(("levels beside", name, half_width), lambda: self._beside(name, half_width))

    def _beside(self, name: str, half_width: float) -> EdgeLevels:
        picture, solid = self.picture, self.picture.scene.solid
        ends = solid.vertices[list(solid.edge(name).ends)]
        start, stop = project_ideal(ends, np.array(list(picture.sensor)), picture.scene.camera)
        length = float(np.linalg.norm(stop - start))
        direction = (stop - start) / length
        pitch = max(1.0, length / _ROWS)
        along = np.arange(-2.0, length / pitch + 2.0) * pitch
        ends = _ends(along.size, half_width)
        across, normal = middles(ends), np.array([-direction[1], direction[0]])
        places = (start + along[:, None, None] * direction + across[..., None] * normal).reshape(-1, 2)
        steps = (
            (_levels(each.one, places) - _levels(each.other, places)) / (2 * each.times) for each in both_ways(picture)
        )
        changed = np.array([step.reshape(across.shape) for step in steps]).reshape(-1, *across.shape)
        return EdgeLevels(along, ends, _levels(picture, places).reshape(across.shape), changed)


def middles(ends: np.ndarray) -> np.ndarray:
    """Of cells (m, T) whose ends are (m, T + 1)."""
    return (ends[:, 1:] + ends[:, :-1]) / 2


def _ends(rows: int, half_width: float) -> np.ndarray:
    """Ends of cells across an edge, px, (rows, T + 1): one at 0, the others at places of each row's own."""
    cells = _STEP * np.arange(np.ceil(half_width / _STEP))
    first = _STEP * np.stack([(np.arange(1, rows + 1) * _GOLDEN + part) % 1.0 for part in (0.0, 0.5)], 1)
    below, above = (first[:, [k]] + cells for k in (0, 1))
    return np.concatenate([-below[:, ::-1], np.zeros((rows, 1)), above], 1)


def _levels(picture: Picture, places: np.ndarray) -> np.ndarray:
    """Recorded grey levels at places (n, 2), ideal px."""
    noise, found = (
        picture.scene.noise,
        seen_at(Pictures.of(picture), places - image_centre(picture.scene.camera), finely=True),
    )
    return recorded(noise, noise.dark_level + found).level
