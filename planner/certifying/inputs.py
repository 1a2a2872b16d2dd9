"""What uncertain inputs of a station add to the variance of distances of corners, from cells of sensors, enclosed.

A wrong input is as if each corner lay by some d beside its place, as the camera sees it. Taken back to the plane of
normal N through the place, seen from w away, that is d - w (N.d) / (N.w), and the distance moves by its slope times it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.pose_scatter import LEAST_SINE
from planner.budgeting.budgets import shared_inputs
from planner.budgeting.sources import Source, sources
from planner.certifying.enclosed import Enclosed, sine, variables
from planner.certifying.pulls import Pull, pulls_of
from planner.certifying.series import dot
from planner.certifying.view import View
from planner.uncertainty.groups import Group, members
from scenes import InvalidInput, Scene

Vector = list[Enclosed]
_AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Seen:
    """A place, (3,) from the point that is looked at, in n cells of sensors.

    Attributes
    ----------
    view : View
    polar : Enclosed
    away : ndarray
    """

    view: View
    polar: Enclosed
    away: np.ndarray

    @cached_property
    def right(self) -> Vector:
        """What moves it to the right by its own distance from the axis."""
        return _times(self.view.right, dot(self.view.right, self.away))

    @cached_property
    def down(self) -> Vector:
        """The same of down."""
        return _times(self.view.down, dot(self.view.down, self.away))

    def turned(self, axis: Vector | np.ndarray) -> Vector:
        """By a turn of the part about an axis, for a degree."""
        x, y, z = self.away
        rows = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])  # axis x away
        if isinstance(axis, np.ndarray):
            still = self.polar * 0.0
            return [still + float(part) for part in np.radians(rows @ axis)]
        return [dot(axis, np.radians(row)) for row in rows]


def _by_sensor_azimuth(seen: Seen) -> Vector:
    around = seen.turned(np.array([0.0, 0.0, -1.0]))
    return _times(around, sine(seen.polar).at_least(LEAST_SINE).inverse())


def _by_roll(seen: Seen) -> Vector:
    view, angle = seen.view, np.radians(1.0)
    x, y = (dot(axis, seen.away * angle) for axis in (view.right, view.down))
    return [y * a - x * b for a, b in zip(view.right, view.down, strict=True)]


def _by_middle(which: int) -> Callable[[Seen], Vector]:
    def moved(seen: Seen) -> Vector:
        view, camera = seen.view, seen.view.scene.camera
        over = view.divisor(seen.away + np.array(camera.look_at)) / camera.focal_px
        return _times((view.right, view.down)[which], over)

    return moved


def _by_focal(*which: str) -> Callable[[Seen], Vector]:
    def moved(seen: Seen) -> Vector:
        parts = [_times(getattr(seen, name), 1 / seen.view.scene.camera.focal_px) for name in which]
        return parts[0] if len(parts) == 1 else [a + b for a, b in zip(*parts, strict=True)]

    return moved


def _by_shift(which: int) -> Callable[[Seen], Vector]:
    return lambda seen: [seen.polar * 0.0 + float(k == which) for k in range(3)]


def _by_tilt(which: int) -> Callable[[Seen], Vector]:
    return lambda seen: seen.turned(np.eye(3)[which])


def _by_distance(seen: Seen) -> Vector:
    return [-part for part in seen.view.axis]


_MOVES: dict[str, Callable[[Seen], Vector]] = {
    "sensor_deg.polar": lambda seen: seen.turned([-part for part in seen.view.right]),
    "sensor_deg.azimuth": _by_sensor_azimuth,
    "sensor_roll_deg": _by_roll,
    "sensor_distance": _by_distance,
    "camera.distance": _by_distance,
    "camera.focal_px": _by_focal("right", "down"),
    "fx": _by_focal("right"),
    "fy": _by_focal("down"),
    **{name: _by_middle(k) for name, k in (("cx", 0), ("cy", 1))},
    **{f"principal_point_px.{axis}": _by_middle(k) for k, axis in enumerate("xy")},
    **{f"part_shift.{axis}": _by_shift(k) for k, axis in enumerate(_AXES)},
    **{f"part_tilt_deg.{axis}": _by_tilt(k) for k, axis in enumerate(_AXES)},
}
"""How each source moves a place, in space for the source's unit."""


@dataclass(frozen=True, eq=False)
class InputTerms:
    """Makes the variances of a scene's quantities by its uncertain inputs that move places in the image.

    Attributes
    ----------
    scene : Scene
    given : tuple of Source
    """

    scene: Scene
    given: tuple[Source, ...]

    @classmethod
    def of_scene(cls, scene: Scene) -> InputTerms:
        """Of all sources.

        Raises
        ------
        InvalidInput
            If how one moves the picture is not known to be enclosed.
        """
        given = sources(scene)
        for each in given:
            if each.kind == "geometry" and each.name not in _MOVES:
                raise InvalidInput(f"uncertain inputs must be of {', '.join(_MOVES)} for a box, got {each.name}")
        return cls(scene, given)

    @cached_property
    def pulls(self) -> list[list[Pull]]:
        """How each quantity moves with places on its plane."""
        return [pulls_of(self.scene, quantity) for quantity in self.scene.quantities]

    @property
    def least_dof(self) -> float:
        """The least degrees of freedom of any input that counts."""
        each = [member for source in shared_inputs(self.scene, self.given) for member in members(source)]
        return min((one.dof for one in each if one.u > 0), default=np.inf)

    def of(self, polar: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Upper bounds in cells (n, 2), (n, 2), rad, and how far above the values in the middle, (n, M) each."""
        view = View.of(self.scene, polar, azimuth, np.zeros(len(self.scene.solid.faces), bool))
        level = variables(polar, azimuth)[0]
        names = [each.name for each in self.given if each.kind == "geometry"]
        with np.errstate(all="ignore"):  # what is not bounded
            found = [self._variance(view, level, pulls, names) for pulls in self.pulls]
        high, middle = (np.stack([getattr(each, name) for each in found], -1) for name in ("high", "middle"))
        return high, np.fmax(high - middle, 0.0)

    def _variance(self, view: View, polar: Enclosed, pulls: list[Pull], names: list[str]) -> Enclosed:
        slopes = dict.fromkeys(names, polar * 0.0)
        if names:
            for pull in pulls:
                seen = Seen(view, polar, pull.place - np.array(self.scene.camera.look_at))
                back = pull.back(view)
                for name in names:
                    slopes[name] = slopes[name] + dot(back, _MOVES[name](seen))
        whole = polar * 0.0
        for source in shared_inputs(self.scene, self.given):
            for own, other, v in _covariances(source):
                if own in slopes and other in slopes:
                    product = slopes[own].square() if own == other else slopes[own] * slopes[other]
                    whole = whole + product * v
        return whole


def _covariances(source) -> list[tuple[str, str, float]]:
    if not isinstance(source, Group):
        return [(source.name, source.name, source.u**2)]
    rows, v = source.inputs, source.covariance
    return [
        (a.name, b.name, float(v[i, k] * (1 if i == k else 2)))
        for i, a in enumerate(rows) for k, b in enumerate(rows[: i + 1])
    ]  # fmt: skip


def _times(vector: Vector, factor: Enclosed | float) -> Vector:
    return [part * factor for part in vector]
