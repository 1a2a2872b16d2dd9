"""Images made without the renderer: a convex polygon, exactly blurred and exactly averaged over square pixels."""

from validate.hard.polygon import polygon_image

__all__ = ["polygon_image"]
