"""The zone of a geometric tolerance (ISO 1101): what several numbers of a measurand, or all points, keep together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class MaximumMaterial:
    """What a zone grows with (ISO 2692, maximum material requirement).

    Attributes
    ----------
    of : str
        Name of the number that is the feature's size.
    limit : float
        The size at which there is most material, the scene's unit: the least of a hole, the largest of a shaft.
    sign : float
        1 of a hole, -1 of a shaft.
    """

    of: str
    limit: float
    sign: float

    def departure(self, size: float) -> float:
        """How much less material a feature of a size has: what the zone is larger by."""
        return self.sign * (size - self.limit)


@dataclass(frozen=True)
class Zone:
    """A zone about a true place, or between two parallel lines.

    Attributes
    ----------
    name, kind : str
        Of the measurand.
    parts : tuple of str
        Names of the numbers whose deviations from their nominal values have to lie in it: as one number, or as the
        components of a way in a plane, at right angles, whose length counts.
    factor : float
        Size over that length, or over the number's magnitude: 2 of a zone about a true place.
    size : float or None
        What the drawing allows: diameter or width, the scene's unit; at maximum material, where it grows.
    material : MaximumMaterial, optional
        What it grows with.
    is_form : bool
        Whether it is of all points of a feature (`scenes.measurands.form`).
    """

    name: str
    kind: str
    parts: tuple[str, ...]
    factor: float
    size: float | None
    material: MaximumMaterial | None = None
    is_form: bool = False

    @property
    def is_joint(self) -> bool:
        """Whether no normal number alone says that it is kept: it is decided by a law of its own."""
        return len(self.parts) > 1 or self.is_form or self.material is not None

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of all that decides whether it is kept: its parts, and the size with which it grows."""
        return self.parts if self.material is None else (*self.parts, self.material.of)


def joint_parts(zones: Iterable[Zone]) -> frozenset[str]:
    """Names of the numbers that nothing is decided of alone, or not by a normal law."""
    return frozenset(name for zone in zones if zone.is_joint for name in zone.parts)
