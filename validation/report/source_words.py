"""Sources of a budget in words, and what makes each of them smaller."""

from __future__ import annotations

from planner.budgeting.terms import BIAS, EXPANSION, MODEL, NOISE, PATTERN, POINTS, ROUNDING, TEMPERATURE, TOGETHER
from scenes.board import PITCH

ALL = "all sources"  # of a correction's uncertainty together, where a run knows no more than their sum
_WORDS = {
    BIAS + ALL: "bias correction",
    BIAS + "reflectance": "bias correction: how the part reflects",
    BIAS + "light_place": "bias correction: where the lamp stands",
    BIAS + "rendering": "bias correction: the simulation's own noise",
    BIAS + "texture": "bias correction: texture of the surface",
    MODEL: "bias that is not taken off",
    PATTERN: "fixed pattern of the sensor",
    ROUNDING: "rounding of the value",
    TEMPERATURE: "temperature of the part",
    EXPANSION: "thermal expansion of the part",
    TOGETHER: "telecentricity and depth together",
    "camera.telecentricity_deg": "telecentricity of the lens",
    "camera.magnification": "magnification", "camera.flange_mm": "sensor's distance from the lens",
    "sensor_distance": "distance of the camera",
    "sensor_roll_deg": "turn of the camera about its axis",
    "camera.distance": "distance of the camera",
    "camera.focal_px": "focal length", "camera.focal_length_mm": "focal length", "fx": "focal length",
    "fy": "focal length, y", "cx": "principal point, x", "cy": "principal point, y",
    "k1": "lens distortion, k1", "k2": "lens distortion, k2", "k3": "lens distortion, k3",
    "p1": "lens distortion, p1", "p2": "lens distortion, p2",
    "camera.pixel_pitch_um": "pixel pitch",
    "camera.blur_px": "blur",
    PITCH: "pitch of the board", POINTS: "places of points on the board",
    "camera.exposure": "exposure",
}  # fmt: skip
_OF_PARTS = {
    "sensor_deg": "direction of the camera", "light_deg": "direction of the lamp", "part_shift": "place of the part",
    "part_tilt_deg": "tilt of the part", "board_shift": "place of the board", "board_tilt_deg": "tilt of the board",
    "principal_point_px": "principal point", "hand_eye": "place of the camera on the hand",
    "stage": "linear stage", "turntable": "turntable",
}  # fmt: skip


def words(source: str) -> str:
    """A source as a page names it; one that has no words is named by its key.

    >>> words("pixel noise"), words("bias by reflectance"), words("part_shift.x")
    ('pixel noise', 'bias correction: how the part reflects', 'place of the part, x')
    >>> words("light_deg[1].polar"), words("camera.lens.focus")
    ('direction of lamp 2, polar', 'camera.lens.focus')
    """
    if source in _WORDS:
        return _WORDS[source]
    key, _, part = source.partition(".")
    name, _, which = key.rstrip("]").partition("[")
    if name not in _OF_PARTS or not part:
        return source
    told = _OF_PARTS[name]
    return f"{told.replace('the lamp', f'lamp {int(which) + 1}') if which else told}, {part}"


def keyed(source: str) -> str:
    """The same with the key beside it, where the two differ and the key is one of a scene file.

    >>> keyed("part_shift.x"), keyed("pixel noise"), keyed("bias by all sources")
    ('place of the part, x (part_shift.x)', 'pixel noise', 'bias correction')
    """
    told = words(source)
    return told if told == source or source.startswith(BIAS) or " " in source else f"{told} ({source})"


def smaller(source: str) -> str:
    """What to do for a smaller uncertainty by a source.

    >>> smaller("camera.focal_px")
    'get to know it more exactly (`ice budget SCENE --reach U` says how exactly)'
    """
    if source == NOISE:
        return "expose longer, come nearer, or take the mean of several pictures"
    if source.startswith(BIAS):
        return (
            "know better how the part reflects and where the lamp stands, and enter it in the scene's file "
            "(`reflectance` and `light_place` of its `[uncertainty]`)"
        )
    if source == MODEL:
        return "move camera or lamp to where the bias is smaller (`ice plan`), or take it off (`ice budget --render`)"
    if source == PATTERN:
        return "correct the pictures by a flat field"
    if source == ROUNDING:
        return "keep more digits of the value"
    return "get to know it more exactly (`ice budget SCENE --reach U` says how exactly)"
