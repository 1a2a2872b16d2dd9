"""The likelihood's maximum in one image: from the expected place, or from where the layout is sought anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from measure.estimators.arrangement import ArrangementEstimator, Centre, Likeliest
from measure.features.alignment import align
from measure.features.layout import Layout
from measure.goodness import WORST, p_value

FURTHEST = 6.0  # px that an end of a required edge may be from where it is expected
_APART = 0.5  # px between vertices of two different solutions
_TELLING = 9.0  # of a chi-square: what tells one solution from another


def locate(tool: ArrangementEstimator, layout: Layout, used: np.ndarray, image: np.ndarray) -> Centre:
    """The likelihood's maximum in one image: from the expected place, or from where the layout is sought anew.

    The second is tried only where the first does not explain the image; the more likely one is taken.

    Parameters
    ----------
    used : ndarray, shape (P,)
        The image's pixels that the tool looks at, grey levels.
    image : ndarray, shape (height, width)
    """
    fit = tool.climb(used, tool.start(used))
    centre = tool.centre(fit)
    if fit.settled and _near(tool, fit) and _probability(centre, used) >= WORST:
        return centre
    x, y, turn = align(image[None], layout)[0]
    if not (x or y or turn):
        return centre
    places = tool.arrangement.moved((x, y), turn, layout.ends.reshape(-1, 2).mean(0)).vertices
    other = tool.climb(used, tool.start(used, places))
    if (other.settled, -other.cost) > (fit.settled, -fit.cost):
        return replace(tool.centre(other), rivalled=_rivals(tool, other, fit))
    return replace(centre, rivalled=_rivals(tool, fit, other))


def _rivals(tool: ArrangementEstimator, best: Likeliest, rest: Likeliest) -> bool:
    """Whether two maxima lie apart and the noise does not tell which is the right one."""
    away = tool.parameters(rest.state) - tool.parameters(best.state)
    apart = np.abs(away[: 2 * tool.model.free.size]).max(initial=0.0) > _APART
    return bool(apart and rest.settled and rest.cost - best.cost < _TELLING)


def _near(tool: ArrangementEstimator, fit: Likeliest) -> bool:
    return bool(moved(tool, fit.state.vertices[None])[0] < FURTHEST)


def _probability(centre: Centre, used: np.ndarray) -> float:
    solved = centre.expansion.solve(centre.expansion.see(used[None, centre.expansion.order]))
    return float(p_value(solved.squares / centre.scale, np.array(centre.freedom)[None])[0])


def moved(tool: ArrangementEstimator, vertices: np.ndarray) -> np.ndarray:
    """Farthest way that an end of a required edge is from its expected line, of vertices (n, V, 2): px, (n,)."""
    required = tool.arrangement.required
    expected = tool.arrangement.vertices[required]
    along = expected[:, 1] - expected[:, 0]
    normals = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1, keepdims=True)
    away = np.einsum("neki,ei->nek", vertices[:, required] - expected, normals)
    return np.nan_to_num(np.abs(away), nan=np.inf).max((1, 2))
