"""Estimators and ellipses on exact images of another maker (GalSim), against the Cramer-Rao bound.

`make bench-measure` prints the tables; tests use the same functions with fewer images. The bound of a rectangle has all
its corners and both levels free, that of an ellipse its parameters and both levels; the blur is known to the bound.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

import numpy as np
from rich.console import Console

import measure
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape
from scenes import status
from tests.benchmarks.estimators import aligned_table
from tests.galsim_images import box, box_corners, corner_bound, ellipse, ellipse_bound
from tests.oracle import polygon_image

ESTIMATORS = "arrangement", "strip", "isophote", "gradient", "canny"
CONTRAST, BLUR = 100.0, 0.7
_BATCH = 50


@dataclass(frozen=True)
class Efficiency:
    """One estimator on one rectangle: of the diagonal and the width, variances over the bound, bias in px."""

    empirical: np.ndarray
    predicted: np.ndarray
    bias: np.ndarray
    failed: int


def rectangle(side: float, degrees: float, ratio: float, estimators, count: int, rng) -> dict[str, Efficiency]:
    """Measure ``count`` noisy images of a square of contrast/noise ``ratio`` by each estimator.

    The width is the distance of the middles of two opposite sides: no line is carried on to a corner.
    """
    size = int(np.ceil(side * (abs(np.cos(np.radians(degrees))) + abs(np.sin(np.radians(degrees)))))) + 36
    shape, centre = (size, size), (size / 2 + 0.13, size / 2 - 0.29)
    corners, sigma = box_corners(side, side, degrees, centre), CONTRAST / ratio
    clean = 20 + CONTRAST * box(side, side, degrees, centre, shape, BLUR)
    layout = polygon_layout(corners, Optics(shape, BLUR, sigma**2))
    weights = _measurands(corners)
    bound = corner_bound(corners, lambda c: polygon_image(c, shape, BLUR, 1.0), ratio)
    least = np.einsum("ki,ij,kj->k", weights, bound, weights)
    noisy = clean + sigma * rng.standard_normal((count, *shape))
    return {name: _efficiency(clean, noisy, layout, name, corners, weights, least) for name in estimators}


def _measurands(corners: np.ndarray) -> np.ndarray:
    """Diagonal and width as linear functions of small moves of the corners (x, y), (2, 8)."""
    across = corners[2] - corners[0]
    diagonal, width = np.zeros((4, 2)), np.zeros((4, 2))
    diagonal[2], diagonal[0] = across / np.linalg.norm(across), -across / np.linalg.norm(across)
    away = corners[3] - corners[0]
    width[[2, 3]], width[[0, 1]] = away / np.linalg.norm(away) / 2, -away / np.linalg.norm(away) / 2
    return np.stack([diagonal.ravel(), width.ravel()])


def _efficiency(clean, noisy, layout, name: str, corners, weights, least) -> Efficiency:
    threshold = 0.15 * CONTRAST  # of canny: half the peak gradient
    still = find_shape(clean[None], layout, name, threshold)
    found = [find_shape(noisy[i : i + _BATCH], layout, name, threshold) for i in range(0, len(noisy), _BATCH)]
    moves = np.concatenate([shape.corners for shape in found]) - corners
    state = np.concatenate([shape.status for shape in found])
    values = moves.reshape(len(noisy), -1)[np.isin(state, status.MEASURED)] @ weights.T
    many = len(values) > len(noisy) / 2
    return Efficiency(
        empirical=values.var(0, ddof=1) / least if many else np.full(2, np.nan),
        predicted=np.einsum("ki,ij,kj->k", weights, still.covariance[0], weights) / least,
        bias=(still.corners[0] - corners).ravel() @ weights.T,
        failed=len(noisy) - len(values),
    )


@dataclass(frozen=True)
class Ellipses:
    """Noisy images of one ellipse: variances over the bound and over what is told, noise-free error in px, time."""

    centre: float
    axes: float
    told: np.ndarray
    bias: np.ndarray
    status: str
    failed: int
    milliseconds: float


def ellipses(a: float, b: float, degrees: float, ratio: float, count: int, rng, circle=False, told=BLUR) -> Ellipses:
    """Find an ellipse in ``count`` noisy images, sought 0.7 px off, with the blur said to be ``told``."""
    shape = (int(2 * max(b, a * abs(np.sin(np.radians(degrees))))) + 34, int(2 * a) + 34)
    true = np.array([shape[1] / 2 + 0.13, shape[0] / 2 - 0.29, a, b, degrees])
    sigma = CONTRAST / ratio
    clean = 20 + CONTRAST * ellipse(true, shape, BLUR)
    bound = ellipse_bound(true, shape, BLUR, ratio, circle)
    expected = true + [0.6, -0.4, 0.4, 0.4, 0.0 if circle else 1.0]
    optics = Optics(shape, told, sigma**2)
    still = measure.find_ellipse(clean, expected, optics, circle=circle)
    noisy = clean + sigma * rng.standard_normal((count, *shape))
    start = time.process_time()
    found = measure.find_ellipse(noisy, expected, optics, circle=circle)
    seconds = time.process_time() - start
    variance = found.parameters[found.status == status.OK].var(0, ddof=1)
    used, free = slice(2, 3) if circle else slice(2, 4), slice(0, 4) if circle else slice(0, 5)
    return Ellipses(
        centre=float(variance[:2].sum() / np.trace(bound[:2, :2])),
        axes=float((variance[used] / np.diag(bound)[used]).max()),
        told=variance[free] / np.diag(still.covariance)[free],
        bias=still.parameters - true,
        status=str(still.status),
        failed=int((found.status != status.OK).sum()),
        milliseconds=1e3 * seconds / count,
    )


def main(count: int = 1000) -> None:
    """Print both tables."""
    console, rng = Console(width=130), np.random.default_rng(1)
    standard = np.sqrt(2 / (count - 1))
    table = aligned_table(
        f"Variance / Cramer-Rao bound of a square's diagonal, width; n = {count}, standard error {standard:.1%}",
        "side px", "degrees", "contrast/noise", *ESTIMATORS,
    )  # fmt: skip
    for side in (90, 60, 30, 15):
        for degrees, ratio in ((0, 20), (22, 5), (22, 20), (22, 200)):
            found = rectangle(side, degrees, ratio, ESTIMATORS, count, rng)
            table.add_row(*map(str, (side, degrees, ratio)), *(_said(found[name]) for name in ESTIMATORS))
    console.print(table)
    table = aligned_table(
        "Ellipses; centre and axes: variance / bound", "semi-axes px", "contrast/noise", "blur told px", "centre",
        "axes", "radius bias px", "status", "ms/image",
    )  # fmt: skip
    shapes = [(r, r, 0.0, True) for r in (5, 8, 12, 20, 40)]
    shapes += [(r, r, 0.0, False) for r in (5, 20)] + [(20, 12, 23.0, False), (40, 8, 23.0, False), (8, 5, 23.0, False)]
    for a, b, degrees, circle in shapes:
        for ratio, told in ((5, BLUR), (20, BLUR), (100, BLUR), (100, 1.0)):
            done = ellipses(a, b, degrees, ratio, count, rng, circle, told)
            lost = f" ({done.failed} failed)" if done.failed else ""
            table.add_row(
                f"circle {a}" if circle else f"{a} x {b}", str(ratio), str(told), f"{done.centre:.2f}{lost}",
                f"{done.axes:.2f}", f"{np.abs(done.bias[2:4]).max():.1e}", done.status, f"{done.milliseconds:.2f}",
            )  # fmt: skip
    console.print(table)


def _said(done: Efficiency) -> str:
    if np.isnan(done.empirical).any():
        return f"- ({done.failed} failed)"
    lost = f" ({done.failed} failed)" if done.failed else ""
    return f"{done.empirical[0]:.2f}, {done.empirical[1]:.2f}{lost}"


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
