"""Boxes of poses of a sensor and a light about two poses: how far each is off along its meridian and around."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

Ranges = tuple[tuple[float, float], tuple[float, float]]  # of polar angles and azimuths, degrees


@dataclass(frozen=True, eq=False)
class PoseBox:
    """Poses of sensor and light that are off by no more than an angle in each direction.

    Around, along the circle of latitude, an angle is that of an azimuth at the middle's polar angle; a box that reaches
    a pole holds all azimuths.

    Attributes
    ----------
    middle : ndarray, shape (4,)
        Polar angle and azimuth of the sensor, then of the light, degrees.
    off : ndarray, shape (2,)
        Largest angles of the sensor and of the light, degrees.

    Examples
    --------
    >>> PoseBox(np.array([30.0, 90.0, 15.0, 0.0]), np.array([2.0, 1.0])).ranges[0]
    ((28.0, 32.0), (86.0, 94.0))
    """

    middle: np.ndarray
    off: np.ndarray

    @property
    def ranges(self) -> tuple[Ranges, Ranges]:
        """Of the sensor and of the light."""
        return self._ranges(0), self._ranges(1)

    def times(self, factor: float) -> PoseBox:
        """So many times as large, about the same poses."""
        return replace(self, off=self.off * factor)

    def at(self, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Poses (n, 2) of sensor and light, degrees, at offsets (n, 4) from -1 to 1 of the box."""
        ends = np.array(self.ranges).reshape(4, 2)
        poses = ends[:, 0] + (np.asarray(offsets, float) + 1) / 2 * np.ptp(ends, axis=1)
        return poses[:, :2], poses[:, 2:]

    def factors(self, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """How many times as large the box is that just holds poses (n, 2), (n, 2), degrees; (n,)."""
        found = []
        for role, (poses, off) in enumerate(zip((sensors, lights), self.off, strict=True)):
            middle = self.middle[2 * role : 2 * role + 2]
            along, around = np.abs(poses - middle).T
            to_pole = min(middle[0], 180 - middle[0])
            found.append(np.maximum(along, np.minimum(around * np.sin(np.radians(middle[0])), to_pole)) / off)
        return np.maximum(*found)

    def _ranges(self, role: int) -> Ranges:
        polar, azimuth, off = *map(float, self.middle[2 * role : 2 * role + 2]), float(self.off[role])
        low, high = max(polar - off, 0.0), min(polar + off, 180.0)
        around = 180.0 if low == 0 or high == 180 else min(off / float(np.sin(np.radians(polar))), 180.0)
        return (low, high), (azimuth - around, azimuth + around)
