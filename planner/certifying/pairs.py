"""Pairs of cells (p, 2) of sensors and lights: bounded by chunks, tried in their middles, divided."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.certifying.cells import LightCells, SensorCells

TRIED = 64  # middles of pairs of cells that are evaluated at a time
_CHUNK = 4096  # pairs of cells at a time


def every(sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """Each of some sensors' cells with each of some lights'."""
    return np.stack(np.meshgrid(sensors, lights, indexing="ij"), -1).reshape(-1, 2)


def bounded(
    bounds: Callable[[SensorCells, LightCells, np.ndarray], tuple[np.ndarray, np.ndarray]],
    sensors: SensorCells, lights: LightCells, pairs: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """What ``bounds`` says of pairs, of which there are some."""
    told = [bounds(sensors, lights, pairs[at : at + _CHUNK]) for at in range(0, len(pairs), _CHUNK)]
    bound, parts = (np.concatenate([each[k] for each in told]) for k in (0, 1))
    return bound, parts


def middles(sensors: SensorCells, lights: LightCells, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses (p, 2) of sensor and light in the middles of pairs, degrees."""
    return sensors.boxes.middles[pairs[:, 0]], lights.boxes.middles[pairs[:, 1]]


def divided(sensors: SensorCells, lights: LightCells, pairs: np.ndarray, by_sensor: np.ndarray) -> np.ndarray:
    """The pairs of which one cell is cut in four: the sensors' where ``by_sensor`` (p,), else the lights'."""
    return np.concatenate([_parted(sensors, pairs[by_sensor], 0), _parted(lights, pairs[~by_sensor], 1)])


def _parted(cells: SensorCells | LightCells, pairs: np.ndarray, role: int) -> np.ndarray:
    """Each pair as often as its cell has parts, with these instead."""
    different, which = np.unique(pairs[:, role], return_inverse=True)
    known = cells.quarters(different)
    parts = [known[int(each)] for each in different]
    count = np.array([len(each) for each in parts], int)
    many = count[which]
    found = np.repeat(pairs, many, axis=0)
    place = np.arange(len(found)) - np.repeat(np.cumsum(many) - many, many)
    if len(found):
        found[:, role] = np.concatenate(parts)[np.repeat((np.cumsum(count) - count)[which], many) + place]
    return found
