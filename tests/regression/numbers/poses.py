"""The bundled scenes and poses without symmetry, not those of their files."""

import functools

import scenes
from scenes import Pose


@functools.cache
def load(name):
    """A bundled scene, loaded once."""
    return scenes.load(name)


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
