"""A direction of the viewing space: where on its sphere the sensor or the light stands."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, PlainSerializer

from scenes.errors import InvalidInput, given

DIGITS = 1  # decimal places of a pose's angles, degrees, wherever it is planned, printed or stored


@dataclass(frozen=True, order=True)
class Pose:
    """Place on a sphere around the object's reference point, in degrees.

    Parameters
    ----------
    polar_deg : float
        Angle from the vertical (the object's z axis), 0 to 180.
    azimuth_deg : float
        Angle in the horizontal plane from the x axis towards the y axis.

    Raises
    ------
    InvalidInput
        If an angle is not finite or the polar angle lies outside 0 to 180.

    Examples
    --------
    >>> Pose(30, 90)
    Pose(polar_deg=30.0, azimuth_deg=90.0)
    """

    polar_deg: float
    azimuth_deg: float

    def __post_init__(self) -> None:
        for name in ("polar_deg", "azimuth_deg"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= sys.float_info.max:
                raise InvalidInput(f"{name} must be a finite number of degrees, got {given(value)}")
            object.__setattr__(self, name, float(value))
        if not 0 <= self.polar_deg <= 180:
            raise InvalidInput(f"polar_deg must be between 0 and 180, got {self.polar_deg:g}")

    @property
    def printed(self) -> str:
        """As tables and lines print it.

        Examples
        --------
        >>> Pose(41.6, 222.13).printed
        '(41.6, 222.1)'
        """
        return f"({self.polar_deg:.{DIGITS}f}, {self.azimuth_deg:.{DIGITS}f})"

    @classmethod
    def of(cls, value: Any) -> Pose:
        """A pose from a pose, or from a pair (polar, azimuth) in degrees."""
        if isinstance(value, cls):
            return value
        try:
            polar, azimuth = value
        except (TypeError, ValueError):
            raise InvalidInput(f"pose must be a pair (polar, azimuth) in degrees, got {given(value)}") from None
        return cls(polar, azimuth)

    def __iter__(self):
        return iter((self.polar_deg, self.azimuth_deg))

    def __str__(self) -> str:
        return f"({self.polar_deg:g}, {self.azimuth_deg:g})"


PoseField = Annotated[Pose, BeforeValidator(Pose.of, json_schema_input_type=tuple[float, float]), PlainSerializer(list)]


def pairs(lights: Pose | tuple[Pose, ...]) -> tuple[Any, ...]:
    """A pose as a pair of numbers, several as a tuple of pairs.

    >>> pairs(Pose(15, 315)), pairs((Pose(15, 315), Pose(60, 90))), pairs(())
    ((15.0, 315.0), ((15.0, 315.0), (60.0, 90.0)), ())
    """
    return tuple(lights) if isinstance(lights, Pose) else tuple(tuple(each) for each in lights)


def shown(lights: tuple[Any, ...]) -> str:
    """What `pairs` gives, for people.

    >>> shown((15.0, 315.0)), shown(((15.0, 315.0), (60.0, 90.0))), shown(())
    ('(15, 315)', '(15, 315) (60, 90)', '-')
    """
    if lights and not isinstance(lights[0], tuple | list):
        return f"({lights[0]:g}, {lights[1]:g})"
    return " ".join(map(shown, lights)) or "-"


def several(lights: Any) -> tuple[Any, ...]:
    """A pose, a pair of numbers, or a list of either, as a tuple."""
    if isinstance(lights, Pose):
        return (lights,)
    try:
        parts = tuple(lights)
    except TypeError:
        return (lights,)
    nested = all(isinstance(part, Pose) or (isinstance(part, Iterable) and not isinstance(part, str)) for part in parts)
    return parts if nested else (lights,)


def one_or_all(poses: tuple[Pose, ...]) -> Pose | tuple[Pose, ...]:
    """One pose itself, several as they are: of free lights as a caller gives them, which `several` makes alike.

    >>> one_or_all((Pose(15, 315),)), one_or_all(())
    (Pose(polar_deg=15.0, azimuth_deg=315.0), ())
    """
    return poses[0] if len(poses) == 1 else poses
