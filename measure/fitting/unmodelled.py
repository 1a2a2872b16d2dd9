"""What a photograph would look like more of, had its camera done what was not modelled: distortion, motion."""

from __future__ import annotations

import numpy as np

from measure.fitting.likelihood import Problem
from measure.fitting.parameters import OPTIONS, Parameters
from scenes import Noise


def directions(problem: Problem, values: np.ndarray, noise: Noise, expected: np.ndarray) -> tuple[np.ndarray, ...]:
    """Derivatives (P, d) of expected levels (P,) by what is not free: k1 where it is not, and motion along two axes."""
    bent = _by_distortion(problem, values, noise)
    return (*bent, _by_motion(problem, expected))


def _by_distortion(problem: Problem, values: np.ndarray, noise: Noise) -> tuple[np.ndarray, ...]:
    name, parameters = OPTIONS["k1"], problem.parameters
    if name in parameters.names:
        return ()
    also = tuple(option for option, key in OPTIONS.items() if key in parameters.names)
    more = Parameters.of(parameters.pictures, (*also, "k1"))
    known = dict(zip(parameters.names, values.tolist(), strict=True))
    whole = np.array([known.get(each, start) for each, start in zip(more.names, more.start(), strict=True)])
    larger = Problem(more, problem.shots, problem.pixels)
    return (larger.jacobian(whole, noise, np.array([more.names.index(name)])),)


def _by_motion(problem: Problem, expected: np.ndarray) -> np.ndarray:
    """Motion blurs along one direction alone: the quadrupole of second derivatives, (P, 2)."""
    found, first = [], 0
    for pixels in problem.pixels:
        level = expected[first : first + pixels.x.size].reshape(pixels.shape)
        first += pixels.x.size
        down, right = np.gradient(level, axis=(1, 2))
        found.append(np.stack([np.gradient(right, axis=2) - np.gradient(down, axis=1), np.gradient(right, axis=1)], -1))
    return np.concatenate([each.reshape(-1, 2) for each in found])
