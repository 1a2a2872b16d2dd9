"""Values with their derivatives: points, lines, numbers, as functions of what was found in a picture.

Derivatives are by the parameters of `imaging.features.seen.Seen`, the small errors of lines and circles.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

DEGREE = float(np.degrees(1.0))
Moves = Mapping[int, np.ndarray]
"""Derivatives by some of the parameters, by their numbers; all others are 0."""


class Evaluated(NamedTuple):
    """A number's value (...) and its derivatives (...)."""

    value: np.ndarray
    gradient: Moves


@dataclass(frozen=True, eq=False)
class Point:
    """A point in the image (k = 2) or in space (k = 3), shape (..., k), with its derivatives (..., k)."""

    at: np.ndarray
    moves: Moves


@dataclass(frozen=True)
class Line:
    """A line through two points, the edge's ends."""

    start: Point
    stop: Point


def between(start: Point, stop: Point) -> Evaluated:
    """Distance of two points."""
    across = stop.at - start.at
    value = np.linalg.norm(across, axis=-1)
    pull = across / value[..., None]
    return Evaluated(value, pulled([(pull, stop.moves), (-pull, start.moves)]))


def from_line(point: Point, line: Line, plane: np.ndarray | None, side: np.ndarray | float) -> Evaluated:
    """Distance of a point from a line, positive on the given side; a line moves as both its ends do."""
    along = line.stop.at - line.start.at
    length = np.linalg.norm(along, axis=-1)[..., None]
    normal = across(along / length, plane) * np.asarray(side)[..., None]
    away = point.at - line.start.at
    share = np.einsum("...i,...i->...", away, along)[..., None] / length**2
    moved = [(normal, point.moves), (-(1 - share) * normal, line.start.moves), (-share * normal, line.stop.moves)]
    return Evaluated(np.einsum("...i,...i->...", normal, away), pulled(moved))


def between_lines(lines: list[Line], signs: list[int], plane: np.ndarray | None) -> Evaluated:
    """Angle between two lines, each taken along (+1) or against (-1) its edge, degrees."""
    units, turns = [], []
    for line, sign in zip(lines, signs, strict=True):
        along = line.stop.at - line.start.at
        length = np.linalg.norm(along, axis=-1)[..., None]
        normal = across(along / length, plane) / length
        units.append(sign * along / length)
        turns.append([(normal, line.stop.moves), (-normal, line.start.moves)])
    crossing = np.einsum("...i,...i->...", across(units[0], plane), units[1])
    value = DEGREE * np.arctan2(np.abs(crossing), np.einsum("...i,...i->...", *units))
    opens = (DEGREE * np.sign(crossing))[..., None]
    moved = [(s * opens * n, m) for s, turn in zip((-1, 1), turns, strict=True) for n, m in turn]
    return Evaluated(value, pulled(moved))


def across(unit: np.ndarray, plane: np.ndarray | None) -> np.ndarray:
    """Unit vector across a direction (..., k): (-y, x) in the image, normal x direction on a plane."""
    if plane is None:
        return np.stack([-unit[..., 1], unit[..., 0]], -1)
    return np.cross(plane, unit)


def pulled(parts: Iterable[tuple[np.ndarray, Moves]]) -> Moves:
    """Sum of directions . moves, by parameter."""
    total: dict[int, np.ndarray] = {}
    for direction, moves in parts:
        for k, move in moves.items():
            total[k] = total.get(k, 0.0) + np.einsum("...i,...i->...", direction, move)
    return total
