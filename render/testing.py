"""Assertions for tests of rendered images, with known rates of false alarm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy import stats


def assert_images_agree(
    image: np.ndarray,
    reference: np.ndarray,
    variance: np.ndarray | float | None = None,
    level: float = 0.01,
    folder: str | Path = "failed_images",
    name: str = "image",
) -> None:
    """Fail if two images differ by more than their noise, anywhere.

    Each pixel is tested for equal means; the smallest p-value is held to the Sidak level, so that true equals fail with
    probability ``level`` (independent pixels; less often if they are correlated).

    Parameters
    ----------
    image, reference : ndarray, shape (height, width), or stacks (n, height, width) of independent renders
    variance : array_like, optional
        Variance (not sigma) of the difference of the two images: a z-test. When not given both must be stacks of at
        least two, whose own scatter is used: Welch's t-test of their means.
    level : float
        Probability of failing where nothing differs.
    folder, name
        On failure ``name``, ``name_reference`` and ``name_p`` are written there as PNG, the last as -log10 p
        from 0 (black) to 10 (white).

    Raises
    ------
    AssertionError
    """
    p = _p_values(np.asarray(image, float), np.asarray(reference, float), variance)
    limit = -np.expm1(np.log1p(-level) / p.size)
    if p.min() >= limit:
        return
    y, x = np.unravel_index(p.argmin(), p.shape)
    _write(Path(folder), name, image, reference, p)
    raise AssertionError(
        f"images must agree, got p = {p.min():.2g} at pixel ({x}, {y}) against {limit:.2g} (Sidak, {level:g} for "
        f"{p.size} pixels); {int((p < limit).sum())} pixels differ; see {Path(folder) / name}*.png"
    )


def assert_measures(measurement: Any, expected_px: float, level: float = 0.01, systematic_px: float = 0.0) -> None:
    """Fail if a measured distance differs from what is expected by more than its own uncertainty.

    Parameters
    ----------
    measurement : measure.Measurement
        One image's, or a stack's: then the mean of all values is tested, with the mean of their own variances over n.
    expected_px : float
    level : float
        Probability of failing where the expectation is true.
    systematic_px : float
        Known bound of what is not noise, such as the locator's bias, px.

    Raises
    ------
    AssertionError
    """
    values, variances = (np.atleast_1d(part).astype(float) for part in (measurement.value_px, measurement.variance_px2))
    if not np.isfinite(values).all():
        raise AssertionError(f"distance must be measured, got status {np.atleast_1d(measurement.status).tolist()}")
    away, sigma = abs(values.mean() - expected_px), float(np.sqrt(variances.mean() / values.size))
    limit = systematic_px + float(stats.norm.isf(level / 2)) * sigma
    if away > limit:
        raise AssertionError(
            f"distance must be {expected_px:.5f} px within {limit:.2g}, got {values.mean():.5f} (sigma {sigma:.2g})"
        )


def _p_values(image: np.ndarray, reference: np.ndarray, variance: np.ndarray | float | None) -> np.ndarray:
    """Two-sided p-value of each pixel; where nothing scatters, 1 for equal and 0 for other values."""
    if image.shape[-2:] != reference.shape[-2:]:
        raise AssertionError(f"images must be of one size, got {image.shape[-2:]} and {reference.shape[-2:]}")
    if variance is None:
        if image.ndim != 3 or reference.ndim != 3 or min(len(image), len(reference)) < 2:
            raise AssertionError("without a variance both must be stacks of at least two renders")
        facts = [fact for stack in (image, reference) for fact in (stack.mean(0), stack.std(0, ddof=1), len(stack))]
        with np.errstate(divide="ignore", invalid="ignore"):
            p = stats.ttest_ind_from_stats(*facts, equal_var=False).pvalue
        return np.where(np.isnan(p), image.mean(0) == reference.mean(0), p)
    difference = np.abs(_mean(image) - _mean(reference))
    sigma = np.sqrt(np.broadcast_to(variance, difference.shape))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(sigma > 0, 2 * stats.norm.sf(difference / sigma), difference == 0)


def _mean(image: np.ndarray) -> np.ndarray:
    return image if image.ndim == 2 else image.mean(0)


def _write(folder: Path, name: str, image: np.ndarray, reference: np.ndarray, p: np.ndarray) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    surprise = 25.5 * np.minimum(-np.log10(np.maximum(p, 1e-10)), 10)
    for suffix, picture in (("", _mean(image)), ("_reference", _mean(reference)), ("_p", surprise)):
        cv2.imwrite(str(folder / f"{name}{suffix}.png"), np.clip(np.rint(picture), 0, 255).astype(np.uint8))
