"""Biases of lines and circles that a simulation told of each picture, and what values of all pictures owe to them.

Taken off line by line (a line's offset and turn, a circle's numbers) before pictures are adjusted. What they are not
sure of moves lines of one picture together, and of several: what surfaces reflect is the part's, the same in all of
them; a light that has one place in several of them is taken for one that stands there, of other places for one that is
placed anew. The noise of renders is each picture's own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scenes import Pose, Quantity, status

RENDERING = "rendering"  # as of one picture's values


@dataclass(frozen=True, eq=False)
class FeatureBias:
    """Of one picture's E lines and C circles by one estimator, q numbers as in `imaging.features.seen.Seen`.

    Attributes
    ----------
    bias : ndarray, shape (q,)
        To be subtracted from what is found, px and rad of lines; NaN where there is none.
    moved : dict of str to ndarray, shape (k, q)
        By source: what one standard uncertainty of each of its k inputs moves them by.
    rendering : ndarray, shape (q, q)
        Covariance of the biases by the noise of renders.
    errors : ndarray, shape (q, q)
        Covariance by pixel noise, propagated in the noise-free image; infinite on the diagonal of what has none.
    states : tuple of str, E + C
        Statuses there.
    saturated : pair of float
        Least and most pixels at the end of the scale that a picture may have for the biases to be its own.
    """

    bias: np.ndarray
    moved: Mapping[str, np.ndarray]
    rendering: np.ndarray
    errors: np.ndarray
    states: tuple[str, ...]
    saturated: tuple[float, float] = (0.0, np.inf)

    @property
    def is_known(self) -> np.ndarray:
        """Which numbers have a bias that is known somehow, bool (q,)."""
        spread = [*self.moved.values(), np.diag(self.rendering)[None], self.bias[None]]
        return np.isfinite(np.concatenate(spread)).all(0)

    @property
    def covariance(self) -> np.ndarray:
        """Of the biases (q, q); 0 of those that are not known."""
        both, known = np.zeros_like(self.rendering), self.is_known
        for rows in (*self.moved.values(), self._rooted):
            some = np.where(known, rows, 0.0)
            both = both + some.T @ some
        return both

    @property
    def _rooted(self) -> np.ndarray:
        """Independent errors by renders, (q, q)."""
        sizes, axes = np.linalg.eigh(np.where(np.isfinite(self.rendering), self.rendering, 0.0))
        return np.sqrt(np.maximum(sizes, 0.0))[:, None] * axes.T

    def states_of(self, found: Sequence[str], known: np.ndarray) -> np.ndarray:
        """Statuses (E + C,) of lines and circles that were measured with others, ``found``, once biases are taken off
        that are known or not, bool (E + C,): of these `scenes.status.corrected` says what may be relied on."""
        told = zip(found, self.states, known, strict=True)
        return np.array([status.corrected(str(one), sim, 0.0 if sure else np.inf, 1.0) for one, sim, sure in told])


def covariances(biases: Sequence[FeatureBias | None], errors: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Of each picture's biases (q, q), beside its noise; 0 where no bias counts."""
    return [np.zeros_like(own) if one is None else one.covariance for one, own in zip(biases, errors, strict=True)]


def doubts(
    pulls: Sequence[np.ndarray], biases: Sequence[FeatureBias | None], lights: Sequence[tuple[Pose, ...]]
) -> dict[str, np.ndarray]:
    """Standard uncertainties (M,) of values by source, of what the biases of all pictures are not sure of.

    Parameters
    ----------
    pulls : sequence of ndarray, shape (M, q)
        Derivatives of the values by each picture's lines and circles.
    biases : sequence of FeatureBias or None
        None of a picture on whose lines and circles nothing depends.
    lights : sequence of tuple of Pose
        Of each picture.
    """
    moved: dict[tuple, np.ndarray] = {}
    squares: dict[str, np.ndarray] = {}
    for k, (pull, told) in enumerate(zip(pulls, biases, strict=True)):
        if told is None:
            continue
        known = told.is_known
        for name, rows in told.moved.items():
            by_input = np.where(known, rows, 0.0) @ pull.T
            key = name, len(rows), lights[k] if _is_of_lights(name) else None
            moved[key] = moved.get(key, 0.0) + by_input
        own = pull @ np.where(known[:, None] & known, told.rendering, 0.0)
        squares[RENDERING] = squares.get(RENDERING, 0.0) + np.einsum("mq,mq->m", own, pull)
    for (name, *_), by_input in moved.items():
        squares[name] = squares.get(name, 0.0) + (by_input**2).sum(0)
    return {name: np.sqrt(np.maximum(each, 0.0)) for name, each in squares.items()}


def _is_of_lights(name: str) -> bool:
    return name.startswith("light")


def corrected(
    said: Sequence[str], u_bias: np.ndarray, sigma: np.ndarray, quantities: Sequence[Quantity]
) -> tuple[str, ...]:
    """Statuses of values (M,) whose biases are known to ``u_bias``, (M,), and taken off (`scenes.status.corrected`)."""
    halves = [0.0 if each.tolerance is None else each.tolerance.half for each in quantities]
    told = zip(said, u_bias, sigma, halves, strict=True)
    return tuple(status.corrected(one, status.OK, float(u), float(noise), half) for one, u, noise, half in told)
