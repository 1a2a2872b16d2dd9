"""What the picture shows along a circular edge, and what it does to the zero crossings there: one picture, looked at.

Rays across the rim tell its levels: the face, the wall with its facets, shadows and the light that it sends to itself,
what is seen through the hole or past the rim, straight edges nearby. The zero crossing of the second derivative of that
picture, blurred and smoothed, is where the locator will find the rim without noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging import sensor
from imaging.features.locator import edge_blur
from imaging.features.rim_outline import facets, outline_beside, zero_of_steps
from imaging.features.rim_sides import RIM_POINTS, outward_normals
from imaging.geometry.blur import blur_at
from imaging.geometry.lens import image_centre, lens_jacobian, recorded
from imaging.geometry.projection import depth, from_axis
from imaging.light.behind import seen_at
from imaging.pictures import Pictures
from scenes import Circle

_BESIDE = np.linspace(-2.5, 2.5, 11)  # standard deviations, tangentially: facets of a wall end anywhere between them
_SHARES = np.exp(-(_BESIDE**2) / 2) / np.exp(-(_BESIDE**2) / 2).sum()
_MIDDLE = len(_BESIDE) // 2
_CELL, _CELLS = 0.2, 24  # standard deviations that a ray stands for, and how many on each side
_MIDDLES = _CELL * (np.arange(-_CELLS, _CELLS) + 0.5)
_ENDS = _CELL * np.arange(1 - _CELLS, _CELLS)  # between them
_SPREAD = 0.2  # of lines beside each other, towards a small rim's middle: it is no less
_TURN = 1e-3  # part of a rim's turn that its bend is told by
_MOST_BEYOND = 64  # lines beyond each end of an arc
_APART, _DIGITS = 0.6, 6  # standard deviations between lines around the rim at most, where not more than 11 a place
_SHARP, _EVEN = 8, 0.02  # rays of an uneven cell, and the part of the brightest level by which it differs
_STEPS, _CONVERGED = 8, 1e-12  # of Newton's method, and moves that are rounding, standard deviations
# where a place counts by half (`_counted`):
_FARTHEST = 0.2  # px that its crossing is moved: levels are known to a few percent, and so is the move
_KNOWN = 0.05  # part of the brighter side that its contrast is: levels so alike may be the other way round
_STEEPER = 0.3  # by which the slope there differs from a lone step's
_ROUGH, _JUMP = 0.03, 0.2  # px of the shift, and part of the contrast, by which it differs from a neighbour
_LOOKED, _RIVAL = 13, 0.5  # places across the search window, and how steep another crossing in it is
_AT = 1e-6  # of the way to the next place: there is the place itself
_MOST = 12  # times `RIM_POINTS`
_SPACING = 0.7  # smoothing scales between places, while there are not so many
_AT_ONCE = 1 << 15  # rays


@dataclass(frozen=True, eq=False)
class RimLook:
    """At equal angles of a circle in one picture.

    Attributes
    ----------
    shift : ndarray, shape (n,)
        How far outwards the crossing lies beside that of two even levels, ideal px; 0 where it is not to be trusted.
    squared : ndarray, shape (n,)
        Squared contrast that the slope at the crossing tells, grey levels^2.
    noise_variance : ndarray, shape (n,)
        Mean of both sides, grey levels^2.
    brightens : ndarray of bool, shape (n,)
        Whether it is brighter outside the rim.
    share : ndarray, shape (n,)
        How much a place counts, 0 to 1: as much as its shift can be trusted. The crossing is near, about as steep as a
        lone step's, and as its neighbours; each of it less and less, so that nothing jumps with the geometry.
    circle : Circle
        Whose angles they are.
    """

    shift: np.ndarray
    squared: np.ndarray
    noise_variance: np.ndarray
    brightens: np.ndarray
    share: np.ndarray
    circle: Circle

    def at(self, angle: np.ndarray) -> RimLook:
        """The same at other angles (m,), between the places; nothing counts beside a place that does not."""
        count = self.shift.size
        place = self.circle.steps(angle, count)
        first, share = place.astype(int) % count, place - place.astype(int)
        then = (first + 1) % count
        shift, squared, noise, counted = (
            v[first] + share * (v[then] - v[first]) for v in (self.shift, self.squared, self.noise_variance, self.share)
        )
        known = ((self.share[first] > 0) | (share > 1 - _AT)) & ((self.share[then] > 0) | (share < _AT))
        return RimLook(shift, squared, noise, self.brightens[first], np.where(known, counted, 0.0), self.circle)


def places_around(pictures: Pictures, circle: Circle, spacing: float, most: int) -> int:
    """Number of places on a rim, about ``spacing`` px apart in one picture: `RIM_POINTS`, or 2 to ``most`` times it."""
    places = circle.at(circle.angles(RIM_POINTS))
    rim = from_axis(places, pictures.sensors, pictures.scene.camera)
    steps = np.linalg.norm(rim - np.roll(rim, 1, 0), axis=-1)
    length = np.nan_to_num(steps if circle.ends is None else steps[1:]).sum()
    return RIM_POINTS * int(np.clip(np.ceil(length / (spacing * RIM_POINTS)), 1, most))


def look(pictures: Pictures, circle: Circle) -> RimLook:
    """Look at a rim in one picture with its lights; once for each."""
    return pictures.once(("look", circle.name), lambda: _look(pictures, circle))


def _look(pictures: Pictures, circle: Circle) -> RimLook:
    scene = pictures.scene
    angle = circle.angles(places_around(pictures, circle, _SPACING * scene.locator.scale_px, _MOST))
    places, normals, width = _normals(pictures, circle, angle)
    where = outline_beside(pictures, circle, places, normals, width[:, None] * _BESIDE) / width[:, None]
    levels = _levels(pictures, circle, angle, places, normals, width)
    alone = zero_of_steps(where, _SHARES)
    steps = _steps(levels, where)
    crossing, slope = _zero(steps, where, alone)
    sides = levels[:, _MIDDLE, [_CELLS - 1, _CELLS]].T
    noise = sensor.recorded(scene.noise, scene.noise.dark_level + sides).noise_variance
    moved = (crossing - alone) * width
    with np.errstate(divide="ignore", invalid="ignore"):
        share = _counted(np.abs(slope / (sides[1] - sides[0]) - 1) / _STEEPER) * _counted(np.abs(moved) / _FARTHEST)
        share *= _counted(_KNOWN * sides.max(0) / np.abs(sides[1] - sides[0]))
        share *= _counted(_rival(steps, where, crossing, slope, scene.locator.window_px / width) / _RIVAL)
    share[sides.max(0) > sensor.headroom(scene.noise)] = 0.0
    share *= scene.camera.aperture_radius == 0  # of a cone of light the wall beside takes a part that is not known
    shift, slope = np.where(share > 0, moved, 0.0), np.where(share > 0, slope, sides[1] - sides[0])
    noise = np.broadcast_to(noise, sides.shape).mean(0)
    squared = np.nan_to_num(slope) ** 2
    return RimLook(shift, squared, noise, sides[1] > sides[0], share * _steady(moved, slope), circle)


def _counted(excess: np.ndarray) -> np.ndarray:
    """How much places count that are so much of a limit away from what is known well: 1 at 0, 0.5 at 1, 0 from 2 on."""
    return np.cos(np.pi / 4 * np.clip(np.nan_to_num(excess, nan=2.0), 0, 2)) ** 2


def _steady(shift: np.ndarray, contrast: np.ndarray) -> np.ndarray:
    """How much places (n,) count by how like they are to both neighbours, so that what lies between them is."""
    size = np.abs(contrast)
    onward = np.roll(size, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        alike = _counted(np.abs(np.roll(shift, -1) - shift) / _ROUGH)
        alike *= _counted(np.abs(onward - size) / (_JUMP * np.maximum(onward, size)))
    return np.minimum(alike, np.roll(alike, 1))


def _normals(pictures: Pictures, circle: Circle, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Image points and normals (n, 2) and the smoothed edge's standard deviation (n,) there, ideal px."""
    scene = pictures.scene
    places, normals = _places(pictures, circle, angle), outward_normals(pictures, circle, angle)[0]
    ideal = places + image_centre(scene.camera)
    stretch = np.sqrt(np.abs(np.linalg.det(lens_jacobian(ideal, scene.camera))))
    away = depth(circle.at(angle), pictures.sensors, scene.camera)
    blur = blur_at(scene.camera, away, recorded(ideal, scene.camera))
    return places, normals, np.hypot(scene.locator.scale_px, edge_blur(blur)) / stretch


def _places(pictures: Pictures, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Image points (n, 2) of the mesh's rim from the image's middle, ideal px."""
    spokes = circle.spokes(angle) * (circle.radius * facets(pictures.scene.solid, circle, angle))[:, None]
    return from_axis(circle.centre + spokes, pictures.sensors, pictures.scene.camera)


def _levels(pictures: Pictures, circle: Circle, angle, places, normals, width) -> np.ndarray:
    """Mean signal of the cells (n, J, 2 cells) on both sides of the outline, from the inside outwards.

    Lines beside a place along its tangent lie between those of places around the rim, which are looked at once.
    """
    around, here = _lines(circle, angle, places, width)
    rim = _normals(pictures, circle, around)
    lines = _along_normals(pictures, *rim)
    spread = 1 + _bend(pictures, circle, angle)[:, None] * width[:, None] * _MIDDLES  # of lines, away from the rim
    beside = (width[:, None] * _BESIDE)[..., None] / np.maximum(spread, _SPREAD)[:, None]
    at = _between(rim[0], here, normals, beside, circle.ends is None)
    before = np.floor(np.nan_to_num(at))
    left, right = _on_lines(lines, before.astype(int), circle.ends is None)
    share = at - before
    return np.where(share == 0, left, (1 - share) * left + share * right)


def _on_lines(lines: np.ndarray, numbers: np.ndarray, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Of cells (m, C) on lines, round a closed rim or held at an arc's ends, those of numbers (n, J, C) and of the next
    ones."""
    count, cells = lines.shape
    lowest = numbers.min()
    every = np.arange(lowest, numbers.max() + 2)
    around = lines.take(every % count if closed else np.clip(every, 0, count - 1), 0).ravel()
    flat = (numbers - lowest) * cells + np.arange(cells)
    return around.take(flat), around.take(flat + cells)


def _bend(pictures: Pictures, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Curvature of the rim's image (n,), 1 / ideal px: its normals turn so much a px along it."""
    step = _TURN * circle.turn
    ahead, back = (angle + step, angle - step)
    one, other = (outward_normals(pictures, circle, each)[0] for each in (ahead, back))
    turn = np.arcsin(np.clip(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0], -1, 1))
    speed = outward_normals(pictures, circle, angle)[2]
    return np.abs(turn) / (2 * step * speed)


def _lines(circle: Circle, angle, places: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles (m,) of the lines around a rim, beyond an arc's ends too, and which of them are those of its places (n,).

    So many for a place that they are near each other, an odd number: one of them goes through it.
    """
    steps = np.diff(places, axis=0)
    apart = np.nan_to_num(np.linalg.norm(steps, axis=-1) / width[1:], nan=_APART)
    times = 1 + 2 * int(np.clip(np.ceil((apart.max() / _APART - 1) / 2), 0, _MIDDLE))
    farthest = times * _BESIDE[-1] / (_SPREAD * apart.min())  # towards the middle of a small arc
    beyond = 0 if circle.ends is None else int(min(np.ceil(farthest), _MOST_BEYOND))
    count = angle.size * times
    around = circle.begin + circle.turn * (np.arange(-beyond, count + beyond) + 0.5) / count
    return around, beyond + times // 2 + times * np.arange(angle.size)


def _between(rim: np.ndarray, here: np.ndarray, normals: np.ndarray, beside: np.ndarray, closed: bool) -> np.ndarray:
    """Which of the lines at places (m, 2) of a rim lie ``beside`` (n, J, C) some of them along the tangent, ideal px.

    Numbers between too, (n, J, C); of a closed rim also below 0 and above m.
    """
    onward = np.diff(rim, axis=0, append=rim[:1])
    length = np.concatenate([[0.0], np.cumsum(np.nan_to_num(np.linalg.norm(onward, axis=-1)))])
    tangents = np.stack([-normals[:, 1], normals[:, 0]], -1)
    ahead = np.sign(np.einsum("ni,ni->n", tangents, onward[np.minimum(here, len(rim) - 2)]))
    numbers, whole = np.arange(len(rim)), length[-1]
    if closed:
        numbers = np.concatenate([numbers - len(rim), numbers, numbers + len(rim)])
        known = np.concatenate([length[:-1] - whole, length[:-1], length[:-1] + whole])
    else:
        known = length[:-1]
    asked = np.expand_dims(length[here], (1, 2)) + np.expand_dims(ahead, (1, 2)) * beside
    return np.where(np.isnan(asked), np.nan, np.round(np.interp(np.nan_to_num(asked), known, numbers), _DIGITS))


def _along_normals(pictures: Pictures, places: np.ndarray, normals: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Mean signal of the cells (n, 2 cells) along the normals of places (n, 2) of a rim, from the inside outwards.

    One ray tells a cell, but several those beside the outline and those that differ from a neighbour: a wall may be
    seen narrower than a cell.
    """

    def seen(line: np.ndarray, cells: np.ndarray) -> np.ndarray:
        points = places[line] + (width[line] * cells)[:, None] * normals[line]
        levels = _looked_at(pictures, points)
        return np.where(np.isfinite(points[:, 0] + points[:, 1]), levels, np.nan)

    line, cell = np.indices((len(places), _MIDDLES.size)).reshape(2, -1)
    levels = seen(line, _MIDDLES[cell]).reshape(len(places), -1)
    uneven = _uneven(levels)
    line, cell = (np.repeat(v, _SHARP) for v in np.nonzero(uneven))
    offsets = _CELL * ((np.arange(_SHARP) + 0.5) / _SHARP - 0.5)
    several = seen(line, _MIDDLES[cell] + np.tile(offsets, uneven.sum()))
    levels[uneven] = several.reshape(-1, _SHARP).mean(1)
    return levels


def _uneven(levels: np.ndarray) -> np.ndarray:
    """Cells beside the outline, and such as differ from a neighbour on their side of it, bool (n, 2 cells)."""
    found = np.zeros(levels.shape, bool)
    found[..., [_CELLS - 1, _CELLS]] = True
    limit = _EVEN * np.nanmax(levels, initial=0.0)
    for side in (slice(0, _CELLS), slice(_CELLS, None)):
        apart = np.abs(np.diff(levels[..., side])) > limit
        found[..., side][..., 1:] |= apart
        found[..., side][..., :-1] |= apart
    return found


def _looked_at(pictures: Pictures, points: np.ndarray) -> np.ndarray:
    """Signal at image points (k, 2) from the image's middle, ideal px."""
    found = np.empty(len(points))
    for k in range(0, len(points), _AT_ONCE):
        part = slice(k, k + _AT_ONCE)
        found[part] = seen_at(pictures, np.nan_to_num(points[part]))
    return found


def _steps(levels: np.ndarray, where: np.ndarray) -> np.ndarray:
    """From each cell to the next (n, J, 2 cells - 1), as lines of levels (n, J, 2 cells) beside each other count, times
    what of a Gaussian about outlines at ``where`` (n, J) is the same wherever it stands (`_second`)."""
    return np.diff(levels) * (_SHARES[:, None] * np.exp(-_ENDS * (_ENDS / 2 + where[..., None])))


def _zero(steps: np.ndarray, where: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Zero crossing of the second derivative of `_steps` about outlines at ``where`` (n, J), in standard deviations,
    and the contrast of a lone step that has its slope there."""
    found = start.copy()
    for _ in range(_STEPS):
        value, slope = (each[:, 0] for each in _second(steps, where, found[:, None]))
        with np.errstate(divide="ignore", invalid="ignore"):
            move = np.clip(np.where(slope != 0, value / slope, np.nan), -0.5, 0.5)
        found = found - move
        if not (np.abs(move) > _CONVERGED).any():
            break
    return found, -slope


def _second(steps: np.ndarray, where: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Second derivative of the blurred levels at ``at`` (n, k) and its slope there, (n, k), as of lone steps.

    Of a step that lies w + e away, w of its outline and e of its cell's end, a Gaussian at a is exp(-(w - a)^2 / 2)
    exp(e a) times what `_steps` holds already, so that few exponentials tell it at many places.
    """
    plain, once, twice = _moments(steps, at, 3)
    away = where[..., None] - at[:, None]  # (n, J, k)
    bell = np.exp(-(away**2) / 2)
    value = bell * (once + away * plain)
    slope = bell * (twice + 2 * away * once + (away**2 - 1) * plain)
    return value.sum(1), slope.sum(1)


def _second_alone(steps: np.ndarray, where: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The former of `_second`."""
    plain, once = _moments(steps, at, 2)
    away = where[..., None] - at[:, None]
    return (np.exp(-(away**2) / 2) * (once + away * plain)).sum(1)


def _moments(steps: np.ndarray, at: np.ndarray, count: int) -> list[np.ndarray]:
    """Sums over the ends e of steps times exp(e a) times 1, e, e^2 ..., (n, J, k) each."""
    near = np.exp(_ENDS[:, None] * at[:, None])  # (n, ends, k)
    powers = [near, *(_ENDS[:, None] ** p * near for p in range(1, count))]
    return np.split(steps @ np.concatenate(powers, -1), count, -1)


def _rival(steps, where, crossing: np.ndarray, slope: np.ndarray, window: np.ndarray) -> np.ndarray:
    """How steep another crossing in the search window (n,), which noise may let win, is at most, over the slope."""
    places = np.linspace(-1, 1, _LOOKED)
    told = _second_alone(steps, where, places * window[:, None]) * np.sign(slope)[:, None]
    left, right = told[:, :-1], told[:, 1:]
    size = window * (places[1] - places[0])
    fall = np.where((left >= 0) & (right < 0), (left - right) / size[:, None], 0.0)
    others = np.abs((places[:-1] + places[1:]) / 2 * window[:, None] - crossing[:, None]) > size[:, None]
    return (fall * others).max(1) / np.abs(slope)
