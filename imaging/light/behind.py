"""Signals of what is seen along lines of sight: past an edge, at a place of the image, of the floor."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from imaging.geometry.projection import ray_origins, rays
from imaging.geometry.rays import Own, first_face, reaches
from imaging.light.appearance import analyser_axis, face_signal, floor_material, signal, unit
from imaging.light.backlight import backlights, backlit
from imaging.light.between import light_between
from imaging.pictures import Pictures
from scenes import Camera, Floor, Solid
from scenes.materials.vectors import chosen

_UP = np.array([0.0, 0.0, 1.0])
_NEAR = 1e-3  # of the object's size: from the sensor, where a ray begins
_LIFT = 1e-6  # of the object's size: how far beside an edge the floor behind it is looked at


def behind(
    pictures: Pictures, points: np.ndarray, wanted: np.ndarray, own: Own,
    outward: np.ndarray | None = None, *, fall_off: bool = True, finely: bool = False,
) -> np.ndarray:  # fmt: skip
    """Signal of what the sensor sees just past points of an edge.

    Parameters
    ----------
    points : ndarray, shape (..., n, 3)
        Scene units.
    wanted : ndarray of bool, shape (..., n)
        For which points; the others get 0.
    own : tuple of int, or ndarray of int, shape (n, k)
        Faces that meet in the edge.
    outward : ndarray, shape (3,) or (n, 3), optional
        Direction away from the body that the edge belongs to.
    finely : bool
        As `imaging.light.between.light_between`.

    Returns
    -------
    ndarray, shape (..., n)
        0 where the ray meets nothing, or what it meets is dark.
    """
    scene, bodies = pictures.scene, pictures.scene.bodies
    vectors = -pictures.viewpoint.widened().towards(points)
    face, t = _met(bodies, points, vectors, wanted, own)
    hit = points + np.where(face >= 0, t, 0.0)[..., None] * vectors
    lit = tuple(_where(wanted & (face >= 0), hit, face, e.at, partial(reaches, bodies)) for e in pictures.emitters)
    found = face_signal(pictures, hit, face, 1, lit, fall_off=fall_off)
    if scene.bright_floor is not None:
        place, ahead = _on_floor(scene.bright_floor, points, vectors, t)
        place = place + _LIFT * scene.solid.extent * (0 if outward is None else outward * (1, 1, 0))
        on_floor = floor_signal(pictures, place, wanted & ahead, fall_off=fall_off)
        found, t = np.where(ahead, on_floor, found), np.where(ahead, 0.0, t)
        hit, face = np.where(ahead[..., None], place, hit), np.where(ahead, len(bodies.faces), face)
    found = np.where(face >= 0, found + light_between(pictures, hit, face, finely=finely), 0.0)
    for which in backlights(scene):
        shown = backlit(pictures, which, points, vectors, analyser_axis(scene, pictures.sensors))
        found = np.where(np.isinf(t), found + shown, found)
    return np.where(wanted, found, 0.0)


def things_behind(pictures: Pictures, points: np.ndarray, wanted: np.ndarray, own: tuple[int, ...]) -> np.ndarray:
    """What the sensor sees just past points of an edge, whatever the light, int (..., n).

    The number of a face of the bodies, that after the last for the floor, -1 for nothing and where not wanted;
    parameters as of `behind`.
    """
    scene, bodies = pictures.scene, pictures.scene.bodies
    vectors = -pictures.viewpoint.widened().towards(points)
    face, t = _met(bodies, points, vectors, wanted, own)
    if scene.bright_floor is not None:
        face = np.where(_on_floor(scene.bright_floor, points, vectors, t)[1], len(bodies.faces), face)
    return np.where(wanted, face, -1)


def seen_at(pictures: Pictures, image: np.ndarray, *, finely: bool = False) -> np.ndarray:
    """Signal of what the sensor of one picture sees at image points (n, 2) from the middle, ideal px, shape (n,)."""
    lines = (make(image, pictures.sensors, pictures.scene.camera) for make in (ray_origins, rays))
    return seen_by_rays(pictures, *lines, finely=finely)


def seen_by_rays(pictures: Pictures, origins: np.ndarray, vectors: np.ndarray, *, finely: bool = False) -> np.ndarray:
    """The same along lines of sight from places (n, 3) on."""
    start = origins + _NEAR * pictures.scene.solid.extent * unit(vectors)
    return behind(pictures, start, np.ones(len(vectors), bool), (), finely=finely)


class Met(NamedTuple):
    """What lines of sight meet, whatever the lights.

    Attributes
    ----------
    faces : ndarray of int, shape (n,)
        The number of a face of the bodies, that after the last for the floor, -1 for nothing.
    points : ndarray, shape (n, 3)
        Where, scene units.
    """

    faces: np.ndarray
    points: np.ndarray


def met_at(bodies: Solid, floor: Floor | None, camera: Camera, sensor: np.ndarray, image: np.ndarray) -> Met:
    """What a sensor of one pose (2,) sees at image points (n, 2) from the middle, ideal px."""
    starts, vectors = _lines_of_sight(image, sensor, camera, bodies.extent)
    faces, t = first_face(bodies, starts, vectors, ())
    points = starts + np.where(faces >= 0, t, 0.0)[:, None] * vectors
    if floor is not None:
        places, ahead = _on_floor(floor, starts, vectors, t)
        faces, points = np.where(ahead, len(bodies.faces), faces), np.where(ahead[:, None], places, points)
    return Met(faces, points)


def direct_light(pictures: Pictures, met: Met) -> np.ndarray:
    """Signal (n,) that what is met has of one picture's lights alone, darkness in shadows."""
    bodies, found = pictures.scene.bodies, np.zeros(len(met.faces))
    here = np.flatnonzero((met.faces >= 0) & (met.faces < len(bodies.faces)))
    there = np.flatnonzero(met.faces == len(bodies.faces))
    if here.size:
        points, faces = met.points.take(here, 0), met.faces[here]
        lit = tuple(reaches(bodies, points, faces, each.at) for each in pictures.emitters)
        found[here] = face_signal(pictures, points, faces, 1, lit)
    if there.size:
        found[there] = floor_signal(pictures, met.points.take(there, 0), np.ones(len(there), bool))
    return found


def shadow_steps(pictures: Pictures, image: np.ndarray) -> np.ndarray:
    """How direct light steps where a shadow's border lies between neighbours of image points (n, k, 2), ideal px from
    the middle, of one picture: signal of the next less that of this one, shape (n, k - 1); 0 between other surfaces.
    """
    scene, bodies, pictures = pictures.scene, pictures.scene.bodies, pictures.glanced
    start, vectors = _lines_of_sight(image, pictures.sensors, scene.camera, scene.solid.extent)
    face, t = first_face(bodies, start, vectors, ())
    hit, met = start + np.where(face >= 0, t, 0.0)[..., None] * vectors, face >= 0
    lit = np.array([_where(met, hit, face, each.at, partial(reaches, bodies)) for each in pictures.emitters])
    if scene.bright_floor is not None:
        place, ahead = _on_floor(scene.bright_floor, start, vectors, t)
        on_floor = [_where(ahead, place, face, each.at, partial(_is_free, bodies)) for each in pictures.emitters]
        face, lit = np.where(ahead, -2, face), np.where(ahead, on_floor, lit)
    ends = (face[:, 1:] == face[:, :-1]) & (lit[..., 1:] != lit[..., :-1]).any(0)
    if not ends.any():
        return np.zeros(ends.shape)
    signal = behind(pictures, start, np.ones(face.shape, bool), ())
    return np.where(ends, np.diff(signal, axis=-1), 0.0)


def _lines_of_sight(image, sensor, camera, extent) -> tuple[np.ndarray, np.ndarray]:
    """Where lines of sight through image points begin, in front of the sensor, and which way they go."""
    starts, vectors = (make(image, sensor, camera) for make in (ray_origins, rays))
    return starts + _NEAR * extent * unit(vectors), vectors


def floor_signal(pictures: Pictures, places: np.ndarray, wanted: np.ndarray, *, fall_off: bool = True) -> np.ndarray:
    """Signal of the floor at places (..., n, 3) upon it, in the bodies' shadows dark; 0 where not wanted."""
    scene, faces = pictures.scene, np.zeros(places.shape[:-1], int)
    free = partial(_is_free, scene.bodies)
    lit = tuple(_where(wanted, places, faces, each.at, free) for each in pictures.emitters)
    return signal(pictures, places, _UP, 1, lit, material=floor_material(scene.floor), fall_off=fall_off)


def _is_free(bodies: Solid, points: np.ndarray, _: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Whether places (..., 3) of the floor see a position, bool (...)."""
    blocker, t = first_face(bodies, light, points + 1e-7 * bodies.extent * _UP - light, ())
    return (blocker < 0) | (t >= 1)


def _met(bodies, points, vectors, wanted, own) -> tuple[np.ndarray, np.ndarray]:
    """First face past the points, -1 for none, and how far along the rays; cast only where anything is wanted."""
    asked = np.broadcast_to(wanted, np.broadcast_shapes(wanted.shape, vectors.shape[:-1]))
    asked = asked.any(tuple(i for i, size in enumerate(vectors.shape[:-1]) if size < asked.shape[i]), keepdims=True)
    face, t = np.full(vectors.shape[:-1], -1), np.full(vectors.shape[:-1], np.inf)
    asked = np.broadcast_to(asked, face.shape)
    if isinstance(own, np.ndarray):
        own = np.broadcast_to(own, (*face.shape, own.shape[-1]))[asked]
    rays = chosen(np.broadcast_to(points, vectors.shape), asked), chosen(vectors, asked)
    face[asked], t[asked] = first_face(bodies, *rays, own)
    return face, t


def _on_floor(floor: Floor, points, vectors, t) -> tuple[np.ndarray, np.ndarray]:
    """Where the rays meet the floor, and whether they do so before anything else."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (floor.height - points[..., 2]) / vectors[..., 2]
        place = points + reach[..., None] * vectors
        ahead = (vectors[..., 2] < 0) & (reach >= -1e-9) & (reach < t)
        ahead &= (np.abs(place[..., :2]) <= floor.half_side).all(-1)
    return np.where(ahead[..., None], place, points), ahead


def _where(wanted, places, faces, light_at, test) -> np.ndarray:
    """``test(places, faces, light)`` where wanted, False elsewhere; broadcast over the light's leading shape."""
    shape = np.broadcast_shapes(wanted.shape, places.shape[:-1], (*light_at.shape[:-1], 1))
    wanted = np.broadcast_to(wanted, shape)
    found = np.zeros(shape, bool)
    place, light = (chosen(np.broadcast_to(v, (*shape, 3)), wanted) for v in (places, light_at[..., None, :]))
    found[wanted] = test(place, np.broadcast_to(faces, shape)[wanted], light)
    return found
