"""A photograph with what was found in it: outlines, lengths, corners' ellipses, and the edge's distance from them."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse as Oval
from matplotlib.patches import Rectangle

import measure
from measure.find.candidate import CHESSBOARD, ellipse_outline
from scenes import InvalidInput

_WIDTH, _TALLEST = 1200, 1500  # px of the drawing: the picture in it
_DPI = 100
_TEXT = 23.0  # pt: 10 px where the drawing is shown 390 px wide
_LINE = 44  # px of a line of text
_DOT, _CORNER = 9.0, 26.0  # px that a usual residual and the largest ellipse get
_COLOURS = ("#00e676", "#ffd600", "#40c4ff", "#ff6e40", "#ea80fc", "#b2ff59", "#ff80ab", "#18ffff")
_LISTED = 8
_CHI2 = 5.991  # 95 % of two dimensions
_HARD = chr(0xA0)  # a space where no line breaks
_LETTER = 0.62 * _TEXT * _DPI / 72  # px: width of a letter, about


def write(path: Path, image: np.ndarray, found: measure.Shapes) -> None:
    """Draw to a PNG, PDF or SVG.

    Raises
    ------
    InvalidInput
        If the suffix is unknown or the file cannot be written.
    """
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InvalidInput(f"--output must end in .png, .pdf, .svg, got {str(path)!r}")
    try:
        quick = {"pil_kwargs": {"compress_level": 1}} if path.suffix.lower() == ".png" else {}
        figure(image, found).savefig(path, dpi=_DPI, **quick)
    except OSError as error:
        raise InvalidInput(f"--output must be a writable file, got {path} ({error.strerror})") from None


def figure(image: np.ndarray, found: measure.Shapes) -> Figure:
    """The drawing: the picture in grey, what was measured in colours, and a line of text for each."""
    scale = min(_WIDTH / image.shape[1], _TALLEST / image.shape[0])
    residual, corner = _factors(found, scale)
    lines = _lines(found, residual, corner)
    grey = _grey(image, scale)
    height, width = grey.shape
    total, left = height + round(_LINE * (len(lines) + 0.6)), (_WIDTH - width) // 2
    shown = Figure(figsize=(_WIDTH / _DPI, total / _DPI), dpi=_DPI, facecolor="white")
    shown.figimage(cv2.cvtColor(grey, cv2.COLOR_GRAY2RGBA), left, total - height, zorder=-1)
    axes = shown.add_axes((left / _WIDTH, 1 - height / total, width / _WIDTH, height / total))
    axes.set_axis_off()
    for one in found.candidates:
        _outlined(axes, one.outline, "white", 0.8, ":")
    for number, one in enumerate(found.found, 1):
        _drawn(axes, one, number, scale, residual, corner)
    axes.set_xlim(-0.5, image.shape[1] - 0.5)
    axes.set_ylim(image.shape[0] - 0.5, -0.5)
    for k, (text, colour) in enumerate(lines):
        y = 1 - (height + _LINE * (k + 0.9)) / total
        shown.text(0.012, y, text, fontsize=min(_TEXT, 0.976 * _WIDTH / _LETTER / len(text) * _TEXT), va="center")
        if colour:
            shown.patches.append(_mark(shown, y, total, colour))
    return shown


def _mark(shown: Figure, y: float, total: float, colour: str):
    return Rectangle(
        (0, y - 0.4 * _LINE / total), 0.008, 0.8 * _LINE / total, color=colour, transform=shown.transFigure
    )


def _grey(image: np.ndarray, scale: float) -> np.ndarray:
    size = max(int(image.shape[1] * scale), 1), max(int(image.shape[0] * scale), 1)
    how = cv2.INTER_AREA if scale < 1 else cv2.INTER_NEAREST
    small = cv2.resize(np.asarray(image, np.float32), size, interpolation=how)
    low, high = np.percentile(small, [0.1, 99.9])
    return np.clip((small - low) * (255 / max(float(high - low), 1e-300)), 0, 255).astype(np.uint8)


def _factors(found: measure.Shapes, scale: float) -> tuple[float, float]:
    """How many times larger residuals and ellipses are drawn than they are in the drawing: 1, 2 or 5 times 10^k."""
    rms = [side.rms for one in found.found for side in one.residuals]
    radii = [math.sqrt(_CHI2 * _largest(one)) for one in found.found if one.covariance is not None]
    return _nice(_DOT / scale / max(np.median(rms), 1e-9) if rms else 1), _nice(
        _CORNER / scale / max(*radii, 1e-9) if radii else 1
    )


def _largest(one: measure.MeasuredShape) -> float:
    known = [block for block in _blocks(one) if np.isfinite(block).all()]
    return max([0.0, *(float(np.linalg.eigvalsh(block)[-1]) for block in known)])


def _blocks(one: measure.MeasuredShape) -> list[np.ndarray]:
    """Covariance of each corner, NaN where a board's is not measured, or of the centre."""
    count = 1 if one.corners is None else len(one.corners)
    return [one.covariance[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(count)]


def _nice(factor: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not more.

    >>> _nice(70.0), _nice(0.3)
    (50.0, 0.2)
    """
    power = 10.0 ** math.floor(math.log10(max(factor, 1e-9)))
    return next(step * power for step in (5.0, 2.0, 1.0) if step * power <= factor * (1 + 1e-9))


def _outlined(axes: Axes, outline: np.ndarray, colour: str, width: float, style: str = "-") -> None:
    closed = np.concatenate([outline, outline[:1]])
    axes.plot(closed[:, 0], closed[:, 1], style, color=colour, linewidth=width)


def _drawn(axes: Axes, one: measure.MeasuredShape, number: int, scale: float, residual: float, corner: float) -> None:
    colour = _colour(number)
    outline = one.candidate.outline if one.candidate is not None else one.corners
    if one.kind == CHESSBOARD and one.corners is not None:
        axes.plot(one.corners[:, 0], one.corners[:, 1], "+", color=colour, markersize=16, markeredgewidth=3)
    elif one.corners is not None:
        outline = one.corners
        _outlined(axes, outline, colour, 2.0)
        _labelled(axes, one, scale, colour)
    elif one.ellipse is not None:
        outline = ellipse_outline(one.ellipse, 181)
        _outlined(axes, outline, colour, 2.0)
    elif outline is not None:
        _outlined(axes, outline, colour, 2.0, "--")
    for side in one.residuals:
        dots = side.places + residual * side.offsets[:, None] * side.normals
        axes.plot(dots[:, 0], dots[:, 1], ".", color=colour, markersize=5, markeredgecolor="black", markeredgewidth=0.4)
    if one.covariance is not None:
        middles = one.corners if one.corners is not None else one.ellipse[None, :2]
        for middle, block in zip(middles, _blocks(one), strict=True):
            if np.isfinite(block).all():
                _oval(axes, middle, corner**2 * block, colour)
    if outline is not None:
        middle = outline.mean(0)
        taken = [each.get_position() for each in axes.texts if each.get_text().isdigit()]
        free = all(np.hypot(*(middle - place)) * scale > _LINE for place in taken)
        _badge(axes, middle if free else (outline[0] + outline[1]) / 2, str(number), colour)


def _oval(axes: Axes, middle: np.ndarray, covariance: np.ndarray, colour: str) -> None:
    sizes, turned = np.linalg.eigh(covariance)
    angle = math.degrees(math.atan2(turned[1, 1], turned[0, 1]))
    across, along = 2 * np.sqrt(_CHI2 * np.clip(sizes, 0, None))
    axes.add_patch(Oval(tuple(middle), along, across, angle=angle, fill=False, edgecolor="#ff1744", linewidth=2.5))


def _badge(axes: Axes, place: np.ndarray, text: str, colour: str) -> None:
    box = {"boxstyle": "circle,pad=0.15", "facecolor": colour, "edgecolor": "black"}
    axes.text(*place, text, fontsize=0.8 * _TEXT, ha="center", va="center", bbox=box, clip_on=True)


def _labelled(axes: Axes, one: measure.MeasuredShape, scale: float, colour: str) -> None:
    """Each side's length beside it, outside, where it has room."""
    middle = one.corners.mean(0)
    box = {"facecolor": "black", "alpha": 0.6, "edgecolor": "none", "pad": 1.5}
    for i, side in enumerate(one.quantities[: len(one.corners)]):
        start, stop = one.corners[i], one.corners[(i + 1) % 4]
        text = f"{_with_sigma(side.value, side.sigma)} px"
        if np.linalg.norm(stop - start) * scale < len(text) * _LETTER * 0.8:
            continue
        away = (start + stop) / 2 - middle
        normal = np.array([-(stop - start)[1], (stop - start)[0]]) / np.linalg.norm(stop - start)
        place = (start + stop) / 2 + np.sign(normal @ away) * normal * 30 / scale
        angle = math.degrees(math.atan2(-(stop - start)[1], (stop - start)[0]))
        angle -= 180 * round(angle / 180)
        axes.text(*place, text, fontsize=0.8 * _TEXT, color=colour, ha="center", va="center", rotation=angle,
                  bbox=box, clip_on=True)  # fmt: skip


def _lines(found: measure.Shapes, residual: float, corner: float) -> list[tuple[str, str]]:
    """Text under the picture, and the colour that marks it."""
    lines = []
    for number, one in enumerate(found.found[:_LISTED], 1):
        told = textwrap.wrap(f"{number} {_told(one)}", int(0.96 * _WIDTH / _LETTER), subsequent_indent="   ")
        lines += [(line, _colour(number)) for line in told]
    if len(found.found) > _LISTED:
        lines.append((f"and {len(found.found) - _LISTED} more", ""))
    if any(one.residuals for one in found.found):
        lines.append((f"dots: edge's distance x {residual:g};  red: 95 % of place x {corner:g}", ""))
    return lines


def _told(one: measure.MeasuredShape) -> str:
    name = f"{one.candidate.family} {one.candidate.identifier}" if one.kind == "tag" else one.kind
    if one.kind == CHESSBOARD:
        return f"{name}: {len(one.corners)} corners, {one.status}"
    if not one.measured:
        return f"{name}: {one.status}"
    lengths = [q for q in one.quantities if q.unit == "px" and not q.name.startswith(("diagonal", "centre"))]
    values = ", ".join(_with_sigma(q.value, q.sigma).replace(" ", _HARD) for q in lengths)
    return f"{name}, {one.status}: {values}{_HARD}px"


def _with_sigma(value: float, sigma: float) -> str:
    """A value and its standard deviation to two digits of it.

    >>> _with_sigma(83.2091, 0.0312)
    '83.209 ± 0.031'
    """
    digits = int(np.clip(1 - math.floor(math.log10(sigma)), 0, 6)) if sigma > 0 else 4
    return f"{value:.{digits}f} ± {sigma:.{digits}f}"


def _colour(number: int) -> str:
    return _COLOURS[(number - 1) % len(_COLOURS)]
