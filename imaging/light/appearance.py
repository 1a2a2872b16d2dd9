"""How bright points of the scene are in a picture and how their noise varies: the one place that says so.

Planner, renderer's effects, estimators and references all ask here. Signals are grey levels above darkness without
noise; `imaging.sensor` makes recorded levels of them. What no formula knows (interreflection) is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from imaging import sensor
from imaging.geometry.projection import camera_frame, edge_points, facing, ray_origins, rays
from imaging.geometry.rays import Own, first_face, reaches
from imaging.geometry.visibility import seen, turned
from imaging.light.backlight import backlights, backlit
from imaging.light.between import light_between
from imaging.light.emitters import is_point
from imaging.light.illumination import dimming
from imaging.light.irradiance import bands, beam, electric_field, squared_distance, widened
from imaging.light.sheets import printed
from imaging.pictures import Pictures
from scenes import Brdf, Edge, Floor, Material, Scene, Solid
from scenes.parts.shading import normals_at
from scenes.viewpoint import Viewpoint

_UP = np.array([0.0, 0.0, 1.0])
_NEAR = 1e-3  # of the object's size: from the sensor, where a ray begins
_LIFT = 1e-6  # of the object's size: how far beside an edge the floor behind it is looked at


class EdgeContrast(NamedTuple):
    """Squared difference of the recorded levels on both sides, and the mean variance of the noise there; (..., E, n).

    An edge locator's kernel is even across the edge, so it sees the mean of both sides' noise.
    """

    squared: np.ndarray
    noise_variance: np.ndarray | float


def is_plain(scene: Scene) -> bool:
    """Whether there is one convex body of plane faces before darkness: nothing hides, shades, or is seen behind an
    edge."""
    return scene.bodies.is_convex and not has_background(scene) and not scene.solid.curved


def has_background(scene: Scene) -> bool:
    """Whether anything but darkness may be seen behind the bodies."""
    return scene.bright_floor is not None or bool(backlights(scene))


def is_separable(scene: Scene) -> bool:
    """Whether a face's signal is a number times 1 / r^3, r the distance from the light.

    One convex body before darkness, diffuse, without print, under one point of light, through a lens that passes it
    evenly.
    """
    plain = is_plain(scene) and scene.bodies.plane.all() and not printed(scene) and not scene.camera.is_dimmed
    return plain and scene.surfaces.is_diffuse and is_point(scene.lights)


def signal(
    pictures: Pictures,
    points: np.ndarray,
    normals: np.ndarray,
    axes: int,
    lit: tuple[np.ndarray, ...] | None = None,
    *,
    material: Brdf | None = None,
    fall_off: bool = True,
) -> np.ndarray:
    """Signal of surface points from all lights, with attached shadows; 0 where a surface is turned away.

    Parameters
    ----------
    points : ndarray, shape (..., k, 3) or (..., j, k, 3), ...
        Scene units; the pictures' leading shape, or what broadcasts to it, then some axes of their own.
    normals : ndarray
        Unit normals, broadcast.
    axes : int
        How many axes the points have of their own.
    lit : tuple of ndarray of bool, optional
        For each emitter where it reaches the points; everywhere when not given.
    material : Brdf, optional
        The object's when not given.
    fall_off : bool
        Whether irradiance falls with the squared distance from the light, as it does; eq. 1 has no such term.
    """
    scene, material = pictures.scene, material or pictures.scene.material
    to_sensor = _unit(pictures.viewpoint.widened(axes).towards(points))
    analyser, total = analyser_axis(scene, pictures.sensors), 0.0
    for i, emitter in enumerate(pictures.emitters):
        arriving = beam(emitter, points, axes, fall_off=fall_off)
        fields = polarisation_axis(scene, emitter.which, pictures.lights_at[emitter.which]), analyser
        across = (None if axis is None else widened(axis, axes) for axis in fields)
        index = bands(scene, emitter.light, material)
        value = material.reflected(index, normals, arriving.to_light, to_sensor, *across)
        value = scene.camera.exposure * arriving.strength * value
        total = total + (value if lit is None else np.where(lit[i], value, 0.0))
    return total * dimming(pictures, points, axes) if scene.camera.is_dimmed else total


def face_signal(
    pictures: Pictures,
    points: np.ndarray,
    faces: np.ndarray | int,
    axes: int,
    lit: tuple[np.ndarray, ...] | None = None,
    *,
    normals: np.ndarray | None = None,
    fall_off: bool = True,
    prints: bool = True,
) -> np.ndarray:
    """Signal of points on faces of the bodies, each of its own material; 0 where a surface is turned away.

    Of textures it knows those that are the same on every part (`printed`); the others are 1 on average.

    Parameters
    ----------
    points, axes, lit, fall_off
        As of `signal`.
    faces : ndarray of int
        Indices, broadcast against the points without their last axis.
    normals : ndarray, optional
        Unit normals where they are not those of the surfaces (`scenes.parts.shading`): of a round wall.
    prints : bool
        Whether faces show what is printed on them.
    """
    surfaces, faces = pictures.scene.surfaces, np.asarray(faces)
    normals = normals_at(pictures.scene.bodies, faces, points) if normals is None else normals
    kinds = surfaces.kinds[faces]
    first, *others = np.unique(kinds) if kinds.size else (0,)

    def of_kind(kind: int) -> np.ndarray:
        return signal(pictures, points, normals, axes, lit, material=surfaces.materials[kind], fall_off=fall_off)

    found = of_kind(first)
    for kind in others:
        found = np.where(kinds == kind, of_kind(kind), found)
    for face, sheet in printed(pictures.scene).items() if prints else ():
        if (faces == face).any():
            matt = diffuse_signal(pictures, points, face, axes, lit, fall_off=fall_off)
            found = found + np.where(faces == face, (sheet.at(points) - 1) * matt, 0.0)
    return found


def diffuse_signal(
    pictures: Pictures,
    points: np.ndarray,
    face: int,
    axes: int,
    lit: tuple[np.ndarray, ...] | None = None,
    *,
    fall_off: bool = True,
) -> np.ndarray:
    """The diffuse part of the signal of points on a face, without its texture; parameters as of `signal`."""
    matt, normal = pictures.scene.surfaces.of(face).matt(), normals_at(pictures.scene.bodies, face, points)
    return signal(pictures, points, normal, axes, lit, material=matt, fall_off=fall_off)


def analyser_axis(scene: Scene, sensors: np.ndarray) -> np.ndarray | None:
    """Direction in space that the analyser passes, shape (..., 3); None without one."""
    if scene.camera.analyser_deg is None:
        return None
    axes, angle = camera_frame(scene.camera, sensors), np.radians(scene.camera.analyser_deg)
    return np.cos(angle) * axes.right + np.sin(angle) * axes.down


def polarisation_axis(scene: Scene, which: int, light_at: np.ndarray) -> np.ndarray | None:
    """Direction in space of a light's polarisation, shape (..., 3); None for unpolarised light."""
    angle = scene.lights[which].polarisation_deg
    return None if angle is None else electric_field(light_at - np.array(scene.camera.look_at), angle)


def side_signals(
    pictures: Pictures, names: tuple[str, ...], points: np.ndarray, *, fall_off: bool = True
) -> np.ndarray:
    """Signal on the two sides of each edge.

    A side is the face that meets in the edge; where that face turns away from the sensor, it is whatever the sensor
    sees behind the edge: another face, the floor, or darkness.

    Parameters
    ----------
    names : tuple of str
        E edges of the object.
    points : ndarray, shape (E, n, 3) or (..., E, n, 3)
        Points on the edges, scene units; the same for all pictures or for each its own.

    Returns
    -------
    ndarray, shape (..., E, 2, n)
        Exactly 0 for a side that is dark: darkness behind, turned away from the light, or in shadow. Both are 0 at a
        point that is hidden from the sensor.
    """
    scene, bodies = pictures.scene, pictures.scene.bodies
    edges = [scene.solid.edge(name) for name in names]
    if not edges:
        lead = np.broadcast_shapes(*(poses.shape[:-1] for poses in (pictures.sensors, *pictures.lights)))
        return np.zeros((*lead, 0, 2, points.shape[-2]))
    faces = np.array([edge.faces for edge in edges])
    if is_plain(scene):
        level = face_signal(pictures, points[..., None, :, :], faces[:, :, None], 3, fall_off=fall_off)
        return np.where(facing(bodies, pictures.viewpoint)[..., faces, None], level, 0.0)
    return np.stack([_beside(pictures, e, points[..., i, :, :], fall_off) for i, e in enumerate(edges)], -3)


def edge_contrast(pictures: Pictures, names: tuple[str, ...], fractions: np.ndarray) -> EdgeContrast:
    """Recorded contrast and noise at fractions (n,) or (..., E, n) of each edge's length in space."""
    if not names or not is_separable(pictures.scene):
        return of_sides(
            pictures.scene, side_signals(pictures, names, edge_points(pictures.scene.solid, names, fractions))
        )
    r2, strength = edge_distance2(pictures, names, fractions), side_strengths(pictures, names)
    return _separable_contrast(pictures.scene, strength, r2)


def of_sides(scene: Scene, sides: np.ndarray) -> EdgeContrast:
    """Recorded contrast and noise from the signals (..., 2, n) of both sides, shape (..., n)."""
    if scene.noise.gain == 0 and not (sides > sensor.headroom(scene.noise)).any():  # NaN of one picture is its own
        return EdgeContrast((sides[..., 0, :] - sides[..., 1, :]) ** 2, scene.noise.variance)
    found = sensor.recorded(scene.noise, scene.noise.dark_level + sides)
    squared = (found.level[..., 0, :] - found.level[..., 1, :]) ** 2
    return EdgeContrast(squared, found.noise_variance.mean(-2))


def _separable_contrast(scene: Scene, strength: np.ndarray, r2: np.ndarray) -> EdgeContrast:
    """The same from `side_strengths` (..., E, 2) and squared distances (..., E, n); signals are formed where needed."""
    squared = ((strength[..., 0] - strength[..., 1]) ** 2)[..., None] / r2**3
    special = np.ones(squared.shape[:-1], bool)
    if scene.noise.gain == 0:
        special = np.broadcast_to(strength.max(-1) > sensor.headroom(scene.noise) * r2.min(-1) ** 1.5, special.shape)
    if not special.any():
        return EdgeContrast(squared, scene.noise.variance)
    noise = np.full(squared.shape, scene.noise.variance)
    sides = np.broadcast_to(strength, (*special.shape, 2))[special][..., None]
    sides = sides / np.broadcast_to(r2, squared.shape)[special][:, None] ** 1.5
    squared[special], noise[special] = of_sides(scene, sides)
    return EdgeContrast(squared, noise)


def paper_contrast2(pictures: Pictures, names: tuple[str, ...], fractions: np.ndarray) -> np.ndarray:
    """Squared contrast of eq. 10 with eq. 1's intensities: no fall-off, no end of the scale; shape (..., E, n)."""
    scene = pictures.scene
    if names and is_separable(scene):
        return (paper_step(pictures, names) ** 2)[..., None] / edge_distance2(pictures, names, fractions)
    sides = side_signals(pictures, names, edge_points(scene.solid, names, fractions), fall_off=False)
    return (sides[..., 0, :] - sides[..., 1, :]) ** 2


def side_strengths(pictures: Pictures, names: tuple[str, ...]) -> np.ndarray:
    """Signal times r^3 on both sides of each edge of a separable scene, grey levels scene units^3, shape (..., E, 2).

    On a plane, diffuse face N.(l - p) is the same for all its points p, so with r = |l - p| the signal is a constant
    over r^3: N.(l - p) / r for the cosine and 1 / r^2 for the fall-off.
    """
    return _heights(pictures, names) * pictures.emitters[0].power


def paper_step(pictures: Pictures, names: tuple[str, ...]) -> np.ndarray:
    """The paper's contrast times r, grey levels times scene units, of a separable scene; shape (..., E)."""
    heights = _heights(pictures, names)
    return np.abs(heights[..., 0] - heights[..., 1])


def edge_distance2(pictures: Pictures, names: tuple[str, ...], fractions: np.ndarray) -> np.ndarray:
    """Squared distance of the first light from points of the edges, scene units^2, shape (..., E, n)."""
    ends = np.array([pictures.scene.solid.vertices[list(pictures.scene.solid.edge(name).ends)] for name in names])
    return squared_distance(ends[:, 0], ends[:, 1], fractions, pictures.lights_at[0])


def _heights(pictures: Pictures, names: tuple[str, ...]) -> np.ndarray:
    """Exposure x reflectance x height of the light over the plane of each side that is seen, (..., E, 2)."""
    scene, solid = pictures.scene, pictures.scene.solid
    faces = np.array([solid.edge(name).faces for name in names])
    height = np.maximum(pictures.lights_at[0] @ solid.normals.T - solid.offsets, 0.0)
    return np.where(facing(solid, pictures.viewpoint), height * whites(scene)[: len(solid.faces)], 0.0)[..., faces]


def whites(scene: Scene) -> np.ndarray:
    """Signal of each face of the bodies by unit irradiance from everywhere, its diffuse part, grey levels, (F,)."""
    each = [material.diffuse(scene.camera.analyser_deg is not None) for material in scene.surfaces.materials]
    return scene.camera.exposure * np.array(each)[scene.surfaces.kinds]


def sides_of_one(pictures: Pictures, edges: Sequence[Edge], which: np.ndarray, points: np.ndarray) -> np.ndarray:
    """`side_signals` of one picture at points (n, 3), each on one of the edges, ``which`` (n,); shape (2, n)."""
    found = np.zeros((2, len(points)))
    if not edges:
        return found
    clear = _visible_on(pictures, edges, which, points)
    if clear.any():
        numbers, some = np.unique(which[clear], return_inverse=True)
        found[:, clear] = _sides(pictures, [edges[k] for k in numbers], some, points[clear], clear[clear], True)
    return found


def _beside(pictures: Pictures, edge: Edge, points: np.ndarray, fall_off: bool) -> np.ndarray:
    """The two sides (..., 2, n) of one edge at points (..., n, 3) of it."""
    which = np.zeros(points.shape[-2], int)
    return _sides(pictures, [edge], which, points, _visible_on(pictures, [edge], which, points), fall_off)


def _sides(
    pictures: Pictures, edges: Sequence[Edge], which: np.ndarray, points: np.ndarray, clear: np.ndarray, fall_off: bool
) -> np.ndarray:
    """The two sides (..., 2, n) of edges at points (..., n, 3), each on one of them, ``which`` (n,), of a scene in
    which things may hide and shade each other; 0 where the sensor has no clear view (..., n)."""
    scene, bodies = pictures.scene, pictures.scene.bodies
    faces, fractions = np.array([edge.faces for edge in edges])[which].T, _fractions(scene.solid, edges, which, points)
    lit = tuple(
        _turned_on(bodies, edges, which, at) & _seen_on(bodies, edges, which, fractions, at)[..., None, :]
        for at in (emitter.at for emitter in pictures.emitters)
    )
    level = face_signal(pictures, points[..., None, :, :], faces, 2, lit, fall_off=fall_off)
    level = level + light_between(pictures, points[..., None, :, :], faces)
    looked_at = _turned_on(bodies, edges, which, pictures.viewpoint)
    found = np.where(clear[..., None, :] & looked_at, level, 0.0)
    outward = bodies.normals[faces].sum(0)
    for side in (0, 1):
        # past an outer face that is turned away there is nothing but the background, for the ray leaves the convex hull
        wanted = clear & ~looked_at[..., side, :] & (has_background(scene) | ~bodies.outer[faces[side]])
        if wanted.any():
            past = behind(pictures, points, wanted, faces.T, outward, fall_off=fall_off)
            found[..., side, :] = np.where(wanted, past, found[..., side, :])
    return found


def _visible_on(pictures: Pictures, edges: Sequence[Edge], which: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether the sensor sees points (..., n, 3) on edges and a face there, bool (..., n)."""
    bodies, at = pictures.scene.bodies, pictures.viewpoint
    fractions = _fractions(pictures.scene.solid, edges, which, points)
    return _turned_on(bodies, edges, which, at).any(-2) & _seen_on(bodies, edges, which, fractions, at)


def _fractions(solid: Solid, edges: Sequence[Edge], which: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Of the edges' lengths at which points (..., n, 3) lie, (..., n)."""
    ends = solid.vertices[[edge.ends for edge in edges]]
    if len(edges) == 1:
        start, way = ends[0, 0], ends[0, 1] - ends[0, 0]
        return (points - start) @ way / (way @ way)
    start, way = ends[which, 0], (ends[:, 1] - ends[:, 0])[which]
    return np.einsum("...ni,ni->...n", points - start, way) / np.einsum("ni,ni->n", way, way)


def _turned_on(bodies: Solid, edges: Sequence[Edge], which: np.ndarray, at: Viewpoint | np.ndarray) -> np.ndarray:
    """`turned` at points on edges, bool (..., 2, n)."""
    found = np.stack([turned(bodies, edge, at) for edge in edges], -1)
    return found if len(edges) == 1 else found[..., which]


def _seen_on(
    bodies: Solid, edges: Sequence[Edge], which: np.ndarray, fractions: np.ndarray, at: Viewpoint | np.ndarray
) -> np.ndarray:
    """`seen` at fractions (..., n) of edges, bool (..., n)."""
    if len(edges) == 1:
        return seen(bodies, edges[0], at, fractions)
    found = np.zeros(np.broadcast_shapes((*Viewpoint.of(at).shape, 1), fractions.shape), bool)
    for number, edge in enumerate(edges):
        here = which == number
        found[..., here] = seen(bodies, edge, at, fractions[..., here])
    return found


def behind(
    pictures: Pictures, points: np.ndarray, wanted: np.ndarray, own: Own,
    outward: np.ndarray | None = None, *, fall_off: bool = True,
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
    found = np.where(face >= 0, found + light_between(pictures, hit, face), 0.0)
    if scene.bright_floor is not None:
        place, ahead = _on_floor(scene.bright_floor, points, vectors, t)
        place = place + _LIFT * scene.solid.extent * (0 if outward is None else outward * (1, 1, 0))
        on_floor = floor_signal(pictures, place, wanted & ahead, fall_off=fall_off)
        found, t = np.where(ahead, on_floor, found), np.where(ahead, 0.0, t)
    for which in backlights(scene):
        shown = backlit(pictures, which, points, vectors, analyser_axis(scene, pictures.sensors))
        found = np.where(np.isinf(t), found + shown, found)
    return np.where(wanted, found, 0.0)


def seen_at(pictures: Pictures, image: np.ndarray) -> np.ndarray:
    """Signal of what the sensor of one picture sees at image points (n, 2) from the middle, ideal px, shape (n,)."""
    return seen_by_rays(
        pictures, *(make(image, pictures.sensors, pictures.scene.camera) for make in (ray_origins, rays))
    )


def seen_by_rays(pictures: Pictures, origins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """The same along lines of sight from places (n, 3) on."""
    start = origins + _NEAR * pictures.scene.solid.extent * _unit(vectors)
    return behind(pictures, start, np.ones(len(vectors), bool), ())


def floor_signal(pictures: Pictures, places: np.ndarray, wanted: np.ndarray, *, fall_off: bool = True) -> np.ndarray:
    """Signal of the floor at places (..., n, 3) upon it, in the bodies' shadows dark; 0 where not wanted."""
    scene, bodies = pictures.scene, pictures.scene.bodies
    lift = 1e-7 * bodies.extent * _UP

    def free(points, _, light):
        blocker, t = first_face(bodies, light, points + lift - light, ())
        return (blocker < 0) | (t >= 1)

    lit = tuple(_where(wanted, places, np.zeros(places.shape[:-1], int), e.at, free) for e in pictures.emitters)
    return signal(pictures, places, _UP, 1, lit, material=floor_material(scene.floor), fall_off=fall_off)


@lru_cache(maxsize=64)
def floor_material(floor: Floor) -> Material:
    """The floor's surface: diffuse."""
    return Material(diffuse_reflectance=floor.reflectance)


def _met(bodies, points, vectors, wanted, own) -> tuple[np.ndarray, np.ndarray]:
    """First face past the points, -1 for none, and how far along the rays; cast only where anything is wanted."""
    asked = np.broadcast_to(wanted, np.broadcast_shapes(wanted.shape, vectors.shape[:-1]))
    asked = asked.any(tuple(i for i, size in enumerate(vectors.shape[:-1]) if size < asked.shape[i]), keepdims=True)
    face, t = np.full(vectors.shape[:-1], -1), np.full(vectors.shape[:-1], np.inf)
    asked = np.broadcast_to(asked, face.shape)
    if isinstance(own, np.ndarray):
        own = np.broadcast_to(own, (*face.shape, own.shape[-1]))[asked]
    face[asked], t[asked] = first_face(bodies, np.broadcast_to(points, vectors.shape)[asked], vectors[asked], own)
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
    parts = (np.broadcast_to(v, (*shape, 3))[wanted] for v in (places, light_at[..., None, :]))
    place, light = parts
    found[wanted] = test(place, np.broadcast_to(faces, shape)[wanted], light)
    return found


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
