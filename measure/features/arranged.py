"""Lines and corners from the most likely arrangement: they are its vertices."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from threadpoolctl import ThreadpoolController

from imaging.sensor import full_scale
from measure.estimators.arrangement import ArrangementEstimator, Centre
from measure.estimators.stack import Solutions, find
from measure.features.contrasts import SEEN, asked, contrasts, seen_edges
from measure.features.found import MIN_SINE, Shape, gather
from measure.features.layout import Layout
from measure.features.linearity import is_reliable
from measure.features.locating import FURTHEST, locate, moved
from measure.goodness import WORST, p_value
from measure.once import once
from scenes import status

BLAS = ThreadpoolController()  # the matrices are small: threads cost more than they give

Part = tuple[np.ndarray, np.ndarray, ArrangementEstimator]
"""Numbers of some images, (m,), those images, and the tool that measures them."""


@BLAS.wrap(limits=1)
def find_arranged(images: np.ndarray, layout: Layout, tool: ArrangementEstimator) -> Shape:
    """Lines and corners in images (n, height, width); what is hidden of them is left out."""
    shown = _shown(layout)
    if shown.size < len(layout.names):
        return _beside_hidden(images, layout, tool, shown)
    if not tool.pixels.size:
        return _nothing(len(images), layout)
    parts = [(which, _shape(some, layout, part)) for which, some, part in _parts(images, layout, tool)]
    if len(parts) == 1:
        return parts[0][1]
    source, rows = np.zeros(len(images), int), np.zeros(len(images), int)
    for number, (which, _) in enumerate(parts):
        source[which], rows[which] = number, np.arange(which.size)
    return gather([shape for _, shape in parts], source, rows)


@BLAS.wrap(limits=1)
def is_told(layout: Layout, tool: ArrangementEstimator) -> bool:
    """Whether an image of a layout whose light is known tells its lines, and their errors are linear in its noise."""
    shown = _shown(layout)
    if not shown.size or not tool.pixels.size:
        return True  # nothing is asked
    if shown.size < len(layout.names):
        tool = _only(tool, layout, tuple(shown))[0]
    return not tool.is_lit or _expected_reliable(tool)


@BLAS.wrap(limits=1)
def goodness(images: np.ndarray, layout: Layout, tool: ArrangementEstimator) -> np.ndarray:
    """Goodness of fit of images (n, height, width), p-values (n,); NaN where edges are not seen."""
    probability = np.full(len(images), np.nan)
    shown = _shown(layout)
    if shown.size < len(layout.names):
        return goodness(images, *_only(tool, layout, tuple(shown))[1::-1]) if shown.size else probability
    if not tool.pixels.size:
        return probability
    for which, some, part in _parts(images, layout, tool):
        found, reliable = _find(some, layout, part)
        if reliable:
            probability[which] = _probabilities(found)
    return probability


def _parts(images: np.ndarray, layout: Layout, tool: ArrangementEstimator) -> list[Part]:
    """Which images are measured with which tool."""
    beyond = _is_beyond(images, tool)
    groups = ((np.flatnonzero(~beyond), tool), (np.flatnonzero(beyond), _unclipped(tool)))
    return [
        (which[part], some, stilled)
        for which, here in groups
        if which.size
        for part, some, stilled in _seen(_some(images, which), layout, here)
    ]


def _is_beyond(images: np.ndarray, tool: ArrangementEstimator) -> np.ndarray:
    """Which images go beyond the sensor's scale, bool (n,)."""
    most = full_scale(tool.noise)
    if np.isinf(most) or (images.min() >= 0 and images.max() <= most):
        return np.zeros(len(images), bool)
    used = tool.taken(images)
    return ((used < 0) | (used > most)).any(1)


def _some(images: np.ndarray, which: np.ndarray) -> np.ndarray:
    return images if which.size == len(images) else images[which]


def _seen(images: np.ndarray, layout: Layout, tool: ArrangementEstimator) -> list[Part]:
    """Which images show what: where the light is not known, the images tell which faces are dark.

    A vertex is free where a piece that ends there is seen; an image of a rigid arrangement tells which pieces are.
    """
    others = frozenset(tool.model.free.tolist()) - frozenset(tool.arrangement.required.ravel().tolist())
    if tool.is_lit or not others:
        return [(np.arange(len(images)), images, tool)]
    rigid = _stilled(tool, others)
    contrast, sigma = contrasts(rigid, find(rigid, images, partial(locate, rigid, layout)))
    seen, which = np.unique((np.abs(contrast) > SEEN * sigma).any(-1), axis=0, return_inverse=True)
    ends = tool.arrangement.pieces[tool.model.moving]
    groups = [np.flatnonzero(which.ravel() == number) for number in range(len(seen))]
    return [
        (group, _some(images, group), _stilled(tool, others - frozenset(ends[pattern].ravel().tolist())))
        for group, pattern in zip(groups, seen, strict=True)
    ]


@once
def _unclipped(tool: ArrangementEstimator) -> ArrangementEstimator:
    """For images that go beyond the sensor's scale: they were not recorded by it, and nothing was cut off."""
    noise = tool.noise
    return replace(tool, noise=noise.model_copy(update={"bits": None, "sigma": float(np.sqrt(noise.variance))}))


@once
def _stilled(tool: ArrangementEstimator, still: frozenset[int]) -> ArrangementEstimator:
    return replace(tool, still=still)


def _shape(images: np.ndarray, layout: Layout, tool: ArrangementEstimator) -> Shape:
    found, reliable = _find(images, layout, tool)
    ends = found.vertices[:, tool.arrangement.required]
    along = ends[:, :, 1] - ends[:, :, 0]
    lengths = np.maximum(np.linalg.norm(along, axis=-1), 1e-12)
    normals = np.stack([-along[..., 1], along[..., 0]], -1) / lengths[..., None]
    corners = found.vertices[:, tool.arrangement.corners]
    probability = _probabilities(found)
    contrast, edge_status = seen_edges(tool, layout, found)
    whole = _whole(tool, found, reliable)
    counted = _counted(tool, edge_status)
    state = _states(layout, normals, counted, whole)
    measured = np.isin(state, status.MEASURED)
    covariance = np.stack([_corners(tool, centre) for centre in found.centres])[found.centre]
    lines = np.stack([_lines(tool, centre) for centre in found.centres])[found.centre]
    count = np.full(edge_status.shape, tool.pixels.size)
    return Shape(
        corners=np.where(measured[:, None, None], corners, np.nan),
        covariance=np.where(measured[:, None, None], covariance, np.nan),
        normals=normals,
        points=ends[:, :, 0],
        lines=lines,
        status=state,
        whole=whole,
        edge_status=edge_status,
        counted=counted,
        edge_contrast=np.abs(contrast),
        used=count,
        rejected=np.zeros_like(count),
        p_value=probability,
    )


def _find(images: np.ndarray, layout: Layout, tool: ArrangementEstimator) -> tuple[Solutions, bool]:
    """What is found in the images, and whether it can be relied on.

    Judged where the light says the picture is, so that all images have one answer; else where the first one is that
    shows what the model says. Where the answer is no, the first image stands for all: of others nothing else is told.
    """
    here = partial(locate, tool, layout)
    first = find(tool, images[:1], here)
    told = tool.is_lit or bool(_shows(tool, layout, first)[0])
    if told and not _reliable(tool, first, 0):
        each = np.zeros(len(images), int)
        return first._replace(**{key: getattr(first, key)[each] for key in first._fields if key != "centres"}), False
    found = first if len(images) == 1 else find(tool, images, here, first.centres[0])
    good = np.flatnonzero(_shows(tool, layout, found))
    return found, bool(told or not good.size or _reliable(tool, found, good[0]))


def _reliable(tool: ArrangementEstimator, found: Solutions, number: int) -> bool:
    return _expected_reliable(tool) if tool.is_lit else is_reliable(tool, found.centres[found.centre[number]])


def _shows(tool: ArrangementEstimator, layout: Layout, found: Solutions) -> np.ndarray:
    """Whether each image shows all edges, and is what the model says, bool (n,)."""
    return _fits(found) & np.isin(seen_edges(tool, layout, found)[1], status.MEASURED).all(1)


def _fits(found: Solutions) -> np.ndarray:
    """Whether the model explains each image, bool (n,)."""
    return found.settled & (_probabilities(found) >= WORST)


def _shown(layout: Layout) -> np.ndarray:
    """Numbers of the required edges that are seen."""
    return np.flatnonzero(layout.visible & (layout.arrangement.required >= 0).all(1))


@once
def _only(
    tool: ArrangementEstimator, layout: Layout, shown: tuple[int, ...]
) -> tuple[ArrangementEstimator, Layout, np.ndarray]:
    """Tool and layout of some edges, and numbers of the corners between these."""
    some, corners = layout.only(np.array(shown))
    return replace(tool, arrangement=some.arrangement), some, corners


def _beside_hidden(images: np.ndarray, layout: Layout, tool: ArrangementEstimator, shown: np.ndarray) -> Shape:
    """Lines and corners of the edges that are seen, beside others that are not."""
    none = _nothing(len(images), layout)
    if not shown.size:
        return none
    part, some, corners = _only(tool, layout, tuple(shown))
    found = find_arranged(images, some, part)
    by_edge = {}
    for name in ("normals", "points", "edge_status", "counted", "edge_contrast", "used", "rejected"):
        by_edge[name] = getattr(none, name).astype(np.result_type(getattr(none, name), getattr(found, name)))
        by_edge[name][:, shown] = getattr(found, name)
    places = none.corners.copy()
    places[:, corners] = found.corners
    return replace(
        none, **by_edge, corners=places, whole=found.whole, p_value=found.p_value,
        covariance=_among(none.covariance, found.covariance, corners), lines=_among(none.lines, found.lines, shown),
    )  # fmt: skip


def _among(whole: np.ndarray, part: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Covariances (n, 2 k, 2 k) with those of some pairs, by their numbers."""
    rows = (2 * which[:, None] + [0, 1]).ravel()
    whole = whole.copy()
    whole[:, rows[:, None], rows] = part
    return whole


def _probabilities(found: Solutions) -> np.ndarray:
    freedom, scale = (np.array([getattr(c, key) for c in found.centres])[found.centre] for key in ("freedom", "scale"))
    return p_value(found.squares / scale, freedom)


@BLAS.wrap(limits=1)
def line_response(tool: ArrangementEstimator, layout: Layout, clean: np.ndarray) -> np.ndarray:
    """Derivative of the lines (displacement, rotation) by the pixels at the very solution of a noise-free image.

    Shape (2 E, height * width); NaN of edges that are not seen.
    """
    rows, shown = np.full((2 * len(layout.names), clean.size), np.nan), _shown(layout)
    if shown.size < len(layout.names):
        part = line_response(*_only(tool, layout, tuple(shown))[:2], clean)
        rows[(2 * shown[:, None] + [0, 1]).ravel()] = part
        return rows
    ((_, _, tool),) = _parts(clean[None], layout, tool)
    centre = locate(tool, layout, tool.taken(clean[None])[0], clean)
    rows[:] = 0.0
    rows[:, tool.pixels] = line_rows(tool, centre) @ tool.derivative(centre)
    return rows


def _counted(tool: ArrangementEstimator, edge_status: np.ndarray) -> np.ndarray:
    """Statuses of the edges as they count: what the light says is faint need not be seen."""
    faint = ~asked(tool) & np.isin(edge_status, [status.LOW_CONTRAST, status.SIGN_CHANGE])
    return np.where(faint, status.OK, edge_status)


def _states(layout: Layout, normals: np.ndarray, counted: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Status of each image."""
    pairs = np.array(layout.corners, int).reshape(-1, 2)
    first, second = normals[:, pairs[:, 0]], normals[:, pairs[:, 1]]
    sines = np.abs(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
    joint = np.where((sines < MIN_SINE).any(1), status.ILL_CONDITIONED, status.OK)
    each = np.concatenate([counted, np.stack([joint, whole], 1)], 1)
    return np.array([status.worst(*row) for row in each])


def _whole(tool, found: Solutions, reliable: bool) -> np.ndarray:
    """What is said of each image as a whole."""
    told = np.full(len(found.vertices), status.OK if reliable else status.ILL_CONDITIONED)
    rivalled = np.array([centre.rivalled for centre in found.centres])[found.centre]
    turned = np.where(_inverted(tool, found.vertices) | rivalled, status.AMBIGUOUS, status.OK)
    near = moved(tool, found.vertices) < FURTHEST
    fits = np.where(near & _fits(found), status.OK, status.MISFIT)
    runs = np.where(near, status.OK, status.LOW_CONTRAST)
    each = np.stack([told, turned, fits, runs], 1)
    return np.array([status.worst(*row) for row in each])


@once
def _expected_reliable(tool: ArrangementEstimator) -> bool:
    return is_reliable(tool, tool.reference)


def _inverted(tool: ArrangementEstimator, vertices: np.ndarray) -> np.ndarray:
    """Whether a face beside a required edge is turned inside out, (n,)."""
    arrangement = tool.arrangement
    beside = np.unique(arrangement.sides[arrangement.edges >= 0])
    found = np.zeros(len(vertices), bool)
    for region in beside[beside > 0]:
        found |= _area(arrangement, region, vertices) <= 0
    return found


def _area(arrangement, region: int, vertices: np.ndarray) -> np.ndarray:
    """Area of a region in the image, px^2, (n,)."""
    sign = (arrangement.sides[:, 0] == region).astype(float) - (arrangement.sides[:, 1] == region)
    a, b = (vertices[:, arrangement.pieces[:, end]] for end in (0, 1))
    inside = sign != 0
    return ((a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])[:, inside] * sign[inside]).sum(1) / 2


def _corners(tool: ArrangementEstimator, centre: Centre) -> np.ndarray:
    index = tool.index(tool.arrangement.corners)
    return centre.covariance[np.ix_(index, index)]


def _lines(tool: ArrangementEstimator, centre: Centre) -> np.ndarray:
    """Covariance of the required lines' displacements at their first ends, px, and rotations, rad, (2 E, 2 E)."""
    rows = line_rows(tool, centre)
    return rows @ centre.covariance @ rows.T


def line_rows(tool: ArrangementEstimator, centre: Centre) -> np.ndarray:
    """Their derivatives by the parameters, (2 E, q)."""
    rows = np.zeros((2 * len(tool.arrangement.required), len(centre.covariance)))
    for e, pair in enumerate(tool.arrangement.required):
        along = np.diff(centre.state.vertices[pair], axis=0)[0]
        size = np.linalg.norm(along)
        normal = np.array([-along[1], along[0]]) / size
        rows[2 * e, tool.index(pair[:1])] += normal
        for vertex, sign in zip(pair, (-1, 1), strict=True):
            rows[2 * e + 1, tool.index(np.array([vertex]))] += sign * normal / size
    return rows


def _nothing(count: int, layout: Layout) -> Shape:
    """No lines: of edges that are hidden, and of those that have darkness on both sides."""
    edges, corners = len(layout.names), len(layout.corners)
    none = np.zeros((count, edges), int)
    drawn = np.where((layout.arrangement.required >= 0).all(1), status.OK, status.LOW_CONTRAST)
    state = np.where(layout.visible, drawn, status.NOT_VISIBLE)
    return Shape(
        corners=np.full((count, corners, 2), np.nan),
        covariance=np.full((count, 2 * corners, 2 * corners), np.nan),
        normals=np.full((count, edges, 2), np.nan),
        points=np.full((count, edges, 2), np.nan),
        lines=np.full((count, 2 * edges, 2 * edges), np.nan),
        status=np.full(count, status.NOT_VISIBLE),
        whole=np.full(count, status.NOT_VISIBLE),
        edge_status=np.tile(state, (count, 1)),
        counted=np.tile(state, (count, 1)),
        edge_contrast=np.zeros((count, edges)),
        used=none,
        rejected=none,
        p_value=np.full(count, np.nan),
    )
