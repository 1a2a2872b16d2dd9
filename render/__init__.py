"""A scene and a pose become an image: rendered without noise, then exposed with the sensor's noise."""

from render.effects import Tolerance, choose, effects
from render.effects.pose import shaken
from render.image import Quality, image
from render.sensor import expose, variance
from render.shots import shots

__all__ = ["Quality", "Tolerance", "choose", "effects", "expose", "image", "shaken", "shots", "variance"]
