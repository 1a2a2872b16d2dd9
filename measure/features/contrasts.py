"""The contrast along the pieces of an arrangement, and which required edges it shows."""

from __future__ import annotations

import numpy as np

from imaging.features.locator import MIN_USABLE
from measure.estimators.arrangement import ArrangementEstimator, Centre
from measure.estimators.stack import Solutions
from measure.features.layout import Layout
from measure.once import once
from scenes import status

SEEN = 4.0  # standard deviations of an edge's contrast that there must be of it


def seen_edges(tool: ArrangementEstimator, layout: Layout, found: Solutions) -> tuple[np.ndarray, np.ndarray]:
    """Contrast in the middle of each required edge and its status, both (n, E)."""
    edges = tool.arrangement.edges[tool.model.moving]
    contrast, sigma = contrasts(tool, found)
    shape = len(contrast), len(layout.names)
    middle, state = np.zeros(shape), np.full(shape, status.OK, dtype=object)
    shown = _shown(tool)
    for e in range(len(layout.names)):
        if not shown[e]:
            state[:, e] = status.NOT_VISIBLE
            continue
        here, spread = contrast[:, edges == e], sigma[:, edges == e]
        faint = (np.abs(here[..., 1]) < SEEN * spread[..., 1]).any(1)
        turns = (here > 2 * spread).any((1, 2)) & (here < -2 * spread).any((1, 2))
        middle[:, e] = here[..., 1].mean(1)
        state[:, e] = np.where(faint, status.LOW_CONTRAST, np.where(turns, status.SIGN_CHANGE, status.OK))
    return middle, state.astype(str)


@once
def asked(tool: ArrangementEstimator) -> np.ndarray:
    """Required edges that must be seen, bool (E,): all but those which the light says are too faint.

    The vertices at the ends of such an edge are told by the other edges there, or `is_reliable` says that they are not.
    """
    edges = tool.arrangement.edges[tool.model.moving]
    if not tool.is_lit:
        return np.ones(len(tool.arrangement.required), bool)
    rows, sigma = _contrast(tool, tool.reference)
    contrast = rows[:, 1] @ tool.reference.state.levels
    seen = np.abs(contrast) >= 2 * SEEN * sigma[:, 1]  # noise would decide nearer to it
    return np.array([seen[edges == e].all() for e in range(len(tool.arrangement.required))])


def _shown(tool: ArrangementEstimator) -> np.ndarray:
    """Whether enough of each required edge lies within the image, bool (E,)."""
    arrangement, t = tool.arrangement, np.linspace(0, 1, 257)[:, None, None]
    start, stop = arrangement.vertices[arrangement.required].swapaxes(0, 1)
    places = arrangement.recorded(start + t * (stop - start))
    inside = ((places >= 0) & (places <= np.array(tool.shape[::-1]) - 1)).all(-1)
    return inside.mean(0) * np.linalg.norm(stop - start, axis=-1) >= MIN_USABLE


def contrasts(tool: ArrangementEstimator, found: Solutions) -> tuple[np.ndarray, np.ndarray]:
    """Contrast at the start, the middle and the end of each moving piece, and its standard deviation, (n, N, 3)."""
    rows, sigma = map(np.stack, zip(*(_contrast(tool, centre) for centre in found.centres), strict=True))
    return np.einsum("intl,il->int", rows[found.centre], found.levels), sigma[found.centre]


def _contrast(tool: ArrangementEstimator, centre: Centre) -> tuple[np.ndarray, np.ndarray]:
    """What levels make of the contrast at those places, (N, 3, L), and the contrast's standard deviation, (N, 3)."""
    levels = slice(2 * tool.model.free.size, -1)
    steps = centre.expansion.pieces.contrast[:, :, levels]
    rows = np.einsum("tk,nkl->ntl", [[1, 0, 0], [1, 0.5, 0.25], [1, 1, 1]], steps)
    return rows, np.sqrt(np.einsum("ntl,lm,ntm->nt", rows, centre.covariance[levels, levels], rows))
