"""The position of a corner or a centre from two datum edges, or of a ball's centre in the scene's x and y."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, Point
from scenes.measurands.features import Wall
from scenes.measurands.kind import MEASURANDS
from scenes.measurands.offset import Offset
from scenes.parts.surfaces import Sphere


class Position(Offset):
    """Two offsets; of a ball's centre, whose z is that of the scene, two coordinates."""

    features = ("pee", "s")
    nominals = 2

    def check(self, solid, key, quantity) -> None:
        """Without datum edges of a ball."""
        super().check(solid, key, quantity)
        feature = quantity.features[0]
        if isinstance(feature, Wall) and not isinstance(solid.round(feature.surface).surface, Sphere):
            raise ValueError(f"{key} must be a ball for kind position, got {feature.surface!r}")

    def check_values(self, measurand) -> None:
        """From datum edges both nominal values are greater than 0."""
        wanted = measurand.nominal
        if wanted is not None and len(measurand.features) > 1 and not min(wanted) > 0:
            raise ValueError(f"nominal must be two numbers greater than 0 from datum edges, got {wanted}")

    def quantities(self, measurand, make) -> tuple:
        """NAME.x, from the first datum edge, and NAME.y, from the second."""
        feature, *datums = measurand.features
        rest = measurand.tolerance, measurand.weight
        each = [(datum,) for datum in datums] or [(), ()]
        return tuple(
            make(f"{measurand.name}.{axis}", measurand.kind, (feature, *datum), nominal, *rest)
            for axis, datum, nominal in zip("xy", each, measurand.nominal or (None, None), strict=True)
        )

    def in_image(self, seen, quantity) -> Evaluated:
        """An offset; a ball's coordinate times the image of a unit length along that axis."""
        if len(quantity.features) > 1:
            return super().in_image(seen, quantity)
        return _coordinate(seen, quantity, _scale(seen, quantity))

    def on_plane(self, seen, quantity) -> Evaluated:
        """An offset; a ball's coordinate."""
        return super().on_plane(seen, quantity) if len(quantity.features) > 1 else _coordinate(seen, quantity, 1.0)


def _coordinate(seen, quantity, scale: np.ndarray | float) -> Evaluated:
    """x or y of a ball's centre, times a scale."""
    point, k = _level(seen, quantity), quantity.axis
    return Evaluated(scale * point.at[..., k], {number: scale * move[..., k] for number, move in point.moves.items()})


def _level(seen, quantity) -> Point:
    """A ball's centre along the line of sight to it, at the height that the scene gives it."""
    curved, found, _, _ = seen.circle(quantity.features[0])
    sight = -seen.viewpoint.towards(found.at)
    reach = (curved.centre[2] - found.at[..., 2]) / sight[..., 2]
    wider = 1 + seen.viewpoint.share * reach
    moves = {
        k: wider[..., None] * (move - sight * (move[..., 2] / sight[..., 2])[..., None])
        for k, move in found.moves.items()
    }
    return Point(found.at + reach[..., None] * sight, moves)


def _scale(seen, quantity) -> np.ndarray:
    """Image of a unit length along the scene's x or y at a ball's centre, px: coordinates in the image are along it."""
    centre = seen.solid.round(quantity.features[0].surface).centre
    return np.linalg.norm(seen.slid(centre, np.eye(3)[quantity.axis]), axis=-1)


MEASURANDS.add("position")(Position())
