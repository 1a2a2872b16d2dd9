"""The bundled scenes and poses without symmetry, not those of their files."""

import functools

import scenes
from scenes import Pose

_NOISE = {"sigma": 2.1, "bits": 10, "gain": 0.06, "dark_level": 23.0, "prnu": 0.004, "dsnu": 0.4}

# what no bundled scene shows: other lights, things around holes and limbs, and distances, scales and
# noises of which no two are alike, or 0 or 1
_CHANGED = {
    "block under a disc": ("task1", {"light": {"kind": "disc", "distance": 61.0, "radius": 7.0}}),
    "block under a bar": ("task1", {"light": {"kind": "bar", "distance": 47.0, "length": 31.0, "width": 3.0,
                                              "turn_deg": 23.0}}),
    "block under a ring": ("glossy_metal", {"light": {"kind": "ring", "distance": 52.0, "inner_radius": 9.0,
                                                      "outer_radius": 13.0, "tilt_deg": 21.0}}),
    "block under a dome": ("task1", {"light": {"kind": "dome", "distance": 90.0, "half_angle_deg": 61.0,
                                               "opening_deg": 17.0}}),
    "block under a ball of light": ("glossy_metal", {"light": {"kind": "point", "distance": 43.0, "radius": 4.0}}),
    "plate on a floor": ("plate", {"floor": {"reflectance": 0.3, "height": -0.4},
                                   "obstacles": [{"corner": [-6.0, -2.0, -0.3], "size": [2.0, 7.5, 5.0]}]}),
    "ball on a floor": ("ball", {"floor": {"reflectance": 0.25, "height": -1.0},
                                 "obstacles": [{"corner": [-40.0, -9.0, 0.0], "size": [12.0, 30.0, 25.0]}]}),
    "shaft under a lamp": ("shaft", {"light": {"kind": "bar", "distance": 70.0, "length": 160.0, "width": 21.0,
                                               "turn_deg": 12.0},
                                     "settings": [{"sensor": [12.0, 70.0], "light": [31.0, 81.0]}]}),
    "block through a lens": ("wedge", {"camera": {"lens": {"distortion": [-0.11, 0.05, 0.002, -0.001, 0.01]},
                                                  "roll_deg": 13.0}}),
    "block of unequal numbers": ("task1", {
        "camera": {"distance": 83.0, "look_at": [1.1, -0.7, 0.6], "roll_deg": 13.0, "blur_px": 0.75, "exposure": 230.0,
                   "lens": {"aperture_radius": 0.4, "focus": 81.0}},
        "light": {"distance": 61.0}, "locator": {"scale_px": 1.4, "window_px": 3.7}, "noise": _NOISE,
        "jitter": {"sensor_deg": 0.05, "light_deg": 0.1}}),
    "plate of unequal numbers": ("plate", {
        "camera": {"distance": 91.0, "look_at": [0.9, -0.4, 0.3], "roll_deg": -21.0, "blur_px": 0.5},
        "light": {"distance": 67.0}, "locator": {"scale_px": 0.85, "window_px": 3.3}, "noise": _NOISE}),
    "ball of unequal numbers": ("ball", {
        "camera": {"distance": 171.0, "look_at": [0.4, -0.9, 9.1], "roll_deg": 8.0, "blur_px": 0.8},
        "light": {"distance": 290.0}, "locator": {"scale_px": 1.3, "window_px": 3.9}, "noise": _NOISE}),
}  # fmt: skip


@functools.cache
def load(name):
    """A bundled scene or a changed one, made once."""
    if name not in _CHANGED:
        return scenes.load(name)
    origin, changes = _CHANGED[name]
    return scenes.load(origin).with_(**changes)


CHANGED = tuple(_CHANGED)


def uneven(scene, number=-1, by=(1.37, 2.91, 2.23, -3.77)):
    """Sensor and light, or lights, of a setting, each turned by its own few degrees."""
    setting = scene.settings[number]
    sensor = _turned(setting.sensor, *by[:2])
    lights = setting.light if isinstance(setting.light, tuple) else (setting.light,)
    turned = tuple(_turned(light, by[2] + i, by[3] - i) for i, light in enumerate(lights))
    return sensor, turned if isinstance(setting.light, tuple) else turned[0]


def _turned(pose, polar, azimuth):
    found = Pose.of(pose)
    return Pose(found.polar_deg + polar, found.azimuth_deg + azimuth)


def without_error(make):
    """A result, or the words in which it is refused."""
    try:
        return make()
    except scenes.InvalidInput as error:
        return f"refused: {error}"
