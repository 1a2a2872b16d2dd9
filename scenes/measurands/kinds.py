"""The kinds of measurands of the project, in the order of pages and messages."""

from scenes.measurands import (  # noqa: F401, I001
    distance, width, offset, angle, diameter, radius, taper, position, slot, pitch_circle,
    true_position, concentricity, symmetry, parallelism, perpendicularity, straightness, roundness, profile,
    height, face_angle, chain,
)  # fmt: skip
from scenes.measurands.kind import MEASURANDS, MeasurandKind

__all__ = ["MEASURANDS", "MeasurandKind"]
