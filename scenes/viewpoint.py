"""From where it is looked: a place, or a direction in which all lines of sight run.

Both are one point in homogeneous coordinates (e, s): the place e / s where s is not 0, else the direction e. A pinhole
camera and a lamp have s = 1. A telecentric camera has s = 0, or little more or less for its entrance pupil is far away
but not at infinity; where s is less than 0, that pupil is behind what is looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A place, or a direction at infinity, or many of them.

    Attributes
    ----------
    at : ndarray, shape (..., 3)
        e, scene units: where the share is 1, the place itself.
    share : float
        s, of perspective.

    Examples
    --------
    >>> above = np.array([0.0, 0.0, 10.0])
    >>> [Viewpoint(above, s).towards(np.array([1.0, 0.0, 0.0])).tolist() for s in (1.0, 0.0)]
    [[-1.0, 0.0, 10.0], [0.0, 0.0, 10.0]]
    """

    at: np.ndarray
    share: float = 1.0

    @classmethod
    def of(cls, given: Viewpoint | np.ndarray) -> Viewpoint:
        """The same, or that at places (..., 3)."""
        return given if isinstance(given, Viewpoint) else cls(np.asarray(given, float))

    @property
    def shape(self) -> tuple[int, ...]:
        """How many there are, as an array's shape."""
        return self.at.shape[:-1]

    def __getitem__(self, which: Any) -> Viewpoint:
        """Some of them, as of an array (...)."""
        return Viewpoint(self.at[which], self.share)

    def widened(self, count: int = 1) -> Viewpoint:
        """With so many axes more, of length 1, for points that each of them looks at."""
        return Viewpoint(self.at[(..., *(None,) * count, slice(None))], self.share)

    def towards(self, points: np.ndarray) -> np.ndarray:
        """Vectors (..., 3) from points towards it: up to it, where it is a place."""
        return self.at - self.share * points

    def origins(self, points: np.ndarray) -> np.ndarray:
        """Where the lines of sight through points (..., 3) begin: `towards` away from them, scene units."""
        if self.share == 1:
            return np.broadcast_to(self.at, np.broadcast_shapes(self.at.shape, np.shape(points)))
        return self.at + (1 - self.share) * points

    def height(self, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """How far it stands over planes (F, 3), (F,), scene units, shape (..., F); of a direction, times the cosine."""
        return self.at @ normals.T - self.share * offsets
