"""The grey level beside a limb: how a matt surface darkens or brightens towards where it turns away.

A line d px inside the limb meets the surface sqrt(2 d / (m k)) before the limb's point along the line of sight, k the
normal curvature that way and m the magnification: the level is a0 + a1 sqrt(d) + a2 d + ..., steep at the limb itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial

_ORDER = 4  # powers of sqrt(d)


class Profile(NamedTuple):
    """Level of the body d px inside its limb: sum of coefficients c_j sqrt(d)^j, at n points.

    Attributes
    ----------
    coefficients : ndarray, shape (n, order + 1)
        Grey levels over px^(j / 2).
    left_out : ndarray, shape (n,)
        Largest difference from the level itself where both were compared, grey levels; 0 where they were not.
    """

    coefficients: np.ndarray
    left_out: np.ndarray

    def levels(self, inside: np.ndarray) -> np.ndarray:
        """At distances (J,) px inside of the n points, (n, J)."""
        return polynomial.polyval(np.sqrt(inside), self.coefficients.T)


def fitted(places: np.ndarray, levels: np.ndarray, reach: float) -> Profile:
    """The profile over ``reach`` px through levels (n, J) at ``places`` (J,), roots of shares of the reach."""
    scaled = np.vander(places, _ORDER + 1, increasing=True)
    solved = np.linalg.lstsq(scaled, levels.T)[0]
    left_out = np.abs(levels.T - scaled @ solved).max(0)
    return Profile((solved / np.sqrt(reach) ** np.arange(_ORDER + 1)[:, None]).T, left_out)
