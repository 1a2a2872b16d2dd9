"""What a station has to reach and to keep to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri

from planner.uncertainty.risks import Limits, global_risks
from scenes import InvalidInput, Quantity, Scene

TUR = 4.0  # test uncertainty ratio (ANSI/NCSL Z540.3): what the pages call precise enough
_LEAST_U, _MOST_U = 1e-6, 0.5  # of half a tolerance zone: between which u is sought; U is then all of it
MOST = 1e9


@dataclass(frozen=True)
class Wishes:
    """What is asked of a station beside the scene's tolerances.

    Attributes
    ----------
    k : float
        U is to be at most half of the tolerance zone over this.
    false_acceptance : float, optional
        In its place, of lengths: probability that a part is outside and accepted (JCGM 106 eq. 17); needs
        ``uncertainty.process_sd``.
    budget : float, optional
        Most that camera, lens and light may cost together, in the catalogue's currency.
    nearest_mm, farthest_mm : float
        Between which the camera may stand from the part.
    speed_mm_s : float
        With which the part moves while it is exposed.
    rate_hz : float, optional
        Parts a second: frame rate, and what an exposure may take.
    motion_px, blur_px : float
        Most that a part may move while it is exposed, and the largest standard deviation of the blur over the depth of
        what is measured.
    fill : float
        Of the saturation capacity, that a white surface makes use of.
    lens_blur_um : float, optional
        Standard deviation of a lens' blur beside diffraction, where its MTF is not stated; by default the scene's own.
    p : float
        Coverage probability of U.
    """

    k: float = TUR
    false_acceptance: float | None = None
    budget: float | None = None
    nearest_mm: float = 0.0
    farthest_mm: float = math.inf
    speed_mm_s: float = 0.0
    rate_hz: float | None = None
    motion_px: float = 1.0
    blur_px: float = 2.0
    fill: float = 0.7
    lens_blur_um: float | None = None
    p: float = 0.95

    def __post_init__(self) -> None:
        positive = ("k", "budget", "rate_hz", "motion_px", "blur_px", "fill")
        for name in (*positive, "farthest_mm", "nearest_mm", "speed_mm_s", "lens_blur_um"):
            value = getattr(self, name)
            if value is not None and not (value > 0 if name in positive else value >= 0):
                raise InvalidInput(f"{name} must be {'above' if name in positive else 'at least'} 0, got {value}")
        for name, most in (("fill", 1.0), ("false_acceptance", 0.5)):
            value = getattr(self, name)
            if value is not None and not 0 < value <= most:
                raise InvalidInput(f"{name} must be above 0 and at most {most:g}, got {value}")
        if not self.nearest_mm < self.farthest_mm:
            raise InvalidInput(
                f"nearest_mm must be less than farthest_mm {self.farthest_mm:g}, got {self.nearest_mm:g}"
            )

    @property
    def coverage(self) -> float:
        """U over u of a normal distribution."""
        return float(ndtri((1 + self.p) / 2))

    @property
    def timed(self) -> bool:
        """Whether it matters how long an exposure takes."""
        return self.rate_hz is not None or self.speed_mm_s > 0


def allowed(scene: Scene, wishes: Wishes) -> np.ndarray:
    """Largest U of each quantity, the scene's unit or degrees, (M,); infinite without a tolerance.

    Raises
    ------
    InvalidInput
        If no quantity has a tolerance, or a risk is asked for without ``uncertainty.process_sd``.
    """
    spread = scene.uncertainty.process_sd
    if wishes.false_acceptance is not None and not spread:
        raise InvalidInput("uncertainty.process_sd must be given for a probability of false acceptance, got nothing")
    found = np.array([_of(quantity, spread, wishes) for quantity in scene.quantities])
    if np.isinf(found).all():
        raise InvalidInput("tolerance must be given for a measurand at least, got none")
    return found


def _of(quantity: Quantity, spread: float | None, wishes: Wishes) -> float:
    if quantity.tolerance is None:
        return math.inf
    if wishes.false_acceptance is None or quantity.is_angle:
        return quantity.tolerance.half / wishes.k
    limits = Limits.of(0.0, quantity.tolerance)

    def excess(ratio: float) -> float:
        risk = global_risks(0.0, spread, ratio * quantity.tolerance.half, limits).wrong_acceptance
        return risk - wishes.false_acceptance

    if excess(_LEAST_U) > 0:
        return 0.0  # the manufacture alone makes more bad parts at the limits than that
    if excess(_MOST_U) < 0:
        return wishes.coverage * _MOST_U * quantity.tolerance.half
    return wishes.coverage * brentq(excess, _LEAST_U, _MOST_U, rtol=1e-9) * quantity.tolerance.half
