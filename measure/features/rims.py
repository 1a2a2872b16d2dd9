"""Circles in images: edge points along the rim of a circle in its known plane, and the circle through them.

The pose tells the circle's plane, so that three numbers are sought: two shifts of the centre in that plane and the
change of the radius. The centre so found is the circle's own, not that of the ellipse which is its image.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import sparse

from imaging.features.circles import HALF, LEAST_CLEAR, LEAST_SEEN
from imaging.features.locator import MIN_CONTRAST, MOST_PLACES, SPACING, edge_blur, reach
from imaging.features.rim_look import RimLook, look, places_around
from imaging.features.rim_outline import facets, smooth_outline
from imaging.features.rim_sides import clearance, outward_normals, seen_along, within_ends
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import project_ideal
from imaging.pictures import Pictures
from measure.estimators.gradient import gradient_along
from measure.features.limbs import limb_tool
from measure.features.optics import Optics
from measure.features.points import EachPoint
from measure.features.rim_fit import Curve
from measure.features.rim_noise import Drawn, Stack, drawn, is_linear
from measure.features.tools import RimTool, held
from scenes import Circle, Curved, Picture, status

_FINER = 3  # times as many on an arc
_GRID = 0.25  # px to which a new expectation is rounded, so that images can share it
_PASSES = 6


@dataclass(frozen=True, eq=False)
class Circles:
    """One circle in n images.

    Attributes
    ----------
    errors : ndarray, shape (n, p)
        Shifts of the centre along the plane's two axes (`Circle.axes`) and change of the radius;
        of a curved surface those of `Curved.parameters`, of a cone four.
    covariance : ndarray, shape (n, p, p)
    state : ndarray of str, shape (n,)
    near : ndarray of bool, shape (n,)
        Whether so many points are found that the circle must be where they say, or near it.
    """

    errors: np.ndarray
    covariance: np.ndarray
    state: np.ndarray
    near: np.ndarray


def find_circle(images: np.ndarray, picture: Picture, name: str) -> Circles:
    """A circle or a curved surface of the object in images (n, height, width)."""
    return _find(Stack(images.reshape(len(images), -1)), picture, name, unmoved(picture, name), _PASSES)


def circle_response(clean: np.ndarray, picture: Picture, name: str) -> sparse.csr_array:
    """Derivative of the circle's p parameters by the pixels of a noise-free image, (p, height * width)."""
    moved = unmoved(picture, name)
    for _ in range(_PASSES):
        tool = rim_tool(picture, name, moved)
        points, response = tool.locator.respond_each(clean)
        fit, errors, used = tool.fitted(points)
        if not tool.is_far(errors)[0]:
            break
        moved = _rounded(tool, np.array(moved) + errors[0])
    taken = used[0] & (tool.weights > 0)
    return sparse.csr_array(fit[0][:, taken]) @ response[np.flatnonzero(taken)]


def tells_errors(response: sparse.csr_array, clean: np.ndarray, picture: Picture, name: str) -> bool:
    """Whether a circle's errors by noise are those that its derivative tells (`measure.features.rim_noise`).

    Parameters
    ----------
    response : csr_array, shape (p, height * width)
        That of `circle_response`.
    clean : ndarray, shape (height, width)
        The noise-free image, in which the circle is found.
    picture : Picture
    name : str
    """
    pixels = np.union1d(response.indices, rim_tool(picture, name, unmoved(picture, name)).locator.pixels)
    here, linear, full, found = find_circle(clean[None], picture, name).errors, [], [], []
    for images in drawn(clean, pixels, Optics.of(picture.scene)):
        each = _find(images, picture, name, unmoved(picture, name), _PASSES)
        linear.append(images.first_order(response))
        full.append(each.errors - here)
        found.append(np.isin(each.state, status.MEASURED))
    return is_linear(*map(np.concatenate, (linear, full, found)))


def nearest_tools(picture: Picture, name: str, found: Circles) -> list[tuple[RimTool, np.ndarray, np.ndarray] | None]:
    """Of each image the tool by which a circle was found in it, the errors (p,) at which that expects it, and how far
    it was found from there; None where it was not found."""
    tools: list[tuple[RimTool, np.ndarray, np.ndarray] | None] = []
    for errors in found.errors:
        if not np.isfinite(errors).all():
            tools.append(None)
            continue
        moved = unmoved(picture, name)
        tool = rim_tool(picture, name, moved)
        if tool.is_far(errors[None])[0]:
            moved = _rounded(tool, errors)
            tool = rim_tool(picture, name, moved)
        tools.append((tool, np.array(moved), errors - np.array(moved)))
    return tools


def unmoved(picture: Picture, name: str) -> tuple[float, ...]:
    each = picture.scene.solid.round(name)
    return (0.0,) * (each.count if isinstance(each, Curved) else 3)


def _find(images: Stack | Drawn, picture: Picture, name: str, moved: tuple[float, ...], passes: int) -> Circles:
    """From a circle expected at some errors; images in which it is elsewhere are measured again from there."""
    tool = rim_tool(picture, name, moved)
    found = _measured(images, tool)
    found = replace(found, errors=found.errors + np.array(moved))
    far = found.near & tool.is_far(found.errors - np.array(moved))
    if not far.any():
        return found
    if passes == 0:
        return replace(found, state=np.where(far, status.LOW_CONTRAST, found.state))
    errors, covariance, state = found.errors.copy(), found.covariance.copy(), found.state.astype(object)
    keys = np.array([_rounded(tool, row) for row in found.errors[far]])
    for key in np.unique(keys, axis=0):
        which = np.flatnonzero(far)[(keys == key).all(1)]
        again = _find(images[which], picture, name, tuple(key.tolist()), passes - 1)
        errors[which], covariance[which], state[which] = again.errors, again.covariance, again.state
    return Circles(errors, covariance, state.astype(str), found.near)


def _measured(images: Stack | Drawn, tool: RimTool) -> Circles:
    count, numbers = len(images), tool.design.shape[1]
    if tool.state not in status.MEASURED:
        return Circles(
            np.full((count, numbers), np.nan),
            np.full((count, numbers, numbers), np.nan),
            np.full(count, tool.state),
            np.zeros(count, bool),
        )
    used = images.at(tool.locator.pixels)
    points = tool.locator.locate_each_in(used)
    fit, errors, _ = tool.fitted(points)
    return Circles(errors, _covariance(used, tool, fit, points), *tool.states(points, errors))


def _covariance(used: np.ndarray, tool: RimTool, fit: np.ndarray, points: EachPoint) -> np.ndarray:
    """Covariance (n, p, p) at the contrast that images of pixels (n, P) show each."""
    rows = tool.noise_rows(fit, points).reshape(-1, fit.shape[-1]) @ tool.response
    rows, variance = tool.optics.independent(rows.reshape(len(used), fit.shape[1], -1), tool.locator.pixels, used)
    variance = variance if isinstance(variance, float) else variance[:, None]
    return np.einsum("nip,njp->nij", rows * variance, rows)


def _rounded(tool: RimTool, errors: np.ndarray) -> tuple[float, ...]:
    """Errors to about `_GRID` px."""
    step = _GRID / np.abs(tool.design).max()
    return tuple((np.round(errors / step) * step).tolist())


@lru_cache(maxsize=256)
def rim_tool(picture: Picture, name: str, moved: tuple[float, ...]) -> RimTool:
    """What measures a circle or a curved surface of the object, expected with some errors."""
    scene, solid = picture.scene, picture.scene.solid
    if isinstance(solid.round(name), Curved):
        return limb_tool(picture, solid.round(name), moved)
    optics, pictures = Optics.of(scene), Pictures.of(picture)
    nominal = solid.circle(name)
    angle = nominal.angles(_places(pictures, nominal, optics))
    circle = _with_errors(nominal, moved)
    one, two = circle.axes
    radial = circle.spokes(angle)
    spokes = radial * (circle.radius * facets(solid, nominal, angle))[:, None]
    ideal = project_ideal(circle.centre + spokes, pictures.sensors, scene.camera)
    normal, slope, speed = outward_normals(pictures, circle, angle)
    across, along = (np.einsum("ni,nij->nj", each, slope) for each in (normal, normal[:, ::-1] * [-1, 1]))
    design = np.stack([across @ one, across @ two, (across * radial).sum(-1)], -1)
    places, gradient = optics.recorded(ideal), optics.gradient(ideal, normal)
    size = np.linalg.norm(gradient, axis=-1)
    width = np.hypot(optics.scale_px, edge_blur(optics.blur_at(places))) * size
    inward = -smooth_outline(pictures, circle, ideal - image_centre(scene.camera), normal, width)
    seen = look(pictures, nominal).at(angle) if pictures.lights else None
    if seen is not None:
        inward = inward - seen.shift
    arc = speed * nominal.turn / angle.size
    weight, state = _weights(pictures, nominal, angle, places, arc, optics, seen)
    taken = (weight > 0) & np.isfinite(inward)
    keep = np.flatnonzero(taken) if taken.any() else np.arange(1)
    weight, inward = np.where(taken, weight, 0.0), np.nan_to_num(inward)
    curve = Curve(
        held(places[keep], optics), (gradient / size[:, None])[keep], size[keep],
        np.stack([along @ one, along @ two], -1)[keep], (design[:, 2] * circle.radius / (2 * speed**2))[keep],
    )  # fmt: skip
    told = None if seen is None else np.sqrt(seen.squared)[keep]
    signs = None if seen is None else np.where(seen.brightens, 1.0, -1.0)[keep]
    locator = gradient_along(optics, angle[keep], curve.places, curve.normals, curve.gain, signs=signs)
    clear = None if seen is None or state != status.OK else seen.share[keep] >= HALF
    return RimTool(design[keep], weight[keep], inward[keep], state, optics, curve, told, locator=locator,
                   places=curve.places, clear=clear)  # fmt: skip


def _places(pictures: Pictures, circle: Circle, optics: Optics) -> int:
    """How many places there are on a rim; on an arc as many as are looked at.

    The variance of an arc's radius goes as its length to the power of -5, so that it must begin and end where it is
    predicted to, within a small part of `SPACING`.
    """
    if circle.ends is None:
        return places_around(pictures, circle, SPACING * optics.scale_px, MOST_PLACES)
    if pictures.lights:
        return look(pictures, circle).shift.size
    return places_around(pictures, circle, SPACING / _FINER * optics.scale_px, MOST_PLACES)


def _with_errors(circle: Circle, errors: tuple[float, ...]) -> Circle:
    one, two = circle.axes
    return replace(circle, centre=circle.centre + errors[0] * one + errors[1] * two, radius=circle.radius + errors[2])


def _weights(
    pictures: Pictures, circle: Circle, angle: np.ndarray, places: np.ndarray, arc: np.ndarray, optics: Optics,
    seen: RimLook | None,
) -> tuple[np.ndarray, str]:  # fmt: skip
    """Weights of places (m,), 0 where they are not taken, and the status that this makes.

    The rules are those of `imaging.features.circles`.
    """
    margin = optics.window_px + 4 * optics.scale_px + 1
    inside = ((places >= margin) & (places <= np.array(optics.shape[::-1]) - 1 - margin)).all(-1)
    turn, off_ends = circle.turn / (2 * np.pi), within_ends(pictures, circle, angle)
    if turn * off_ends.mean() < LEAST_SEEN:
        return np.zeros(off_ends.size), status.SHORT
    shown = inside & off_ends & seen_along(pictures, circle, angle)
    if turn * shown.mean() < LEAST_SEEN:
        return np.zeros(shown.size), status.NOT_VISIBLE
    if seen is None:
        strong, weight = shown, arc
        known = 1.0 * (clearance(pictures, circle, angle) >= reach(optics.scale_px, optics.most_blur_px))
    else:
        strong = shown & (seen.squared >= MIN_CONTRAST**2 * seen.noise_variance)
        weight, known = arc * seen.squared / seen.noise_variance, seen.share
        if turn * strong.mean() < LEAST_SEEN:
            return np.zeros(shown.size), status.LOW_CONTRAST
    part = (strong & (known >= HALF)).mean()
    if part < LEAST_CLEAR * max(strong.mean(), LEAST_CLEAR) or turn * part < LEAST_SEEN:
        return np.where(strong, weight, 0.0), status.CLUTTER
    return np.where(strong, known * weight, 0.0), status.OK
