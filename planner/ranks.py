"""Whether edges and quantities can be measured and trusted, for one picture or many: statuses by their severity."""

from __future__ import annotations

import numpy as np

from imaging.features.circles import LEAST_SEEN
from imaging.features.locator import MIN_CONTRAST, MIN_USABLE
from imaging.features.seen import unit_normals
from imaging.models.errors import Errors
from scenes import Corner, status
from scenes.measurands.between import Crossing
from scenes.measurands.kinds import MEASURANDS
from scenes.status import WORST_FIRST

_NOT_VISIBLE, _SHORT, _LOW_CONTRAST, _ILL_CONDITIONED, _AMBIGUOUS, _UNPLACED, _CLUTTER, _OK = map(
    WORST_FIRST.index,
    (status.NOT_VISIBLE, status.SHORT, status.LOW_CONTRAST, status.ILL_CONDITIONED, status.AMBIGUOUS, status.UNPLACED,
     status.CLUTTER, status.OK),
)  # fmt: skip
MIN_SINE = 0.02  # edges meeting at less than about a degree give a corner that no linear propagation describes


def edge_ranks(evaluated: Errors, clutter: np.ndarray) -> np.ndarray:
    """Status of each straight edge as its index in `WORST_FIRST`, int, shape (..., E).

    Parameters
    ----------
    evaluated : Errors
    clutter : ndarray of bool, shape (..., E)
        What `imaging.models.bias.cluttered` says; False where it is not asked.
    """
    view = evaluated.measurands.view
    whole = view.lengths - view.trims.sum(-1)
    with np.errstate(invalid="ignore"):
        hidden = ~view.visible | ~np.isfinite(view.usable) | ((view.usable < MIN_USABLE) & (whole >= MIN_USABLE))
        short = view.usable < MIN_USABLE  # before contrast: where nothing is left there is none either
        weak = ~(evaluated.contrast > least_contrast(evaluated))
    return np.select([hidden, short, weak, clutter], [_NOT_VISIBLE, _SHORT, _LOW_CONTRAST, _CLUTTER], _OK)


def feature_ranks(evaluated: Errors, clutter: np.ndarray) -> np.ndarray:
    """The same of each straight edge and circle, (..., E + C), for pictures that are adjusted together."""
    edges, rims = edge_ranks(evaluated, clutter), []
    for covariance, left, crowded in zip(evaluated.circles, evaluated.left, evaluated.crowded, strict=True):
        lost = ~np.isfinite(np.einsum("...ii->...i", covariance)).all(-1)
        rank = np.select([left < LEAST_SEEN, lost, crowded], [_SHORT, _NOT_VISIBLE, _CLUTTER], _OK)
        rims.append(np.broadcast_to(rank, edges.shape[:-1]))
    return np.concatenate([edges, np.stack(rims, -1)], -1) if rims else edges


def least_contrast(evaluated: Errors) -> np.ndarray:
    """The contrast at which an edge is ``low_contrast``, grey levels, shape (..., E)."""
    return MIN_CONTRAST * np.sqrt(evaluated.noise_variance)


def quantity_ranks(evaluated: Errors, clutter: np.ndarray) -> np.ndarray:
    """Status of each quantity, from the edges and circles that it needs, the same way, shape (..., M)."""
    known, edges = evaluated.measurands, edge_ranks(evaluated, clutter)
    rims = [
        np.select([left < LEAST_SEEN, crowded], [_SHORT, _CLUTTER], _OK)
        for left, crowded in zip(evaluated.left, evaluated.crowded, strict=True)
    ]
    rims += [np.array(_OK)] * (len(known.circles) - len(rims))
    lead, unplaced = evaluated.variances.shape[:-1], _are_unplaced(evaluated)
    single = np.stack([np.broadcast_to(each, lead) for each in (*np.moveaxis(edges, -1, 0), *rims)], -1)
    ranks = []
    for m, (quantity, needs) in enumerate(zip(known.quantities, known.depends(), strict=True)):
        rank = np.where(needs, single, _OK).min(-1)
        flat = np.zeros(rank.shape, bool)
        for corner in quantity.crossings:
            flat = flat | (sine(evaluated, corner) < MIN_SINE)
        lost = ~np.isfinite(evaluated.variances[..., m])
        told = np.where(flat, np.minimum(rank, _ILL_CONDITIONED), np.where(lost, _NOT_VISIBLE, rank))
        told = np.where(unplaced[..., m], np.minimum(told, _UNPLACED), told)
        if MEASURANDS[quantity.kind].pictures > 1:
            told = np.minimum(rank, _AMBIGUOUS)
        ranks.append(np.where(rank <= _LOW_CONTRAST, rank, told))
    return np.stack(ranks, -1)


def _are_unplaced(evaluated: Errors) -> np.ndarray:
    """Of which quantities what the datums do not tell of the part's place matters, bool (..., M)."""
    adjustment, known = evaluated.adjustment, evaluated.measurands
    if adjustment is None or not known.datums:
        return np.zeros(evaluated.variances.shape, bool)
    return adjustment.matters(known.gradient_object, evaluated.variances_object, known.quantities)


def sine(evaluated: Errors, corner: Corner | Crossing) -> np.ndarray:
    """Of the angle at which a corner's two edges meet in the image, shape (...); NaN where one is seen end-on."""
    view = evaluated.measurands.view
    pair = unit_normals(view.along)[..., [view.names.index(name) for name in corner.edges], :]
    (a, b), (c, d) = np.moveaxis(pair, (-2, -1), (0, 1))
    return np.abs(a * d - b * c)
