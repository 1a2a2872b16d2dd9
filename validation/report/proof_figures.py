"""The proof at a glance: measured against predicted scatter, bias beside tolerance, distributions, of everything."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from scipy import stats

from scenes.status import is_trusted
from validation import statistics
from validation.batch.measurands import column
from validation.batch.result import Validation
from validation.batch.rows import Row
from validation.batch.store import RunFile
from validation.report import cells
from validation.report.canvas import TEXT, WIDTH, inline, plt
from validation.report.requirements import HALF

MOST = 5000  # settings that are looked at, evenly spaced
_SINGLE = 60  # lines up to which each has its own place; beyond they are grouped
_FAR = 12  # of the lines of many that are shown beside the groups
_TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.7, 1, 1.4, 2, 5, 10, 20, 50, 100)
_LONGEST = 26  # letters of a name beside a line
_PANELS = 24  # small multiples
_BINS = np.linspace(-5, 5, 41)
_GOOD, _BAD, _OPEN = "#0b5a8f", "#8c1a11", "#6b6b6b"


@dataclass(frozen=True)
class Line:
    """One requirement of one setting; ``number`` of the requirement, ``setting`` from 1.

    ``ratio`` of variances with its 95 % interval, ``bias`` and its standard error, the renderer's noise included, in
    the measurand's unit, ``sigma`` of one picture, ``half`` of the tolerance zone; None, or infinite, where there is no
    number.
    """

    name: str
    number: int
    setting: int
    status: str
    ratio: float | None
    low: float
    high: float
    n: int
    bias: float | None
    error: float
    sigma: float
    half: float | None

    @property
    def grade(self) -> str:
        """Whether it is as predicted: "inside" or "outside" its interval, or "open", where it is not judged."""
        if self.ratio is None or not is_trusted(self.status):
            return "open"
        return "inside" if self.low <= 1 <= self.high else "outside"


def lines_of(found: Validation, halves: dict[str, float]) -> list[Line]:
    """All requirements of all settings, requirement by requirement; half of each tolerance zone by name."""
    numbers: dict[str, int] = {}
    lines = []
    for row in _some(found):
        for each in row.measurands:
            number = numbers.setdefault(each.name, len(numbers) + 1)
            low, high = each.ratio_interval or (math.nan, math.nan)
            good = each.n - each.failed
            empirical = math.inf if each.empirical is None or good < 2 else each.empirical / good
            spread = math.hypot(math.sqrt(empirical), each.render_noise)
            lines.append(Line(
                each.name, number, row.index + 1, each.status, each.ratio, low, high, good, each.bias, spread,
                math.sqrt(each.predicted), halves.get(each.name),
            ))  # fmt: skip
    return sorted(lines, key=lambda line: (line.number, line.setting))


def forest(lines: Sequence[Line], key: str = "forest") -> Markup:
    """Ratio of variances with its interval, a line each; of many the spread of each requirement, and the farthest."""
    known = [line for line in lines if line.ratio is not None]
    shown = _farthest(known) if len(known) > _SINGLE else known
    figure, axis, first = _grouped(known, shown, lambda line: line.ratio)
    for y, line in enumerate(shown, first):
        colour, fill = {"inside": (_GOOD, _GOOD), "outside": (_BAD, "white"), "open": (_OPEN, "white")}[line.grade]
        axis.plot([line.low, line.high], [y, y], color=colour, lw=1.6, ls=":" if line.grade == "open" else "-")
        axis.plot(line.ratio, y, {"inside": "o", "outside": "D", "open": "X"}[line.grade], color=colour, mfc=fill, ms=6)
        _name(axis, y, _label(line, lines))
    axis.axvline(1, color="black", lw=0.9, zorder=0)
    _ratio_axis(axis, known)
    return inline(figure, key, _forest_told(known))


def grouped_told(lines: Sequence[Line]) -> str:
    """How a plot of many lines is read; empty of few."""
    if len(lines) <= _SINGLE:
        return ""
    return f" Bar: 90 % of a requirement's settings, line: all of them, dot: their median; below, the {_FAR} farthest."


def _farthest(known: Sequence[Line]) -> list[Line]:
    return sorted(known, key=lambda line: (-round(abs(math.log(max(line.ratio, 1e-300))), 9), line.number))[:_FAR]


def _groups(known: Sequence[Line]) -> list[tuple[str, list[Line]]]:
    names = dict.fromkeys(line.name for line in known)
    return [(name, [line for line in known if line.name == name]) for name in names][:_SINGLE]


def _group(axis, y: int, ratios: np.ndarray) -> None:
    """Least and largest as a line, the middle 90 % as a bar, the median as a dot."""
    low, least, median, most, high = np.quantile(ratios, [0, 0.05, 0.5, 0.95, 1])
    axis.plot([low, high], [y, y], color=_GOOD, lw=1)
    axis.barh(y, most - least, left=least, height=0.5, color="#a9c7dd", edgecolor=_GOOD)
    axis.plot(median, y, "o", color=_GOOD, ms=6)


def _ratio_axis(axis, known: Sequence[Line]) -> None:
    ends = np.array([end for line in known for end in (line.low, line.high, line.ratio)] + [0.7, 1.4])
    ends = ends[(ends > 0) & np.isfinite(ends)]
    low, high = max(ends.min() / 1.05, 1e-3), min(ends.max() * 1.05, 1e3)
    ticks = [tick for tick in _TICKS if low <= tick <= high]
    axis.set(xscale="log", xlim=(low, high), xlabel="measured / predicted variance, 95 % interval")
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_xticks([], minor=True)


def _forest_told(known: Sequence[Line]) -> str:
    judged = [line for line in known if line.grade != "open"]
    inside = sum(line.grade == "inside" for line in judged)
    ratios = [line.ratio for line in judged]
    reach = f" The ratios go from {min(ratios):.2f} to {max(ratios):.2f}." if ratios else ""
    return f"Measured over predicted variance: 1 lies inside the interval of {inside} of {len(judged)} lines.{reach}"


def bias(lines: Sequence[Line]) -> Markup:
    """Mean error of each line with its 95 % interval, in per cent of half the tolerance zone, or in sigmas of one
    picture where no requirement has a tolerance; of many the spread of each requirement, and the largest."""
    known = [line for line in lines if line.bias is not None and math.isfinite(line.error)]
    toleranced = any(line.half for line in known)
    known = [line for line in known if line.half] if toleranced else known
    key = {id(line): round(abs(_biased(line, toleranced)[0]), 9) for line in known}
    shown = sorted(known, key=lambda line: -key[id(line)])[:_FAR] if len(known) > _SINGLE else known
    figure, axis, first = _grouped(known, shown, lambda line: _biased(line, toleranced)[0])
    for y, line in enumerate(shown, first):
        value, spread = _biased(line, toleranced)
        trusted = is_trusted(line.status)
        colour = _GOOD if trusted else _BAD
        axis.plot([value - spread, value + spread], [y, y], color=colour, lw=1.6)
        axis.plot(value, y, "o" if trusted else "X", color=colour, mfc=colour if trusted else "white", ms=6)
        _name(axis, y, _label(line, lines))
    limit = 100.0 if toleranced else statistics.ALLOWANCE
    ends = [abs(value) + spread for value, spread in (_biased(line, toleranced) for line in shown)] + [limit]
    axis.axvspan(-limit, limit, color="#e8eef3", zorder=0)
    for place in (-limit, limit):
        axis.axvline(place, color="black", lw=0.9, ls="--")
    axis.axvline(0, color="black", lw=0.6)
    axis.set_xlim(-1.1 * max(ends), 1.1 * max(ends))
    axis.set_xlabel(f"bias, % of {HALF}" if toleranced else "bias, sigmas of one picture")
    return inline(figure, "bias", bias_told(shown))


def _biased(line: Line, toleranced: bool) -> tuple[float, float]:
    """Bias and half of its 95 % interval in the unit of the plot."""
    unit = line.half / 100 if toleranced and line.half else line.sigma or math.inf
    return line.bias / unit, 1.96 * line.error / unit


def bias_told(lines: Sequence[Line]) -> str:
    """The largest bias in words."""
    some = [line for line in lines if line.bias is not None and line.half]
    if not some:
        return (
            "Mean errors and their 95 % intervals. The band, 0.3 sigma of one picture, is what the check allows: only "
            "an interval outside of it tells of a bias, and up to one of 20 lies there by chance."
        )
    worst = max(some, key=lambda line: (round(abs(line.bias) / line.half, 9), -line.setting))
    part = 100 * abs(worst.bias) / worst.half
    name = cells.name(worst.name)
    what = f"Mean errors and their 95 % intervals against {HALF} (band)"
    return f"{what}: the largest, of {name}, is {part:.2g} % of it."


def distributions(found: Validation, store: RunFile) -> Markup:
    """Of each requirement all measured values, less their setting's mean, over the predicted sigma, as small panels."""
    counts = standardised(found, store)
    names = [name for name, count in counts.items() if count.any()][:_PANELS]
    across = min(3, max(len(names), 1))
    down = max(-(-len(names) // across), 1)
    figure, panels = plt.subplots(
        down, across, figsize=(WIDTH, 0.5 + 1.35 * down), squeeze=False, sharex=True, layout="constrained"
    )
    x = np.linspace(_BINS[0], _BINS[-1], 101)
    for panel in panels.flat[len(names) :]:
        panel.set_axis_off()
    for panel, name in zip(panels.flat, names, strict=False):
        total = counts[name].sum()
        panel.stairs(counts[name] / max(total, 1) / np.diff(_BINS), _BINS, fill=True, color="#a9c7dd")
        panel.plot(x, stats.norm.pdf(x), color="black", lw=1)
        panel.set(yticks=[], xticks=[-3, 0, 3], ylim=(0, None))
        panel.set_title(_short(cells.name(name), 18), fontsize=TEXT)
    figure.supxlabel("(value - mean) / predicted sigma", fontsize=TEXT)
    return inline(figure, "spread", f"Distributions of {len(names)} requirements, beside the normal one predicted.")


def standardised(found: Validation, store: RunFile) -> dict[str, np.ndarray]:
    """Counts of standardised values between `_BINS`, the outermost with all beyond, by requirement; a histogram of
    fixed size, so that any number of settings can be looked at."""
    counts: dict[str, np.ndarray] = {}
    for row in _some(found):
        for k, each in enumerate(row.measurands):
            here = counts.setdefault(each.name, np.zeros(_BINS.size - 1, int))
            values = store.distances(row.index, column(row.main.method, k))
            values = values[np.isfinite(values)]
            if values.size > 1 and 0 < each.predicted < math.inf:
                z = (values - values.mean()) / math.sqrt(each.predicted)
                here += np.histogram(np.clip(z, _BINS[0], _BINS[-1]), _BINS)[0]
    return counts


def _some(found: Validation) -> Iterator[Row]:
    """All rows, or of very many `MOST`."""
    every = np.unique(np.linspace(0, len(found.rows) - 1, min(MOST, len(found.rows))).astype(int))
    return (found.rows[int(i)] for i in every)


def _grouped(known: Sequence[Line], shown: Sequence[Line], number: Callable[[Line], float]):
    """A figure for the lines shown, below the spread of each requirement if there are many; the first line's place."""
    groups = _groups(known) if len(known) > _SINGLE else []
    figure, axis = _rows(len(shown) + len(groups))
    for y, (name, some) in enumerate(groups):
        _group(axis, y, np.array([number(line) for line in some]))
        _name(axis, y, f"{cells.name(name)}, {len(some)} settings")
    return figure, axis, len(groups)


def _rows(count: int):
    """A figure with so many lines, the first on top."""
    figure, axis = plt.subplots(figsize=(WIDTH, 0.7 + 0.235 * max(count, 1)), layout="constrained")
    axis.set(ylim=(max(count, 1) - 0.4, -0.6), yticks=[])
    axis.tick_params(labelsize=TEXT)
    if not count:
        axis.text(0.5, 0.5, "nothing was measured", transform=axis.transAxes, ha="center", fontsize=TEXT)
    return figure, axis


def _name(axis, y: int, text: str) -> None:
    axis.set_yticks([*axis.get_yticks(), y], [*(label.get_text() for label in axis.get_yticklabels()), text])


def _label(line: Line, every: Sequence[Line]) -> str:
    """Requirement, and the setting where there are several; of one requirement the setting alone."""
    several = any(other.setting != every[0].setting for other in every)
    if not several:
        return f"{line.number}: {_short(cells.name(line.name))}"
    if all(other.number == 1 for other in every):
        return f"setting {line.setting}"
    return f"{_short(cells.name(line.name))}, setting {line.setting}"


def _short(name: str, most: int = _LONGEST) -> str:
    return name if len(name) <= most else name[: most - 1] + "\N{HORIZONTAL ELLIPSIS}"
