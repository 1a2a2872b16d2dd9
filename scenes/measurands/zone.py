"""The zone of a geometric tolerance (ISO 1101): what several numbers of a measurand, or all points, keep together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


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
        What the drawing allows: diameter or width, the scene's unit.
    is_form : bool
        Whether it is of all points of a feature (`scenes.measurands.form`).
    """

    name: str
    kind: str
    parts: tuple[str, ...]
    factor: float
    size: float | None
    is_form: bool = False

    @property
    def is_joint(self) -> bool:
        """Whether no normal number alone says that it is kept: it is decided by a law of its own."""
        return len(self.parts) > 1 or self.is_form


def joint_parts(zones: Iterable[Zone]) -> frozenset[str]:
    """Names of the numbers that nothing is decided of alone, or not by a normal law."""
    return frozenset(name for zone in zones if zone.is_joint for name in zone.parts)
