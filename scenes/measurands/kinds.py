"""The kinds of measurands of the project, in the order of pages and messages."""

from scenes.measurands import distance, width, offset, angle, diameter, taper, position  # noqa: F401, I001
from scenes.measurands.kind import MEASURANDS, MeasurandKind

__all__ = ["MEASURANDS", "MeasurandKind"]
