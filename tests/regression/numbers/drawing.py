"""What figures hold, exactly, and where the layout puts it: for every picture that the project draws.

Where the layout puts things depends on how wide words are, and that on the version of the font's renderer. Without any
hinting of letters, or with those of DejaVu Serif, no place differs by more than 1.4 % of the largest beside it.
"""

import io
import tempfile
from functools import cache, partial
from pathlib import Path
from unittest import mock

import numpy as np
from matplotlib.collections import Collection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.quiver import Quiver
from matplotlib.text import Annotation

import measure
import planner
from measure.photo.photograph import photograph
from scenes import Picture, Pose, Tolerance
from tests.photographs import rectangle, turned
from tests.regression.numbers.poses import load, uneven
from tests.regression.numbers.working import calibrated, cost_model, fit, plan_of, views_of
from tests.regression.stored import SEARCHED
from validation.cost import pareto, scaling
from validation.report import (
    budget_figure,
    calibration_figure,
    cost_figures,
    figures,
    overlay,
    plan_figures,
    residuals,
    scene_figure,
    sharpness,
    station_sketch,
    station_view,
    views_figure,
    views_page,
)
from validation.report.requirements import Requirement

LAID_OUT = 3e-2  # of the largest number of a box; sizes are compared exactly


def shown(draw):
    """What each figure holds: lines, marks, pictures and areas, words, colours, ends of axes; its size."""
    return _drawn(draw, content)


def placed(draw):
    """Where each figure has its axes, legends and titles, inches."""
    return _drawn(draw, places)


def _drawn(draw, told):
    found = []

    def keep(figure, file, **how):
        found.append(told(figure))
        if told is content:
            found[-1].append(how.get("dpi"))
        if isinstance(file, io.StringIO):
            file.write("<svg></svg>")

    with mock.patch.object(Figure, "savefig", keep), tempfile.TemporaryDirectory() as folder:
        draw(Path(folder) / "figure.png")
    return found


def content(figure):
    """Of a figure: each of its axes, then its own words, where they are, and its size."""
    words = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    at = [[*text.get_position()] for text in figure.texts]
    size = {"inches": [*figure.get_size_inches()], "dots": figure.dpi}
    return [axis(each) for each in figure.axes] + [[text.get_text() for text in words], at, size]


def axis(axis):
    """What one has."""
    texts = (axis.title, axis.xaxis.label, axis.yaxis.label, *axis.texts)
    return {
        "lines": [line.get_xydata() for line in axis.lines],
        "marks": [np.asarray(each.get_offsets(), float) for each in axis.collections],
        "pictures": [np.asarray(each.get_array(), float) for each in axis.images],
        "areas": [each.get_patch_transform().transform(each.get_path().vertices) for each in axis.patches],
        "words": [text.get_text() for text in texts],
        "at": [[*text.get_position(), text.get_ha(), text.get_va()] for text in axis.texts],
        "turned": [text.get_rotation() for text in axis.texts],
        "beside": [[*text.xyann] for text in axis.texts if isinstance(text, Annotation)],
        "scales": [axis.get_xscale(), axis.get_yscale(), str(axis.get_aspect()), axis.axison],
        "ends": [[*axis.get_xlim()], [*axis.get_ylim()]] if axis.name == "rectilinear" else [],
        "ticks": [label.get_text() for label in (*axis.get_xticklabels(), *axis.get_yticklabels())],
        "legend": [text.get_text() for text in axis.get_legend().get_texts()] if axis.get_legend() else [],
        "colours": [*map(_colours, (*axis.lines, *axis.collections, *axis.patches))],
        "arrows": [[*each.U, *each.V] for each in axis.collections if isinstance(each, Quiver)],
        "drawn": [_look(each) for each in (*axis.lines, *axis.collections, *axis.patches, *axis.images, *axis.texts)],
        "frame": sorted({to_hex(each.get_edgecolor()) for each in axis.spines.values() if each.get_visible()}),
        "box": [*axis.get_position(original=True).bounds],
        **({"view": [axis.elev, axis.azim, axis.roll]} if hasattr(axis, "elev") else {}),
    }  # fmt: skip


def _colours(drawn):
    """Of a line, of marks or of an area, as "#rrggbbaa"; how a line is dashed."""
    if isinstance(drawn, Line2D):
        return [to_hex(drawn.get_color(), keep_alpha=True), drawn.get_linestyle(), drawn.get_marker()]
    return sorted({to_hex(each, keep_alpha=True) for each in np.atleast_2d(drawn.get_facecolor())})


def _look(drawn):
    """How far it can be seen through, how large lines, marks and words are; of an area whether it is filled and
    hatched, of a picture where it lies and between which levels, of marks their edges."""
    if isinstance(drawn, Collection):
        edges = sorted({to_hex(each, keep_alpha=True) for each in np.atleast_2d(drawn.get_edgecolor())})
        return [drawn.get_alpha(), edges, drawn.get_hatch(), [*drawn.get_clim()]]
    if hasattr(drawn, "get_extent"):
        return [drawn.get_alpha(), [*drawn.get_extent()], [*drawn.get_clim()], drawn.get_cmap().name]
    if hasattr(drawn, "get_fill"):
        return [drawn.get_alpha(), drawn.get_fill(), drawn.get_hatch(), to_hex(drawn.get_edgecolor())]
    size = [drawn.get_linewidth(), drawn.get_markersize()] if isinstance(drawn, Line2D) else [drawn.get_fontsize()]
    return [drawn.get_alpha(), to_hex(drawn.get_color()), size]


def places(figure):
    """After the layout, inches: left, bottom, width, height of axes, middle and height of legends, middle of titles."""
    if engine := figure.get_layout_engine():
        engine.execute(figure)
    legends = [*figure.legends, *(each.get_legend() for each in figure.axes if each.get_legend())]
    return {
        "axes": [_inches(figure, each.get_window_extent()) for each in figure.axes],
        "legends": [[*_middle(figure, each), _inches(figure, each.get_window_extent())[3]] for each in legends],
        "titles": [_middle(figure, each.title) for each in figure.axes if each.title.get_text()],
    }  # fmt: skip


def _inches(figure, box):
    return [each / figure.dpi for each in box.bounds]


def _middle(figure, drawn):
    left, low, width, height = _inches(figure, drawn.get_window_extent())
    return [left + width / 2, low + height / 2]


def _station(name, image=None):
    """What is measured at a station, of every grade, one of it not drawn."""
    scene = load(name)
    picture = Picture.of(scene, *uneven(scene))
    made = [_requirement(n, each.name) for n, each in enumerate(scene.quantities, 1)]
    found = [None if n == 3 else each for n, each in enumerate(made)]
    return station_view.draw(picture, found, image, "the station")


def _requirement(number, name):
    """Of a grade by its number, the last of them without a tolerance."""
    half, status = (0.02, "ok") if number % 6 else (None, "ok")
    if number % 6 in (3, 4):
        status = "clutter" if number % 6 == 3 else "not_visible"
    tolerance = half and Tolerance(plus=half, minus=half)
    return Requirement(
        number, name, "mm", 4.0, tolerance, 0.0005, 0.0001, None, 0.004 * number, status, "pixel noise, 90 %",
        source="pixel noise",
    )  # fmt: skip


def _sketch(name, by=(1.37, 2.91, 2.23, -3.77), **changes):
    scene = load(name).with_(**changes)
    return station_sketch.draw(Picture.of(scene, *uneven(scene, by=by)))


def _panels(path):
    """Two, three and one pictures."""
    at = [np.outer(np.arange(4 + n), np.arange(5)) + 17.0 * n for n in range(3)]
    lights = [Pose(31.0, 40.0), Pose(7.5, 311.0), Pose(55.0, 190.0)]
    for count in (3, 1):
        figures._panel(at[:count], Pose(12.0, 71.0), lights, "images", (0, 200), path)


def _names():
    """Of what is drawn of a scene: where each name may stand, and how large its owner is."""
    scene = load("plate of unequal numbers")
    view = scene_figure._View(scene, uneven(scene)[0])
    axis = Figure().add_subplot()
    for edge in scene.solid.sharp:
        scene_figure._edge(axis, view, edge)
    for circle in scene.solid.rims:
        scene_figure._circle(axis, view, circle)
    for name in scene.solid.corner_names:
        scene_figure._vertex(axis, view, name)
    return view.names


_charts = cache(plan_figures._charts)  # seconds


def _plan(path):
    with mock.patch.object(plan_figures, "_charts", _charts):
        plan_figures.draw(plan_of("task1"), path.parent, path)


def _costs(path):
    for made in (scaling.scaling_parameter(cost_model()), pareto.pareto_parameter(cost_model())):
        cost_figures._draw(made, path)


_FIGURES = {
    "scene": lambda path: scene_figure.draw(load("plate"), uneven(load("plate"))[0], path),
    "block": lambda path: scene_figure.draw(load("task1"), uneven(load("task1"))[0], path),
    "long": lambda path: scene_figure.draw(load("shaft"), uneven(load("shaft"))[0], path),
    "plan": _plan,
    "views": lambda path: views_figure.draw(views_of(), path.parent),
    "residuals": lambda path: residuals.draw(fit()[0], [fit()[1]], path),
    "budget": lambda path: budget_figure.draw(planner.budget(load("plate"), *uneven(load("plate"))), path),
    "sharpness": lambda path: sharpness.write(path, [(0, measure.mtf(rectangle(120, 70, 13), turned(120, 70, 13), 0))]),
    "overlay": lambda path: overlay.write(path, rectangle(120, 70, 13), photograph(rectangle(120, 70, 13), most=1)),
    "calibration": lambda path: calibration_figure.draw(calibrated(), path),
    "cost": _costs,
    "station": lambda _: _station("plate"),
    "station of a photograph": lambda _: _station("bracket", np.add.outer(np.arange(600.0), np.arange(800.0)) / 6),
    "sketch": lambda _: _sketch("plate"),
    "sketch of two lamps": lambda _: _sketch("two_lights"),
    "sketch of neighbours": lambda _: _sketch("task1", by=(-14.0, 20.0, 3.0, -150.0)),
    "sky": lambda _: views_page.sky(views_of().sets[-1]),
    "panels": _panels,
}  # fmt: skip


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {f"figure {name}": (SEARCHED, partial(shown, draw)) for name, draw in _FIGURES.items()}
    laid_out = {f"figure {name} laid out": (LAID_OUT, partial(placed, draw)) for name, draw in _FIGURES.items()}
    return found | laid_out | {"figure names": (SEARCHED, _names)}
