"""All shapes that stand out in a photograph, the most prominent first."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from measure.find import four_sides, rounds
from measure.find.candidate import CHESSBOARD, CIRCLE, ELLIPSE, KINDS, QUADRILATERAL, TAG, Candidate
from measure.find.chessboard import find_chessboard
from measure.find.coarse import Coarse
from measure.find.contours import contours
from measure.find.distinct import distinct, outside
from measure.find.tags import tag
from scenes import InvalidInput
from scenes.arrays import picture

_CELL = 4.0  # px: outlines with all corners this near are tried together
_TRIES = 3  # of them
_MOST = 400  # outlines that are tried
_MOST_READ = 100  # quadrilaterals that may be tags
_LEAST_SCORE, _LEAST_CONTRAST = 25.0, 1.0  # standard deviations: of an outline as a whole, and of a pixel
_LEAST_PART = 0.04  # of the best one's score


def find(image: Any, kinds: tuple[str, ...] | None = None) -> tuple[Candidate, ...]:
    """Find quadrilaterals, circles, ellipses, tags and chessboards, the most prominent first.

    Closed outlines are taken from the image cut at many grey levels, from what differs from its surroundings, and from
    what edges enclose. One counts where a person would see the shape: sides are straight and end at the corners, and
    nearly all of the outline is an edge. The same outline is told once; a frame has two.

    Parameters
    ----------
    image : array_like, shape (height, width)
        Grey levels. Beyond two megapixels, means of squares of pixels are looked at.
    kinds : tuple of str, optional
        Which kinds of `Candidate`; all when not given.

    Raises
    ------
    InvalidInput
        If the image is none, or a kind is unknown.

    Examples
    --------
    >>> image = np.zeros((90, 120))
    >>> image[20:70, 30:100] = 100
    >>> [one.kind for one in find(image)], find(image)[0].outline.round().tolist()
    (['quadrilateral'], [[30.0, 20.0], [30.0, 70.0], [100.0, 70.0], [100.0, 20.0]])
    """
    image, wanted = picture(image), check_kinds(kinds)
    if min(image.shape) < 8:
        return ()
    coarse = Coarse.of(image)
    if not coarse.noise > 0:
        return ()
    found = distinct(list(_shapes(coarse, wanted)), coarse.factor)
    if {TAG, QUADRILATERAL} & wanted:
        found = [tag(image, one) for one in found[:_MOST_READ]] + found[_MOST_READ:]
    board = find_chessboard(coarse) if {CHESSBOARD, QUADRILATERAL} & wanted else None
    found = outside(found + [board] * (board is not None), [*found, *[board] * (board is not None)])
    return _prominent([one for one in found if one.kind in wanted])


def _prominent(found: list[Candidate]) -> tuple[Candidate, ...]:
    """Those that stand out of the noise, and do not vanish beside the best; the best first."""
    least = max([_LEAST_SCORE, *(_LEAST_PART * one.score for one in found)])
    good = [one for one in found if one.score >= least and abs(one.contrast) >= _LEAST_CONTRAST]
    return tuple(sorted(good, key=lambda one: -one.score))


def check_kinds(kinds: tuple[str, ...] | None) -> frozenset[str]:
    """The kinds wanted.

    Raises
    ------
    InvalidInput
        If one is unknown.
    """
    for kind in kinds or ():
        if kind not in KINDS:
            raise InvalidInput(f"kind must be one of {', '.join(KINDS)}, got {kind!r}")
    return frozenset(kinds or KINDS)


def find_quadrilateral(image: np.ndarray) -> np.ndarray:
    """Corners (4, 2) of the most prominent quadrilateral or tag, (x, y), px, in order around it.

    The first is the one nearest to the image's upper left corner, but for a tag.

    Raises
    ------
    InvalidInput
        If there is none.
    """
    found = find(image, (QUADRILATERAL, TAG))
    if not found:
        raise InvalidInput("image must show a convex quadrilateral, got none that stands out")
    return found[0].outline


def _shapes(coarse: Coarse, wanted: frozenset[str]) -> Iterator[Candidate]:
    tried: dict[tuple, int] = {}
    good: set[tuple] = set()
    sides, round_ = bool({QUADRILATERAL, TAG, CHESSBOARD} & wanted), bool({CIRCLE, ELLIPSE} & wanted)
    for outline in contours(coarse):
        shape = _shape(outline)
        if shape is None or not (sides if shape[0] == QUADRILATERAL else round_):
            continue
        key = shape[0], *np.rint(shape[1].ravel() / _CELL).astype(int).tolist()
        if key in good or tried.get(key, 0) >= _TRIES or len(tried) >= _MOST:
            continue
        tried[key] = tried.get(key, 0) + 1
        found = (four_sides.four_sides if shape[0] == QUADRILATERAL else rounds.rounded)(coarse, shape[1])
        if found is not None:
            good.add(key)
            yield found


def _shape(outline: np.ndarray) -> tuple[str, np.ndarray] | None:
    """Quadrilateral or ellipse, whichever is nearer to an outline, if it is near enough."""
    fits = []
    corners = four_sides.polygon(outline)
    if corners is not None:
        away, quantile = four_sides.deviation(outline, corners)
        if four_sides.near(corners, quantile):
            fits.append((away, QUADRILATERAL, corners))
    parameters = rounds.ellipse(outline)
    if parameters is not None:
        away, quantile = rounds.deviation(outline, parameters)
        if rounds.near(parameters, quantile):
            fits.append((away, ELLIPSE, parameters))
    return min(fits, key=lambda fit: fit[0])[1:] if fits else None
