"""What scenes, parts, surfaces, lights and materials say of themselves; rays, renders of small pictures."""

from functools import partial

import numpy as np

import render
import scenes
from imaging import sensor
from imaging.geometry import blur, lens, projection, visibility
from scenes.changes import changed
from scenes.materials import torrance_sparrow
from scenes.parts import facets
from scenes.parts.block import Block
from scenes.parts.surfaces import Cone, Cylinder, Plane, Quadric, Sphere, Torus
from scenes.parts.turned import Turned
from tests.regression.numbers.poses import CHANGED, load, uneven, without_error
from tests.regression.stored import CLOSED, RENDERED
from tests.unit.test_facet_parts import strip

_AXIS = np.array([0.48, -0.6, 0.64])
_CENTRE = np.array([0.7, -1.1, 2.3])


def _surfaces():
    made = {
        "plane": Plane(_CENTRE, _AXIS), "sphere": Sphere(_CENTRE, 1.7), "hole": Sphere(_CENTRE, 1.7, hollow=True),
        "cylinder": Cylinder(_CENTRE, _AXIS, 1.3, (-0.9, 2.1)),
        "cone": Cone(_CENTRE, _AXIS, 1.3, (-0.9, 1.1), half_angle_deg=17.0), "torus": Torus(_CENTRE, _AXIS, 2.3, 0.6),
        "quadric": Quadric.about(_CENTRE, np.diag([1.0, 0.4, 0.25]) + 0.05, np.array([0.1, 0.2, 0.0]), -1.2),
    }  # fmt: skip
    return made


def _surface(name):
    surface, rng = _surfaces()[name], np.random.default_rng(4)
    points, away = _CENTRE + rng.normal(0, 1.4, (5, 3)), rng.normal(0, 1, (5, 3))
    away /= np.linalg.norm(away, axis=-1, keepdims=True)
    origins = points - 6 * away
    return {
        "values": surface.values(points), "normals": surface.normals(points), "bend": surface.shape_operator(points),
        "shifts": surface.shifts(points),
        "hits": surface.intersections(origins, away), "within": surface.within(points),
    }  # fmt: skip


def _solid(name):
    scene = load(name)
    solid = scene.solid
    return {
        "vertices": solid.vertices, "faces": len(solid.faces), "normals": solid.normals, "offsets": solid.offsets,
        "edges": [[each.name, each.ends, each.faces] for each in solid.edges[:30]],
        "circles": solid.circles[:12], "extent": solid.extent, "convex": solid.is_convex,
        "height": solid.height_above(np.array([1.1, 0.7, 9.3])), "plane": without_error(lambda: solid.plane),
        "corners": solid.corner_names[:20], "names": solid.vertex_names[:20], "volume": float(solid.mesh().volume),
        "sharp": [each.name for each in solid.sharp[:30]],
    }  # fmt: skip


def _scene(name):
    scene = load(name)
    return {
        "camera": scene.camera, "lights": scene.lights, "noise": scene.noise, "material": scene.material,
        "uncertainty": scene.uncertainty, "settings": scene.settings, "quantities": scene.quantities,
        "variance": scene.noise.variance,
    }  # fmt: skip


def _reflected(name):
    material, cosines = load(name).material, np.linspace(0.13, 0.97, 7)
    return {
        "fresnel": torrance_sparrow.fresnel(cosines, 1.51, 0.0), "metal": torrance_sparrow.fresnel(cosines, 0.27, 2.9),
        "beckmann": torrance_sparrow.beckmann(cosines, 1 - cosines**2, 0.31),
        "diffuse": [material.diffuse(analysed) for analysed in (False, True)],
    }  # fmt: skip


def _optics(name):
    scene = load(name)
    return [_seen_from(scene, np.array(list(uneven(scene, n)[0]))) for n in (0, -1)]


def _seen_from(scene, sensor):
    camera = scene.camera
    points = np.random.default_rng(6).normal(0, 0.1, (5, 3)) * scene.solid.extent + scene.solid.vertices.mean(0)
    found = {one: getattr(projection, one)(points, sensor, camera) for one in (
        "project", "project_ideal", "from_axis", "depth", "jacobian", "jacobian_ideal")}  # fmt: skip
    ideal, depth, eye = found["project_ideal"], found["depth"], projection.sensor_position(camera, sensor)
    found |= {
        "undistorted": lens.undistorted(found["project"], camera), "lens": lens.lens_jacobian(ideal, camera),
        "confusion": blur.signed_confusion(camera, depth), "blur": blur.blur_at(camera, depth, found["project"]),
        "facing": projection.facing(scene.solid, eye),
    }  # fmt: skip
    for edge in scene.solid.sharp[:8]:
        found[f"hidden {edge.name}"] = visibility.hidden_spans(scene.solid, edge, eye)
        found[f"seen {edge.name}"] = visibility.seen(scene.solid, edge, eye, np.array([0.11, 0.47, 0.93]))
        found[f"span {edge.name}"] = visibility.visible_spans(scene.solid, edge, eye)
    return found


def _exposed():
    noise = load("low_light").noise
    image = np.linspace(3, 270, 35).reshape(5, 7)
    return {
        "shots": render.expose(image, noise, np.random.default_rng(3), 2), "variance": render.variance(image, noise),
        "digitised": render.sensor.digitised(image + 0.3, noise),
        "recorded": sensor.recorded(noise, image), "sensitivity": sensor.sensitivity(noise, image),
        "errors": sensor.squared_errors(noise, image, sensor.recorded(noise, image + 2.1)),
    }  # fmt: skip


def _effects(name):
    scene = load(name)
    found = render.effects(scene)
    return [[each.effect.name, each.on, each.reason, each.influence] for each in found]


def small(name, factor):
    scene = load(name)
    camera = scene.camera
    return scene.model_copy(update={"camera": camera.model_copy(update={
        "width": round(camera.width / factor), "height": round(camera.height / factor),
        "focal_px": camera.focal_px / factor})})  # fmt: skip


def _rendered(name, effects="auto"):
    scene = small(name, 4.0)
    picture = scenes.Picture.of(scene, *uneven(scene))
    return render.image(picture, quality=render.Quality(supersample=2, edge_samples=4), effects=effects)


def _turned():
    part = Turned(kind="turned", axis="y", profile=((0.0, 1.5), (2.0, 1.5), (2.0, 2.25), (3.5, 1.75)))
    solid = part.solid
    return {"vertices": solid.vertices, "circles": solid.circles, "extent": solid.extent,
            "curved": [[each.centre, each.radius, each.half_angle, each.parameters(np.array([9.0, 4.0, 7.0])),
                        *each.sideways(np.array([9.0, 4.0, 7.0]))] for each in solid.curved]}  # fmt: skip


def _shots():
    scene = small("task1", 4.0)
    return render.shots(scene, *uneven(scene), count=2, rng=np.random.default_rng(3))


def _changed():
    changes = {"camera.focal_px": 611.0, "noise.sigma": 3.3, "material.roughness": 0.21}
    made = changed(load("glossy_metal"), changes)
    return [made.camera, made.noise, made.material]


def _strips():
    """Faces side by side, of widths and bends near what is asked of them: which are curved surfaces, which edges."""
    rng, told = np.random.default_rng(12), []
    sizes, turns = np.array([0.4, 0.9, 1.0, 1.0, 1.1, 1.5, 4.0, 6.0]), np.array([0.5, 2.0, 2.2, 8.0, 11.5, 13, 20, 33])
    for count in rng.integers(4, 22, 120):
        some, few = rng.choice(sizes, rng.integers(1, 4)), rng.choice(turns, rng.integers(1, 4))
        widths = np.concatenate([[9.0], rng.choice(some, count) * rng.uniform(0.95, 1.05, count), [7.0]])
        bends = np.radians(rng.choice(few, count + 1) * rng.uniform(0.95, 1.05, count + 1))
        convex = np.cumsum(rng.random(count + 1) < 0.06) % 2 == 0
        bends[rng.random(count + 1) < 0.05] = np.radians(88.0)
        made = facets.facets(*strip(widths, bends, convex, rng.uniform(0.5, 5.0)), ())
        told.append(
            f"{_letters(made.region)} {_letters(made.smooth.astype(int) - 1)} {_letters(made.rim.astype(int) - 1)}"
        )
    return told


def _letters(numbers):
    """A letter each, the same for the same number; "-" for -1."""
    known = {-1: "-"}
    return "".join(known.setdefault(int(number), chr(ord("A") + len(known))) for number in numbers)


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {f"surface {name}": (CLOSED, partial(_surface, name)) for name in _surfaces()}
    for name in scenes.names():
        found[f"scene {name}"] = CLOSED, partial(_scene, name)
        found[f"optics {name}"] = CLOSED, partial(_optics, name)
        if name not in ("bracket_station",):
            found[f"solid {name}"] = CLOSED, partial(_solid, name)
        found[f"reflected {name}"] = CLOSED, partial(_reflected, name)
        if name not in ("bracket_mm", "bracket_station", "flange"):
            found[f"effects {name}"] = CLOSED, partial(_effects, name)
    for name in ("task1", "glossy_metal", "plate", "ball", "two_lights", "printed_label", "polarised", "wedge", "shaft",
                 "calibrated_rig", "grey_floor", "ring_light", "backlight_plate"):  # fmt: skip
        found[f"render {name}"] = RENDERED, partial(_rendered, name)
    for name in CHANGED:
        found[f"render {name}"] = RENDERED, partial(_rendered, name)
        found[f"effects {name}"] = CLOSED, partial(_effects, name)
    found["render grey_floor with all"] = RENDERED, partial(_rendered, "grey_floor", "all")
    return found | {
        "exposed": (CLOSED, _exposed), "turned": (CLOSED, _turned), "changed": (CLOSED, _changed),
        "strips of facets": (CLOSED, _strips),
        "shots": (RENDERED, _shots), "block": (CLOSED, lambda: Block(kind="block", size=(3.0, 5.0, 7.5)).solid),
    }  # fmt: skip
