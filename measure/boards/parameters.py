"""Which intrinsics of a camera are free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from scenes.cameras.covariance import ORDER
from scenes.errors import InvalidInput

_COEFFICIENTS = ORDER[4:]
_ORIGIN = np.zeros(3)
SPLINED, CONTROL = "splined", (8, 6)  # control points, columns and rows
_FEWEST, _MOST = 4, 40


class CameraModel(Protocol):
    """How a camera sees points, by some free numbers."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the numbers."""
        ...

    @property
    def prior(self) -> np.ndarray:
        """Rows (p, k): their products with the numbers are normal deviates, as far as anything is known before."""
        ...

    def seen(self, values: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Images (n, 2), px, of points (n, 3) before the camera; derivatives by the numbers (n, 2, k), by the points
        (n, 2, 3)."""
        ...


@dataclass(frozen=True)
class Model:
    """Free intrinsics.

    Attributes
    ----------
    names : tuple of str
        In OpenCV's order; without fy where there is one focal length.
    """

    names: tuple[str, ...]

    @property
    def one_focal(self) -> bool:
        """Whether fx stands for both."""
        return "fy" not in self.names

    def camera(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Camera matrix (3, 3) and five distortion coefficients from the free values."""
        known = dict(zip(self.names, map(float, values), strict=True))
        known.setdefault("fy", known["fx"])
        matrix = np.array([[known["fx"], 0, known["cx"]], [0, known["fy"], known["cy"]], [0, 0, 1.0]])
        return matrix, np.array([known.get(name, 0.0) for name in _COEFFICIENTS])

    @property
    def prior(self) -> np.ndarray:
        """Nothing is known before."""
        return np.zeros((0, len(self.names)))

    def seen(self, values: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `CameraModel` has it, by OpenCV."""
        image, by = cv2.projectPoints(points[:, None], _ORIGIN, _ORIGIN, *self.camera(values))
        by = by.reshape(len(points), 2, -1)
        by_values = self.derivatives(by[..., 6:15].reshape(2 * len(points), -1)).reshape(len(points), 2, -1)
        return image.reshape(-1, 2), by_values, by[..., 3:6]

    def values(self, matrix: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """The inverse of `camera`."""
        numbers = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *np.ravel(coefficients)[:5]]
        return np.array([float(dict(zip(ORDER, numbers, strict=True))[name]) for name in self.names])

    def derivatives(self, by_all: np.ndarray) -> np.ndarray:
        """Columns of the free values from those of fx, fy, cx, cy, k1, k2, p1, p2, k3, shape (n, 9)."""
        found = by_all[:, [ORDER.index(name) for name in self.names]]
        if self.one_focal:
            found[:, 0] += by_all[:, 1]
        return found

    @property
    def flags(self) -> int:
        """Of OpenCV's calibration."""
        fixed = {"k1": cv2.CALIB_FIX_K1, "k2": cv2.CALIB_FIX_K2, "k3": cv2.CALIB_FIX_K3}
        flags = sum(flag for name, flag in fixed.items() if name not in self.names)
        tangential = {"p1", "p2"} & set(self.names)
        return flags + (0 if tangential else cv2.CALIB_ZERO_TANGENT_DIST)


def read_model(text: str) -> Model:
    """The model of a list of free coefficients.

    Raises
    ------
    InvalidInput
        If it is none.

    Examples
    --------
    >>> read_model("k1,k2").names
    ('fx', 'fy', 'cx', 'cy', 'k1', 'k2')
    >>> read_model("f,k1").names
    ('fx', 'cx', 'cy', 'k1')
    """
    given = text if isinstance(text, str) else "?"
    names = [] if given == "none" else [part.strip() for part in given.split(",")]
    if len(set(names)) < len(names) or not set(names) <= {"f", *_COEFFICIENTS}:
        raise InvalidInput(
            f"model must be none, splined, or some of f, {', '.join(_COEFFICIENTS)}, got {str(text)[:80]!r}"
        )
    always = ("fx", "cx", "cy") if "f" in names else ("fx", "fy", "cx", "cy")
    return Model((*always, *(name for name in _COEFFICIENTS if name in names)))


def splined_control(text: str) -> tuple[int, int] | None:
    """Control points, columns and rows, of a model that is splined; None of another.

    Raises
    ------
    InvalidInput
        If there are no such splines.

    Examples
    --------
    >>> splined_control("splined"), splined_control("splined:12x8"), splined_control("k1")
    ((8, 6), (12, 8), None)
    """
    name, _, size = text.partition(":") if isinstance(text, str) else ("", "", "")
    if name.strip() != SPLINED:
        return None
    if not size:
        return CONTROL
    try:
        columns, rows = (int(part) for part in size.lower().split("x"))
    except ValueError:
        columns = rows = 0
    if not (_FEWEST <= columns <= _MOST and _FEWEST <= rows <= _MOST):
        raise InvalidInput(
            f"model must be {SPLINED}:COLUMNSxROWS, {_FEWEST} to {_MOST} control points each, got {text[:80]!r}"
        )
    return columns, rows
