"""Tone curves: from the numbers of a file, which most cameras write gamma coded, to the light that made them."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from scenes.errors import InvalidInput

_LONGEST = 65536  # of a table: one number for each of 16 bits
_LINEAR = 0.04045  # of the full scale: below it sRGB is a straight line (IEC 61966-2-1)


@dataclass(frozen=True)
class Tone:
    """A tone curve: light as a function of what is written, both as parts of the full scale.

    Attributes
    ----------
    name : str
        "none", "sRGB", "gamma 2.2", "table": what is told of it.
    power : float
        Of the curve; 1 where nothing is to be undone, 0 where it is sRGB's or a table.
    table : tuple of float
        Light at equally spaced numbers, where a profile holds one.
    """

    name: str
    power: float = 1.0
    table: tuple[float, ...] = ()

    def light(self, written: np.ndarray) -> np.ndarray:
        """Light, 0 to 1, of numbers from 0 to 1.

        Examples
        --------
        >>> SRGB.light(np.array([0.0, 0.5, 1.0])).round(3)
        array([0.   , 0.214, 1.   ])
        """
        written = np.asarray(written)
        if self.table:
            return np.interp(written, np.linspace(0, 1, len(self.table)), self.table).astype(written.dtype)
        if self.power:
            return written if self.power == 1 else np.power(np.maximum(written, 0), self.power)
        return np.where(written <= _LINEAR, written / 12.92, ((np.maximum(written, 0) + 0.055) / 1.055) ** 2.4)

    @property
    def plain(self) -> bool:
        """Whether there is nothing to undo."""
        return self.power == 1 and not self.table


NONE, SRGB = Tone("none"), Tone("sRGB", 0.0)


def asked(gamma: str) -> Tone:
    """The curve that a user names: "none", "srgb", or the exponent that turns numbers into light.

    Raises
    ------
    InvalidInput
        If it is none of these.
    """
    known = {"none": NONE, "srgb": SRGB}
    if gamma.lower() in known:
        return known[gamma.lower()]
    try:
        power = float(gamma)
    except ValueError:
        power = float("nan")
    if not 0.1 <= power <= 10:
        raise InvalidInput(f"--gamma must be none, srgb or a number from 0.1 to 10, got {gamma!r}")
    return NONE if power == 1 else Tone(f"gamma {power:g}", power)


def of_profile(profile: bytes) -> Tone | None:
    """The tone curve of an ICC profile (its green or grey one), None if it holds none that is known."""
    try:
        count = struct.unpack(">I", profile[128:132])[0]
        tags = [struct.unpack(">4sII", profile[132 + 12 * k : 144 + 12 * k]) for k in range(min(count, 200))]
        found = {name: profile[start : start + size] for name, start, size in tags}
        return _curve(next(found[name] for name in (b"gTRC", b"kTRC", b"rTRC") if name in found))
    except (struct.error, StopIteration, ValueError):
        return None


def _curve(data: bytes) -> Tone | None:
    kind = data[:4]
    if kind == b"para":
        form, power = struct.unpack(">H", data[8:10])[0], struct.unpack(">i", data[12:16])[0] / 65536
        if form == 0:
            return _powered(power)
        return SRGB if form in (3, 4) and abs(power - 2.4) < 0.01 else None
    if kind != b"curv":
        return None
    count = struct.unpack(">I", data[8:12])[0]
    if count < 2:
        return NONE if count == 0 else _powered(struct.unpack(">H", data[12:14])[0] / 256)
    if count > _LONGEST:
        return None
    table = np.array(struct.unpack(f">{count}H", data[12 : 12 + 2 * count])) / 65535
    close = np.abs(table - SRGB.light(np.linspace(0, 1, count))).max() < 1e-3
    return SRGB if close else Tone("the profile's table", 0.0, tuple(table.tolist()))


def _powered(power: float) -> Tone | None:
    if not 0.1 <= power <= 10:
        return None
    return NONE if power == 1 else Tone(f"gamma {power:.4g}", power)
