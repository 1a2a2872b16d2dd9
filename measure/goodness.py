"""Goodness of fit: is what the model leaves of an image its noise, no more and no less?"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtr, chdtrc

WORST = 1e-4  # p-value below which an image is not what the model says: one false alarm in 10 000 images
_NOISELESS = 0.1  # of the noise: an image with less was made without it


def p_value(squares: np.ndarray, freedom: np.ndarray) -> np.ndarray:
    """Probability of a residual at least as unlikely, if the image is the model's and the noise the sensor's.

    Parameters
    ----------
    squares : ndarray, shape (n, k)
        Chi-square of the residual in k separate parts of the image: a misfit of edges is drowned in faces otherwise.
    freedom : ndarray, shape (n, k)
        Degrees of freedom of each; parts of none are left out.

    Returns
    -------
    ndarray, shape (n,)
        Two-sided, for smoothed noise is as wrong as more of it, and uniform where all is well: 1 - (1 - p)^k of the
        smallest p of k. A residual so small that the image holds no noise is no misfit.
    """
    used = freedom > 0
    each = np.where(used, freedom, 1.0)
    low, high = chdtr(each, squares), chdtrc(each, squares)
    low = np.where(squares < _NOISELESS * each, 1.0, low)
    found = np.where(used, np.minimum(2 * np.minimum(low, high), 1.0), 1.0)
    return -np.expm1(used.sum(-1) * np.log1p(-np.minimum(found.min(-1), 1 - 1e-16)))
