"""What a scene's tables must be together: a message says which of them is not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scenes.cameras.lens_modes import check_lens_modes
from scenes.lights.filters import check_names
from scenes.materials.textures import check_textures
from scenes.measurands.features import Corner, check_feature
from scenes.measurands.kinds import MEASURANDS
from scenes.measurands.measurands import Task, check_quantity, quantities_of
from scenes.parts.mesh_file import Mesh
from scenes.placement import check_placement
from scenes.uncertain import check_uncertain
from scenes.view import check_view

if TYPE_CHECKING:
    from scenes.scene import Scene

MOST_LIGHTS = 16


def check_consistent(scene: Scene) -> None:
    """See that a scene's tables go together.

    Raises
    ------
    ValueError, InvalidInput
        If two of them contradict each other, or one names what the part does not have.
    """
    mesh = scene.object if isinstance(scene.object, Mesh) else None
    check_view(scene.solid, scene.camera, scene.units, mesh and mesh.units, mesh is not None)
    _check_measurands(scene)
    _check_surroundings(scene)
    _check_lights(scene)
    check_names("lamps", scene.lamps)
    check_names("filters", scene.filters)
    _ = scene.surfaces  # names of faces
    _check_curved(scene)
    _check_colour(scene)
    _check_forms(scene)
    check_placement(scene)
    check_textures(scene.textures, scene.solid)
    check_uncertain(scene, scene.uncertain)
    scene.uncertainty.check_once(scene.uncertain)
    check_lens_modes(scene.camera, scene.uncertainty.lens_modes)
    for i, setting in enumerate(scene.settings):
        scene.check_pose("sensor", setting.sensor, f"settings[{i}].sensor")
        scene.check_lights(setting.lights, f"settings[{i}].light")


def _check_lights(scene: Scene) -> None:
    """Either ``light`` or ``lights``; those that are fixed stand clear of the object."""
    if (scene.light is None) == (not scene.several_lights):
        raise ValueError(f"light or lights must be given, not both, got {'both' if scene.light else 'none'}")
    if len(scene.lights) > MOST_LIGHTS:
        raise ValueError(f"lights must be at most {MOST_LIGHTS}, got {len(scene.lights)}")
    if not any(light.intensity > 0 for light in scene.lights):
        raise ValueError(f"{'lights' if scene.several_lights else 'light'}.intensity must be more than 0 once, got 0")
    for i, light in enumerate(scene.lights):
        if light.pose is not None and not light.faces_sensor:
            scene.check_pose("light", light.pose, f"lights[{i}].pose" if scene.several_lights else "light.pose", i)


def _check_measurands(scene: Scene) -> None:
    """``task`` or ``measurands``, not both, of features that the object has; a scene without is only looked at."""
    if scene.task is not None and scene.measurands:
        raise ValueError("task or measurands must be given, not both, got both")
    names = [quantity.name for quantity in quantities_of(scene.task, scene.measurands)]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"measurands must have different names, got {name!r} twice")
    if scene.task is not None:
        _check_task(scene, scene.task)
    whole = scene.all_walls if scene.measured_walls else scene.solid
    for i, measurand in enumerate(scene.measurands):
        for k, feature in enumerate(measurand.features):
            check_feature(whole, f"measurands[{i}].features[{k}]", feature)
        for quantity in measurand.quantities:
            check_quantity(scene.solid, f"measurands[{i}].features", quantity)
    _ = scene.zones  # what some grow with


def _check_task(scene: Scene, task: Task) -> None:
    for end, feature in zip(("start", "end"), task.corners, strict=False):
        check_feature(scene.solid, f"task.{end}", feature)
    if task.kind == "angle":
        known = [edge.name for edge in scene.solid.sharp]
        for name in task.lines:
            if name not in known:
                raise ValueError(f"task.lines must be edges ({', '.join(known)}), got {name!r}")
        if task.lines[0] == task.lines[1]:
            raise ValueError(f"task.lines must be two different edges, got {list(task.lines)}")
        check_quantity(scene.solid, "task.lines", task.quantity)
    elif task.start == task.end or (getattr(task.start, "vertex", 0) == getattr(task.end, "vertex", 1)):
        key = "vertex" if isinstance(task.end, Corner) else "circle"
        raise ValueError(f"task.end.{key} must be another {key} than task.start.{key}, got {getattr(task.end, key)!r}")


def _check_curved(scene: Scene) -> None:
    """What limbs are not known with."""
    if not scene.solid.curved:
        return
    if scene.camera.lens.bends:
        raise ValueError("camera.lens must be without distortion for a curved object, got one that bends")
    if scene.textures:
        raise ValueError(f"textures must be none for a curved object, got {len(scene.textures)}")


def _check_forms(scene: Scene) -> None:
    """The law of a form's size takes its points' errors for those of independent pixels."""
    forms = [each.name for each in scene.measurands if MEASURANDS[each.kind].is_form]
    if scene.noise.is_shared and forms:
        raise ValueError(f"noise.row_sigma and column_sigma must be 0 for forms, got some with {', '.join(forms)}")


def _check_colour(scene: Scene) -> None:
    """The picture is not sharper than demosaicing leaves it, nor its locator finer than the pixels read."""
    colour, blur = scene.noise.colour, scene.camera.blur_px
    if colour is not None and blur < colour.blur_px:
        raise ValueError(
            f"camera.blur_px must be at least {colour.blur_px:.4g}, by which bilinear demosaicing blurs a picture "
            f"of {colour.reads} itself, got {blur:g}"
        )
    if colour is not None and colour.interpolates and scene.camera.blur_field is not None:
        raise ValueError(
            f"camera.blur_field must be left out with noise.colour.demosaicing = {colour.demosaicing}, got one"
        )
    if colour is not None and scene.locator.scale_px < colour.least_scale_px:
        raise ValueError(
            f"locator.scale_px must be at least {colour.least_scale_px:g} where only {colour.reads} is read, from "
            f"every second pixel of every second row, got {scene.locator.scale_px:g}"
        )


def _check_surroundings(scene: Scene) -> None:
    """Floor below the object."""
    low = float(scene.solid.vertices[:, 2].min())
    if scene.floor is not None and scene.floor.height > low:
        raise ValueError(f"floor.height must be at most {low:g}, the object's lowest point, got {scene.floor.height:g}")
