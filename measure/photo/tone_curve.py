"""A tone curve that was not undone, told by blurred edges: it makes the bright side of each sharper than the dark one.

A curve of power 1 + b makes L^(1 / (1 + b)) of light L; to first order a grey level g moves by -b g ln g. That is much
like a shift of the edge, which is what does the harm, but not quite: what is left tells b with its standard error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import erfc

from measure.goodness import WORST
from scenes import status

_CODED = 1.2  # b of sRGB and its like: a file that does not say what it is holds either light or this
_CLEAR = 12.0  # by how much the one's chi-square must exceed the other's
_SLIGHT = 2.0  # standard errors that a power may be from 1: beyond it may be a weaker curve than sRGB
_HARMLESS = 0.3  # of a standard error: a shift that does not count
_DARKEST = 1e-3  # of the brightest level: darker ones are taken for this


@dataclass(frozen=True)
class ToneCurve:
    """What is told of a tone curve by one edge or several.

    Attributes
    ----------
    bend, error : float
        Power of the curve less 1, and its standard error; NaN where it is not told.
    shift : float
        By how many of their standard errors, at most, measured values move from light to sRGB (a power of 2.2).
    """

    bend: float
    error: float
    shift: float

    @property
    def bent(self) -> bool:
        """Whether levels are not linear in the light."""
        return bool(self.error > 0 and erfc(abs(self.bend / self.error) / np.sqrt(2)) < WORST)

    @property
    def straight(self) -> bool:
        """Whether levels are either linear in the light rather than sRGB, or it makes no difference."""
        if abs(self.shift) < _HARMLESS:
            return True
        clear = ((_CODED - self.bend) ** 2 - self.bend**2) / self.error**2 > _CLEAR
        return bool(clear and abs(self.bend) < _SLIGHT * self.error)

    def status(self, known: bool) -> str:
        """``misfit``, ``tone_unknown`` or ``ok``; ``known`` where levels are said to be linear in the light."""
        if self.bent:
            return status.MISFIT
        return status.OK if known or self.straight else status.TONE_UNKNOWN


UNTOLD = ToneCurve(np.nan, np.nan, np.nan)


def tone_curve(design: np.ndarray, levels: np.ndarray, left: np.ndarray, root: np.ndarray, values: int) -> ToneCurve:
    """The tone curve that a least-squares fit of pixels tells.

    Parameters
    ----------
    design : ndarray, shape (P, k)
        Derivatives of the pixels by what was fitted; the first ``values`` of them count as measured.
    levels, left : ndarray, shape (P,)
        Fitted grey levels, and what the fit leaves of the seen ones.
    root : ndarray, shape (P,)
        One over each pixel's standard deviation.
    values : int
    """
    shown = np.maximum(levels, _DARKEST * float(levels.max()))
    if not shown.max() > 0:
        return UNTOLD
    moved = -shown * np.log(shown / shown.mean()) * root
    weighted = design * root[:, None]
    spread = np.linalg.pinv(weighted.T @ weighted)
    taken = spread @ (weighted.T @ moved)
    rest = moved - weighted @ taken
    told = float(rest @ rest)
    if not told > 1e-12 * float(moved @ moved):
        return UNTOLD
    shift = np.abs(taken[:values]) / np.sqrt(np.maximum(np.diag(spread)[:values], 1e-300))
    return ToneCurve(float(rest @ (left * root)) / told, told**-0.5, _CODED * float(shift.max()))


def together(curves: tuple[ToneCurve, ...]) -> ToneCurve:
    """What several edges with one tone curve tell; those that tell nothing left out."""
    told = [one for one in curves if one.error > 0]
    if not told:
        return UNTOLD
    weight = np.array([one.error**-2 for one in told])
    bend = float(np.average([one.bend for one in told], weights=weight))
    return ToneCurve(bend, float(weight.sum() ** -0.5), max(one.shift for one in told))
