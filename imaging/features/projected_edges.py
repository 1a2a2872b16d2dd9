"""The required edges as the sensor sees them: ends, lengths, and the part of each edge that can be measured.

Near a corner another edge disturbs the locator, so an edge is trimmed until its neighbours are `locator.reach`
away: reach / sin(angle) along the edge where the neighbour is long, else until its far end is so far away, or reach
itself where the neighbour turns away. Where another part of the object hides a piece of an edge, its longest free piece
is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.features.locator import reach
from imaging.geometry.lens import image_centre, recorded
from imaging.geometry.projection import divisor, facing, from_axis
from imaging.geometry.visibility import boundaries, longest_span, turned
from imaging.pictures import Pictures
from scenes import Centre, Corner, Edge, Scene, Solid, Wall
from scenes.measurands.features import place_of
from scenes.measurands.form import forms_of
from scenes.measurands.kinds import MEASURANDS


@dataclass(frozen=True, eq=False)
class ProjectedEdges:
    """Images of E straight edges for sensor poses of leading shape (...).

    Attributes
    ----------
    names : tuple of str
        Edge names.
    ends, recorded : ndarray, shape (..., E, 2, 2)
        The two end points (x, y), px: in ideal coordinates, where edges are straight, and where they are recorded.
    along : ndarray, shape (..., E, 2)
        From the first end to the last, px; exact too where it is small against the image.
    trims : ndarray, shape (..., E, 2)
        Length to leave out at each end, px: what is hidden, and what a neighbouring edge disturbs.
    framed : ndarray, shape (..., E, 2)
        The same, and what lies outside the image or too near to its border for the locator's window.
    shown : ndarray, shape (..., E, 2)
        The longest piece of each edge that the sensor sees, as fractions (from, to) of the image's length; (0, 0)
        where it sees nothing of it. `visibility.visible_spans` gives all pieces.
    visible : ndarray of bool, shape (..., E)
        Whether the sensor sees a piece of the edge and a face of it.
    """

    names: tuple[str, ...]
    ends: np.ndarray
    recorded: np.ndarray
    along: np.ndarray
    trims: np.ndarray
    framed: np.ndarray
    shown: np.ndarray
    visible: np.ndarray

    @property
    def lengths(self) -> np.ndarray:
        """Length of each edge's image, px, shape (..., E)."""
        return np.linalg.norm(self.along, axis=-1)

    @property
    def usable(self) -> np.ndarray:
        """Length that is left within the image after trimming, px, shape (..., E); not positive where nothing is."""
        return self.lengths - self.framed.sum(-1)


def straight(scene: Scene) -> tuple[str, ...]:
    """The different straight edges that the scene's quantities need, in their order."""
    rims = set(circles(scene))
    names = (name for feature in scene.features for name in feature.edges)
    return tuple(dict.fromkeys(name for name in names if name not in rims))


def circles(scene: Scene) -> tuple[str, ...]:
    """The different circles and curved surfaces that they need."""
    return tuple(dict.fromkeys(place_of(feature) for feature in scene.features if isinstance(feature, Centre | Wall)))


def lines_alone(scene: Scene) -> bool:
    """Whether straight edges' lines tell all quantities, to first order."""
    extreme = any(MEASURANDS[each.kind].extreme for each in scene.quantities)
    return not circles(scene) and not forms_of(scene.quantities) and not extreme


def corner_features(scene: Scene) -> tuple[Corner, ...]:
    """The different corners of all quantities."""
    return tuple(dict.fromkeys(feature for feature in scene.features if isinstance(feature, Corner)))


def projected_edges(pictures: Pictures, names: tuple[str, ...] | None = None) -> ProjectedEdges:
    """Project edges and decide how much of each can be measured; found once for each set of pictures.

    Parameters
    ----------
    pictures : Pictures
        Their lights do not matter.
    names : tuple of str, optional
        Edges; the straight ones that the scene's quantities need when not given.
    """
    names = straight(pictures.scene) if names is None else names
    return pictures.once(("edges", names), lambda: _project(pictures, names))


def _project(pictures: Pictures, names: tuple[str, ...]) -> ProjectedEdges:
    scene, solid, sensors, view = pictures.scene, pictures.scene.solid, pictures.sensors, pictures.viewpoint
    seen = facing(solid, view)
    edges = [solid.edge(name) for name in names]
    needed, clear, lead = (
        _near(solid, edges),
        reach(scene.locator.scale_px, scene.camera.most_blur_px),
        sensors.shape[:-1],
    )
    corners = dict(
        zip(needed, np.moveaxis(from_axis(solid.vertices[needed], sensors, scene.camera), -2, 0), strict=True)
    )
    trims = [np.stack([_trim(solid, e, end, corners, seen, clear) for end in (0, 1)], -1) for e in edges]
    ends = _stack([np.stack([corners[end] for end in e.ends], -2) for e in edges], lead, (2, 2))
    trims = _stack(trims, lead, (2,))
    shown = image_fractions(
        scene, names, sensors, _stack([longest_span(scene.bodies, e, view) for e in edges], lead, (2,))
    )
    along = ends[..., 1, :] - ends[..., 0, :]
    lengths, ends = np.linalg.norm(along, axis=-1), ends + image_centre(scene.camera)
    if not scene.bodies.is_convex:
        trims = cut(trims, shown, lengths, clear)
    bent = recorded(ends, scene.camera)
    return ProjectedEdges(
        names=names,
        ends=ends,
        along=along,
        trims=trims,
        recorded=bent,
        framed=cut(trims, within_image(scene, bent), lengths, 0.0),
        shown=shown,
        visible=_stack([turned(scene.bodies, edge, view).any(-1) for edge in edges], lead, ()).astype(bool)
        & (shown[..., 1] > 0)
        & np.isfinite(bent).all((-1, -2)),
    )


def cut(trims: np.ndarray, shown: np.ndarray, lengths: np.ndarray, clear: float) -> np.ndarray:
    """Trims (..., 2) enlarged so that only the shown fractions of the image's length, less ``clear`` px, are left."""
    hidden = np.stack([shown[..., 0], 1 - shown[..., 1]], -1)
    return np.where(hidden > 0, np.maximum(trims, hidden * lengths[..., None] + clear), trims)


def within_image(scene: Scene, ends: np.ndarray) -> np.ndarray:
    """Part of each edge's image, ends (..., E, 2, 2), where the locator's window fits into the image.

    Fractions (from, to) of the length, shape (..., E, 2); (1, 0) where none is left.
    """
    margin = scene.locator.window_px + 4 * scene.locator.scale_px + 1
    size = np.array([scene.camera.width, scene.camera.height])
    start, along = ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        low, high = (margin - start) / along, (size - 1 - margin - start) / along
    inside = (start >= margin) & (start <= size - 1 - margin)
    still = along == 0
    enter = np.where(still, np.where(inside, 0.0, 1.0), np.minimum(low, high)).max(-1)
    leave = np.where(still, np.where(inside, 1.0, 0.0), np.maximum(low, high)).min(-1)
    found = np.stack([np.clip(enter, 0, 1), np.clip(leave, 0, 1)], -1)
    return np.where(found[..., :1] < found[..., 1:], found, np.array([1.0, 0.0]))


def image_fractions(scene: Scene, names: tuple[str, ...], sensors: np.ndarray, spatial: np.ndarray) -> np.ndarray:
    """Fractions of each edge's IMAGE length from fractions (..., E, n) of its length in space."""
    near, far = end_divisors(scene, names, sensors)
    with np.errstate(divide="ignore", invalid="ignore"):
        return spatial * far / (near + spatial * (far - near))


def end_divisors(scene: Scene, names: tuple[str, ...], sensors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`divisor` at both ends of each edge, scene units, each (..., E, 1)."""
    found = divisor(edge_ends(scene, names), sensors, scene.camera).reshape(*sensors.shape[:-1], len(names), 2)
    return found[..., :1], found[..., 1:]


def edge_ends(scene: Scene, names: tuple[str, ...]) -> np.ndarray:
    """Both ends of edges, one after the other, scene units, shape (2 E, 3)."""
    return np.array([scene.solid.vertices[list(scene.solid.edge(name).ends)] for name in names]).reshape(-1, 3)


def _stack(arrays: list, lead: tuple[int, ...], tail: tuple[int, ...]) -> np.ndarray:
    """Arrays (*lead, *tail) of E edges as one, (*lead, E, *tail), also of none."""
    return np.stack(arrays, len(lead)) if arrays else np.empty((*lead, 0, *tail))


def _near(solid: Solid, wanted: list[Edge]) -> np.ndarray:
    """The vertices of the wanted edges and of those that share a vertex with them."""
    ends = {end for edge in wanted for end in edge.ends}
    return np.array(sorted({other for end in ends for edge in solid.meeting[end] for other in edge.ends}), int)


def _trim(solid: Solid, edge: Edge, end: int, corners: dict, seen: np.ndarray, clear: float):
    """Length to leave out at one end of an edge, shape (...)."""
    here, far = edge.ends[end], edge.ends[1 - end]
    along = corners[far] - corners[here]
    trim = np.full(along.shape[:-1], clear)
    for other in solid.meeting[here]:
        if other is edge:
            continue
        aside = corners[other.ends[1 - other.ends.index(here)]] - corners[here]
        needed = np.fmax(trim, trim_beside(along, aside, clear))
        trim = np.where(boundaries(solid, (other,), seen)[..., 0], needed, trim)
    return trim


def trim_beside(along: np.ndarray, aside: np.ndarray, clear: float) -> np.ndarray:
    """Length to leave out at the end of an edge so that another one that starts there is so far away, shape (...).

    Parameters
    ----------
    along, aside : ndarray, shape (..., 2)
        From the corner to the other ends of the edge and of its neighbour, px.
    clear : float
        px

    Examples
    --------
    >>> long, short = np.array([60.0, 80.0]), np.array([0.6, 0.8])
    >>> np.round([trim_beside(np.array([90.0, 0.0]), each, 4.0) for each in (long, short, -long)], 3).tolist()
    [5.0, 4.519, 4.0]
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        unit = along / np.linalg.norm(along, axis=-1, keepdims=True)
        ahead = np.einsum("...i,...i->...", unit, aside)
        apart = np.abs(unit[..., 0] * aside[..., 1] - unit[..., 1] * aside[..., 0])
        size = np.hypot(ahead, apart)
        beside = clear * ahead <= size * apart  # it is nearest beside it, not at its far end
        past = ahead + np.sqrt(np.maximum(clear**2 - apart**2, 0.0))
        return np.where(ahead > 0, np.where(beside, clear * size / apart, past), clear)
