"""Maximum likelihood in a strip along each edge by itself, the corners trimmed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from imaging.features.locator import CLEARANCE, edge_blur
from measure.estimators.beside import SideLevel, misled
from measure.estimators.coverage import NODE_WEIGHTS, NODES, density, half_plane
from measure.estimators.kinds import EstimatorKind
from measure.estimators.likelihood import Columns, LikelihoodEstimator
from measure.estimators.scene_strip import SCENE_STRIP
from measure.estimators.strip_pixels import LEAST_BLUR, are_own, pixels_beside
from measure.features.calipers import Caliper, edge_calipers
from measure.features.layout import Layout
from scenes import status

SLIVER = 2.0  # px: a face thinner than this beside an edge is not told from the blur
HALF_WIDTH = 16.0  # px to each side; wider hardly helps, since the levels are then known well enough


def strip_estimator(
    layout: Layout, caliper: Caliper, index: int, strip: tuple[np.ndarray, ...]
) -> LikelihoodEstimator | None:
    """Estimator of one edge; None if too few pixels are free of other edges.

    Grey levels may change linearly along and across the edge on each side, and the blur is free.

    Parameters
    ----------
    layout : Layout
    caliper : Caliper
        Frame of the edge; its positions tell the part to use.
    index : int
        Which edge of the layout.
    strip : tuple of ndarray
        Its pixels (flat indices), their ideal coordinates, and those in the caliper (along, across).
    """
    pixels, ideal, along, across = strip
    if len(pixels) < 40:
        return None
    middle = caliper.length / 2
    slopes = [layout.optics.gradient(ideal, axis) for axis in (caliper.normal, caliper.direction)]
    sigma = np.maximum(caliper.blur(along), LEAST_BLUR) * np.linalg.norm(slopes[0], axis=-1)
    sigma = sigma[:, None]
    nodes = across[:, None] + slopes[0] @ NODES.T
    inside = (half_plane(nodes / sigma) * NODE_WEIGHTS).sum(1)
    thin = density(nodes / sigma) * NODE_WEIGHTS / sigma
    lever = along[:, None] + slopes[1] @ NODES.T - middle
    basis = np.stack([np.ones_like(along), (along - middle) / caliper.length, across / HALF_WIDTH], 1)
    places = caliper.at(along, across)
    plus, minus = (layout.shade(face, places)[:, None] for face in layout.sides[index])
    ends = caliper.at(np.array([0.0, caliper.length]), np.zeros(2))
    at_ends = np.array([[1, -0.5, 0], [1, 0.5, 0]])
    contrast = np.concatenate([layout.shade(layout.sides[index, 0], ends)[:, None] * at_ends,
                               -layout.shade(layout.sides[index, 1], ends)[:, None] * at_ends], 1)  # fmt: skip
    # blurring a step between sloping levels adds the blur's variance times the slope across times the step's density
    rising = (
        np.eye(3)[2]
        / HALF_WIDTH
        * ((sigma**2 + 1 / 12 * (slopes[0] ** 2).sum(-1, keepdims=True)) * thin).sum(1)[:, None]
    )
    columns = Columns(
        levels=np.concatenate(
            [(basis * inside[:, None] + rising) * plus, (basis * (1 - inside)[:, None] - rising) * minus], 1
        ),
        start=contrast[:1],
        stop=contrast[1:],
        offsets=-np.stack([thin.sum(1), (thin * lever).sum(1)], 1),
        blurs=-(thin * nodes / sigma).sum(1)[:, None],
    )
    return LikelihoodEstimator.of((caliper,), pixels, columns, layout.optics)


def _strip(layout: Layout, caliper: Caliper, index: int, clear: float) -> tuple[np.ndarray, ...]:
    """Pixels of the strip (flat indices), their ideal coordinates, and those in the caliper (along, across)."""
    flat, points, along, across = pixels_beside(caliper, HALF_WIDTH)
    keep = are_own(layout, index, points, across, clear)
    expected = np.where(across > 0, *layout.sides[index])
    keep &= (layout.face_at(flat) == expected) | (np.abs(across) < 1)
    return flat[keep], points[keep], along[keep], across[keep]


def _misled(layout: Layout, index: int, caliper: Caliper, strip: tuple[np.ndarray, ...]) -> bool:
    _, points, along, across = strip
    beyond = [sign * across >= 1 for sign in (1, -1)]
    if not all(some.any() for some in beyond):
        return layout.looks is not None
    plus, minus = (
        SideLevel(sign, int(face), points[some], along[some], across[some], (True, True, True))
        for sign, face, some in zip((1, -1), layout.sides[index], beyond, strict=True)
    )
    return misled(layout, index, caliper, (plus, minus), 0.0)


def _prepared(layout: Layout, threshold: float) -> LikelihoodEstimator:
    # a face less than twice as wide has no pixel of its own level
    clear = CLEARANCE * edge_blur(layout.optics.most_blur_px)
    seen, calipers, parts = layout.without_slivers(SLIVER), [], []
    for index, caliper in enumerate(edge_calipers(layout, clear, 0.0, 2 * clear)):
        part = None
        if caliper.status in status.MEASURED:
            strip = _strip(seen, caliper, index, clear)
            part = strip_estimator(seen, caliper, index, strip)
            states = [status.SHORT] * (part is None) + [status.CLUTTER] * _misled(seen, index, caliper, strip)
            caliper = replace(caliper, status=status.worst(caliper.status, *states))
        calipers.append(caliper)
        parts.append(part)
    return LikelihoodEstimator.joined(tuple(calipers), parts)


STRIP = EstimatorKind(_prepared, capture_px=0.125, exact_px=2e-3, knowing=SCENE_STRIP)
