"""What ``ice plan --views`` prints."""

from __future__ import annotations

import math

from rich.console import Group
from rich.table import Table
from rich.text import Text

import planner
from scenes.status import legend
from validation.report.cells import number as _number
from validation.report.cells import pose as _pose
from validation.report.cells import sigma as _sigma
from validation.report.cells import table as _table
from validation.report.vary_table import CHOICE, HELD, OF_CHOICE, of_view
from validation.views_check import CheckedQuantity, ViewsCheck

_TERMS = """\
  minimised: what is said above, of all pictures together. one / it, repeats / it: how many times as large it is of the
  best single picture, and of that one taken as often, which takes as long. over exhaustive: how far above the best of
  all sets of what was looked at."""
_BOUND = "  over grid's bound: over what no pictures of the grid can stay below."
_CHOICES = "  own choice / it: the same of the best pictures with the scene's own polarisers, lamp and filter."


def report(found: planner.Views, check: ViewsCheck | None, seconds: float) -> Group:
    """Numbers of pictures, their poses, what each measurand gains, and what rendering them says."""
    terms = f"{_TERMS}\n{_CHOICES}\n  {OF_CHOICE}" if found.vary else f"{_TERMS}\n{_BOUND}"
    parts = [Text(_head(found)), _numbers(found), Text(terms), _poses(found), _quantities(found),
             *_statuses(found.sets[-1]), Text(_searched(found, seconds))]  # fmt: skip
    if check:
        parts += [_checked(check)] if check.rows else []
        said = check.verdict.text if check.verdict else f"Nothing is judged: {check.reason}."
        parts.append(Text(f"  {said}\n  The check took {check.seconds:.1f} s (--no-check leaves it out)."))
    return Group(*parts)


def _head(found: planner.Views) -> str:
    held = f", one {found.share} for all" if found.share else ""
    held += f"; {', '.join(found.vary)} of each its own" if found.vary else ""
    return (
        f"{found.scene.title or found.scene.name}\n"
        f"Pictures that together measure best: least {_minimised(found)} ({found.model} model){held}"
    )


def _minimised(found: planner.Views) -> str:
    if len(found.scene.quantities) == 1:
        return "variance"
    return "worst ratio of sigma to tolerance, squared" if found.over == "minimax" else "sum of ratios^2"


def _numbers(found: planner.Views) -> Table:
    columns = ("pictures", "measured", "minimised", "worst ratio", "limited by", "one / it", "repeats / it",
               "over exhaustive", "own choice / it" if found.vary else "over grid's bound")  # fmt: skip
    table = _table("\nN pictures take N times as long: the fair comparison is with the best one repeated", *columns)
    whole = len(found.scene.quantities)
    for index, each in enumerate(found.sets):
        over = found.over_own(index) if found.vary else each.bound and each.minimised / each.bound
        table.add_row(
            str(len(each.views)), f"{whole - len(each.lost)} of {whole}", f"{each.minimised:.4g}",
            _number(each.worst_ratio, ".3g"), each.limiting or "-", _number(each.over_one, ".3f"),
            _number(each.over_repeats, ".3f"),
            "not searched" if each.gap is None else f"{100 * each.gap:.1f} %",
            _number(over, ".3f" if found.vary else ".2f"),
        )  # fmt: skip
    return table


def _poses(found: planner.Views) -> Table:
    before = CHOICE if found.vary else ()
    table = _table("\nWhere they are taken", "pictures", "", "sensor", "light", *before, "measures alone")
    for each in found.sets:
        for number, view in enumerate(each.views, 1):
            told = view.prediction.measurands
            fine, doubtful = (sum(f.status == state for f in told) for state in ("ok", "clutter"))
            alone = f"{fine} ok" + (f", {doubtful} clutter" if doubtful else "")
            row = (str(len(each.views)) if number == 1 else "", f"no. {number}", _pose(view.sensor), _pose(view.light))
            table.add_row(*row, *(of_view(found, view) if found.vary else ()), alone)
    return table


def _quantities(found: planner.Views) -> Table:
    """Of each measurand its sigma for each number of pictures, and which pictures it is taken from."""
    columns = [f"sigma of {len(each.views)}" for each in found.sets]
    last = found.sets[-1]
    title = "\nEach measurand by inverse variance from the pictures that see it; beside it all jointly by least squares"
    table = _table(title, "name", "unit", *columns, "jointly", "taken from", "status")
    for m, forecast in enumerate(last.views[0].prediction.measurands):
        sigmas = [_sigma(each.combination.covariance[m, m]) for each in found.sets]
        used = [str(v + 1) for v in range(len(last.views)) if last.combination.used[v, m]]
        jointly = _sigma(last.combination.covariance_least_squares[m, m])
        taken = "no. " + " ".join(used) if used else "-"
        table.add_row(forecast.name, forecast.unit, *sigmas, jointly, taken, last.combination.status[m])
    return table


def _statuses(last: planner.ViewSet) -> list[Text]:
    """What each status of the table means, what decided it, and what to do."""
    told = [forecast.name for forecast in last.views[0].prediction.measurands]
    reasons = [f"{name}: {why}" if (why := last.why(m)) else "" for m, name in enumerate(told)]
    lines = legend(last.combination.status, reasons)
    return [Text("\n".join(f"  {line}" for line in lines))] if lines else []


def _searched(found: planner.Views, seconds: float) -> str:
    most = found.most_over_repeats
    hard = [f"{', '.join(each.hard)} of {len(each.views)}" for each in found.sets if each.hard]
    lines = [
        f"  {found.pairs} pairs glanced at, {found.looked} settings looked at closely, in {seconds:.1f} s",
        f"  Guarantee: {found.guarantee}.",
    ]
    lines += [f"  Equal: {HELD[found.hold]}."] if found.vary else []
    lines += [f"  {same}: no picture from elsewhere adds as much as the same one again." for same in _repeated(found)]
    if hard:
        lines.append(f"  Hard to set up: a little off the poses these cannot be measured any more: {'; '.join(hard)}.")
    if most is not None:
        lines.append(
            "  By a glance at the grid, were nothing clutter: no pictures, however many, are more than"
            f" {most:.2f} times as good as the best one repeated."
        )
    told = (each for one in found.sets for view in one.views for each in view.prediction.measurands)
    if any(each.status == "clutter" for each in told):
        lines.append(
            "  What is clutter counts as 4 times its variance in what is minimised, and only where no picture is ok."
        )
    return "\n".join(lines)


def _repeated(found: planner.Views) -> list[str]:
    """Pictures of the largest set that are taken from one place, in words."""
    places: dict[tuple, list[str]] = {}
    for number, view in enumerate(found.sets[-1].views, 1):
        places.setdefault(view.place, []).append(str(number))
    return [f"No. {' and '.join(each)} are taken from one place" for each in places.values() if len(each) > 1]


def _checked(check: ViewsCheck) -> Table:
    images = check.rows[0].n + check.rows[0].failed
    title = f"\nEach picture rendered, {images} noisy images of it measured, their values combined by these weights"
    columns = ("pictures", "name", "measured / predicted", "least squares", "bias taken off", "left",
               "propagated /", "failed", "status")  # fmt: skip
    table = _table(title, *columns)
    for row in check.rows:
        table.add_row(
            str(row.pictures), row.name, _interval(row.ratio, row.ratio_interval),
            _interval(row.ratio_least_squares, row.interval_least_squares), _taken_off(row), _left(row),
            _number(row.propagated / row.predicted, ".3f"), str(row.failed),
            row.status if row.judged else f"{row.status}, not judged",
        )  # fmt: skip
    return table


def _taken_off(row: CheckedQuantity) -> str:
    """The correction and its standard uncertainty, in sigmas."""
    sigma = row.predicted**0.5
    return f"{row.correction / sigma:+.2f} ± {row.u_bias / sigma:.2f} sigma" if row.u_bias < math.inf else "not known"


def _left(row: CheckedQuantity) -> str:
    """Mean error in sigmas."""
    return "-" if row.bias is None else f"{row.bias / row.predicted**0.5:+.2f} sigma"


def _interval(ratio: float | None, interval: tuple[float, float] | None) -> str:
    if ratio is None or interval is None:
        return "-"
    out = "" if interval[0] <= 1 <= interval[1] else " *"
    return f"{ratio:.3f} [{interval[0]:.3f}, {interval[1]:.3f}]{out}"
