"""Where camera and lamp stand, to scale beside the part: from the side, and from above."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from scipy.spatial import ConvexHull, QhullError

from imaging.geometry.projection import sensor_position
from imaging.pictures import Pictures
from scenes import Picture
from validation.report.canvas import TEXT, inline, plt
from validation.report.scene_figure import corners

_SIZE = 2.3, 2.2  # inches of a view
_STEPS = np.array([1.0, 2.0, 5.0, 10.0])  # of a scale's length, times a power of ten
_LAMP, _CAMERA = "#b35900", "#0b3c5d"
ARROW = "azimuth 0"
AZIMUTH = "Azimuth: counterclockwise from the part's x axis (arrow)."
_CORNERS = np.array([[0.79, 0.24], [0.79, 0.84], [0.21, 0.84]])  # in parts of a view; in the fourth stands the scale
_VIEWS = ("from the side", "from above")


def axes_of(picture: Picture) -> np.ndarray:
    """Two pairs of unit vectors, (2, 2, 3): right and up of the view from the side, in which the camera's axis lies,
    and of the view from above, its right the same."""
    azimuth = np.radians(picture.sensor.azimuth_deg)
    right = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    return np.array([[right, [0.0, 0.0, 1.0]], [right, [-right[1], right[0], 0.0]]])


def told(picture: Picture) -> str:
    """The same in words."""
    scene, parts = picture.scene, [_where("camera", picture.scene.camera.distance, picture.sensor, picture.scene.units)]
    names = ["lamp"] if len(scene.lights) == 1 else [f"lamp {i + 1}" for i in range(len(scene.lights))]
    for name, light, pose in zip(names, scene.lights, picture.lights, strict=True):
        parts.append(_where(f"{name} ({type(light).__name__.lower()})".replace(" (light)", ""),
                            light.distance, pose, scene.units))  # fmt: skip
    return "; ".join(parts)


def _where(what: str, distance: float, pose, units: str) -> str:
    azimuth = f", azimuth {pose.azimuth_deg:.1f}°" if pose.polar_deg % 180 else ""
    return f"{what} {distance:.4g} {units} away, {pose.polar_deg:.1f}° from the vertical{azimuth}"


def draw(picture: Picture) -> Markup:
    """The sketch as SVG, one a view, each with a scale of its own."""
    pictures, scene = Pictures.of(picture), picture.scene
    eye = sensor_position(scene.camera, np.array(list(picture.sensor)))
    lamps = [np.array([e.at for e in pictures.emitters if e.which == i]) for i in range(len(scene.lights))]
    drawn = []
    for (right, up), title in zip(axes_of(picture), _VIEWS, strict=True):
        figure, panel = plt.subplots(figsize=_SIZE, layout="constrained")
        flat, shining = np.stack([right, up], -1), [lamp for lamp in lamps if len(lamp)]
        _panel(panel, flat, picture, eye, shining)
        if up[2] == 0:
            _azimuth(panel, flat, [place.reshape(-1, 3).mean(0) @ flat for place in (eye, *shining)])
        _scale(panel, scene.units)
        panel.set_title(title, fontsize=TEXT)
        label = f"Sketch to scale, seen {title}: {told(picture)}."
        drawn.append(inline(figure, f"sketch-{title.split()[-1]}", label))
    return Markup("").join(drawn)


def _panel(axis, flat: np.ndarray, picture: Picture, eye: np.ndarray, lamps: list[np.ndarray]) -> None:
    scene, middle = picture.scene, np.array(picture.scene.camera.look_at) @ flat
    _part(axis, scene.solid.vertices @ flat)
    board = scene.placement.board
    if board is not None:
        axis.fill(*(board.outline @ flat).T, facecolor="#e8e8e8", edgecolor="#333333", lw=0.8)
    camera = eye @ flat
    _ray(axis, middle, camera, _CAMERA)
    for lamp in lamps:
        points = lamp @ flat
        _ray(axis, middle, points.mean(0), _LAMP)
        single = len(points) == 1
        axis.plot(*points.T, "*" if single else ".", color=_LAMP, ms=12 if single else 3, ls="")
    axis.plot(*camera, "s", color=_CAMERA, ms=9)
    places = [("camera", camera, _CAMERA), *(("lamp", lamp.mean(0) @ flat, _LAMP) for lamp in lamps[:1])]
    _labels(axis, places, corners(scene) @ flat, middle)


def _part(axis, points: np.ndarray) -> None:
    """The part's outline, filled."""
    try:
        hull = points[ConvexHull(np.round(points, 9)).vertices]
    except QhullError:  # of no area
        hull = points
    axis.fill(*hull.T, facecolor="#b8b8b8", edgecolor="#333333", lw=0.8)


def _ray(axis, start: np.ndarray, stop: np.ndarray, colour: str) -> None:
    axis.plot(*np.stack([start, stop]).T, color=colour, lw=1, ls=(0, (4, 3)))


def _labels(axis, places: list, part: np.ndarray, middle: np.ndarray) -> None:
    """Names above what they name, side by side where they are near each other; room for them on all sides."""
    every = np.concatenate([part, *(place[None] for _, place, _ in places)])
    low, high = every.min(0), every.max(0)
    reach = max(high - low) / 2
    centre = (low + high) / 2
    near = len(places) == 2 and np.abs(places[0][1] - places[1][1]).max() < 0.7 * reach
    left_first = len(places) == 2 and round(float(places[0][1][0] - places[1][1][0]), 9) <= 0
    for k, (name, place, colour) in enumerate(places):
        aside = 0 if not near else (-1 if (k == 0) == left_first else 1)
        align = {0: "center", -1: "right", 1: "left"}[aside]
        above = 1 if place[1] >= middle[1] - 0.05 * reach else -1
        axis.annotate(name, place, xytext=(2 * aside, 9 * above), textcoords="offset points", fontsize=TEXT,
                      color=colour, ha=align, va="bottom" if above > 0 else "top")  # fmt: skip
    axis.set(xlim=centre[0] + np.array([-1.6, 1.6]) * reach, ylim=centre[1] + np.array([-1.75, 1.45]) * reach)
    axis.set(aspect="equal", xticks=[], yticks=[])
    for side in axis.spines.values():
        side.set_color("#cccccc")


def _azimuth(axis, flat: np.ndarray, places: list[np.ndarray]) -> None:
    """An arrow along the part's x axis, azimuth 0, in the corner that is farthest from camera and lamps."""
    low, high = np.array([axis.get_xlim(), axis.get_ylim()]).T
    size, along = high - low, np.array([1.0, 0.0, 0.0]) @ flat
    corners = low + _CORNERS * size
    away = [min(np.linalg.norm(place - corner) for place in places) for corner in corners]
    centre, half = corners[np.argmax(np.round(away, 6))], 0.05 * size[0] * along
    axis.annotate("", centre + half, xytext=centre - half, arrowprops={"arrowstyle": "->", "lw": 1.2})
    below = np.array([0.0, abs(half[1]) + 0.06 * size[1]])
    axis.text(*(centre - below), ARROW, fontsize=TEXT, ha="center", va="center")


def _scale(axis, units: str) -> None:
    """A length in the lower left corner."""
    (left, right), (low, high) = axis.get_xlim(), axis.get_ylim()
    length = scale_length((right - left) / 3)
    start, level = left + 0.04 * (right - left), low + 0.05 * (high - low)
    axis.plot([start, start + length], [level, level], color="black", lw=2, solid_capstyle="butt")
    axis.annotate(f"{length:g} {units}", (start + length, level), xytext=(5, 0), textcoords="offset points",
                  fontsize=TEXT, va="center")  # fmt: skip


def scale_length(most: float) -> float:
    """The longest of 1, 2, 5, 10, 20, ... that is no longer.

    >>> scale_length(0.3), scale_length(7), scale_length(50), scale_length(99.9)
    (0.2, 5.0, 50.0, 50.0)
    """
    power = 10.0 ** np.floor(np.log10(most) + 1e-9)
    return float((_STEPS * power)[_STEPS * power <= most * (1 + 1e-9)].max())
