"""How close the estimators come to the Cramer-Rao bound, and how fast: `make bench-measure` prints it all.

Everything is measured on exact blurred polygons (tests/oracle.py), not on renders. The distance is the diagonal between
the first and the third corner. Tests use the same functions with fewer images.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.ndimage import map_coordinates
from scipy.optimize import curve_fit
from scipy.special import ndtr

from imaging.geometry.projection import project
from measure import ESTIMATORS
from measure.features.layout import Layout, polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape, prepared
from measure.measurement import separation
from tests.galsim_images import corner_bound
from tests.oracle import polygon_image

SHAPE = (112, 152)
SIGMA = 2.0


@dataclass(frozen=True)
class Trial:
    """One estimator on one polygon: variances of the diagonal in px^2, mean error in px."""

    empirical: float
    predicted: float
    bound: float
    bias: float
    failed: int


def rectangle(width: float, height: float, degrees: float, centre=(75.3, 55.7)) -> np.ndarray:
    """Corners of a turned rectangle, px."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]).T / 2
    return np.stack([c * x * width - s * y * height, s * x * width + c * y * height], 1) + centre


def random_block(rng: np.random.Generator) -> np.ndarray:
    """Image of the top face of a 12.5 x 7.5 cm block from a random pose within 55 degrees, moved into the frame."""
    from scenes import Camera

    camera = Camera(width=152, height=112, focal_px=rng.uniform(550, 700), distance=100)
    points = np.array([[0, 0, 0], [12.5, 0, 0], [12.5, 7.5, 0], [0, 7.5, 0.0]]) - [6.25, 3.75, 0]
    pose = np.array([rng.uniform(0, 55), rng.uniform(0, 360)])
    return project(points, pose, camera) + rng.uniform(-0.5, 0.5, 2)


def setup(corners, blur: float, contrast: float) -> tuple[np.ndarray, Layout]:
    """Noise-free image and layout of a polygon."""
    clean = polygon_image(corners, SHAPE, blur, contrast, 20.0)
    return clean, polygon_layout(corners, Optics(SHAPE, blur, SIGMA**2))


def diagonal(shape) -> tuple[np.ndarray, np.ndarray]:
    """Distance of the first and the third corner, and its variance as the images tell it, (n,)."""
    value, gradient = separation(shape.corners[:, [0, 2]])
    pick = np.ix_(range(len(value)), [0, 1, 4, 5], [0, 1, 4, 5])
    return value, np.einsum("ni,nij,nj->n", gradient, shape.covariance[pick], gradient)


def trial(corners, estimator: str, ratio: float, count: int, rng, blur: float = 0.7) -> Trial:
    """Measure ``count`` noisy images of a polygon of contrast / noise ``ratio``."""
    clean, layout = setup(corners, blur, ratio * SIGMA)
    true = np.linalg.norm(corners[2] - corners[0])
    threshold = 0.15 * ratio * SIGMA  # of canny: half the peak gradient
    value, predicted = diagonal(find_shape(clean[None], layout, estimator, threshold))
    values = []
    for start in range(0, count, 50):
        noisy = clean + SIGMA * rng.standard_normal((min(50, count - start), *SHAPE))
        shape = find_shape(noisy, layout, estimator, threshold)
        values.append(np.where(np.isin(shape.status, ("ok", "clutter")), diagonal(shape)[0], np.nan))
    values = np.concatenate(values)
    covariance = corner_bound(corners, lambda at: polygon_image(at, SHAPE, blur, 1.0), ratio)
    covariance = covariance[np.ix_([0, 1, 4, 5], [0, 1, 4, 5])]
    _, gradient = separation(corners[None, [0, 2]])
    good = values[np.isfinite(values)]
    return Trial(
        empirical=float(good.var(ddof=1)) if good.size > 1 else np.nan,
        predicted=float(predicted[0]),
        bound=float(gradient[0] @ covariance @ gradient[0]),
        bias=float(value[0] - true),
        failed=int(np.isnan(values).sum()),
    )


def worst_bias(estimator: str, phases: int = 9) -> float:
    """Largest noise-free error of a corner over 5 angles and as many sub-pixel phases each, px."""
    worst = 0.0
    for degrees in (0, 10, 22.5, 37, 45):
        for phase in range(phases):
            corners = rectangle(100, 60, degrees, (75 + phase / phases, 56 + (phase * 4 % phases) / phases))
            clean, layout = setup(corners, 0.7, 100.0)
            worst = max(worst, float(np.abs(find_shape(clean[None], layout, estimator).corners[0] - corners).max()))
    return worst


def rates(count: int = 600) -> dict[str, float]:
    """Images a second of CPU time for each estimator, and for two plain per-image loops."""
    corners = rectangle(100, 60, 22)
    clean, layout = setup(corners, 0.7, 40.0)
    noisy = clean + SIGMA * np.random.default_rng(1).standard_normal((count, *SHAPE))
    found = {}
    for name in ESTIMATORS:
        prepared(layout, name, 8.0)
        seconds = []
        for _ in range(5):
            start = time.process_time()
            for first in range(0, count, 50):
                find_shape(noisy[first : first + 50], layout, name, 8.0)
            seconds.append(time.process_time() - start)
        found[name] = count / float(np.median(seconds))
    for name, loop in (("loop: map_coordinates + curve_fit", _profile_fits), ("loop: Canny + cv2.fitLine", _canny_fit)):
        some = noisy[: 3 if loop is _profile_fits else 100]
        start = time.process_time()
        for image in some:
            loop(image, corners)
        found[name] = len(some) / (time.process_time() - start)
    return found


def _profile_fits(image, corners) -> None:
    """What one would write first: an error function fitted to the profile at each px of each edge."""
    for a, b in zip(corners, np.roll(corners, -1, 0), strict=True):
        length = np.linalg.norm(b - a)
        along, t = (b - a) / length, np.arange(-5, 6.0)
        for s in np.arange(5, length - 5):
            x, y = (a + s * along)[:, None] + np.array([-along[1], along[0]])[:, None] * t
            profile = map_coordinates(image, [y, x], order=1)
            curve_fit(lambda u, u0, base, step: base + step * ndtr((u - u0) / 0.8), t, profile, (0.0, 20.0, 40.0))


def _canny_fit(image, corners) -> None:
    """The textbook pipeline, to whole pixels."""
    edges = cv2.Canny(np.clip(image, 0, 255).astype(np.uint8), 20, 40)
    y, x = np.nonzero(edges)
    points = np.stack([x, y], 1).astype(np.float32)
    for a, b in zip(corners, np.roll(corners, -1, 0), strict=True):
        normal = np.array([-(b - a)[1], (b - a)[0]]) / np.linalg.norm(b - a)
        near = points[np.abs((points - a) @ normal) < 3]
        cv2.fitLine(near, cv2.DIST_L2, 0, 0.01, 0.01)


def main(count: int = 2000) -> None:
    """Print all tables."""
    console, rng = Console(width=110), np.random.default_rng(1)
    standard = np.sqrt(2 / (count - 1))
    table = aligned_table(
        f"Variance / Cramer-Rao bound (numerical Fisher matrix), n = {count}, standard error {standard:.1%}",
        "rectangle px", "degrees", "contrast/noise", *ESTIMATORS,
    )  # fmt: skip
    for size in ((100, 60), (40, 40), (25, 25), (15, 15)):
        for degrees, ratio in ((0, 5), (22, 5), (22, 20), (45, 50), (0, 200), (22, 200)):
            cells = [trial(rectangle(*size, degrees), name, ratio, count, rng) for name in ESTIMATORS]
            table.add_row(f"{size[0]} x {size[1]}", str(degrees), str(ratio), *map(_efficiency, cells))
    console.print(table)
    table = aligned_table(
        "Predicted / empirical variance over 10 random perspective blocks, contrast/noise 10-100", "", *ESTIMATORS
    )
    ratios = {name: [] for name in ESTIMATORS}
    for _ in range(10):
        corners, ratio, blur = random_block(rng), float(rng.uniform(10, 100)), float(rng.uniform(0.5, 1.0))
        for name in ESTIMATORS:
            done = trial(corners, name, ratio, count, rng, blur)
            ratios[name].append(done.predicted / done.empirical)
    table.add_row("mean", *(f"{np.mean(ratios[name]):.3f}" for name in ESTIMATORS))
    table.add_row("standard deviation", *(f"{np.std(ratios[name]):.3f}" for name in ESTIMATORS))
    table.add_row("expected from n alone", *(f"{standard:.3f}" for _ in ESTIMATORS))
    console.print(table)
    table = aligned_table("Noise-free error of a corner, worst of 45 angles and phases, px", *ESTIMATORS)
    table.add_row(*(f"{worst_bias(name):.1e}" for name in ESTIMATORS))
    console.print(table)
    table = aligned_table("Images a second and core, 100 x 60 px quadrilateral", "", "images/s")
    for name, rate in rates().items():
        table.add_row(name, f"{rate:.0f}")
    console.print(table)


def _efficiency(done: Trial) -> str:
    lost = f" ({done.failed} failed)" if done.failed else ""
    return "-" if np.isnan(done.empirical) else f"{done.empirical / done.bound:.2f}{lost}"


def aligned_table(title: str, *columns: str) -> Table:
    """A table without lines, columns to the right."""
    table = Table(title=title, title_justify="left", box=None, padding=(0, 2))
    for name in columns:
        table.add_column(name, justify="right")
    return table


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
