"""The picture of a station with what is measured in it: each requirement's features, and its numbered balloon."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from markupsafe import Markup
from scipy.optimize import linear_sum_assignment

from imaging.geometry.projection import project, viewpoint
from scenes import Centre, Curved, Picture, Side, Wall
from scenes.measurands.features import Between, ends_of, is_line, point_of
from scenes.measurands.measurands import Quantity
from scenes.parts.surfaces import Sphere
from scenes.viewpoint import Viewpoint
from validation.explore import preview
from validation.report.canvas import TEXT, WIDTH, inline, plt
from validation.report.grades import LOOKS
from validation.report.requirements import Grade, Requirement

_BAND, _PITCH = 0.34, 0.36  # inches: of the rim in which balloons stand, and from one to the next
_TEXT = 1.35  # inches: of what stands beside a balloon
_TALLEST = 5.5  # inches, of the picture in it
_MOST_PX = 900  # of the picture's longer side
_SOFT = 2  # times that a pixel is enlarged, from which on edges look soft
_CHORDS = 72
_TIED = np.array([0.5, 0.35, 0.65, 0.2, 0.8])  # of what lies between two features: where a balloon may be tied


@dataclass(frozen=True, eq=False)
class Mark:
    """What is drawn of a requirement, px in the image: lines (n, 2) each, and the points (k, 2) to one of which its
    balloon may be tied."""

    lines: tuple[np.ndarray, ...]
    anchors: np.ndarray


def marks(picture: Picture) -> list[Mark]:
    """Of each quantity of a picture's scene: its edges and rims, and what lies between two of them."""
    return [_mark(picture, quantity) for quantity in picture.scene.quantities]


def _mark(picture: Picture, quantity: Quantity) -> Mark:
    solid = picture.scene.solid
    places = [_place(picture, feature) for feature in quantity.features] or [np.array(picture.scene.camera.look_at)]
    lines = [line for feature in quantity.features for line in _outline(picture, feature)]
    if len(quantity.features) == 1:
        return Mark(tuple(lines), lines[-1] if len(lines[-1]) > 2 else _between(*lines[-1]))
    if quantity.is_angle:
        return Mark(tuple(lines), _nearest_ends(*lines[:2])[None])
    for i, feature in enumerate(quantity.features):
        if is_line(feature):
            ends = ends_of(solid, feature)
            places[i] = _foot(places[1 - i], ends) if len(places) == 2 else ends.mean(0)
    start, stop = _seen(picture, np.array([places[0], places[-1]]))
    return Mark((*lines, np.stack([start, stop])), _between(start, stop))


def _between(start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Points of a line to which a balloon may be tied, (k, 2)."""
    return start + _TIED[:, None] * (stop - start)


def _nearest_ends(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The middle of those ends of two lines that are nearest to each other."""
    pairs = [(a, b) for a in one[[0, -1]] for b in other[[0, -1]]]
    return np.mean(min(pairs, key=lambda pair: round(float(np.linalg.norm(pair[0] - pair[1])), 6)), 0)


def _place(picture: Picture, feature) -> np.ndarray:
    """Of a feature in space, (3,); of an edge its middle."""
    solid = picture.scene.solid
    if is_line(feature):
        return ends_of(solid, feature).mean(0)
    return point_of(solid, feature)


def _foot(point: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """The point of a line through two ends that is nearest to a point."""
    along = ends[1] - ends[0]
    return ends[0] + along * ((point - ends[0]) @ along / (along @ along))


def _outline(picture: Picture, feature) -> list[np.ndarray]:
    """Lines of a feature in the image; of a corner none, of what lies between others theirs, too."""
    solid = picture.scene.solid
    if isinstance(feature, Between):
        own = [_seen(picture, ends_of(solid, feature))] if feature.is_line else []
        return [*own, *(line for part in feature.parts for line in _outline(picture, part))]
    if isinstance(feature, Side):
        return [_seen(picture, ends_of(solid, feature))]
    if isinstance(feature, Centre):
        return [_seen(picture, preview.ring(solid.circle(feature.circle), _CHORDS))]
    if isinstance(feature, Wall):
        eye = viewpoint(picture.scene.camera, np.array(list(picture.sensor)))
        return [_seen(picture, line) for line in _limb(solid.round(feature.surface), eye)]
    return []


def _limb(wall: Curved, eye: Viewpoint) -> list[np.ndarray]:
    """What an eye sees a curved surface end at, about: a circle of a sphere; of others a line on both sides, and what
    is between them."""
    one, two = wall.sideways(eye)
    if isinstance(wall.surface, Sphere):
        turn = np.linspace(0, 2 * np.pi, _CHORDS + 1)[:, None]
        return [wall.centre + wall.radius * (np.cos(turn) * one + np.sin(turn) * two)]
    along = np.array(wall.surface.ends)[:, None]
    radii = wall.radius + getattr(wall.surface, "slope", 0.0) * along
    sides = [wall.centre + along * wall.surface.axis + side * radii * one for side in (-1, 1)]
    return [*sides, wall.centre + np.array([[-1], [1]]) * wall.radius * one]


def _seen(picture: Picture, points: np.ndarray) -> np.ndarray:
    return project(points, np.array(list(picture.sensor)), picture.scene.camera)


def draw(
    picture: Picture,
    found: Sequence[Requirement | None],
    image: np.ndarray | None,
    label: str,
    key: str = "view",
    values: Sequence[str] = (),
) -> Markup:
    """The picture as SVG, a balloon for each requirement around it.

    Parameters
    ----------
    found : sequence of Requirement or None
        Of each quantity of the picture's scene, in its order; None: not drawn. Empty: none is.
    image : ndarray, shape (height, width), or None
        Grey levels of the whole image; None: drawn from the model, without shadows.
    label, key : str
        As of `canvas.inline`.
    values : sequence of str
        Of each quantity what stands beside its balloon, of one or two lines; then the balloons stand on both sides.
    """
    part = preview.window(picture.scene, picture)
    grey = preview.drawn(picture.scene, picture, part) if image is None else _cut(picture, image, part)
    frame = _frame(part, len(values))
    figure = plt.figure(figsize=(frame.width, frame.height))
    axis = figure.add_axes((0, 0, 1, 1), xlim=(0, frame.width), ylim=(frame.height, 0))
    axis.set_axis_off()
    (left, top), (wide, high) = frame.corner, frame.size
    axis.imshow(grey, cmap="gray", vmin=0, vmax=255, interpolation="none", aspect="auto",
                extent=(left, left + wide, top + high, top))  # fmt: skip

    def placed(points: np.ndarray) -> np.ndarray:
        """Inches in the figure of px in the image."""
        return (points + 0.5 - [part.left, part.top]) * frame.scale + frame.corner

    texts = values or [""] * len(found)
    both = [each for each in zip(found, marks(picture), texts, strict=True) if each[0]] if found else []
    anchors = [placed(mark.anchors) for _, mark, _ in both]
    spots, tied = balloons(anchors, frame.beside(len(both)) if values else frame.around(len(both)))
    for (each, mark, text), anchor, spot in zip(both, tied, spots, strict=True):
        _requirement(axis, each, [placed(line) for line in mark.lines], anchor, spot)
        if text:
            aside = 1 if spot[0] > frame.width / 2 else -1
            side = "left" if aside > 0 else "right"
            axis.text(spot[0] + 0.2 * aside, spot[1], text, fontsize=TEXT, va="center", ha=side)
    return inline(figure, key, label)


@dataclass(frozen=True, eq=False)
class Frame:
    """Where the picture lies in its figure, inches.

    ``scale`` of a pixel; ``size`` of the picture, ``corner`` its upper left one; ``width``, ``height`` of the figure.
    """

    scale: float
    size: np.ndarray
    corner: np.ndarray
    width: float
    height: float

    def around(self, count: int) -> np.ndarray:
        """Places around the picture for at least so many balloons, none nearer to another than a pitch, (n, 2)."""
        outer = self.size + _BAND
        around = 2 * outer.sum()
        many = max(int(around / _PITCH), count)
        at = (np.arange(many) + 0.5) * around / many
        corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) * outer
        start = np.array([0, outer[0], outer.sum(), outer.sum() + outer[0], around])
        return np.stack([np.interp(at, start, corners[:, i]) for i in (0, 1)], -1) + self.corner - _BAND / 2

    def beside(self, count: int) -> np.ndarray:
        """Places on both sides of the picture for at least so many balloons with two lines of text, (n, 2)."""
        many = max(int(self.height / _PITCH), -(-count // 2))
        at = (np.arange(many) + 0.5) * self.height / many
        sides = self.corner[0] - _BAND / 2, self.corner[0] + self.size[0] + _BAND / 2
        return np.array([[side, y] for side in sides for y in at])


def _frame(part: preview.Window, values: int) -> Frame:
    """Of a picture with balloons, beside which so many values stand."""
    scale = _scale(part)
    size = np.array([part.width, part.height]) * scale
    width = WIDTH + 2 * _TEXT * bool(values)
    height = max(size[1] + 2 * _BAND, _PITCH * -(-values // 2))
    return Frame(scale, size, (np.array([width, height]) - size) / 2, width, height)


def enlarged(picture: Picture) -> str:
    """What is to be said of a picture of few pixels, each of which is drawn large; of others nothing."""
    times = 96 * _scale(preview.window(picture.scene, picture))
    if times < _SOFT:
        return ""
    return f" Each pixel of the camera is drawn about {times:.0f} times as large, so edges look soft."


def _scale(part: preview.Window) -> float:
    """Inches of a pixel of the camera."""
    return min((WIDTH - 2 * _BAND) / part.width, _TALLEST / part.height)


def _cut(picture: Picture, image: np.ndarray, part: preview.Window) -> np.ndarray:
    """The part of an image that is shown, uint8, no larger than can be seen."""
    some = image[part.top : part.top + part.height, part.left : part.left + part.width].astype(np.float32)
    scale = _MOST_PX / max(some.shape)
    if scale < 1:
        some = cv2.resize(some, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return preview.shades(picture.scene, some)


def balloons(anchors: list[np.ndarray], slots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of n balloons, and the points that they are tied to.

    Parameters
    ----------
    anchors : list of n ndarray, shape (k, 2)
        The points to one of which each may be tied.
    slots : ndarray, shape (at least n, 2)
        Where a balloon may stand.

    Returns
    -------
    spots, tied : ndarray, shape (n, 2)
        Of all ways the one whose leaders are shortest in sum: then they do not cross.
    """
    if not anchors:
        return np.empty((0, 2)), np.empty((0, 2))
    away = [np.linalg.norm(np.nan_to_num(each)[:, None] - slots, axis=-1).round(6) for each in anchors]
    _, chosen = linear_sum_assignment(np.array([each.min(0) for each in away]))
    tied = [each[far[:, slot].argmin()] for each, far, slot in zip(anchors, away, chosen, strict=True)]
    return slots[chosen], np.array(tied)


def _requirement(axis, each: Requirement, lines: list[np.ndarray], anchor: np.ndarray, spot: np.ndarray) -> None:
    look = LOOKS[each.grade]
    style = (0, (3, 1.5)) if each.grade in (Grade.MISSING, Grade.DOUBT) else "-"
    for line in lines:
        axis.plot(*line.T, color="white", lw=4.5, alpha=0.9, solid_capstyle="round")
        axis.plot(*line.T, color=look.border, lw=2, ls=style)
    if np.isfinite(anchor).all():
        axis.plot(*np.stack([anchor, spot]).T, color="white", lw=2.4, alpha=0.8)
        axis.plot(*np.stack([anchor, spot]).T, color="black", lw=0.8)
        axis.plot(*anchor, ".", color="black", ms=4)
    size = {"o": 18, "s": 16, "D": 15, "8": 18}[look.marker]
    axis.plot(*spot, look.marker, ms=size, mfc=look.fill, mec=look.border, mew=1.8, clip_on=False)
    axis.text(*spot, str(each.number), color=look.text, fontsize=TEXT, ha="center", va="center_baseline", weight="bold")
