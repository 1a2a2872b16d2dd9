"""What two inputs do together: the chief rays' angle of a telecentric lens and what stands nearer or farther.

Where the angle is known but for its sign its expectation is 0; then a part's height alone moves nothing, and a first
order budget has none of it. The second order is a product of both (JCGM 100, 5.1.2, note), here of the angle and every
other input that moves places in the image.
"""

from __future__ import annotations

import numpy as np

from planner.budgeting.features import Features
from planner.budgeting.sensitivities import STEP, pulled
from planner.budgeting.sources import Source
from planner.budgeting.station import Station

ANGLE = "camera.telecentricity_deg"


def products(features: Features, given: tuple[Source, ...]) -> np.ndarray:
    """Standard uncertainty of all M values by products of the chief rays' angle and another input, shape (M,).

    The root of the sum of (d2 value / d angle d x u(angle) u(x))^2 over inputs x, of which the first order knows
    nothing; the scene's unit or degrees. Inputs of a calibration count as uncorrelated.
    """
    angle = next((each for each in given if each.name == ANGLE), None)
    total = np.zeros(len(features.known.quantities))
    if angle is None or angle.told.u == 0:
        return total
    here = Station.nominal(features.pictures)
    for other in given:
        if other.kind == "geometry" and other is not angle and other.told.u > 0:
            total += (_mixed(features, here, angle, other) * other.told.u) ** 2
    return np.sqrt(total)


def _mixed(features: Features, here: Station, angle: Source, other: Source) -> np.ndarray:
    """Change of the values' derivative by an input over the angle's standard uncertainty, shape (M,)."""
    step, slopes = STEP * other.scale, []
    for sign in (1, -1):
        turned = angle.moved(here, sign * angle.told.u)
        ahead, behind = (features.errors(other.moved(turned, way * step)) for way in (1, -1))
        slopes.append((ahead - behind) / (2 * step))
    return pulled(features.gradient_object, slopes[0] - slopes[1]) / 2
