"""What linear observations tell of unknown numbers, not all of which need be determined.

Rows A x = y + e have independent errors e of variance 1: observations that were made so, and what is known before. No
unknown is held or damped. Where the rows leave directions open (the null space of A) a function g . x is told exactly
where it does not change along any of them: an estimable function of the Gauss-Markov model (C. R. Rao, Linear
Statistical Inference, 4a); its best estimate is g . A+ y, with the variance |g . A+|^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

_OPEN = 1e-10  # of the largest singular value: below it, there is rounding alone
_CHANGES = 1e-6  # part of a function that lies along open directions, at least, where it is not told


@dataclass(frozen=True, eq=False)
class Told:
    """What rows tell.

    Attributes
    ----------
    rows : ndarray, shape (m, n)
        A, of n unknowns.
    units : ndarray, shape (n,)
        Changes of the unknowns that are alike in their effect: what is open is told apart from rounding in these.

    Examples
    --------
    >>> told = Told(np.array([[1.0, -1.0]]), np.ones(2))  # a difference of two numbers
    >>> told.is_told(np.array([[1.0, -1.0], [1.0, 0.0]])).tolist(), told.freedom
    ([True, False], 0)
    """

    rows: np.ndarray
    units: np.ndarray

    @property
    def count(self) -> int:
        """Of unknowns."""
        return self.rows.shape[1]

    @cached_property
    def rank(self) -> int:
        """How many directions are told."""
        sizes = self._svd[1]
        return int((sizes > _OPEN * sizes.max(initial=0.0)).sum())

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the residuals: rows that say something, less what they tell."""
        return int(self.rows.any(1).sum()) - self.rank

    @cached_property
    def inverse(self) -> np.ndarray:
        """A+, (n, m): the estimate by the rows, of least norm in those units."""
        left, sizes, right = self._svd
        told = slice(0, self.rank)
        return (right[told].T / sizes[told]) @ left[:, told].T * self.units[:, None]

    @cached_property
    def open(self) -> np.ndarray:
        """Directions (k, n) that the rows leave open, orthonormal in those units."""
        return self._svd[2][self.rank :]

    def is_told(self, functions: np.ndarray) -> np.ndarray:
        """Which functions (M, n) of the unknowns the rows tell, bool (M,)."""
        return np.linalg.norm(self.left(functions), axis=-1) <= _CHANGES * np.linalg.norm(
            self._in_units(functions), axis=-1
        )

    def left(self, functions: np.ndarray) -> np.ndarray:
        """The part of functions (M, n) that lies along open directions, (M, n), in those units."""
        return self._in_units(functions) @ self.open.T @ self.open

    def gain(self, functions: np.ndarray) -> np.ndarray:
        """Derivatives (M, m) of the functions' estimates by the rows' right-hand sides."""
        return functions @ self.inverse

    def _in_units(self, functions: np.ndarray) -> np.ndarray:
        return functions * self.units

    @cached_property
    def _svd(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return np.linalg.svd(self.rows * self.units)
