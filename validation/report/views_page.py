"""The page of a plan of several pictures: what they measure together, the part as each of them sees it, where they
stand."""

from __future__ import annotations

import math
from pathlib import Path

from markupsafe import Markup
from scipy.stats import norm

import planner
from scenes import several
from scenes.results import finite
from validation.report import camera_words, cells, map_figure, page, station_table, station_view
from validation.report.canvas import TEXT, WIDTH, inline, plt
from validation.report.page_tables import Table
from validation.report.requirements import Requirement
from validation.report.vary_table import CHOICE, OF_CHOICE, of_view
from validation.report.wording import what

_P = 0.95
_LAMP, _CAMERA = "#b35900", "#0b3c5d"
_ABOVE = f"U: expanded uncertainty (95 %), by noise alone. {station_table.PART}"
_NOTE = (
    "sigma: standard deviation of the combined value, by noise. bias: mean error of it. taken from: by inverse "
    f"variance from these pictures. {station_table.GRADED}"
)


def write(found: planner.Views, path: Path) -> Path:
    """Write plan.html of the largest set of pictures; the path."""
    scene, last = found.scene, found.sets[-1]
    asked = requirements(last)
    first = {
        "what": f"{what(asked)}, numbered in the pictures, from {_pictures(len(last.views))} together",
        **page.said(asked),
        "is_sky": True,
        "places": f"{camera_words.told(scene)}.",
        "sketch": sky(last),
        "sketched": f"Seen from above, distance from the middle: angle from the vertical. {_told(last)}.",
        "view": Markup("").join(_view(found, number, asked) for number in range(len(last.views))),
        "caption": "What is taken from each picture. Drawn from the model: no shadows.",
        "columns": (*station_table.COLUMNS[:-1], "taken from"),
        "above": _ABOVE, "note": station_table.note(asked, _NOTE),
    }  # fmt: skip
    sections = [
        page.Section("Where they stand", tables=[_poses(found)]),
        page.Section("How many pictures are worth it", answer=_worth(found), tables=[_numbers(found)]),
        page.Section("How it was found", answer=_searched(found)),
    ]  # fmt: skip
    return page.write_page(first, scene.name, scene.title or scene.name, sections, path)


def _searched(found: planner.Views) -> str:
    known = f"{found.guarantee[0].upper()}{found.guarantee[1:]}."
    return f"{known} {found.pairs} pairs of places were glanced at, {found.looked} looked at closely."


def requirements(found: planner.ViewSet) -> tuple[Requirement, ...]:
    """Of what a set of pictures tells together; U is of noise alone, ``limits`` the pictures a value is taken from."""
    both, told, k = found.combination, found.views[0].prediction.measurands, norm.ppf((1 + _P) / 2)
    made = []
    for m, each in enumerate(told):
        sigma, state = math.sqrt(both.variances[m]), both.status[m]
        used = [str(v + 1) for v in range(len(found.views)) if both.used[v, m]]
        made.append(Requirement(
            number=m + 1, name=each.name, unit=each.unit, nominal=each.nominal, tolerance=each.tolerance, sigma=sigma,
            bias=finite(both.bias[m]), u_bias=None, U=finite(k * sigma), status=state, kind=each.kind,
            limits=f"picture{'s' * (len(used) > 1)} {', '.join(used)}" if used else "",
            reason=found.why(m),
        ))  # fmt: skip
    return tuple(made)


def sky(found: planner.ViewSet, key: str = "sky") -> Markup:
    """Where cameras and lamps stand, numbered, seen from above the part."""
    poses = [pose for view in found.views for pose in (view.sensor, *several(view.light))]
    reach = 90.0 if max(pose.polar_deg for pose in poses) <= 90 else 180.0
    figure, axis = plt.subplots(figsize=(WIDTH, 0.9 * WIDTH), layout="constrained")
    map_figure.rings(axis, reach)
    for number, view in enumerate(found.views, 1):
        camera, *lamps = [map_figure.place(*pose) for pose in (view.sensor, *several(view.light))]
        for lamp in lamps:
            axis.plot(*zip(camera, lamp, strict=True), color="0.4", lw=0.9, ls=(0, (4, 3)))
        marks = [(camera, "s", _CAMERA), *((lamp, "o", _LAMP) for lamp in lamps)]
        for (x, y), marker, colour in marks:
            axis.plot(x, y, marker, color=colour, ms=15, mec="white")
            axis.text(x, y, str(number), color="white", fontsize=TEXT, ha="center", va="center_baseline", weight="bold")
    return inline(figure, key, f"Seen from above: squares cameras, circles lamps. {_told(found)}.")


def _told(found: planner.ViewSet) -> str:
    return "Squares: cameras, circles: lamps, by the picture's number. " + "; ".join(
        f"{number}: camera {cells.pose(view.sensor)}, lamp {cells.pose(view.light)}"
        for number, view in enumerate(found.views, 1)
    )


def _view(found: planner.Views, number: int, asked: tuple[Requirement, ...]) -> Markup:
    """The part in one of the pictures, with what is taken from it."""
    last = found.sets[-1]
    view, used = last.views[number], last.combination.used[number]
    shown = [each if taken else None for each, taken in zip(asked, used, strict=True)]
    names = "; ".join(f"{each.number} {each.title}: {each.grade}" for each in shown if each)
    label = f"Picture {number + 1}: {names or 'nothing is taken from it'}."
    return station_view.draw(view.picture, shown, None, label, f"view{number + 1}")


def _pictures(count: int) -> str:
    return "one picture" if count == 1 else f"{count} pictures"


def _poses(found: planner.Views) -> Table:
    last, rows = found.sets[-1], []
    for number, (view, taken) in enumerate(zip(last.views, last.combination.used, strict=True), 1):
        names = [each.name for each, used in zip(view.prediction.measurands, taken, strict=True) if used]
        before = of_view(found, view) if found.vary else []
        rows.append(
            [str(number), cells.pose(view.sensor), cells.pose(view.light), *before, ", ".join(names) or "nothing"]
        )
    columns = ["picture", "camera", "lamp", *(CHOICE if found.vary else ()), "taken from it"]
    note = "Places of camera and lamp: (angle from the vertical, azimuth), degrees."
    note += f" {OF_CHOICE}" if found.vary else ""
    return Table("Where the pictures are taken", columns, rows, note, words=True)


def _numbers(found: planner.Views) -> Table:
    whole = len(found.scene.quantities)
    rows = [
        [str(len(each.views)), f"{whole - len(each.lost)} of {whole}", cells.number(each.worst_ratio, ".3g"),
         each.limiting or "-", cells.number(each.over_one, ".2f"), cells.number(each.over_repeats, ".2f")]
        for each in found.sets
    ]  # fmt: skip
    note = (
        "worst: largest sigma over half the tolerance zone. than one picture, than one repeated: how many times as"
        " good (in variance) as the best single picture, and as that one taken as often, which takes as long."
    )
    columns = ["pictures", "measured", "worst", "limited by", "than one picture", "than one repeated"]
    return Table("What more pictures gain", columns, rows, note, chosen=len(rows) - 1)


def _worth(found: planner.Views) -> str:
    last = found.sets[-1]
    if last.over_repeats is None:
        return "No single picture measures all of it, so several are needed."
    if last.over_repeats <= 1.005:
        return "Taking the best single picture again and again is as good."
    return f"They are {last.over_repeats:.2f} times as good, in variance, as the best single picture taken as often."
