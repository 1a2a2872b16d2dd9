"""Maximum likelihood of all edges of one face together, corners included."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from measure.estimators.coverage import NODE_WEIGHTS, NODES, wedge, wedge_slope
from measure.estimators.likelihood import Columns, LikelihoodEstimator
from measure.estimators.strip import LEAST_BLUR, NEARER, SLIVER
from measure.features.calipers import Caliper, distance_to_segment
from measure.features.layout import BACKGROUND, Layout
from scenes import InvalidInput

REACH = 16.0  # px from an edge up to which pixels are used; beyond it they only add to known grey levels
_CURVED = 30.0  # px: faces larger than this may shade quadratically


def polygon_estimator(layout: Layout, calipers: tuple[Caliper, ...], clear: float) -> LikelihoodEstimator | None:
    """Estimator of the whole outline of a face; None unless the edges are a closed, convex ring around one face.

    Grey levels are linear in x and y times the known shading; where the shading is not known, quadratic on a large
    face. The blur is free. Pixels near any other visible edge are left out.

    Parameters
    ----------
    layout : Layout
    calipers : tuple of Caliper
    clear : float
        How far edges that do not belong to the ring must be from a pixel that is used, px.
    """
    layout = layout.without_slivers(SLIVER)
    ring = inner_face(layout)
    if ring is None:
        return None
    inner, sign = ring
    y, x, points, nearest = _pixels(layout, inner, clear)
    covered, slopes, levers = _coverage(layout, calipers, sign, points, nearest)
    wider, *_ = _coverage(layout, calipers, sign, points, nearest, 1.02)
    outer = np.where(sign > 0, layout.sides[:, 1], layout.sides[:, 0])
    levels, start, stop = _levels(layout, inner, points, covered, outer, nearest)
    edges = len(calipers)
    offsets = np.stack([slopes, levers], -1).transpose(1, 2, 0).reshape(2 * edges, -1).T
    blurs = ((wider - covered) / 0.02)[:, None]
    columns = Columns(levels, start, stop, offsets, blurs)
    return LikelihoodEstimator.of(calipers, y * layout.optics.shape[1] + x, columns, layout.optics)


def edge_derivatives(layout: Layout, calipers: tuple[Caliper, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Change of every pixel near the ring with each edge's offset and with its tilt, at unit contrast, both (P, E).

    Raises
    ------
    InvalidInput
        If the edges are no closed convex ring around one face.
    """
    ring = inner_face(layout)
    if ring is None:
        raise InvalidInput("edges must be a closed convex ring around one face, got another arrangement")
    _, _, points, nearest = _pixels(replace(layout, others=np.empty((0, 2, 2))), ring[0], 0.0)
    return _coverage(layout, calipers, ring[1], points, nearest)[1:]


def inner_face(layout: Layout) -> tuple[int, np.ndarray] | None:
    """The face that all edges border, and for each edge +1 if it lies on the normal's side, else -1.

    None if there is no such face, the edges do not close around it, or it is not convex.
    """
    common = set.intersection(*(set(pair) for pair in layout.sides.tolist())) - {BACKGROUND}
    if (
        not common
        or not layout.visible.all()
        or (layout.shown != [0, 1]).any()
        or len(layout.joints) != len(layout.names)
    ):
        return None
    inner = common.pop()
    sign = np.where(layout.sides[:, 0] == inner, 1.0, -1.0)
    away = (layout.faces[inner][:, None] - layout.ends[:, 0]) * layout.normals
    return (inner, sign) if (sign * away.sum(-1) > -1.0).all() else None


def _pixels(layout: Layout, inner: int, clear: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rows and columns of the pixels to use, their ideal coordinates, and which edge each is nearest to."""
    height, width = layout.optics.shape
    ends = layout.optics.recorded(layout.ends)
    low = np.maximum(np.floor(ends.min((0, 1)) - REACH), 0).astype(int)
    high = np.minimum(np.ceil(ends.max((0, 1)) + REACH + 1), [width, height]).astype(int)
    y, x = (part.ravel() for part in np.mgrid[low[1] : high[1], low[0] : high[0]])
    points = layout.optics.ideal(np.stack([x, y], 1).astype(float))
    distances = np.stack([distance_to_segment(points, *ends) for ends in layout.ends], 1)
    nearest = distances.argmin(1)
    labels = layout.labels()[y, x]
    beside = np.where(layout.sides[:, 0] == inner, layout.sides[:, 1], layout.sides[:, 0])[nearest]
    keep = (distances.min(1) <= REACH) & ((labels == inner) | (labels == beside) | (distances.min(1) < 1))
    for segment in layout.others:
        away = distance_to_segment(points[keep], *segment)
        touching = np.linalg.norm(segment[:, None] - layout.ends.reshape(-1, 2), axis=-1).min() < 1
        keep[keep] = (away > clear) | ((not touching) & (away > NEARER * distances.min(1)[keep]))
    return y[keep], x[keep], points[keep], nearest[keep]


def _coverage(layout, calipers, sign, points, nearest, wider=1.0):
    """Part of each pixel within the face (P,), its derivative by each edge's offset (P, E), and by its tilt (P, E).

    ``wider`` multiplies the blur.
    """
    partner = _partners(layout, points, nearest)
    covered = np.zeros(len(points))
    slopes, levers = np.zeros((len(points), len(calipers))), np.zeros((len(points), len(calipers)))
    for i in range(len(calipers)):
        for j in np.unique(partner[nearest == i]):
            here = (nearest == i) & (partner == j)
            (h, s_i, size_i, way_i), (k, s_j, size_j, way_j) = (
                _inside(layout, calipers[e], sign[e], points[here], wider) for e in (i, j)
            )
            rho = float((way_i * way_j).sum(-1).mean())
            covered[here] = (wedge(h, k, rho) * NODE_WEIGHTS).sum(1)
            for e, s, size, slope in (
                (i, s_i, size_i, wedge_slope(h, k, rho)),
                (j, s_j, size_j, wedge_slope(k, h, rho)),
            ):
                part = -sign[e] / size * slope * NODE_WEIGHTS
                slopes[here, e] = part.sum(1)
                levers[here, e] = (part * (s - calipers[e].length / 2)).sum(1)
    return covered, slopes, levers


def _inside(layout: Layout, caliper: Caliper, sign: float, points: np.ndarray, wider: float):
    """How far the nodes of pixels lie inside an edge in standard deviations of its blur, places along it, both (P, n),
    that deviation in ideal px (P, 1), and the unit direction inwards as recorded (P, 2)."""
    along, across = caliper.coordinates(points)
    inwards, onwards = (layout.optics.gradient(points, axis) for axis in (caliper.normal, caliper.direction))
    gain = np.linalg.norm(inwards, axis=-1)
    size = (wider * np.maximum(caliper.blur(along), LEAST_BLUR) * gain)[:, None]
    nodes = across[:, None] + inwards @ NODES.T
    return sign * nodes / size, along[:, None] + onwards @ NODES.T, size, sign * inwards / gain[:, None]


def _partners(layout: Layout, points: np.ndarray, nearest: np.ndarray) -> np.ndarray:
    """For each pixel the edge that meets its nearest edge in the nearer corner."""
    met = {a: b[0] for joint in layout.joints for a, b in (joint, joint[::-1])}
    distance = np.linalg.norm(points[:, None] - layout.ends[nearest], axis=-1)
    return np.array([[met[i, 0], met[i, 1]] for i in range(len(layout.names))])[nearest, distance.argmin(1)]


def _levels(layout, inner, points, covered, outer, nearest):
    """Level columns (P, q), and rows (E, q) for the contrast at the start and the stop of each edge."""
    middle = layout.ends.reshape(-1, 2).mean(0)
    reach = np.abs(layout.ends.reshape(-1, 2) - middle).max()
    large = np.linalg.norm(layout.ends[:, 1] - layout.ends[:, 0], axis=1).min() > _CURVED
    curved = large and layout.shadings[inner] is None

    def basis(places: np.ndarray, quadratic: bool) -> np.ndarray:
        x, y = ((places - middle) / reach).T
        return np.stack([np.ones_like(x), x, y, *((x * x, x * y, y * y) if quadratic else ())], 1)

    outside = np.unique(outer)

    def shaded(face: int, places: np.ndarray, quadratic: bool) -> np.ndarray:
        return basis(places, quadratic) * layout.shade(face, places)[:, None]

    blocks = [shaded(inner, points, curved) * covered[:, None]]
    starts, stops = (([shaded(inner, layout.ends[:, end], curved)]) for end in (0, 1))
    for region in outside:
        belongs = outer == region
        blocks.append(shaded(region, points, False) * ((1 - covered) * belongs[nearest])[:, None])
        starts.append(-shaded(region, layout.ends[:, 0], False) * belongs[:, None])
        stops.append(-shaded(region, layout.ends[:, 1], False) * belongs[:, None])
    return np.concatenate(blocks, 1), np.concatenate(starts, 1), np.concatenate(stops, 1)
