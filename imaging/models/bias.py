"""How far a classic locator's result is off without any noise, in closed form.

The zero crossing of the Gaussian second derivative is the edge's place only for a lone step between constant levels.
Another edge within a few px, shading, and the end of the sensor's scale move it, by amounts that the image model knows,
and with it the line through the crossings and the measurand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from imaging.blurred.boundaries import Boundaries, Places, boundaries_near
from imaging.blurred.clipped_step import clipped
from imaging.blurred.segment import Segments, second_and_third
from imaging.blurred.shadows import with_shadows
from imaging.features.demosaiced import line_shift
from imaging.features.locator import CLEARANCE, edge_blur
from imaging.features.measurand import Measurands, corner_response, measurands, normals
from imaging.features.projected_edges import edge_ends
from imaging.features.sampling import sampled_line
from imaging.geometry.blur import blur_in_focus, confusion
from imaging.geometry.lens import image_centre, lens_jacobian
from imaging.geometry.lens import recorded as recorded_at
from imaging.geometry.projection import depth, edge_points
from imaging.light.appearance import is_plain
from imaging.light.between import is_exchanged
from imaging.light.edge_sides import side_signals
from imaging.light.sheets import printed
from imaging.models.along import NODE_WEIGHTS, EdgeNodes, place_nodes, used_trims
from imaging.models.calibrated import calibrated
from imaging.models.texture import texture_errors
from imaging.pictures import Pictures
from imaging.sensor import recorded
from scenes import Corner, Scene

_BLOCK = 256  # pictures at a time, so that their places stay in the processor's cache
_FAR = 6.0  # standard deviations of the smoothed edge beyond which a boundary is not felt
_STEPS = 5  # of Newton's method
_LONGEST = 0.5  # px a step
_SETTLED = 1e-4  # px: the next step would be its square
MOST = 0.3  # standard deviations of the measurand: the largest bias of what is `ok`
NEGLIGIBLE = 0.25  # of the predicted ones, so that what the prediction leaves out stays below `MOST`
_FARTHEST = 0.25  # px that a crossing may be off: beyond, another one may be the steepest
_LOOKED = np.linspace(0.1, 0.9, 5)  # of an edge's length: where it is asked where its light comes from
_MOSTLY, _FELT, _CHANGES = 0.5, 0.05, 0.1  # parts of a side's light, and of the contrast, twice
_MOST_CONFUSION = 0.5  # px, radius: beyond, rendered edges are found some tenths of a standard deviation off
_JUMP = 0.2  # of the contrast, that neighbouring places on an edge may differ by
_STEEPER = 0.1  # by which the slope at the crossing may differ from a lone step's: the variance then does by a fifth


@dataclass(frozen=True, eq=False)
class Bias:
    """What is added to the result without noise, for pictures of leading shape (...).

    Attributes
    ----------
    values, values_object : ndarray, shape (..., M)
        Shift of each quantity in the image, px or degrees, and in the object, to first order; NaN where it is not
        known, for next to an edge's place there is no zero crossing. Circles count as unbiased.
    lines : ndarray, shape (..., E, 2)
        Displacement of each edge's line along its normal, at the edge's two ends, ideal px.
    corners : ndarray, shape (..., 2, 2)
        Shift of the first quantity's two features (x, y), ideal px; NaN for what is no corner.
    shares : ndarray, shape (..., M, E)
        What each edge adds to ``values``.
    disturbed : ndarray of bool, shape (..., E)
        Edges of which neither bias nor variance are to be trusted: somewhere along them the crossing is far off, or
        flatter or steeper than a lone step's, for errors by noise are divided by its slope; or the contrast jumps; or
        an obstacle is near; or a side's light from other faces is much or changes much.
    """

    values: np.ndarray
    values_object: np.ndarray
    lines: np.ndarray
    corners: np.ndarray
    shares: np.ndarray
    disturbed: np.ndarray

    @property
    def value(self) -> np.ndarray:
        """Of the first quantity in the image, shape (...)."""
        return self.values[..., 0]


def bias(pictures: Pictures) -> Bias:
    """Bias of the ``gradient`` locator (and nearly that of ``canny``), found once for each set of pictures."""
    return pictures.once("bias", lambda: _in_blocks(pictures))


def cluttered(pictures: Pictures) -> np.ndarray:
    """Which edges have the status ``clutter``, bool, shape (..., E): the one rule of planner and measurement.

    What lies around the edge disturbs its crossings, a cone of light that is so wide is partly taken by what is beside
    it, or a quantity's bias is above a quarter of its standard deviation and the edge's share in it is no less than an
    equal one.
    """
    found = bias(pictures)
    limit = NEGLIGIBLE * np.sqrt(calibrated(pictures).variances)
    equal = np.maximum(measurands(pictures).depends()[:, : found.shares.shape[-1]].sum(-1), 1)
    with np.errstate(invalid="ignore"):
        biased = np.abs(found.values) > limit
        large = np.abs(found.shares) >= (limit / equal)[..., None]
    return found.disturbed | _defocused(pictures) | (biased[..., None] & large).any(-2)


def _defocused(pictures: Pictures) -> np.ndarray | bool:
    """Which edges have an end whose circle of confusion is wide, bool, shape (..., E)."""
    scene = pictures.scene
    if scene.camera.aperture_radius == 0:
        return False
    away = depth(edge_ends(scene, measurands(pictures).view.names), pictures.sensors, scene.camera)
    wide = confusion(scene.camera, away) > _MOST_CONFUSION
    return wide.reshape(*wide.shape[:-1], -1, 2).any(-1)


def _in_blocks(pictures: Pictures) -> Bias:
    lead = np.broadcast_shapes(*(poses.shape[:-1] for poses in (pictures.sensors, *pictures.lights)))
    flat = [np.broadcast_to(poses, (*lead, 2)).reshape(-1, 2) for poses in (pictures.sensors, *pictures.lights)]
    parts = []
    for first in range(0, max(len(flat[0]), 1), _BLOCK):
        sensors, *lights = (poses[first : first + _BLOCK] for poses in flat)
        with np.errstate(all="ignore"):
            parts.append(_bias(pictures.at(sensors, tuple(lights))))
    whole = {each.name: np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Bias)}
    return Bias(**{name: values.reshape((*lead, *values.shape[1:])) for name, values in whole.items()})


def _bias(pictures: Pictures) -> Bias:
    """For pictures with one leading axis."""
    known = measurands(pictures)
    if not known.view.names:
        return _nothing(np.broadcast_shapes(pictures.sensors.shape, *(p.shape for p in pictures.lights))[0], known)
    nodes = place_nodes(pictures, known.view, used_trims(pictures, known.view, trimmed=True))
    moved, steepness = _crossings(pictures, nodes, normals(known.view))
    mean = moved @ NODE_WEIGHTS / 2
    turn = 6 / nodes.length[..., 0] ** 2 * ((moved * nodes.t[..., 1:-1]) @ NODE_WEIGHTS)
    by_pixels = _sampled(pictures, nodes)
    mean, turn = mean + by_pixels[0], turn + by_pixels[1]
    start = mean - turn * nodes.middle[..., 0]
    by_prints = _by_prints(pictures)
    start, turn = start + by_prints[0], turn + by_prints[1]
    shares, shares_object = (
        offset * start[..., None, :] + tilt * turn[..., None, :]
        for offset, tilt in (known.of_lines(known.gradient), known.of_lines(_in_object(pictures, known)))
    )
    lines = np.stack([start, start + turn * known.view.lengths], -1)
    needed = known.depends()[:, : len(known.view.names)] | [name in known.datums for name in known.view.names]
    values, values_object = (np.where(needed, each, 0.0).sum(-1) for each in (shares, shares_object))
    disturbed = ~((np.abs(steepness - 1) <= _STEEPER) & (np.abs(moved) <= _FARTHEST)).all(-1)
    disturbed |= by_prints[2]
    if pictures.closely and is_exchanged(pictures.scene):
        disturbed |= _by_other_faces(pictures, known.view.names)
    corners = _corners(pictures.scene, known.view, lines)
    return Bias(values, values_object, lines, corners, shares, disturbed)


def _in_object(pictures: Pictures, known: Measurands) -> np.ndarray:
    """Derivatives (N, M, q) of the values in the object by the lines, the part's place adjusted where it is not known:
    a bias of the datums moves them too."""
    return known.gradient_object if known.placing is None else calibrated(pictures.glanced).gradient_object


def _by_prints(pictures: Pictures) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement and rotation of each line by images on faces, and where that is not to be trusted, (N, E) each."""
    edges, parts = len(measurands(pictures).view.names), []
    lead = np.broadcast_shapes(*(poses.shape[:-1] for poses in (pictures.sensors, *pictures.lights)))
    if not printed(pictures.scene):
        return np.zeros((*lead, edges)), np.zeros((*lead, edges)), np.zeros((*lead, edges), bool)
    poses = [np.broadcast_to(each, (*lead, 2)) for each in (pictures.sensors, *pictures.lights)]
    for sensor, *lights in zip(*poses, strict=True):
        found = texture_errors(pictures.at(sensor, tuple(lights)))
        parts.append((found.printed[0::2], found.printed[1::2], found.disturbed))
    return tuple(np.array(part) for part in zip(*parts, strict=True))


def _by_other_faces(pictures: Pictures, names: tuple[str, ...]) -> np.ndarray:
    """Edges whose light from other faces is known too roughly for a bias, bool (N, E).

    A side has most of its light from there, or it changes much along the edge, as it does beside a corner.
    """
    points = edge_points(pictures.scene.solid, names, _LOOKED)
    glanced = Pictures(pictures.scene, pictures.sensors, pictures.lights)
    whole, direct = (side_signals(each, names, points) for each in (pictures, glanced))
    lent = whole - direct
    contrast = np.abs(whole[..., 1, :] - whole[..., 0, :])[..., None, :]
    mostly = ((lent > _MOSTLY * whole) & (lent > _FELT * contrast)).any((-1, -2))
    return mostly | (np.ptp(lent, -1) > _CHANGES * contrast.mean(-1)).any(-1)


def _nothing(count: int, known: Measurands) -> Bias:
    """Of ``count`` pictures in which no straight edge is needed."""
    quantities = len(known.quantities)
    none, lines, corners = np.zeros((count, quantities)), np.zeros((count, 0, 2)), np.full((count, 2, 2), np.nan)
    return Bias(none, none, lines, corners, np.zeros((count, quantities, 0)), np.zeros((count, 0), bool))


def _corners(scene: Scene, view, lines: np.ndarray) -> np.ndarray:
    """Shifts (N, 2, 2) of both corners from the displacements (N, E, 2) of the lines at the edges' ends."""
    found = np.full((len(lines), 2, 2), np.nan)
    for k, feature in enumerate(scene.quantities[0].features[:2]):
        if isinstance(feature, Corner):
            index = [view.names.index(name) for name in feature.edges]
            vertex = scene.solid.vertex_names.index(feature.vertex)
            end = [scene.solid.edge(name).ends.index(vertex) for name in feature.edges]
            found[:, k] = np.einsum("nij,nj->ni", corner_response(normals(view)[:, index]), lines[:, index, end])
    return found


def _sampled(pictures: Pictures, nodes: EdgeNodes) -> tuple[np.ndarray, np.ndarray]:
    """Mean shift, ideal px, and turn of each line by the sampling, (N, E); a bent edge is taken as its tangent."""
    scene, view = pictures.scene, measurands(pictures).view
    fraction = nodes.middle / view.lengths[..., None]
    middle = view.ends[..., 0, :] + fraction * view.along
    along = np.einsum("...ij,...j->...i", lens_jacobian(middle, scene.camera), view.along)
    size = np.linalg.norm(along, axis=-1)
    length = nodes.length[..., 0] * size / view.lengths
    there, scale = recorded_at(middle, scene.camera), scene.locator.scale_px
    tangent = along / size[..., None]
    mean, turn = sampled_line(there, tangent, length, blur_in_focus(scene.camera, there), scale)
    mixed, mixed_turn = line_shift(scene.noise.colour, there, tangent, length, scene.camera.blur_px, scale)
    across = np.broadcast_to(nodes.across, nodes.t.shape).mean(-1)
    return (mean + mixed) * across, (turn + mixed_turn) * across * size / view.lengths


def _crossings(pictures: Pictures, nodes: EdgeNodes, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place of the zero crossing across the edge, ideal px, and the slope there over the lone step's, (N, E, n)."""
    scene, view = pictures.scene, measurands(pictures).view
    fractions = (nodes.middle + nodes.t[..., 1:-1]) / view.lengths[..., None]
    shape, scale = fractions.shape, scene.locator.scale_px
    blur = np.broadcast_to(edge_blur(nodes.blur), nodes.t.shape)[..., 1:-1].ravel()
    width = np.hypot(blur, scale)
    widest = float(np.nanmax(width, initial=0.0))
    near = boundaries_near(pictures, _places(pictures, fractions, normal), _FAR * widest, CLEARANCE * widest)
    if pictures.closely and not is_plain(scene):
        image = view.ends[..., :1, :] + fractions[..., None] * view.along[..., None, :] - image_centre(scene.camera)
        near = with_shadows(near, pictures, image, np.broadcast_to(normal[..., None, :], image.shape), _FAR * widest)
    contrast = np.zeros(width.size)
    levels = recorded(scene.noise, scene.noise.dark_level + near.sides[near.own]).level
    contrast[near.place[near.own]] = levels[:, 1] - levels[:, 0]
    uneven = _uneven(contrast.reshape(shape)).ravel() & (not is_plain(scene))
    moved, slope = _zero(near, width, clipped(scene.noise, near, blur, scale))
    steepness = np.where(near.unknown | uneven, np.nan, -slope / contrast * (np.sqrt(2 * np.pi) * width**3))
    wrong = ~(np.abs(moved) < scene.locator.window_px) | ~(steepness > 0)
    across = np.broadcast_to(nodes.across, nodes.t.shape)[..., 1:-1]
    return np.where(wrong, np.nan, moved).reshape(shape) * across, steepness.reshape(shape)


def _uneven(contrast: np.ndarray) -> np.ndarray:
    """Places (..., n) along edges between which and a neighbour the contrast jumps: a shadow ends there, or another
    thing is seen past the edge, at a place between them that nothing tells."""
    apart = np.abs(np.diff(contrast)) > _JUMP * np.maximum(np.abs(contrast[..., 1:]), np.abs(contrast[..., :-1]))
    found = np.zeros(contrast.shape, bool)
    found[..., 1:] |= apart
    found[..., :-1] |= apart
    return found


def _zero(near: Boundaries, width: np.ndarray, cut_off: Callable | None) -> tuple[np.ndarray, np.ndarray]:
    """By Newton's method the move (M,), px, at which each place's second derivative is 0, and its slope there."""
    moved, slope, live = np.zeros(width.size), np.zeros(width.size), np.ones(width.size, bool)
    for _ in range(_STEPS):
        rows = np.flatnonzero(live[near.place])
        place = near.place[rows]
        parts = second_and_third(Segments(*(part[rows] for part in near.segments)), moved[place], width[place])
        value, steep = (np.bincount(place, part, width.size) for part in parts)
        if cut_off is not None:
            value, steep = (a + b for a, b in zip((value, steep), cut_off(moved), strict=True))
        slope[live] = steep[live]
        step = np.where(live, np.clip(value / steep, -_LONGEST, _LONGEST), 0.0)
        moved = moved - step
        live = np.abs(step) > _SETTLED
        if not live.any():
            break
    return moved, slope


def _places(pictures: Pictures, fractions: np.ndarray, normal: np.ndarray) -> Places:
    """The nodes as places of the recorded image; ``normal`` (N, E, 2) is that of the edges' ideal images."""
    camera, view = pictures.scene.camera, measurands(pictures).view
    lens = lens_jacobian(view.ends[..., :1, :] + fractions[..., None] * view.along[..., None, :], camera)
    normal = np.broadcast_to(normal[..., None, :], lens.shape[:-1])
    if camera.lens.bends:
        tangent = np.einsum("...ij,...j->...i", lens, np.stack([normal[..., 1], -normal[..., 0]], -1))
        tangent = tangent / np.linalg.norm(tangent, axis=-1, keepdims=True)
        normal = np.stack([-tangent[..., 1], tangent[..., 0]], -1)
    tangent = np.stack([normal[..., 1], -normal[..., 0]], -1)
    return Places(view.names, fractions, np.stack([tangent, normal], -2), lens)
