"""A zone under the maximum material requirement (ISO 2692): decided by place and size together.

A hole that is larger than it must be at least, or a shaft that is smaller than it may be at most, may lie so much
farther from its true place: the zone's diameter 2 |v| must not exceed the drawing's by more than that departure. Both
are measured, in one picture, with a joint covariance: an error that makes a hole look large and off its place at once
leaves less doubt than two that have nothing to do with each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.uncertainty.zones import REACH, ZoneSize, within
from scenes import InvalidInput

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(120)
_DIFFERENCE = 0.02  # standard deviations


@dataclass(frozen=True, eq=False)
class MaterialSize(ZoneSize):
    """What is known of factor |v| - b, b the departure from the maximum material size, (v, b) being normal.

    That is what has to keep the drawing's size. As ISO 2692 has it b may be negative, of a feature beyond its limit,
    and is not cut off at the other one, which the size's own tolerance keeps.

    Attributes
    ----------
    off : ndarray, shape (k,)
        Measured deviations from the true place, k = 1 or 2.
    covariance : ndarray, shape (k + 1, k + 1)
        Of these and of ``departure``, the last.
    factor : float
        Size over |v|: 2 of a zone about a true place.
    departure : float
        How much less material there is than there may be, as measured: of a hole its diameter less the least one.

    Examples
    --------
    >>> found = MaterialSize(np.array([0.1, 0.0]), np.diag([1e-4, 1e-4, 1e-4]), 2.0, 0.06)
    >>> print(f"{found.value:.2f}: {found.decide(0.2)}; at maximum material {replace(found, departure=0).decide(0.2)}")
    0.14: pass; at maximum material undecided
    """

    departure: float = 0.0

    def __post_init__(self) -> None:
        shape = np.shape(self.off)
        if shape not in ((1,), (2,)) or np.shape(self.covariance) != (shape[0] + 1, shape[0] + 1):
            raise InvalidInput(
                "off and covariance must be of one or two components and of one more, "
                f"got {shape} and {np.shape(self.covariance)}"
            )

    @property
    def value(self) -> float:
        """Size that the measured deviation needs, less what the measured departure gives."""
        return self._place.value - self.departure

    @property
    def is_known(self) -> bool:
        """Whether there is a value with a covariance."""
        return bool(super().is_known and np.isfinite(self.departure))

    @cached_property
    def mean(self) -> float:
        """Of the law."""
        return self._place.mean - self.departure

    @property
    def u(self) -> float:
        """Standard deviation of the law: the covariance of |v| and b is that of v and b times the mean's derivative
        (Stein's lemma)."""
        count, together = len(self.off), self.covariance[-1, :-1]
        step = _DIFFERENCE * math.sqrt(float(np.trace(self.covariance[:-1, :-1]))) or 1.0
        slopes = [
            (replace(self._place, off=self.off + part).mean - replace(self._place, off=self.off - part).mean)
            / (2 * step)
            for part in step * np.eye(count)
        ]
        square = self._place.u**2 + self.covariance[-1, -1] - 2 * float(together @ slopes)
        return math.sqrt(max(square, 0.0))

    def below(self, size: float) -> float:
        """Probability that what is needed less what is given is at most so much: over the departure, given it of v."""
        sigma = self._sigma
        if sigma == 0:
            return self._place.below(size + self.departure)
        borders = self._borders(size)
        low, high = borders[:-1], borders[1:]
        turned = ((low + high) / 2)[:, None] + ((high - low) / 2)[:, None] * _NODES
        step = ((high - low) / 2)[:, None] * _WEIGHTS * np.exp(-(turned**2) / 2) / math.sqrt(2 * math.pi)
        z = turned.ravel()
        squares, axes = np.linalg.eigh(self._rest)
        means = (self.off + z[:, None] * self._follows) @ axes
        radius = (size + self.departure + sigma * z) / self.factor
        kept = within(radius, means, np.sqrt(np.maximum(squares, 0.0)))
        return float(min(step.ravel() @ kept, 1.0))

    @cached_property
    def _place(self) -> ZoneSize:
        """Without the departure."""
        return ZoneSize(self.off, self.covariance[:-1, :-1], self.factor)

    @property
    def _sigma(self) -> float:
        return math.sqrt(max(float(self.covariance[-1, -1]), 0.0))

    @cached_property
    def _follows(self) -> np.ndarray:
        """How far v goes with a standard deviation of b, (k,)."""
        return self.covariance[-1, :-1] / self._sigma

    @cached_property
    def _rest(self) -> np.ndarray:
        """Covariance of v given b, (k, k)."""
        return self.covariance[:-1, :-1] - np.outer(self._follows, self._follows)

    @property
    def _reach(self) -> tuple[float, float]:
        """Of the value over `factor`, between which all of the law is."""
        low, high = self._place._reach
        most = REACH * self._sigma
        return low - (self.departure + most) / self.factor, high - (self.departure - most) / self.factor

    def _within(self, radius: float) -> float:
        return self.below(self.factor * radius)

    def _borders(self, size: float) -> np.ndarray:
        """Between the ends of b's law, in standard deviations, where v lies on the zone's border on average, in order:
        where v is known well the probability jumps there."""
        start, grows = (size + self.departure) / self.factor, self._sigma / self.factor
        a = grows**2 - float(self._follows @ self._follows)
        b = 2 * (start * grows - float(self.off @ self._follows))
        c = start**2 - float(self.off @ self.off)
        roots = np.roots([a, b, c]) if a or b else np.empty(0)
        inside = [float(root.real) for root in roots if abs(root.imag) < 1e-12 * (1 + abs(root))]
        every = [-REACH, REACH, *(root for root in (*inside, -start / grows) if abs(root) < REACH)]
        return np.unique(every)
