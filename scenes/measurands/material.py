"""The maximum material requirement (ISO 2692): a zone that grows as a feature has less material than it may have."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from scenes.measurands.features import Centre, Wall
from scenes.measurands.zone import MaximumMaterial
from scenes.parts.solid import Circle, Solid

if TYPE_CHECKING:
    from scenes.measurands.measurands import Measurand, Quantity

_SAME = 1e-6  # of the part's size, and sine of an angle: of one axis


def material_of(solid: Solid, key: str, each: Measurand, quantities: Iterable[Quantity]) -> MaximumMaterial:
    """What a measurand's zone grows with.

    Parameters
    ----------
    solid : Solid
    key : str
        Of the measurand in its scene, for messages.
    each : Measurand
        That has ``maximum_material``.
    quantities : iterable of Quantity
        All numbers of its scene.

    Raises
    ------
    ValueError
        If that is no size with a tolerance, or that of another feature.
    """
    size = next((one for one in quantities if one.name == each.maximum_material), None)
    if size is None or not (size.kind == "diameter" or (size.kind == "slot" and size.part == "width")):
        got = f"{each.maximum_material!r}" if size is None else f"a {size.kind}, {size.name!r}"
        raise ValueError(f"{key}.maximum_material must be the name of a diameter or of a slot's width, got {got}")
    if size.tolerance is None:
        raise ValueError(f"{key}.maximum_material must be a size that has a tolerance, got {size.name!r}")
    rounds = [_round(solid, feature) for feature in size.features]
    own = [
        solid.circle(part.circle) for part in each.quantities[0].of(each.features[0]).basic if isinstance(part, Centre)
    ]
    if own and not any(_is_same(one, other, solid.extent) for one in own for other in rounds):
        raise ValueError(f"{key}.maximum_material must be the size of {own[0].name}, got that of {size.edges[0]}")
    nominal = 2 * float(np.mean([one.radius for one in rounds])) if size.nominal is None else size.nominal
    if isinstance(rounds[0], Circle) and rounds[0].hole:
        return MaximumMaterial(size.name, nominal - size.tolerance.minus, 1.0)
    return MaximumMaterial(size.name, nominal + size.tolerance.plus, -1.0)


def _round(solid: Solid, feature: Centre | Wall):
    """A rim, or the surface of a shaft or a ball."""
    return solid.circle(feature.circle) if isinstance(feature, Centre) else solid.round(feature.surface)


def _is_same(one: Circle, other, extent: float) -> bool:
    """Whether both are of one bore or shaft; of a curved surface nothing is said."""
    if not isinstance(other, Circle):
        return True
    away = other.centre - one.centre
    beside = np.linalg.norm(away - one.axis * (away @ one.axis))
    alike = abs(one.radius - other.radius) <= _SAME * extent and np.linalg.norm(np.cross(one.axis, other.axis)) <= _SAME
    return bool(alike and beside <= _SAME * extent)
