"""Real numbers of a scene by their keys, as error messages name them: read, and changed in a copy."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from scenes.cameras.data_sheet import derived
from scenes.cameras.pinhole import shear

if TYPE_CHECKING:
    from scenes.cameras.pinhole import Camera
    from scenes.scene import Scene

ROOTS = ("camera", "light", "lights", "material", "noise", "floor", "placement")
"""Tables of a scene whose numbers may be uncertain."""
_STEP = re.compile(r"\.?([A-Za-z_]\w*)|\[(\d+)\]")
_MOVING = ("motion", "line_time_us")
_TWICE = {"working_distance_mm": "distance"}


def steps_of(key: str) -> list[str | int]:
    """The names and numbers that lead to a number.

    >>> steps_of("lights[1].distance")
    ['lights', 1, 'distance']
    """
    return [name or int(index) for name, index in _STEP.findall(key)]


def number_at(scene: Scene, key: str) -> float:
    """A real number of a scene.

    Raises
    ------
    ValueError
        If there is none of that key.

    Examples
    --------
    >>> import scenes
    >>> number_at(scenes.load("task1"), "camera.look_at[2]")
    0.0
    """
    steps = steps_of(key)
    at: Any = scene if steps and steps[0] in ROOTS else None
    for step in steps:
        at = _inner(at, step)
    if not isinstance(at, float):
        raise ValueError(f"uncertain.key must be a number of {', '.join(ROOTS)}, got {key!r}")
    return at


def with_number(scene: Scene, key: str, value: float) -> Scene:
    """The scene with another number, unchecked: for small changes of one that is a scene.

    What the camera's data sheet says is kept true: another focal length or pitch is another ``focal_px``. Another
    distance is one that the lens was not set for, and so leaves ``focal_px`` as it is.

    Examples
    --------
    >>> import scenes
    >>> bracket = scenes.load("bracket_mm")
    >>> longer = with_number(bracket, "camera.focal_length_mm", 25.25)
    >>> round(longer.camera.focal_px / bracket.camera.focal_px, 4)
    1.0109
    """
    name = key.removeprefix("camera.")
    if name == "distance":
        return scene.tried(camera=scene.camera.moved_to(value))
    changed = _changed(scene, steps_of(key), value)
    if name in scene.camera.sheet or name.startswith("blur_field.mtf") or name == "blur_field.lp_per_mm":
        return changed.tried(camera=_followed(changed))
    if name.partition("[")[0] in _MOVING:
        camera = changed.camera
        told = camera.lens.tried(shear=shear(camera.line_time_us, camera.motion, camera.focal_px / camera.distance))
        return changed.tried(camera=camera.tried(lens=told))
    if name in _TWICE:
        scale = value / number_at(scene, key)
        return with_number(changed, "camera.distance", scene.camera.distance * scale)
    return changed


def _followed(scene: Scene) -> Camera:
    """The scene's camera with what follows from its data sheet."""
    camera = scene.camera
    said = {name: getattr(camera, name) for name in type(camera).model_fields}
    followed = derived(type(camera), said, scene.units, camera.pixel_pitch_um)
    return camera.tried(**{name: number for name, (number, _) in followed.items()})


def _inner(at: Any, step: str | int) -> Any:
    if isinstance(step, int):
        return at[step] if isinstance(at, tuple) and step < len(at) else None
    return getattr(at, "several_lights" if step == "lights" else step, None)


def _changed(at: Any, steps: list[str | int], value: float) -> Any:
    if not steps:
        return value
    step, inner = steps[0], _changed(_inner(at, steps[0]), steps[1:], value)
    if isinstance(step, int):
        return (*at[:step], inner, *at[step + 1 :])
    return at.tried(**{"several_lights" if step == "lights" else step: inner})
