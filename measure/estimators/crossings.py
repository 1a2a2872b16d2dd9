"""Where the function of a locator changes sign: crossings of its profiles, which is taken, and how surely.

Profiles are the function at T places across an edge, `STEP` px apart, at m positions along it in n images, shape
(m, T, n), made positive on the edge's darker side: they fall through zero at an edge. NumPy alone: a recipe
(`validation.recipe`) has this file.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imaging.features.locator import STEP
from measure.features.lines import trend_along
from measure.features.points import DECIDED, EdgePoints

_NEAR = 3  # places on each side within which an edge is brighter on one side, whatever lies beside it
_CERTAIN = 4.0  # standard deviations of the function by noise that a point is from being another: it counts as a whole
_DIFFERENCE = 0.01  # standard deviations of the function by noise
_FADES = 2  # steps from the window's ends in which a crossing beside another one counts the less


def known_signs(profiles: np.ndarray, known: np.ndarray | None) -> np.ndarray:
    """1 or -1 of each position by itself, (m, n), which makes its profile positive on the darker side.

    Signs (m,) that are known stand in an image unless all of it brightens the other way, between the ends and close to
    the middle: light from elsewhere than the scene says turns all of them round.
    """
    return signs(known, rise(profiles), rise_near(profiles))


def signs(known: np.ndarray | None, up: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The same by `rise` and `rise_near`, (m, n)."""
    if known is None:
        return np.where(up >= 0, 1.0, -1.0)
    known = known[:, None]
    other = ((known * up).sum(0) < 0) & ((known * near).sum(0) < 0)
    return known * np.where(other, -1.0, 1.0)


def located(first: float, best: Crossings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Offsets, px, whether they are valid, and the slopes there, all (m, n).

    ``first`` is the first place across the edge, px.
    """
    offset, slope = refine(best)
    valid = best.found & (np.abs(offset - best.start) < 1)
    return np.where(valid, first + STEP * offset, 0.0), valid, np.where(valid, -slope / STEP, 0.0)


def edge_points(
    along: np.ndarray, offset: np.ndarray, valid: np.ndarray, contrast: np.ndarray, even: np.ndarray,
    counts: np.ndarray, turned: np.ndarray,
) -> EdgePoints:  # fmt: skip
    """Points of n lines at places (n, m), px, with the contrast that each shows.

    ``even`` (m,) or (n, m) is how much of the edge each stands for, ``counts`` (n, m) how much it counts of that.
    """
    middle, trend, _ = trend_along(along, contrast, 1.0 * valid)
    weights = even * counts
    certain = (weights * valid).sum(1) / np.maximum((even * valid).sum(1), 1e-300)
    weights = np.where((certain < DECIDED)[:, None], even, weights)
    return EdgePoints(along, offset, valid, middle, turned, trend, weights, certain=certain)


def polarity(profiles: np.ndarray) -> np.ndarray:
    """+1 where the image brightens along the normal, else -1; one sign an image, shape (n,)."""
    return np.where(rise(profiles).sum(0) >= 0, 1.0, -1.0)


def rise(profiles: np.ndarray) -> np.ndarray:
    """How much the image brightens along the normal at each position, (m, n)."""
    half = profiles.shape[1] // 2
    return profiles[:, :half].sum(1) - profiles[:, half + 1 :].sum(1)


def rise_near(profiles: np.ndarray) -> np.ndarray:
    """The same close to the middle, (m, n)."""
    out = max(profiles.shape[1] // 2 - _NEAR, 0)
    return rise(profiles[:, out : profiles.shape[1] - out])


def is_reversed(profiles: np.ndarray) -> np.ndarray:
    """Whether the two halves of the edge brighten in opposite directions, each as clearly as the other, (n,)."""
    up = rise(profiles)
    first, second = (part.mean(0) for part in np.array_split(up, 2))
    return are_opposite(first, second, np.abs(np.diff(up, axis=0)).mean(0))


def are_opposite(first: np.ndarray, second: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Whether two halves of an edge brighten in opposite directions on the mean, beside how much places differ."""
    return (first * second < 0) & (np.minimum(np.abs(first), np.abs(second)) > 2 * noise)


def _falls(signed: np.ndarray) -> np.ndarray:
    """Whether the function falls through zero from each place to the next, (m, T - 3, n)."""
    below = signed[:, 1:-1] < 0
    return below[:, 1:] > below[:, :-1]


class Crossings(NamedTuple):
    """One crossing at each position of each image.

    Attributes
    ----------
    crossing : ndarray of int, shape (m, n)
        The last place before it.
    start : ndarray, shape (m, n)
        A first estimate of where it is, in steps.
    found : ndarray of bool, shape (m, n)
        Whether there is one.
    around : ndarray, shape (4, m, n)
        The function at the place before the last, the last, the next and the one after it.
    apart : ndarray, shape (m, n)
        How far it is from being another crossing, in the function's unit; infinite where that is not asked.
    """

    crossing: np.ndarray
    start: np.ndarray
    found: np.ndarray
    around: np.ndarray
    apart: np.ndarray | float = np.inf


def bracket(signed: np.ndarray) -> Crossings:
    """Steepest descent through zero."""
    best, several = _first(signed)
    if several.any():
        rows = np.moveaxis(signed, 1, -1)[several]
        best[several] = ((rows[:, 1:-2] - rows[:, 2:-1]) * _falls(rows)).argmax(1)
    return _started(signed, best)


def surest(signed: np.ndarray) -> Crossings:
    """The steepest descent through zero, and how far noise would have to move the function for another one."""
    best, several = _first(signed)
    if not several.any():
        found = _started(signed, best)
        return found._replace(apart=_clear(found.around))
    best[several], ahead = _first_of_several(np.moveaxis(signed, 1, -1)[several])
    found = _started(signed, best)
    apart = _clear(found.around)
    apart[several] = np.minimum(apart[several], ahead)
    return found._replace(apart=apart)


def _first(signed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first fall among the places that may have one, and whether there are several; both (m, n)."""
    falls = _falls(signed)
    return falls.argmax(1), falls.view(np.uint8).sum(1, dtype=np.uint8) > 1


def _started(signed: np.ndarray, best: np.ndarray) -> Crossings:
    """What is said of a choice (m, n) among the places that may have a fall."""
    crossing, around = best + 1, _around(signed, best)
    _, here, after, _ = around
    found = (here >= 0) & (after < 0)
    return Crossings(crossing, crossing + np.where(found, here / np.where(found, here - after, 1), 0), found, around)


def _around(values: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Of values (m, T, n) four from the first (m, n) on, (4, m, n); as `numpy.take_along_axis`, which is slower."""
    _, size, n = values.shape
    flat = np.arange(0, values.size, size * n)[:, None] + np.arange(n) + n * first
    return values.reshape(-1).take(flat + np.arange(0, 4 * n, n)[:, None, None])


def counted(found: Crossings, spread: np.ndarray, size: int) -> np.ndarray:
    """How much a point counts by how far it is from being another one, 0 to 1, (m, n).

    ``spread`` is the standard deviation of the function, ``size`` the number of its places; one that leaves the window
    counts the less, too.
    """
    whole = np.maximum(_CERTAIN * spread, np.finfo(np.float32).tiny)
    part = np.minimum(found.apart, whole) / whole * _inside(found.start - 1, size - 3)
    return part**2 * (3 - 2 * part)  # smooth at both ends, so that its derivative tells what noise does


def counted_by(rows: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Derivative of `counted` by the values of functions (k, T), by central differences, (k, T)."""
    step = _DIFFERENCE * spread[..., None] * np.eye(rows.shape[1])
    above, below = (
        counted(surest(np.moveaxis(rows[:, None] + sign * step, 1, -1)), spread, rows.shape[1]) for sign in (1, -1)
    )
    return (above - below) / (2 * _DIFFERENCE * spread)


def _inside(place: np.ndarray, last: int) -> np.ndarray:
    """1, falling to 0 from `_FADES` steps before the ends 0 and ``last`` of places where there may be a crossing.

    From nearer in a small window, for in its middle nothing counts less.
    """
    return np.clip(np.minimum(place, last - place) / min(_FADES, last / 4), 0.0, 1.0)


def _first_of_several(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of functions (k, T) with several crossings the steepest, and how much it is ahead of the next, (k,).

    Slopes are central differences, interpolated to the crossing: they change little where noise moves it over a place.
    Towards the window's ends they count the less, so that one that comes into it takes over smoothly.
    """
    left, falls = rows[:, 1:-2], _falls(rows)
    part = np.where(falls, left / np.where(falls, left - rows[:, 2:-1], 1.0), 0.0)
    slope = (rows[:, :-2] - rows[:, 2:]) / 2
    place = np.arange(left.shape[1]) + part
    steep = ((1 - part) * slope[:, :-1] + part * slope[:, 1:]) * _inside(place, left.shape[1])
    steep = np.where(falls, steep, -np.inf)
    best = np.partition(steep, -2, 1)[:, -2:]
    return steep.argmax(1), best[:, 1] - best[:, 0]


def _clear(around: np.ndarray) -> np.ndarray:
    """How far from zero the function is within a px beside a crossing, on the side where it is less, (m, n).

    Where it hardly leaves zero, another crossing is about to take this one away, or did so.
    """
    before, here, after, beyond = around
    return np.maximum(np.minimum(np.maximum(before, here), -np.minimum(after, beyond)), 0.0)


def refine(best: Crossings) -> tuple[np.ndarray, np.ndarray]:
    """Root (in steps) of the cubic through the four values around the crossing, and its slope there; shape (m, n)."""
    before, c0, after, beyond = best.around
    c1 = -before / 3 - c0 / 2 + after - beyond / 6
    c2 = (before + after) / 2 - c0
    c3 = (beyond - before) / 6 + (c0 - after) / 2
    x = best.start - best.crossing
    for _ in range(3):
        value, slope = _cubic(x, c0, c1, c2, c3)
        x = x - value / np.where(slope < 0, slope, -np.inf)
    return best.crossing + x, _cubic(x, c0, c1, c2, c3)[1]


def _cubic(x: np.ndarray, *c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """c0 + c1 x + c2 x^2 + c3 x^3 and its slope, by Horner's rule."""
    third = c[3] * x
    second = c[2] + third
    first = c[1] + second * x
    return c[0] + first * x, first + (second + third) * x


def cubic_weights(x: np.ndarray) -> np.ndarray:
    """Weights of the values at -1, 0, 1, 2 in the cubic's value at x, shape (m, n, 4) for x (m, n)."""
    return np.stack(
        [
            -x * (x - 1) * (x - 2) / 6,
            (x + 1) * (x - 1) * (x - 2) / 2,
            -(x + 1) * x * (x - 2) / 2,
            (x + 1) * x * (x - 1) / 6,
        ],
        -1,
    )
