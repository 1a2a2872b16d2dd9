"""A camera calibration's covariance: which parameters, and how they are correlated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.errors import InvalidInput
from scenes.files.door import read_json, read_toml
from scenes.model import Model

Intrinsic = Literal["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"]
ORDER: tuple[Intrinsic, ...] = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""OpenCV's, of its ``stdDeviationsIntrinsics``."""
_ASYMMETRIC, _NEGATIVE = 1e-9, 1e-9  # of the diagonal's geometric mean, of the largest eigenvalue


class Covariance(Model):
    """Covariance of the camera's parameters, px for fx, fy, cx, cy.

    Examples
    --------
    >>> Covariance(names=("fx", "k1"), matrix=((4.0, 0.01), (0.01, 1e-4))).correlation.round(2).tolist()
    [[1.0, 0.5], [0.5, 1.0]]
    """

    names: tuple[Intrinsic, ...]
    """Of the parameters: fx, fy, cx, cy, k1, k2, p1, p2, k3; fx alone stands for both focal lengths."""
    matrix: tuple[tuple[Annotated[float, Field(ge=-1e24, le=1e24)], ...], ...]
    """Their covariance, one row and column each."""

    @model_validator(mode="after")
    def _is_one(self) -> Covariance:
        n = len(self.names)
        if len(set(self.names)) < n or not n:
            raise ValueError(f"covariance.names must be different parameters, got {list(self.names)}")
        if [len(row) for row in self.matrix] != [n] * n:
            raise ValueError(f"covariance.matrix must be {n} rows of {n} numbers, got {[len(r) for r in self.matrix]}")
        whole = np.array(self.matrix)
        size = np.sqrt(np.abs(np.diag(whole)))
        if (np.diag(whole) < 0).any() or (np.abs(whole - whole.T) > _ASYMMETRIC * np.outer(size, size)).any():
            raise ValueError("covariance.matrix must be symmetric with no negative diagonal, got another")
        unit = self.correlation
        if np.linalg.eigvalsh(unit)[0] < -_NEGATIVE * n or (np.abs(unit) > 1 + _NEGATIVE).any():
            raise ValueError("covariance.matrix must be positive semidefinite, got another")
        return self

    @property
    def sd(self) -> np.ndarray:
        """Standard uncertainty of each parameter, shape (n,)."""
        return np.sqrt(np.diag(np.array(self.matrix)))

    @property
    def correlation(self) -> np.ndarray:
        """Their correlation, shape (n, n); 1 on the diagonal."""
        size = np.where(self.sd > 0, self.sd, 1.0)
        unit = np.array(self.matrix) / np.outer(size, size)
        np.fill_diagonal(unit, 1.0)
        return unit


def of_document(value: Any, directory: Path) -> Any:
    """What the model takes, from a file's name, a table with `names` and `matrix`, or OpenCV's standard deviations.

    A file is TOML or JSON with ``names`` and ``matrix``, or with ``stdDeviationsIntrinsics``: OpenCV's list of standard
    deviations in its own order (further ones must be 0), which then count as uncorrelated.

    Raises
    ------
    InvalidInput
        If the file cannot be read; the text names it.
    """
    if not isinstance(value, str | Path):
        return _of_table(value)
    path = directory / value
    read = read_json if path.suffix.lower() == ".json" else read_toml
    try:
        return Covariance.model_validate(_of_table(read(path)))
    except InvalidInput:
        raise
    except ValueError as error:
        from pydantic import ValidationError

        from scenes.errors import describe

        text = describe(error) if isinstance(error, ValidationError) else str(error)
        raise InvalidInput(f"{path}: {text}") from None


def _of_table(table: Any) -> Any:
    if not isinstance(table, dict) or "stdDeviationsIntrinsics" not in table:
        return table
    given = table["stdDeviationsIntrinsics"]
    flat = [v[0] if isinstance(v, list) and len(v) == 1 else v for v in given] if isinstance(given, list) else []
    if not flat or not all(isinstance(v, int | float) and not isinstance(v, bool) for v in flat):
        raise InvalidInput(f"stdDeviationsIntrinsics must be a list of numbers, got {given!r}")
    if any(flat[len(ORDER) :]):
        raise InvalidInput(f"stdDeviationsIntrinsics must be 0 after {ORDER[-1]}, got {flat[len(ORDER) :]}")
    kept = {name: float(sd) for name, sd in zip(ORDER, flat, strict=False) if sd}
    rows = [[sd**2 if a == b else 0.0 for b in kept] for a, sd in kept.items()]
    return {"names": list(kept), "matrix": rows}
