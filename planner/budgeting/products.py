"""What two inputs do together: the chief rays' angle of a telecentric lens and what stands nearer or farther.

Where the angle is known but for its sign its expectation is 0; then a part's height alone moves nothing, and a first
order budget has none of it. The second order is a product of both (JCGM 100, 5.1.2, note), here of the angle and every
other input that moves places in the image.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.budgeting.features import Features
from planner.budgeting.sensitivities import by_geometry
from planner.budgeting.sources import Source
from planner.budgeting.station import Station

ANGLE = "camera.telecentricity_deg"


def products(features: Features, given: tuple[Source, ...]) -> np.ndarray:
    """Standard uncertainty of all M values by products of the chief rays' angle and another input, shape (M,).

    The root of the sum of (d2 value / d angle d x u(angle) u(x))^2 over inputs x, of which the first order knows
    nothing; the scene's unit or degrees. Inputs of a calibration count as uncorrelated.
    """
    angle = next((each for each in given if each.name == ANGLE), None)
    if angle is None or angle.told.u == 0:
        return np.zeros(len(features.known.quantities))
    others = [each for each in given if each.kind == "geometry" and each is not angle and each.told.u > 0]
    u = np.array([each.told.u for each in others])
    return np.sqrt(((_mixed(features, angle, others) * u[:, None]) ** 2).sum(0))


def _mixed(features: Features, angle: Source, others: Sequence[Source]) -> np.ndarray:
    """Change of the values' derivatives by n inputs over the angle's standard uncertainty, shape (n, M)."""
    here = Station.nominal(features.pictures)
    more, less = (by_geometry(features, angle.moved(here, sign * angle.told.u), others) for sign in (1, -1))
    return (more - less) / 2
