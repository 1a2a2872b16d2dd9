"""What a kind of measurand is: which features it asks for, when they make it, its value and derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from scenes.measurands.evaluated import Evaluated
from scenes.measurands.features import (
    Between,
    Centre,
    Corner,
    Side,
    Wall,
    found_at,
    is_flat,
    is_line,
    outward,
    plane_of,
    points_of,
)
from scenes.measurands.zone import Zone
from scenes.parts.solid import Solid
from scenes.registry import Registry

if TYPE_CHECKING:
    from scenes.measurands.measurands import Measurand, Quantity

_ZERO = 1e-9  # of the object's size: an offset that is none, and has no side
WORDS = {"p": "a corner or a circle", "r": "a circle or a curved surface", "s": "a curved surface", "e": "an edge",
         "c": "a circle"}  # fmt: skip
_FEATURES = {"p": (Corner, Centre), "r": (Centre, Wall), "s": (Wall,), "e": (Side,), "c": (Centre,)}


class MeasurandKind:
    """A kind of measurand; made known by ``@MEASURANDS.add(name)`` of an instance.

    ``seen`` is what was found in a picture, or is expected there (`imaging.features.seen.Seen`): it gives points, lines
    and circles, in the image or on a plane, with their derivatives.
    """

    features: ClassVar[tuple[str, ...]]
    """Orders of features that make one: p a corner or centre, c a circle, r one or a curved surface s, e an edge.

    A point between others (`scenes.measurands.between`) may stand for p, a line between others for e.
    """
    is_angle: ClassVar[bool] = False
    """Whether its unit is degrees."""
    is_flat: ClassVar[bool] = True
    """Whether its features must lie in one plane."""
    qif: ClassVar[str] = ""
    """QIF's name of the characteristic (ISO 23952: Diameter, Width, ...); empty where QIF has none."""
    parts: ClassVar[tuple[str, ...]] = ()
    """What it consists of, where that are several numbers, each called NAME.part."""
    nominals: ClassVar[int] = 1
    """How many nominal values one may be given; what is 0 by its meaning has none."""
    zone: ClassVar[float] = 0.0
    """Of a geometric tolerance its zone's size over how far a value may be off: 2 about a true place, 1 to one side.

    0 for a dimension. ``tolerance`` of a measurand is then the zone's diameter or width.
    """
    is_form: ClassVar[bool] = False
    """Whether it is about all points of a feature (`scenes.measurands.form`)."""

    is_chain: ClassVar[bool] = False
    """Whether it is of other measurands' numbers (`scenes.measurands.chain`)."""

    extreme: ClassVar[int] = 0
    """Of a chain +1 where it is the largest of its numbers, -1 where it is the smallest: not normal if several may be
    it."""

    pictures: ClassVar[int] = 1
    """How many pictures, adjusted together (`imaging.bundles`), tell it at least."""

    takes_material: ClassVar[bool] = False
    """Whether its zone may grow with a feature's size (`scenes.measurands.material`)."""

    def takes(self, features: tuple) -> bool:
        """Whether these features, in their order, make one."""
        return any(
            len(features) == len(each)
            and all(_stands_for(feature, letter) for letter, feature in zip(each, features, strict=True))
            for each in self.features
        )

    @property
    def wanted(self) -> str:
        """The features that it asks for, in words."""
        return "; or ".join(", then ".join(WORDS[letter] for letter in each) for each in self.features)

    def check(self, solid: Solid, key: str, quantity: Quantity) -> None:
        """See that features of an object make one; ValueError if not."""
        if self.is_flat and not is_flat(found_at(solid, quantity), solid.extent):
            raise ValueError(f"{key} must be features in one plane, got {', '.join(quantity.edges)}")

    def quantities(self, measurand: Measurand, make: type[Quantity]) -> tuple[Quantity, ...]:
        """The numbers that a measurand of this kind consists of."""
        nominal = measurand.nominal if isinstance(measurand.nominal, tuple) else (measurand.nominal,)
        wanted = nominal * (len(self.parts) or 1) if len(nominal) == 1 else nominal
        wanted = wanted if self.nominals else (0.0,) * (len(self.parts) or 1)
        limits = measurand.tolerance and measurand.tolerance.scaled(1 / (self.zone or 1.0))
        names = [f"{measurand.name}.{part}" for part in self.parts] or [measurand.name]
        return tuple(
            make(name, measurand.kind, self.needed(measurand.features, name), value, limits, measurand.weight)
            for name, value in zip(names, wanted, strict=True)
        )

    def check_values(self, measurand: Measurand) -> None:
        """See that nominal value and tolerance are such as this kind has; ValueError if not."""
        limits = measurand.tolerance
        if self.zone and limits is not None and limits.plus != limits.minus:
            raise ValueError(
                f"tolerance must be one number, the zone's size, for kind {measurand.kind}, "
                f"got plus {limits.plus}, minus {limits.minus}"
            )

    def needed(self, features: tuple, name: str) -> tuple:
        """Those of a measurand's features of which a number of it, by its name, is."""
        return features

    def zone_of(self, measurand: Measurand) -> Zone | None:
        """What a geometric tolerance of this kind limits; None of a dimension."""
        if not self.zone:
            return None
        names = tuple(f"{measurand.name}.{part}" for part in self.parts) or (measurand.name,)
        size = measurand.tolerance and measurand.tolerance.plus
        return Zone(measurand.name, measurand.kind, names, self.zone, size, is_form=self.is_form)

    def in_image(self, seen: Any, quantity: Quantity) -> Evaluated:
        """Value and derivatives in the image: px, or degrees."""
        return self.evaluated(seen, quantity, None)

    def on_plane(self, seen: Any, quantity: Quantity) -> Evaluated:
        """The same on the plane of its features: the scene's unit, or degrees."""
        return self.evaluated(seen, quantity, plane(seen, quantity))

    def evaluated(self, seen: Any, quantity: Quantity, plane: np.ndarray | None) -> Evaluated:
        """The same in the image (``plane`` None) or on a plane of unit normal (..., 3): one formula for both."""
        raise NotImplementedError


MEASURANDS: Registry[MeasurandKind] = Registry("measurand kind")


def _stands_for(feature: Any, letter: str) -> bool:
    if isinstance(feature, Between):
        return letter == ("e" if is_line(feature) else "p")
    return isinstance(feature, _FEATURES[letter])


def plane(seen: Any, quantity: Quantity) -> np.ndarray:
    """Unit normal of the plane in which it is measured, towards the sensor, (..., 3).

    That of `plane_of`; where that is none, the plane through both points that faces the sensor most.
    """
    points = points_of(seen.solid, quantity)
    ray = -seen.viewpoint.towards(points.mean(0))
    normal = plane_of(seen.solid, quantity)
    if normal is None:
        along = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
        normal = ray - (ray @ along)[..., None] * along
        normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    away = np.einsum("...i,...i->...", np.broadcast_to(normal, ray.shape), ray)
    return np.where(away[..., None] > 0, -normal, normal)


def side(
    seen: Any, quantity: Quantity, point: np.ndarray, line: tuple[np.ndarray, np.ndarray], *, in_space: bool
) -> np.ndarray:
    """+1 or -1 (...): on which side of a line (its start, its direction) a point is, so that it counts as positive.

    The in-plane normal is turned one way as the sensor sees the plane, and the other way in the image, whose y axis
    points down.
    """
    start, along = line
    away = np.cross(plane(seen, quantity), along) @ (point - start)
    sign = np.where(away < -_ZERO * seen.solid.extent * np.linalg.norm(along), -1.0, 1.0)
    return sign if in_space else -sign


def turn(seen: Any, quantity: Quantity, *, in_space: bool) -> np.ndarray:
    """+1 or -1 (...): whether `across` of a direction points to the left of it as seen from a plane's own outside.

    For what may lie on either side of a line, or upon it, so that the object itself tells no side. The outside is the
    side to which the normal's largest component points along the scene's axes.
    """
    facing = plane(seen, quantity)
    normal = plane_of(seen.solid, quantity)
    normal = facing if normal is None else normal
    sign = np.sign(np.einsum("...i,...i->...", outward(normal), facing))
    return sign if in_space else -sign
