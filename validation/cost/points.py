"""Points an edge: the prediction's sum over points as an integral by three rules."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from imaging.features.projected_edges import image_fractions, straight
from imaging.light.edge_sides import edge_contrast
from imaging.pictures import Pictures
from scenes import InvalidInput
from validation.batch.campaign import Case
from validation.cost.parameter import Parameter, Trend, slope

_POINTS = (2, 3, 4, 6, 8, 12, 16, 25, 50, 100)
_EXACT = 64  # Gauss-Legendre nodes
_REPEATS = 20


def equal(count: int) -> tuple[np.ndarray, np.ndarray]:
    """The paper's points: equally spaced with both ends, equal weights."""
    return np.linspace(0, 1, count), np.full(count, 1 / count)


def trapezoid(count: int) -> tuple[np.ndarray, np.ndarray]:
    """The same points, half the weight at the ends."""
    weights = np.full(count, 1 / (count - 1))
    weights[[0, -1]] /= 2
    return np.linspace(0, 1, count), weights


def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (nodes + 1) / 2, weights / 2


RULES: dict[str, Callable] = {"equal weights": equal, "trapezoid": trapezoid, "Gauss-Legendre": gauss}


def points_parameter(case: Case) -> Parameter:
    """Largest relative error over the required edges of a line's end variance, by rule and number of points.

    Raises
    ------
    InvalidInput
        If the scene needs no straight edge.
    """
    if not straight(case.scene):
        raise InvalidInput(f"measurands must need a straight edge for points along it, got none in {case.scene.name}")
    exact, rows = _end_variance(case, *gauss(_EXACT)), []
    for name, rule in RULES.items():
        for count in _POINTS:
            began = time.perf_counter()
            for _ in range(_REPEATS):
                found = _end_variance(case, *rule(count))
            seconds = (time.perf_counter() - began) / _REPEATS
            rows.append((name, count, 1e3 * seconds, float(np.max(np.abs(found / exact - 1)))))
    fits = []
    for name, theory in (("equal weights", -1.0), ("trapezoid", -2.0)):
        points = np.array([row[1:4:2] for row in rows if row[0] == name and row[1] >= 6])
        fits.append(Trend(f"{name}: error against points", slope(*points.T), theory))
    return Parameter(
        name="points",
        title="Points an edge: error of the predicted variance at an edge's end",
        columns=("rule", "points", "ms", "relative error"),
        rows=tuple(rows),
        x="points",
        y="relative error",
        series="rule",
        fits=tuple(fits),
        note="Gauss-Legendre falls faster than any power, to rounding; hence the 16 nodes of the calibrated model. "
        "Equal weights: the paper's sum over points is what its estimator really does, no integral; against the edge's "
        "whole information it is off by 1/points.",
    )


def _end_variance(case: Case, fractions: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Variance at the end of each required edge's line, its length and information density being 1, shape (E,)."""
    names = straight(case.scene)
    pictures = Pictures.of(case.picture)
    u = image_fractions(case.scene, names, pictures.sensors, fractions)
    density = edge_contrast(pictures, names, fractions).squared * weights
    total = density.sum(-1)
    mean = (density * u).sum(-1) / total
    spread = (density * (u - mean[..., None]) ** 2).sum(-1)
    return 1 / total + mean**2 / spread
