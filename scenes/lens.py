"""What makes a lens more than a pinhole."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scenes.model import Model
from scenes.ranges import NotNegative, Positive


class Lens(Model):
    """What makes the lens more than a pinhole.

    ``aperture_radius`` (cm) of a thin lens focused at the distance ``focus`` (cm; the origin's when not given), and
    the radial ``distortion`` k1: a point at r focal lengths from the image's centre is seen at r (1 + k1 r^2).
    """

    aperture_radius: NotNegative = 0.0
    focus: Positive | None = None
    distortion: Annotated[float, Field(ge=-1, le=1)] = 0.0
