"""The most likely arrangement in each image of a stack.

One image is measured by itself; the others are solved around the place found for it, as far as an expansion of fourth
order holds (`measure.estimators.expansion`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from measure.estimators.arrangement import ArrangementEstimator, Centre
from measure.estimators.expansion import Evidence, Solved

_VALID = 0.003  # of a standard deviation: how large the effect of an expansion's highest order may be
_AROUND = 0.45  # of the blur: how far an end of a required edge may be from an expansion's centre
_BATCH = 40  # images looked at together, so that they stay in the processor's cache
_SOLVED = 1000  # images solved together
_ROUNDS = 4  # expansions before each image is measured alone


class Solutions(NamedTuple):
    """Most likely parameters in n images.

    Attributes
    ----------
    vertices : ndarray, shape (n, V, 2)
    levels : ndarray, shape (n, L)
    blur : ndarray, shape (n,)
    squares : ndarray, shape (n, 3)
        Chi-square near the pieces, elsewhere, and of bows in the pieces.
    centre : ndarray of int, shape (n,)
        Which of ``centres`` was expanded about.
    settled : ndarray of bool, shape (n,)
    centres : tuple of Centre
    """

    vertices: np.ndarray
    levels: np.ndarray
    blur: np.ndarray
    squares: np.ndarray
    centre: np.ndarray
    settled: np.ndarray
    centres: tuple[Centre, ...]


Locate = Callable[[np.ndarray, np.ndarray], Centre]
"""The maximum in one image, from its used pixels (P,) and the whole of it (height, width)."""


def find(tool: ArrangementEstimator, images: np.ndarray, locate: Locate, first: Centre | None = None) -> Solutions:
    """Most likely parameters in images (n, height, width).

    The first image is measured by itself, unless its centre is given; the others around it, as far as the
    expansion holds; the first that is left by itself, and so on.
    """
    collected, left, centres = _Collected(tool, len(images)), np.arange(len(images)), []
    while left.size:
        image = images[left[0]]
        centre = first if first and not centres else locate(tool.taken(image[None])[0], image)
        tried = left[: 1 if len(centres) >= _ROUNDS else left.size]
        done = [_around(tool, images, tried[at : at + _SOLVED], centre, collected, len(centres), at == 0)
                for at in range(0, tried.size, _SOLVED)]  # fmt: skip
        centres.append(centre)
        left = np.setdiff1d(left, np.concatenate(done))
    return collected.found(tuple(centres))


def _around(tool, images, part, centre, collected, number, first) -> np.ndarray:
    """Solve some images around a centre and collect those for which it holds: which they are."""
    expansion, batches = centre.expansion, np.split(part, range(_BATCH, part.size, _BATCH))
    seen = [expansion.see(tool.taken([images[i] for i in batch], expansion.order)) for batch in batches]
    solved = expansion.solve(Evidence(*map(np.concatenate, zip(*seen, strict=True))))
    good, settled = _good(tool, solved, centre), np.ones(part.size, bool)
    if first:  # the centre is its own, but for what is left of the last step
        solved.steps[0] *= good[0] and centre.settled
        good[0], settled[0] = True, centre.settled
    collected.add(part[good], tool.parameters(centre.state) + solved.steps[good], solved.squares[good])
    collected.owner[part[good]], collected.settled[part[good]] = number, settled[good]
    return part[good]


def _good(tool, solved: Solved, centre: Centre) -> np.ndarray:
    """Where an expansion holds: required edges hardly move, and what is left out moves no measured corner."""
    index, ends = tool.index(tool.arrangement.corners), tool.index(np.unique(tool.arrangement.required))
    sigma = np.sqrt(np.maximum(np.diag(centre.covariance)[index], 1e-300))
    near = np.abs(solved.steps[:, ends]) < _AROUND * np.hypot(centre.state.blur, np.sqrt(1 / 12))
    return near.all(1) & (solved.left[:, index] < _VALID * sigma).all(1)


class _Collected:
    """What is found in n images, as it comes."""

    def __init__(self, tool: ArrangementEstimator, count: int) -> None:
        self.tool = tool
        self.parameters = np.full((count, tool.model.count), np.nan)
        self.squares = np.full((count, 3), np.nan)
        self.owner, self.settled = np.zeros(count, int), np.zeros(count, bool)

    def add(self, which: np.ndarray, parameters: np.ndarray, squares: np.ndarray) -> None:
        self.parameters[which], self.squares[which] = parameters, squares

    def found(self, centres: tuple[Centre, ...]) -> Solutions:
        arrangement, free = self.tool.arrangement, self.tool.model.free
        count, first = len(self.parameters), 2 * free.size
        vertices = np.broadcast_to(arrangement.vertices, (count, *arrangement.vertices.shape)).copy()
        vertices[:, free] = self.parameters[:, :first].reshape(count, -1, 2)
        return Solutions(
            vertices, self.parameters[:, first:-1], self.parameters[:, -1], self.squares, self.owner, self.settled,
            centres,
        )  # fmt: skip
