"""How much of a pixel lies within one or two half-planes, as a blurring lens and a square pixel see it."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

_X, _W = np.polynomial.legendre.leggauss(4)
NODES = np.stack(np.meshgrid(_X / 2, _X / 2), -1).reshape(-1, 2)  # within a pixel, px
NODE_WEIGHTS = np.outer(_W, _W).ravel() / 4


def half_plane(u: np.ndarray) -> np.ndarray:
    """Blurred half-plane at u standard deviations inside its line."""
    return ndtr(u)


def density(u: np.ndarray) -> np.ndarray:
    """Derivative of `half_plane`."""
    return np.exp(-u * u / 2) / np.sqrt(2 * np.pi)
