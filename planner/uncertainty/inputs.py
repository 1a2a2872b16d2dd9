"""What goes into an uncertainty budget: quantities that are known with a standard uncertainty and a distribution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from scipy import special

from planner.uncertainty.checks import check_finite, check_not_negative
from scenes.errors import InvalidInput

Distribution = Literal["normal", "rectangular", "triangular", "arcsine", "t"]
Type = Literal["A", "B"]
Kind = Literal["noise", "systematic"]

_HALF_WIDTHS = {"rectangular": math.sqrt(3), "triangular": math.sqrt(6), "arcsine": math.sqrt(2)}  # GUM 4.3, in u


@dataclass(frozen=True)
class Input:
    """A quantity that the result depends on.

    Attributes
    ----------
    name : str
        Names the source in the budget.
    value, u : float
        Estimate and standard uncertainty (not variance), of the same unit. Of ``t`` it is the scale s / sqrt(n) that
        the GUM takes; the distribution's own standard deviation is larger by sqrt(dof / (dof - 2)) (JCGM 101 6.4.9).
    distribution : {"normal", "rectangular", "triangular", "arcsine", "t"}
        What Monte Carlo draws from. A rectangular one of finite `dof` has limits that are themselves known to
        1 / sqrt(2 dof) only (GUM G.4.2), and is drawn as the curvilinear trapezoid of JCGM 101 6.4.3.
    dof : float
        Degrees of freedom, at least 1; infinite where u is exactly known. A ``t`` needs a finite number.
    type : {"A", "B"}
        Evaluated by statistics of repeats, or by other means.
    unit : str
    kind : {"noise", "systematic"}
        Different in every repeat, or the same in all of them.

    Raises
    ------
    InvalidInput

    Examples
    --------
    >>> focal = Input.from_half_width("focal length", 25.0, 0.05, unit="mm")
    >>> round(focal.u, 4), round(float(focal.quantile(0.975)), 4)
    (0.0289, 25.0475)
    """

    name: str
    value: float
    u: float
    distribution: Distribution = "normal"
    dof: float = math.inf
    type: Type = "B"
    unit: str = ""
    kind: Kind = "systematic"

    def __post_init__(self) -> None:
        if not self.name:
            raise InvalidInput("name must be a text that is not empty, got ''")
        for what, allowed in (("distribution", Distribution), ("type", Type), ("kind", Kind)):
            if getattr(self, what) not in get_args(allowed):
                choices = ", ".join(get_args(allowed))
                raise InvalidInput(f"{self.name}: {what} must be one of {choices}, got {getattr(self, what)}")
        check_finite(f"{self.name}: value", self.value)
        check_not_negative(f"{self.name}: u", self.u)
        if not self.dof >= 1:
            raise InvalidInput(f"{self.name}: dof must be at least 1, got {self.dof}")
        if self.distribution == "t" and math.isinf(self.dof):
            raise InvalidInput(f"{self.name}: dof must be finite for distribution t, got inf")

    @classmethod
    def from_half_width(
        cls, name: str, value: float, half_width: float, distribution: Distribution = "rectangular", **about: Any
    ) -> Input:
        """An input within value +- half_width: rectangular, triangular or arcsine (GUM 4.3.7, 4.3.9, H.1.3.4).

        ``about``: dof, type, unit and kind as of an Input.
        """
        if distribution not in _HALF_WIDTHS:
            allowed = ", ".join(_HALF_WIDTHS)
            raise InvalidInput(f"{name}: distribution must be one of {allowed} with a half-width, got {distribution}")
        check_not_negative(f"{name}: half_width", half_width)
        return cls(name, value, half_width / _HALF_WIDTHS[distribution], distribution, **about)

    @property
    def sd(self) -> float:
        """Standard deviation of what is drawn: u, but of t and rectangular of finite `dof` more; inf for t up to 2."""
        if math.isinf(self.dof) or self.distribution not in ("t", "rectangular") or self.u == 0:
            return self.u
        if self.distribution == "rectangular":  # JCGM 101 6.4.3.3 with d = half width / sqrt(2 dof)
            return self.u * math.sqrt(1 + 1 / (6 * self.dof))
        return self.u * math.sqrt(self.dof / (self.dof - 2)) if self.dof > 2 else math.inf

    def quantile(self, p: np.ndarray | float) -> np.ndarray:
        """Value that is not exceeded with probability p, of p's shape."""
        return self.value + self.u * _standard_quantile(self, np.asarray(p, float))

    def draw(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """n independent values, shape (n,)."""
        if self.distribution == "normal":
            return self.value + self.u * rng.standard_normal(n)
        if self.distribution == "t":
            return self.value + self.u * rng.standard_t(self.dof, n)
        return self.quantile(rng.random(n))


def _standard_quantile(given: Input, p: np.ndarray) -> np.ndarray:
    """Quantile of the distribution scaled to mean 0 and u = 1."""
    match given.distribution:
        case "normal":
            return special.ndtri(p)
        case "t":
            return np.where(p > 0, special.stdtrit(given.dof, p), -np.inf)
        case "triangular":
            return math.sqrt(6) * np.sign(p - 0.5) * (1 - np.sqrt(2 * np.minimum(p, 1 - p)))
        case "arcsine":
            return -math.sqrt(2) * np.cos(np.pi * p)
        case _:
            return math.sqrt(3) * _trapezoid(p, 1 / math.sqrt(2 * given.dof))


def _trapezoid(p: np.ndarray, r: float) -> np.ndarray:
    """Quantile of a rectangular distribution on -1 to 1 whose half-width is itself within +- r of 1 (JCGM 101 6.4.3).

    The density is constant within 1 - r, and falls as the logarithm of (1 + r) / |z| up to 1 + r; so the tail beyond
    z = (1 + r) s holds (1 + r) (1 - s + s ln s) / (4 r), which Lambert's W inverts.
    """
    if r == 0:
        return 2 * p - 1
    tail, sign = np.minimum(p, 1 - p), np.sign(p - 0.5)
    flat = (0.5 - tail) * 4 * r / math.log((1 + r) / (1 - r))
    argument = np.minimum((4 * r * tail / (1 + r) - 1) / math.e, -np.finfo(float).tiny)
    edge = (1 + r) * np.exp(1 + special.lambertw(argument, -1).real)
    return sign * np.where(flat <= 1 - r, flat, np.where(tail > 0, edge, 1 + r))
