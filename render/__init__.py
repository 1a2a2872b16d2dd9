"""A scene and a pose become an image: rendered without noise, then exposed with the sensor's noise."""

import ice_vision

ice_vision.check(__file__, "scenes", "imaging")

from render.phenomena import EffectTolerance, choose, effects
from render.phenomena.pose import shaken
from render.quality import Quality
from render.renderer import image
from render.sensor import Exposer, expose, variance
from render.series import shots

__all__ = [
    "EffectTolerance",
    "Exposer",
    "Quality",
    "choose",
    "effects",
    "expose",
    "image",
    "shaken",
    "shots",
    "variance",
]
