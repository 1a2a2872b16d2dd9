"""How bright surfaces are in a picture: the one place that says so.

Planner, renderer's effects, estimators and references all ask here. Signals are grey levels above darkness without
noise; `imaging.sensor` makes recorded levels of them. What no formula knows (interreflection) is left out. What is seen
beside edges says `imaging.light.edge_sides`, along lines of sight `imaging.light.behind`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from imaging.geometry.projection import camera_frame
from imaging.light.backlight import backlights
from imaging.light.emitters import is_point
from imaging.light.illumination import dimming
from imaging.light.irradiance import bands, beam, electric_field, widened
from imaging.light.sheets import printed
from imaging.pictures import Pictures
from scenes import Brdf, Floor, Material, Scene
from scenes.materials.vectors import length
from scenes.parts.shading import normals_at


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
    to_sensor = unit(pictures.viewpoint.widened(axes).towards(points))
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


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) of length 1."""
    return vectors / length(vectors)[..., None]


@lru_cache(maxsize=64)
def floor_material(floor: Floor) -> Material:
    """The floor's surface: diffuse."""
    return Material(diffuse_reflectance=floor.reflectance)
