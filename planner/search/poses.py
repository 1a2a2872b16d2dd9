"""Poses of all free lights as one array, (..., 2 F) for F of them, as a search moves them."""

from __future__ import annotations

import numpy as np

from scenes import Pose, several


def by_light(lights: np.ndarray) -> np.ndarray | tuple[np.ndarray, ...]:
    """What `Pictures.of` takes: the poses (..., 2) of the one free light, else a tuple of such."""
    parts = tuple(lights[..., i : i + 2] for i in range(0, lights.shape[-1], 2))
    return parts[0] if len(parts) == 1 else parts


def as_poses(lights: np.ndarray) -> Pose | tuple[Pose, ...]:
    """One setting's lights (2 F,): the pose of the one free light, else a tuple of such."""
    found = tuple(Pose(*map(float, lights[i : i + 2])) for i in range(0, lights.size, 2))
    return found[0] if len(found) == 1 else found


def as_array(lights: Pose | tuple[Pose, ...]) -> np.ndarray:
    """And back, (2 F,)."""
    return np.array([list(pose) for pose in several(lights)], float).ravel()
