"""Lines and corners of a layout in a stack of images: the estimator, brought to where the edges really are."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from weakref import finalize

import numpy as np

from measure.estimators.arrangement import ArrangementEstimator
from measure.estimators.estimate import Estimate, Estimator
from measure.estimators.kinds import ESTIMATORS
from measure.estimators.registry import estimator
from measure.features.alignment import align
from measure.features.arranged import find_arranged, goodness
from measure.features.corners import corner_response, intersect, line_equations
from measure.features.found import MIN_SINE, Shape, gather, nothing
from measure.features.layout import Layout
from measure.features.lines import at_ends, capture, edge_states, end_errors
from measure.goodness import WORST
from scenes import status

_GRID = 0.125  # px to which a new expectation is rounded, so that images can share it
_PASSES = 6
_BATCH = 50  # images measured at a time: what they need then stays in the processor's cache
_COPIED = 1 << 23  # pixels, 64 MiB, of images that are copied at a time where edges are sought anew, pass by pass
_KEPT = 64  # estimators
_TOOLS: OrderedDict[tuple[int, str, float], Estimator | ArrangementEstimator] = OrderedDict()
_LOST = 0.75  # px from the expected edge beyond which the whole layout is sought anew


def prepared(layout: Layout, name: str, threshold: float) -> Estimator | ArrangementEstimator:
    """The estimator of a layout, made once; the last `_KEPT` are kept, each no longer than its layout."""
    key = id(layout), name, threshold
    tool = _TOOLS.pop(key, None)
    if tool is None:
        tool = estimator(layout, name, threshold)
        finalize(layout, _TOOLS.pop, key, None).atexit = False
    _TOOLS[key] = tool
    if len(_TOOLS) > _KEPT:
        _TOOLS.popitem(last=False)
    return tool


@lru_cache(maxsize=256)
def _moved(layout: Layout, shift: tuple[float, float], turn: float) -> Layout:
    return layout.moved(shift, turn)


@lru_cache(maxsize=256)
def _shifted(layout: Layout, offsets: tuple[float, ...]) -> Layout:
    return layout.shifted(np.reshape(offsets, (-1, 2)))


def find_shape(images: np.ndarray, layout: Layout, name: str, threshold: float = 12.0, *, judged: bool = True) -> Shape:
    """Find the lines and corners of a layout in images, shape (n, height, width); how well they fit, where ``judged``.

    Each image is measured by itself: its result does not depend on the others of the stack. Where the edges are not
    within the estimator's capture of their expected place, the layout is moved there first.
    """
    if not layout.names:
        return nothing(len(images))
    tool = prepared(layout, name, threshold)
    if isinstance(tool, ArrangementEstimator):
        return find_arranged(images, layout, tool)
    parts = [_find(some, layout, name, threshold, _PASSES) for some in _split(images, _BATCH)]
    found = Shape(**{key: np.concatenate([vars(part)[key] for part in parts]) for key in vars(parts[0])})
    return _judged(found, images, layout) if judged and name == "strip" and layout.arrangement else found


def _judged(found: Shape, images: np.ndarray, layout: Layout) -> Shape:
    """With the goodness of fit of the whole picture: a strip by itself has too few pixels to tell."""
    p_value = goodness(images, layout, prepared(layout, "arrangement", 1.0))
    fits = np.where(p_value < WORST, status.MISFIT, status.OK)
    state, whole = (
        np.array([status.worst(*pair) for pair in zip(said, fits, strict=True)]) for said in (found.status, found.whole)
    )
    return replace(found, status=state, whole=whole, p_value=p_value)


def _find(images: np.ndarray, layout: Layout, name: str, threshold: float, passes: int) -> Shape:
    tool = prepared(layout, name, threshold)
    estimate = tool.estimate(images)
    lines = tool.covariance(estimate, images)
    shape = _assemble(tool, layout, estimate, lines)
    calipers = tool.calipers
    if any(caliper.status not in status.MEASURED for caliper in calipers):
        return shape
    lengths = np.array([caliper.length for caliper in calipers])
    offsets, errors = at_ends(estimate.level, estimate.slope, lengths), end_errors(lines, lengths)
    there = (np.abs(offsets) <= capture(ESTIMATORS[name].of(layout).capture_px, errors)).all(2)
    far = ~there.all(1)
    lost = far & ((estimate.state == status.LOW_CONTRAST).any(1) | ~(np.abs(offsets) < _LOST).all((1, 2)))
    if not far.any() or passes == 0:
        return _refuse(shape, far)
    parts = [shape]
    rows = np.arange(len(images))
    source = np.zeros(len(images), int)
    if layout.clutter is not None:  # of a known picture an edge that is caught stays, whatever others do
        offsets = np.where(there[..., None], 0.0, offsets)
    reach = ESTIMATORS[name].of(layout).capture_px if passes == _PASSES else None
    for move, every in _expectations(images, layout, offsets, far, lost, reach):
        for which in _split(every, _copied(images)):
            source[which], rows[which] = len(parts), np.arange(len(which))
            parts.append(_find(images[which], move, name, threshold, passes - 1))
    return gather(parts, source, rows)


def _split(values: np.ndarray, size: int) -> list[np.ndarray]:
    """In blocks, one after another."""
    return [values[first : first + size] for first in range(0, len(values), size)]


def _copied(images: np.ndarray) -> int:
    """How many images are copied at a time."""
    return max(_COPIED // images[0].size, 1)


def _expectations(images, layout, offsets, far, lost, reach):
    """(layout, images' indices) for the images whose edges are elsewhere: sought anew, where ``reach`` is given, px, or
    moved to where they seem."""
    if reach is not None and lost.any():
        for move, own in _sought(images, layout, np.flatnonzero(lost)):
            if move is not None and not (layout.clutter is not None and _away(move, layout) <= reach):
                yield move, own
            elif layout.clutter is not None:  # all are caught from where they are expected: what is far is another edge
                continue
            far = far & ~np.isin(np.arange(len(far)), own)
    which = np.flatnonzero(far & np.isfinite(offsets).all((1, 2)))
    keys = np.round(np.clip(offsets[which], -1, 1) / _GRID) * _GRID
    for key in np.unique(keys, axis=0):
        yield _shifted(layout, tuple(key.ravel().tolist())), which[(keys == key).all((1, 2))]


def _sought(images: np.ndarray, layout: Layout, which: np.ndarray) -> Iterator[tuple[Layout | None, np.ndarray]]:
    """Where the layout seems to be in some images, and in which of them; None: where it is expected."""
    poses = np.concatenate([align(images[some], layout) for some in _split(which, _copied(images))])
    for pose in np.unique(poses, axis=0):
        move = _moved(layout, tuple(pose[:2].tolist()), float(pose[2])) if pose.any() else None
        yield move, which[(poses == pose).all(1)]


def _away(moved: Layout, layout: Layout) -> float:
    """How far off an edge lies, across it, from where another layout has it, at most, px."""
    return float(np.abs(np.einsum("eki,ei->ek", moved.ends - layout.ends, layout.normals)).max())


def _assemble(tool: Estimator, layout: Layout, estimate: Estimate, lines: np.ndarray) -> Shape:
    """Corners from lines with covariance ``lines`` (n, 2 E, 2 E)."""
    calipers = tool.calipers
    normals, points = line_equations(calipers, estimate.level, estimate.slope)
    crossings = [intersect(normals[:, list(pair)], points[:, list(pair)]) for pair in layout.corners]
    corners = np.stack([c for c, _ in crossings], 1) if crossings else np.empty((len(normals), 0, 2))
    sines = np.stack([s for _, s in crossings], 1) if crossings else np.empty((len(normals), 0))
    edge_status = edge_states(np.array([caliper.status for caliper in calipers]), estimate.state)
    joint = np.where(sines < MIN_SINE, status.ILL_CONDITIONED, status.OK)
    state = np.array([status.worst(*row) for row in np.concatenate([edge_status, joint], 1)])
    measured = np.isin(state, status.MEASURED)
    covariance = np.full((len(state), 2 * len(layout.corners), 2 * len(layout.corners)), np.nan)
    if measured.any() and layout.corners:
        response = np.concatenate([corner_response(calipers, pair) for pair in layout.corners])
        covariance[measured] = response @ lines[measured] @ response.T
    middle = estimate.contrast[..., 0] + estimate.contrast[..., 1] * np.array([f.length / 2 for f in calipers])
    return Shape(
        corners=np.where(measured[:, None, None], corners, np.nan),
        covariance=covariance,
        normals=normals,
        points=points,
        lines=lines,
        status=state,
        whole=np.full(len(state), status.OK),
        edge_status=edge_status,
        counted=edge_status,
        edge_contrast=np.abs(middle),
        used=estimate.used,
        rejected=estimate.rejected,
        p_value=np.full(len(state), np.nan),
    )


def _refuse(shape: Shape, lost: np.ndarray) -> Shape:
    """A line that still runs away after all passes is no measurement."""
    if not lost.any():
        return shape
    state = np.where(lost & np.isin(shape.status, status.MEASURED), status.LOW_CONTRAST, shape.status)
    gone = ~np.isin(state, status.MEASURED)
    corners = np.where(gone[:, None, None], np.nan, shape.corners)
    whole = np.where(lost, status.LOW_CONTRAST, shape.whole)
    return replace(shape, status=state, whole=whole, corners=corners)
