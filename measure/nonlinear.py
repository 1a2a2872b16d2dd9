"""Are quantities linear in the errors of the lines that they are measured from, as their variances take them to be?

Noise turns a line of which little is seen, or little stands out, so far that a width across it leans to one side. Lines
drawn from their covariance tell (Monte Carlo, JCGM 101:2008, 8): an interval of 95 % ends elsewhere.
"""

from __future__ import annotations

import numpy as np

from imaging.features.kinds import on_plane
from measure.features.layout import Layout
from measure.quantities import MeasuredFeatures, found_in_images, values

_DRAWN = 1024
_TURNED = 0.1  # px: lines whose ends noise moves by less bend nothing
_ENDS = (0.025, 0.975)  # of an interval of 95 %
_APART = 0.3  # standard deviations by which they may be elsewhere, as a mean may


def are_nonlinear(found: MeasuredFeatures, layout: Layout, errors: np.ndarray) -> np.ndarray:
    """Of which quantities of one image an interval of 95 % ends elsewhere than a linear error's does, bool (M,).

    Parameters
    ----------
    found : MeasuredFeatures
    layout : Layout
    errors : ndarray, shape (q, q)
        Covariance of lines and circles (`Seen`); 0 of lines that are not measured.
    """
    lines, lengths = errors[: 2 * len(layout.names), : 2 * len(layout.names)], _lengths(layout)
    sds = np.sqrt(np.diag(lines)).reshape(-1, 2)
    if not np.hypot(sds[:, 0], sds[:, 1] * lengths).max(initial=0.0) > _TURNED:
        return np.zeros(len(found.known.quantities), bool)
    steps = _drawn(lines)
    with np.errstate(all="ignore"):  # of lines that are not measured
        linear = steps @ found.at_known.gradient[0][:, : len(lines)].T
        return _apart(linear, _moved(found, layout, steps) - found.at_known.value[0])


def _lengths(layout: Layout) -> np.ndarray:
    return np.linalg.norm(layout.ends[:, 1] - layout.ends[:, 0], axis=-1)


def _drawn(covariance: np.ndarray) -> np.ndarray:
    """Errors (n, 2 E) of lines, level and slope of each, with a covariance; the same at each call."""
    size, vectors = np.linalg.eigh(covariance)
    standard = np.random.default_rng(0).standard_normal((_DRAWN, size.size))
    return standard @ (vectors * np.sqrt(np.maximum(size, 0.0))) @ vectors.T  # the one root that has no signs to choose


def _moved(found: MeasuredFeatures, layout: Layout, steps: np.ndarray) -> np.ndarray:
    """Values (n, M) with lines moved by errors (n, 2 E)."""
    level, slope, normals = steps[:, ::2, None], steps[:, 1::2, None], found.shape.normals[0]
    turned = normals - slope * np.stack([normals[:, 1], -normals[:, 0]], -1)
    points = found.shape.points[0] + level * normals
    circles = tuple(np.repeat(each.errors, len(steps), 0) for each in found.circles)
    sizes = {quantity: np.repeat(form.size, len(steps), 0) for quantity, form in found.forms.items()}
    seen = found_in_images(found.known, layout, turned / np.hypot(slope, 1.0), points, circles, sizes)
    return values(seen, found.known.quantities, on_plane, np.zeros((len(steps), *[found.seen.count] * 2))).value


def _apart(linear: np.ndarray, full: np.ndarray) -> np.ndarray:
    """Whether the ends of intervals are elsewhere, of columns (n, M), bool (M,).

    >>> linear = np.random.default_rng(1).standard_normal((1024, 1))
    >>> _apart(linear, 1.05 * linear), _apart(linear, linear + 0.1 * linear**2)
    (array([False]), array([ True]))
    """
    ends = (np.quantile(each, _ENDS, axis=0) for each in (linear, full))
    return np.abs(np.subtract(*ends)).max(0) > _APART * linear.std(0)
