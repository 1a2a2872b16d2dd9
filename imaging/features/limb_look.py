"""What pictures show along a limb, and what the locator finds there: the levels on both sides, no step between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from imaging import sensor
from imaging.contours.shading import Profile, fitted
from imaging.features.demosaiced import place_shifts
from imaging.features.limb_lent import unlent, unlent_by_faces
from imaging.features.limb_locator import box_cumulant, limb_crossing
from imaging.features.limb_outline import LimbOutline, clear_of_ends, framed
from imaging.features.locator import edge_blur, reach
from imaging.features.rim_sides import RIM_POINTS, steady, to_curve
from imaging.features.sampling import sampled_places
from imaging.geometry.blur import blur_in_focus
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import from_axis, ray_origins, rays
from imaging.geometry.rays import first_face
from imaging.light.appearance import has_background, signal
from imaging.light.behind import behind
from imaging.light.illumination import fall
from imaging.light.revolved import light_around, passes, rings_of
from imaging.pictures import Pictures
from scenes import Camera, Curved

_NODES = 12  # places inside the limb at which the level is found
_ALONG = 17  # places of a straight edge at which it is asked whether it is seen
_BEFORE = 1e-3  # of the way to a rim: nearer than its facets are to it
_FARTHEST = 1.0  # px that a crossing may be moved
_ROUGH = 0.02  # of the contrast that the profile's terms may leave out
_STEEPER = 3.0  # times a lone step's slope that the crossing may have, and a third of it


@dataclass(frozen=True, eq=False)
class LimbLook:
    """At the n places of an outline, pictures of leading shape (...).

    Attributes
    ----------
    shift : ndarray, shape (..., n)
        How far outwards the crossing lies beside the limb, px; 0 where it is not known.
    squared : ndarray, shape (..., n)
        Squared contrast of a step with the slope at the crossing, grey levels^2; 0 where nothing is seen.
    noise_variance : ndarray, shape (..., n)
        Mean of both sides, grey levels^2.
    good : ndarray of bool, shape (..., n)
        Where the shift can be trusted.
    """

    shift: np.ndarray
    squared: np.ndarray
    noise_variance: np.ndarray
    good: np.ndarray


def limb_look(pictures: Pictures, curved: Curved, outline: LimbOutline) -> LimbLook:
    """Look at a limb; of one picture or of many alike."""
    scene = pictures.scene
    far, seen = reach(scene.locator.scale_px, scene.camera.most_blur_px), seen_along(pictures, curved, outline)
    safe = np.where(outline.seen[..., None], outline.points, scene.solid.vertices[0])
    inside, terms = _profile(pictures, curved, outline, safe, far)
    beyond = np.broadcast_to(_beyond(pictures, curved, safe, seen), inside.shape[:-1])
    seen = np.broadcast_to(seen, inside.shape[:-1])
    outward = np.nan_to_num(outline.outward)
    curvature = np.broadcast_to(np.nan_to_num(outline.curvature), beyond.shape)
    blur = np.broadcast_to(blur_in_focus(scene.camera, _recorded(outline, scene.camera)), beyond.shape)
    crossing = limb_crossing(
        Profile(terms.coefficients, terms.left_out), beyond.ravel(), blur.ravel(), scene.locator.scale_px,
        curvature.ravel(), box_cumulant(np.broadcast_to(outward, (*beyond.shape, 2)).reshape(-1, 2)),
    )  # fmt: skip
    shift, slope = (part.reshape(beyond.shape) for part in crossing)
    width = np.hypot(edge_blur(blur), scene.locator.scale_px)
    contrast = np.sqrt(2 * np.pi) * width**3 * slope
    near = inside[..., _NODES // 3]
    sides = np.stack([near, beyond], -2)
    noise = sensor.recorded(scene.noise, scene.noise.dark_level + sides).noise_variance
    noise = np.broadcast_to(noise, sides.shape).mean(-2)
    step = np.abs(near - beyond)
    with np.errstate(invalid="ignore"):
        good = np.isfinite(shift) & (np.abs(shift) <= _FARTHEST) & seen
        good &= terms.left_out.reshape(beyond.shape) <= _ROUGH * step
        good &= (np.abs(contrast) <= _STEEPER * step) & (_STEEPER * np.abs(contrast) >= step)
        good &= (contrast > 0) == (near > beyond)
        good &= np.maximum(inside.max(-1), beyond) <= sensor.headroom(scene.noise)
        good &= scene.camera.aperture_radius == 0  # a cone of light touches a round wall in many places
    if scene.camera.is_dimmed:  # what is seen past the limb changes as the lens' light does
        falls = (fall(scene.camera, _recorded(outline, scene.camera)) * outward).sum(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            shift = shift + np.where(good, width**2 * beyond * falls / (beyond - near), 0.0)
    squared = np.where(seen, np.where(good, contrast, step) ** 2, 0.0)
    shift = shift + _sampled(pictures, outline)
    return LimbLook(np.where(good, shift, 0.0), squared, noise, good)


def seen_along(pictures: Pictures, curved: Curved, outline: LimbOutline) -> np.ndarray:
    """Whether the sensor sees places, whatever the light, bool, shape (..., n)."""
    scene, found = pictures.scene, outline.seen & framed(outline, pictures.scene)
    if scene.bodies.is_convex or not found.any():
        return found
    start = pictures.viewpoint.widened().origins(outline.points)
    found[found] = _free(scene, curved, start[found], outline.points[found])
    return found


def _sampled(pictures: Pictures, outline: LimbOutline) -> np.ndarray:
    """What sampling by pixels adds, px: much where a wall's line runs along their rows."""
    camera, scale = pictures.scene.camera, pictures.scene.locator.scale_px
    at, outward = _recorded(outline, camera), np.nan_to_num(outline.outward)
    mixed = place_shifts(pictures.scene.noise.colour, at, outward, camera.blur_px, scale)
    return sampled_places(at, outward, blur_in_focus(camera, at), scale) + mixed


def _recorded(outline: LimbOutline, camera: Camera) -> np.ndarray:
    """Where the places are recorded, px, (..., n, 2); somewhere where they are not seen."""
    return np.nan_to_num(outline.at) + image_centre(camera)


def clear_of_others(pictures: Pictures, curved: Curved, outline: LimbOutline, seen: LimbLook) -> np.ndarray:
    """Places that neither the end of their line, nor a rim or edge of the part, nor a shadow's end disturbs, (..., n).

    Nor light that a floor, an obstacle or another face of the part sends there.
    """
    scene, found = pictures.scene, clear_of_ends(outline, pictures.scene) & unlent(pictures, outline)
    found = found & unlent_by_faces(pictures, curved, outline)
    if scene.bodies.is_convex:
        return found
    far = reach(scene.locator.scale_px, scene.camera.most_blur_px)
    found = found & ~_disturbed(pictures, outline, far)
    lit = np.where(seen.good, seen.squared, 0.0)
    return found & steady(lit, np.zeros(lit.shape), np.nan_to_num(outline.arc), far)


def _disturbed(pictures: Pictures, outline: LimbOutline, far: float) -> np.ndarray:
    """Places nearer than ``far`` px to an edge of the part that the sensor sees, bool, shape (..., n)."""
    solid, sensors, views = pictures.scene.solid, pictures.sensors, pictures.viewpoint
    at, found = np.nan_to_num(outline.at, nan=1e9), np.zeros(outline.at.shape[:-1], bool)
    low = np.nan_to_num(outline.at, nan=np.inf).min(-2) - far
    high = np.nan_to_num(outline.at, nan=-np.inf).max(-2) + far

    def image(places: np.ndarray, rows: Any = ...) -> np.ndarray:
        return from_axis(places, sensors[rows], pictures.scene.camera)

    def is_near(curves: np.ndarray) -> np.ndarray:
        """Of curves (..., C, k, 2): the box about one meets that about the places, (..., C); so where it is unknown."""
        return ~((curves.max(-2) < low[..., None, :]) | (curves.min(-2) > high[..., None, :])).any(-1)

    def shown(places: np.ndarray, rows: np.ndarray) -> np.ndarray:
        start, to = np.broadcast_arrays(views[rows].widened().origins(places), places)
        return first_face(pictures.scene.bodies, start, to - start, ())[1] > 1 - _BEFORE

    for rim in solid.rims:
        places = rim.at(rim.angles(RIM_POINTS))
        rows = is_near(image(places)[..., None, :, :])[..., 0]
        if rows.any():
            found[rows] |= to_curve(at[rows], image(places, rows), rim.joined(shown(places, rows))) < far
    ends = solid.vertices[np.array([edge.ends for edge in solid.lines], int)].reshape(-1, 2, 3)
    lines = image(ends.reshape(-1, 3)).reshape(*at.shape[:-2], -1, 2, 2)
    near = is_near(lines)
    for number in np.flatnonzero(near.any(tuple(range(near.ndim - 1)))):
        rows, (start, stop) = near[..., number], ends[number]
        beside = to_curve(at[rows], lines[..., number, :, :][rows]) < far
        if beside.any():
            places = start + np.linspace(0, 1, _ALONG)[:, None] * (stop - start)
            found[rows] |= beside & shown(places, rows).any(-1, keepdims=True)
    return found


def _free(scene, curved: Curved, start: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether nothing but the surface's own facets stands between places (k, 3)."""
    _, t = first_face(scene.bodies, start, points - start, curved.faces)
    return t > 1 - 1e-6


def _beyond(pictures: Pictures, curved: Curved, points: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Signal of what is seen past the limb."""
    if pictures.scene.bodies.is_convex and not has_background(pictures.scene):
        return np.zeros(1)
    return behind(pictures, points, seen, curved.faces)


def _profile(
    pictures: Pictures, curved: Curved, outline: LimbOutline, points: np.ndarray, far: float
) -> tuple[np.ndarray, Profile]:
    """Signal inside the limb at rising distances up to ``far`` px, (..., n, J), and its terms."""
    scene, camera = pictures.scene, pictures.scene.camera
    places = np.sort((chebyshev.chebpts1(_NODES) + 1) / 2)
    away = (far * places**2)[:, None]
    at = np.nan_to_num(outline.at)[..., None, :] - away * np.nan_to_num(outline.outward)[..., None, :]
    way, start = (make(at, pictures.sensors[..., None, None, :], camera) for make in (rays, ray_origins))
    met = curved.surface.intersections(start, way)
    first = np.where(met > 0, met, np.inf).min(-1)
    hit = np.isfinite(first) & outline.seen[..., None]
    where = np.where(hit[..., None], start + np.where(hit, first, 0.0)[..., None] * way, points[..., None, :])
    material = scene.surfaces.of(curved.faces[0])
    found = signal(
        pictures, where, curved.surface.normals(where), 2, _lit(pictures, curved, points, where), material=material
    )
    found = np.where(hit, found + light_around(pictures, curved, where), 0.0)
    return found, fitted(places, found.reshape(-1, _NODES), far)


def _lit(pictures: Pictures, curved: Curved, points: np.ndarray, inside: np.ndarray) -> tuple[np.ndarray, ...] | None:
    """Of each emitter whether other things leave its light to places inside the limb; None where there are none.

    Exact, (..., n, J), of a lone turned part; else as it is at the limb, (..., n, 1).
    """
    scene = pictures.scene
    if scene.bodies.is_convex:
        return None
    rings = rings_of(scene.solid) if not scene.obstacles else None
    if rings is not None:
        return tuple(passes(rings, inside, emitter.at[..., None, None, :]) for emitter in pictures.emitters)
    found = []
    for emitter in pictures.emitters:
        light, place = np.broadcast_arrays(emitter.at[..., None, :], points)
        found.append(_free(scene, curved, light, place)[..., None])
    return tuple(found)
