"""Mitsuba's description of a scene: only the parts that the chosen effects call for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from imaging.geometry.projection import camera_frame, viewpoint
from imaging.light.appearance import analyser_axis
from imaging.light.irradiance import bands
from imaging.light.sheets import sheets
from render import bsdf, lights
from render.board import board_shapes
from render.curved import curved_shapes, stands_for
from render.meshes import mesh
from render.parts import Part
from render.rays import SURFACES
from render.sight import Sight
from render.texture import Face, bitmap, faces, shapes, texels, uneven_part
from scenes import Brdf, Floor, Picture, Scene, Solid
from scenes.lights.luminaire import BLACK
from scenes.parts.shading import corner_normals

_TINY_APERTURE = 1e-4  # of the distance: Mitsuba accepts it, and it changes nothing
_BLOCK = 32  # fine pixels that share a stream of random numbers in scalar variants; else it depends on the processor
MANY_WAYS = {"interreflection", "depth_of_field", "light_size"}  # a single ray is random, wherever it hits
CUSTOM = {"specular_lobe", "polarisation", "analyser", "wavelength"}


def description(
    mitsuba: Any,
    part: Part,
    size: tuple[int, int],
    crop: tuple[slice, slice],
    samples: int,
    textures: tuple[tuple[Face, ...], ...] | None = None,
    met: int = SURFACES,
) -> dict:
    """Description of a scene with the named effects.

    Parameters
    ----------
    part : Part
        A picture with one light and names of effects; what of the scene has none of them must already be neutral.
    size : tuple of int
        Fine pixels of the whole frame, (width, height).
    crop : tuple of slice
        Rows and columns of fine pixels to render.
    samples : int
        Rays a fine pixel.
    textures : tuple of tuple of Face, optional
        Of `textured`, to be used instead of the surface's own reflectance.
    met : int
        Surfaces that light may meet, the one that is seen among them.
    """
    picture, active, scene = part.picture, part.active, part.picture.scene
    integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    if "interreflection" in active:
        integrator = {"type": "path", "max_depth": met + 1, "rr_depth": 99}
    parts = {
        "type": "scene",
        "integrator": {**integrator, "hide_emitters": not part.silhouette, "block_size": _BLOCK},
        "sensor": view(mitsuba, picture, active, size, crop, samples),
        **(lights.seen if part.silhouette else lights.description)(mitsuba, picture),
    }
    if textures is None:
        made = [shape for solid in _solids(scene, active) for shape in _shown(mitsuba, solid, part)]
    else:
        made = [shape for faces in textures for shape in shapes(mitsuba, faces)]
    parts.update((f"part{i}", shape) for i, shape in enumerate(made))
    passed = 0.0 if part.silhouette else 0.5 if "analyser" in active else 1.0
    parts.update(board_shapes(mitsuba, picture, passed))
    if "floor" in active:
        floor = scene.floor or Floor(reflectance=0.0, height=_lowest(scene))
        parts["floor"] = _floor(mitsuba, floor, passed)
    return parts


def aperture_radius(scene: Scene, active: frozenset[str]) -> float:
    """Radius of the aperture as it is simulated, scene units."""
    least = _TINY_APERTURE * scene.camera.distance
    return max(scene.camera.aperture_radius, least) if "depth_of_field" in active else 0.0


def textured(picture: Picture, active: frozenset[str]) -> tuple[tuple[Face, ...], ...] | None:
    """Each solid's surface with the paper's reflectance as textures; None where it has no such form (`render.texture`).

    Light between surfaces, and light or an aperture of some size need the reflectance for more than one
    direction; curved surfaces, and facets of such, have no plane to put a table on.
    """
    if active & MANY_WAYS or not all(solid.plane.all() for solid in _solids(picture.scene, active)):
        return None
    found = []
    for solid in _solids(picture.scene, active):
        uneven = sheets(picture.scene) if solid is picture.scene.solid else {}
        found.append(faces(solid, picture, _materials(picture.scene, solid), uneven))
        if found[-1] is None:
            return None
    return tuple(found)


def _solids(scene: Scene, active: frozenset[str]) -> list[Solid]:
    """The object, and what else throws a shadow."""
    return [scene.solid, *(obstacle.solid for obstacle in (scene.obstacles if "cast_shadow" in active else ()))]


def _materials(scene: Scene, solid: Solid) -> list[Brdf]:
    """Of each face of the object, or of an obstacle."""
    known = scene.surfaces
    return [known.of(face) if solid is scene.solid else scene.material for face in range(len(solid.faces))]


def _shown(mitsuba, solid: Solid, part: Part) -> list[Any]:
    """A solid's surface as one shape a material, and one a textured face; black where only a light is seen."""
    picture, active = part.picture, part.active
    if part.silhouette:
        return _of_material(mitsuba, solid, np.ones(len(solid.faces), bool), BLACK)
    of_face, made = _materials(picture.scene, solid), []
    uneven = sheets(picture.scene) if solid is picture.scene.solid else {}
    for material in dict.fromkeys(of_face):
        here = [each == material and face not in uneven for face, each in enumerate(of_face)]
        if any(here):
            made += _of_material(mitsuba, solid, np.array(here), _surface(mitsuba, picture, active, material))
    for face, sheet in uneven.items():
        piece = uneven_part(solid, face, sheet)
        surface = _surface(mitsuba, picture, active, of_face[face], piece)
        made.append(mesh(mitsuba, piece.triangles, surface, texels(piece)))
    return made


def _of_material(mitsuba, solid: Solid, here: np.ndarray, bsdf: dict) -> list[Any]:
    """Faces ``here``, bool (F,): the plane ones as one mesh, facets as another that is shaded as their surface, curved
    ones as they are."""
    left, made = here & ~stands_for(solid), []
    for some, normals in ((left & solid.plane, None), (left & ~solid.plane, corner_normals)):
        there = some[solid.triangle_faces]
        if there.any():
            shaded = None if normals is None else normals(solid)[there]
            made.append(mesh(mitsuba, solid.triangles[there], bsdf, normals=shaded))
    return made + curved_shapes(mitsuba, solid, bsdf, here)


def _surface(mitsuba, picture: Picture, active: frozenset[str], material: Brdf, part: Face | None = None) -> dict:
    """A material as a BSDF; ``part`` has the factors of its diffuse reflectance."""
    scene = picture.scene
    if not active & CUSTOM:
        if part is not None:
            return {"type": "diffuse", "reflectance": bitmap(mitsuba, material.diffuse() * part.values)}
        return {"type": "diffuse", "reflectance": {"type": "spectrum", "value": material.diffuse()}}
    pose = np.array(list(picture.sensor))
    eye, analyser = viewpoint(scene.camera, pose), analyser_axis(scene, pose) if "analyser" in active else None
    return bsdf.describe(
        mitsuba,
        bsdf.Interaction(
            material,
            bands(scene, material=material if "wavelength" in active else material.with_dispersion(())),
            tuple(eye.at.tolist()),
            sensor_share=eye.share,
            sensor_angle=2 * aperture_radius(scene, active) / scene.camera.distance,
            lamps=lights.lamps(picture, active),
            analyser=None if analyser is None else tuple(analyser.tolist()),
            texture=part,
        ),
    )


def view(mitsuba, picture: Picture, active, size, crop, samples: int) -> dict:
    """Description of the sensor, for a crop of the whole frame of fine pixels."""
    scene, sensor = picture.scene, picture.sensor
    camera, axes = scene.camera, camera_frame(scene.camera, np.array(list(sensor)))
    position = scene.position("sensor", sensor)
    rows, columns = crop
    lens: dict[str, Any] = {"type": "perspective"}
    sight = Sight.of(picture, active, size[0] // camera.width)
    if sight is not None:
        lens = {"type": "orthographic"}
    elif "depth_of_field" in active:
        lens = {
            "type": "thinlens",
            "aperture_radius": aperture_radius(scene, active),
            "focus_distance": camera.lens.focus or camera.distance,
        }
    if sight is not None:
        seen = sight.described((0, 0), size)
        placed = {**seen, "to_world": mitsuba.ScalarTransform4f(seen["to_world"])}
    else:
        placed = {
            "fov_axis": "x",
            "fov": 2 * math.degrees(math.atan(camera.width / 2 / camera.focal_px)),
            "near_clip": 1e-3 * camera.distance,
            "far_clip": 1e3 * camera.distance,
            "to_world": mitsuba.ScalarTransform4f().look_at(
                origin=position.tolist(), target=list(camera.look_at), up=(-axes.down).tolist()
            ),  # single precision: a target beside the sensor would turn the image by 0.001 px
        }
    return {
        **lens,
        **placed,
        "film": {
            "type": "hdrfilm",
            "width": size[0],
            "height": size[1],
            "crop_offset_x": columns.start,
            "crop_offset_y": rows.start,
            "crop_width": columns.stop - columns.start,
            "crop_height": rows.stop - rows.start,
            "rfilter": {"type": "box"},
            "pixel_format": "luminance",
            "component_format": "float32",
        },
        # strata of one way after another go together: of light that met several faces four rays lose a tenth
        "sampler": {"type": "multijitter" if active & MANY_WAYS else "stratified", "sample_count": samples},
    }


def _floor(mitsuba, floor: Floor, passed: float) -> dict:
    """The floor; an analyser passes half of what it reflects."""
    transform, reflectance = mitsuba.ScalarTransform4f(), floor.reflectance * passed
    return {
        "type": "rectangle",
        "to_world": transform.translate([0, 0, floor.height]).scale(floor.half_side),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "spectrum", "value": reflectance}},
    }


def _lowest(scene: Scene) -> float:
    return float(scene.solid.vertices[:, 2].min())
