"""Are the errors of a circle linear in the noise, as the variance that is propagated says?

Where two edges are near, of a rim and of what lies beside it, noise may decide at a place which of them is found. Its
crossing then jumps from one to the other, which no derivative by the pixels of a noise-free image tells. Drawn noise
answers it: circles through the points of drawn images beside those that the derivative gives of the same noise.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from measure.features.tools import RimTool

_DRAWN, _AT_ONCE = 128, 16  # images; the same noise is in both variances, whose ratio is known better than each
_ALIKE = 1.25  # ratio of variances, full and to first order, up to which they are alike
_BIAS = 0.3  # standard deviations of the mean error, that `ok` allows


def is_linear(tool: RimTool, clean: np.ndarray, response: sparse.csr_array) -> bool:
    """Whether a circle's errors have the variances of its linear response, and no mean beside it.

    Parameters
    ----------
    tool : RimTool
    clean : ndarray, shape (height, width)
        Noise-free grey levels.
    response : csr_array, shape (p, height * width)
        Derivative of the circle's parameters by the pixels.
    """
    linear, full = drawn(tool, clean, response)
    spread = linear.std(0)
    if not (np.isfinite(full).all() and (spread > 0).all()):
        return bool(not spread.any())  # without noise there is nothing to ask
    alike = np.abs(np.log(full.var(0) / spread**2)) <= np.log(_ALIKE)
    return bool((alike & (np.abs((full - linear).mean(0)) <= _BIAS * spread)).all())


def drawn(tool: RimTool, clean: np.ndarray, response: sparse.csr_array) -> tuple[np.ndarray, np.ndarray]:
    """Errors of a circle's parameters in drawn images, to first order and in full, both (n, p); always the same."""
    pixels, rng = tool.locator.pixels, np.random.default_rng(0)
    level = clean.ravel()[pixels]
    variance = tool.optics.noise_at(level)
    sigma = np.sqrt(tool.optics.noise_variance if variance is None else variance)
    near = sparse.csr_array(response[:, pixels])
    here, linear, full = _found(tool, level[None]), [], []
    for _ in range(0, _DRAWN, _AT_ONCE):
        noise = sigma * rng.standard_normal((_AT_ONCE, pixels.size))
        linear.append((near @ noise.T).T)
        full.append(_found(tool, level + noise) - here)
    return np.concatenate(linear), np.concatenate(full)


def _found(tool: RimTool, used: np.ndarray) -> np.ndarray:
    """Parameters (n, p) in images of which the locator's pixels are given, (n, P)."""
    points = tool.locator.locate_each_in(used)
    return tool.solve(tool.fit(points.valid), points.offset)
