"""Lights: what they look like and where they are mounted, one file a kind; lamps and filters at hand."""

from scenes.lights.backlight import Backlight
from scenes.lights.bar import Bar
from scenes.lights.disc import Disc
from scenes.lights.dome import Dome
from scenes.lights.kinds import LIGHTS, AnyLight
from scenes.lights.luminaire import FULL, GLANCE, SMOOTH, Luminaire, Mount, Nodes
from scenes.lights.point import Light, as_point
from scenes.lights.ring import Ring

__all__ = [
    "FULL", "GLANCE", "LIGHTS", "SMOOTH", "AnyLight", "Backlight", "Bar", "Disc", "Dome", "Light", "Luminaire", "Mount",
    "Nodes", "Ring", "as_point",
]  # fmt: skip
