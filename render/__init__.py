"""A scene and a pose become an image: rendered without noise, then exposed with the sensor's noise."""

from render.image import Quality, image
from render.sensor import expose

__all__ = ["Quality", "expose", "image"]
