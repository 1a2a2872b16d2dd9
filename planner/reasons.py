"""Why a quantity cannot be measured or trusted in a picture: the number that decided its status, and the limit."""

from __future__ import annotations

import numpy as np

from imaging.boards.seen import NEEDED
from imaging.features.circles import LEAST_SEEN
from imaging.features.locator import MIN_CONTRAST, MIN_USABLE
from imaging.models.bias import NEGLIGIBLE
from imaging.models.errors import Errors
from planner.ranks import MIN_SINE, edge_ranks, least_contrast, sine
from scenes import Corner
from scenes.measurands.between import Crossing
from scenes.measurands.kinds import MEASURANDS
from scenes.status import (
    AMBIGUOUS,
    CLUTTER,
    ILL_CONDITIONED,
    LOW_CONTRAST,
    NOT_VISIBLE,
    OK,
    SHORT,
    UNPLACED,
    WORST_FIRST,
    allowed,
)


def reason(evaluated: Errors, clutter: np.ndarray, bias_image: float, m: int, status: str) -> str:
    """That of one picture's m-th quantity in words; empty for ``ok``.

    Parameters
    ----------
    evaluated : Errors
    clutter : ndarray of bool, shape (E,)
        As of `planner.ranks.edge_ranks`, which decides the same.
    bias_image : float
        Of the quantity, px or degrees; NaN where it is not known.
    status : str
        The quantity's.
    """
    if status == OK:
        return ""
    known = evaluated.measurands
    if status == UNPLACED:
        return _unplaced(evaluated, m)
    if status == AMBIGUOUS:
        return alone(known.quantities[m].kind)
    if status == ILL_CONDITIONED:
        return _flattest(evaluated, known.quantities[m].crossings)
    names, ranks = known.view.names, edge_ranks(evaluated, clutter)
    needed = np.flatnonzero(known.depends()[m][: len(names)])
    guilty = [int(e) for e in needed if WORST_FIRST[ranks[e]] == status]
    if status == CLUTTER:
        return _clutter(evaluated, bias_image, m, [names[e] for e in guilty])
    if not guilty:
        rims = [name for name, needs in zip(known.circles, known.depends()[m][len(names) :], strict=True) if needs]
        if status == SHORT:
            return _short_arc(evaluated, rims)
        return f"too little is seen of {_joined(rims or known.quantities[m].edges)}, or it is too faint"
    return {NOT_VISIBLE: _hidden, SHORT: _short, LOW_CONTRAST: _faint}[status](evaluated, guilty)


def alone(kind: str) -> str:
    """Why one picture does not tell a measurand of a kind.

    >>> alone("height")
    'a height needs at least 2 pictures that are adjusted together'
    """
    name = kind.replace("_", " ")
    return f"a {name} needs at least {MEASURANDS[kind].pictures} pictures that are adjusted together"


def _hidden(evaluated: Errors, edges: list[int]) -> str:
    view = evaluated.measurands.view
    away = [view.names[e] for e in edges if not view.visible[e]]
    if away:
        return (
            f"the camera does not see {_joined(away)}, which {'is' if len(away) == 1 else 'are'} turned away or hidden"
        )
    worst = min(edges, key=lambda e: round(float(view.usable[e]), 6))
    left = max(float(view.usable[worst]), 0.0)
    return f"{left:.2g} px of edge {view.names[worst]} lie well within the image; at least {MIN_USABLE:g} are needed"


def _short(evaluated: Errors, edges: list[int]) -> str:
    """Of the edge that lacks most."""
    view = evaluated.measurands.view
    whole = view.lengths - view.trims.sum(-1)
    worst = min(edges, key=lambda e: round(float(whole[e]), 6))
    free = float(view.lengths[worst] * np.ptp(view.shown[worst]))
    lost = free - float(whole[worst])
    seen = "is" if free > 0.999 * view.lengths[worst] else f"of {_px(view.lengths[worst])} px is hidden but for"
    length = f"{_px(free)} px long" if seen == "is" else f"{_px(free)} px"
    ends = f": {_px(lost)} at its ends lie too near to other edges" if lost > free else ""
    return (
        f"edge {view.names[worst]} {seen} {length} in this picture; at least {_px(lost + MIN_USABLE)} are needed{ends}"
    )


def _short_arc(evaluated: Errors, names: list[str]) -> str:
    """Of the arc of which least is left."""
    left = dict(zip(evaluated.measurands.circles, evaluated.left, strict=True))
    worst = min(names, key=lambda name: round(float(left[name]), 6))
    return (
        f"{360 * float(left[worst]):.2g} degrees of arc {worst} lie well off its ends in this picture;"
        f" at least {360 * LEAST_SEEN:.0f} are needed"
    )


def _px(length: float) -> str:
    return f"{length:.0f}" if length >= 100 else f"{length:.3g}"


def _faint(evaluated: Errors, edges: list[int]) -> str:
    least = least_contrast(evaluated)
    share = np.nan_to_num(evaluated.contrast) / np.maximum(least, np.finfo(float).tiny)  # no noise at the scale's end
    worst = min(edges, key=lambda e: round(float(share[e]), 6))
    if not evaluated.contrast[worst] > 0:
        return f"no light reaches edge {evaluated.measurands.view.names[worst]}, or both sides of it are alike"
    return (
        f"the contrast at edge {evaluated.measurands.view.names[worst]} is {evaluated.contrast[worst]:.2g} grey levels;"
        f" at least {least[worst]:.2g} are needed, {MIN_CONTRAST:g} times the noise"
    )


def _unplaced(evaluated: Errors, m: int) -> str:
    known, adjustment = evaluated.measurands, evaluated.adjustment
    if adjustment is None:
        return ""
    board = adjustment.placing.board
    if board is not None and not np.isfinite(board.noise[..., 0, 0]).any():
        return NEEDED
    gradient, zone = known.gradient_object[m], known.quantities[m].tolerance
    most = allowed(float(np.sqrt(evaluated.variances_object[m])), 0.0 if zone is None else zone.half)
    tell = "tell" if board is None else "tells"
    return (
        f"{_joined(known.datums)} {tell} less of {adjustment.guilty(gradient)} than was known before, which leaves "
        f"{float(adjustment.untold(gradient[None])[0]):.2g} (1 sigma); at most {most:.2g} may be left"
    )


def _flattest(evaluated: Errors, corners: tuple[Corner | Crossing, ...]) -> str:
    worst = min(corners, key=lambda each: round(float(np.nan_to_num(sine(evaluated, each))), 9), default=None)
    if worst is None:
        return ""
    angle, least = np.degrees(np.arcsin([float(np.nan_to_num(sine(evaluated, worst))), MIN_SINE]))
    return f"{_joined(worst.edges)} meet at {angle:.2g} degrees in this picture; at least {least:.2g} are needed"


def _clutter(evaluated: Errors, bias: float, m: int, edges: list[str]) -> str:
    sigma = float(np.sqrt(evaluated.variances[m]))
    if np.isfinite(bias) and abs(bias) > NEGLIGIBLE * sigma > 0:
        off = f"{abs(bias) / sigma:.2g} sigma of noise; uncorrected at most {NEGLIGIBLE:g} may be"
        return f"another edge, shading, or the end of the scale near its edges biases it by {off}"
    where = _joined(edges) if edges else "a rim"
    return f"another edge, shading, or light from other faces biases {where} by what no formula tells"


def _joined(names) -> str:
    """
    >>> _joined(["e1"]), _joined(["e1", "e2", "c3"])
    ('edge e1', 'e1, e2 and c3')
    """
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else f"edge {last}" if last.startswith("e") else str(last)
