"""Inputs that are correlated, such as a camera's calibrated parameters, and joint draws of everything."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy import special

from planner.uncertainty.inputs import Input
from scenes.errors import InvalidInput


@dataclass(frozen=True)
class Group:
    """Inputs that are known together: one row of a budget.

    Attributes
    ----------
    inputs : tuple of Input
        Of one `kind`.
    correlation : array-like, shape (n, n)
        Correlation coefficients; kept as nested tuples.
    name : str
        Of the row; the inputs' names joined where none is given.
    dof : float, optional
        Degrees of freedom of the whole group; the least of its inputs' where none is given.

    Raises
    ------
    InvalidInput

    Notes
    -----
    Draws are of a multivariate normal distribution where all inputs are normal. Otherwise each keeps its own
    distribution and a Gaussian copula of this correlation ties them (JCGM 101 6.4.8 has the normal case alone); the
    linear correlation of such draws is a few per cent smaller than the stated one.
    """

    inputs: tuple[Input, ...]
    correlation: tuple[tuple[float, ...], ...]
    name: str = ""
    dof: float = math.nan

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", tuple(self.inputs))
        if not self.inputs:
            raise InvalidInput("inputs of a group must be at least one, got none")
        name = self.name or ", ".join(given.name for given in self.inputs)
        object.__setattr__(self, "name", name)
        if math.isnan(self.dof):
            object.__setattr__(self, "dof", min(given.dof for given in self.inputs))
        if not self.dof >= 1:
            raise InvalidInput(f"{name}: dof must be at least 1, got {self.dof}")
        if len(kinds := {given.kind for given in self.inputs}) > 1:
            raise InvalidInput(f"{name}: kind must be the same for all inputs of a group, got {sorted(kinds)}")
        matrix = _correlation(self.correlation, len(self.inputs), name)
        object.__setattr__(self, "correlation", tuple(tuple(row) for row in matrix.tolist()))

    @property
    def kind(self) -> str:
        """ "noise" or "systematic", as all of its inputs."""
        return self.inputs[0].kind

    @property
    def covariance(self) -> np.ndarray:
        """V, shape (n, n): u_i u_j r_ij."""
        u = np.array([given.u for given in self.inputs])
        return np.outer(u, u) * np.array(self.correlation)

    def draw(self, rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
        """n joint values of each input by its name, each of shape (n,)."""
        values, vectors = np.linalg.eigh(np.array(self.correlation))
        root = vectors * np.sqrt(np.maximum(values, 0))
        normal = root @ rng.standard_normal((len(self.inputs), n))
        return {
            given.name: given.value + given.u * z if given.distribution == "normal" else given.quantile(special.ndtr(z))
            for given, z in zip(self.inputs, normal, strict=True)
        }


Source = Input | Group


def draw(sources: Iterable[Source], rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    """n values of every input by its name, each of shape (n,); groups jointly, the others independently."""
    drawn: dict[str, np.ndarray] = {}
    for source in sources:
        drawn |= source.draw(rng, n) if isinstance(source, Group) else {source.name: source.draw(rng, n)}
    return drawn


def members(source: Source) -> tuple[Input, ...]:
    """The single inputs of a row."""
    return source.inputs if isinstance(source, Group) else (source,)


def _correlation(given: object, size: int, name: str) -> np.ndarray:
    """A correlation matrix, checked."""
    matrix = np.asarray(given, float)
    what = f"{name}: correlation must be"
    if matrix.shape != (size, size):
        raise InvalidInput(f"{what} of shape {(size, size)}, got {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise InvalidInput(f"{what} finite, got {matrix[~np.isfinite(matrix)][0]}")
    if not np.allclose(matrix, matrix.T, rtol=0, atol=1e-9):
        raise InvalidInput(f"{what} symmetric, got a difference of {np.abs(matrix - matrix.T).max():.3g}")
    if not np.allclose(np.diag(matrix), 1, rtol=0, atol=1e-9):
        raise InvalidInput(f"{what} 1 on its diagonal, got {np.diag(matrix)[np.abs(np.diag(matrix) - 1).argmax()]}")
    if (least := np.linalg.eigvalsh(matrix)[0]) < -1e-9 * size:
        raise InvalidInput(f"{what} positive semidefinite, got an eigenvalue of {least:.3g}")
    return matrix
