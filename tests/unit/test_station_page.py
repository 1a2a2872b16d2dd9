"""The page of a station: grades, sentences, balloons, the sketch and the budget's chart, each by its own arithmetic."""

import dataclasses
import math
import re
from itertools import combinations
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import measure
import planner
import scenes
from imaging.geometry.projection import project
from scenes import Picture, Tolerance
from scenes.status import MEANINGS, MEASURED, REMEDIES, legend
from validation.batch.campaign import Campaign
from validation.explore import preview
from validation.report import (
    budget_figure,
    camera_words,
    canvas,
    guide,
    page,
    proof_figures,
    requirements,
    settings_table,
    source_words,
    station,
    station_sketch,
    station_table,
    station_view,
    wording,
)
from validation.report.requirements import Grade, Requirement

TOLERANCE = Tolerance(plus=0.03, minus=0.01)  # half of the zone: 0.02


def required(number=1, u=0.001, status="ok", tolerance=TOLERANCE, name="bore"):
    return Requirement(
        number, name, "mm", 4.0, tolerance, 0.0005, 0.0001, None, u, status, "pixel noise, 90 %", source="pixel noise"
    )


@pytest.fixture(scope="module")
def plate():
    scene = scenes.load("plate")
    return Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)


def test_a_run_says_what_decided_each_status_once():
    """Of the first requirement of the first row that has it, with the numbers of that row; of what is ok nothing."""

    def row(index, *statuses):
        names = ("hole to corner", "bore", "length", "square", "hole from front")
        told = (SimpleNamespace(name=name, status=status, u_bias=0.03 * (index + 1), predicted=1e-4)
                for name, status in zip(names, statuses, strict=True))  # fmt: skip
        return SimpleNamespace(index=index, measurands=tuple(told))

    rows = [
        row(0, *5 * ["ok"]),
        row(1, "ok", "clutter", "ok", "clutter", "ok"),
        row(2, "clutter", *3 * ["ok"], "short"),
    ]
    found = station.reasons(Campaign.of(scenes.load("plate")), rows)
    assert list(found) == ["clutter", "short"]
    most = "at most 0.01 cm is allowed, the sigma of noise"
    assert found["clutter"] == f"bore, setting 2: its bias is known to 0.06 cm (1 sigma); {most}"
    assert found["short"] == ""  # it was not predicted to be
    (line,) = guide.statuses(["ok", "clutter"], found)
    assert f"biases the value (bore, setting 2: its bias is known to 0.06 cm (1 sigma); {most}); move" in line


def test_a_requirement_without_a_tolerance_is_told_with_its_uncertainty():
    one = required(tolerance=None, u=0.00284)
    told = "measured with an expanded uncertainty U (95 %) of 0.0028 mm; no tolerance is given to compare with."
    assert wording.sentence([one]) == f"Bore is {told}"
    assert wording.sentence([one, required(2, name="slot")]).endswith(told)
    assert "U (95 %)" not in wording.sentence([one, dataclasses.replace(one, number=2)])


@pytest.mark.parametrize("name", ["plate", "copper", "task1"])
def test_what_is_predicted_is_of_one_estimator(name):
    """U is not of another one than sigma, which it would be too small for."""
    scene = scenes.load(name)
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
    for each in (*requirements.predicted(picture), *station.of_picture(picture).requirements):
        assert each.U / each.sigma > 1.959  # margin: k is 1.96


def test_parts_above_one_have_no_exponent():
    cells = station_table.lines([required(u=0.0341)])[0].cells
    assert cells[6] == "170 %"
    assert station_table.lines([required(u=0.246)])[0].cells[6] == "12 x"


@pytest.fixture(scope="module")
def rig():
    scene = scenes.load("calibrated_rig")
    return Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)


@pytest.mark.parametrize(
    ("u", "status", "tolerance", "grade"),
    [
        (0.0049, "ok", TOLERANCE, Grade.WELL),
        (0.0051, "ok", TOLERANCE, Grade.WITHIN),
        (0.0199, "ok", TOLERANCE, Grade.WITHIN),
        (0.0201, "ok", TOLERANCE, Grade.OVER),
        (None, "ok", TOLERANCE, Grade.OVER),
        (0.0049, "ok", None, Grade.OPEN),
        (0.0049, "clutter", TOLERANCE, Grade.DOUBT),
        (0.0049, "clutter", None, Grade.DOUBT),
        (0.0049, "short", TOLERANCE, Grade.MISSING),
        (None, "not_visible", None, Grade.MISSING),
    ],
)
def test_grades_are_of_half_the_zone(u, status, tolerance, grade):
    """A quarter of it, a test uncertainty ratio of 4, and all of it are the limits; nothing doubtful is graded by U."""
    assert required(u=u, status=status, tolerance=tolerance).grade == grade


def test_the_sentence_counts_all_and_names_what_is_wrong():
    several = [required(k, name=f"r{k}") for k in range(1, 9)]
    several += [required(9, u=0.03, name="step"), required(10, status="clutter", name="square")]
    text = wording.sentence(several)
    assert text.startswith(
        "8 of 10 requirements are measured precisely enough: the uncertainty U (95 %) of the measurement is at most"
    )
    assert "Step (no. 9) is measured too uncertainly: U is larger than half the tolerance zone. " in text
    assert text.endswith("Square (no. 10) is not proven: its value must not be relied on.")
    square, step = wording.wrong(several)
    assert square == f"Square (no. 10), status clutter: {MEANINGS['clutter']}."
    assert step == "Step (no. 9): U is 1.5 times half the tolerance zone; most of it comes from pixel noise."
    first, second = wording.next_step(several).split(". Step")
    assert first == f"Square (no. 10): {REMEDIES['clutter']}"
    assert second == (
        " (no. 9): most of U comes from pixel noise; expose longer, come nearer, or take the mean of several pictures."
    )
    assert wording.next_step(several[:9]) == f"Step{second}"
    assert wording.next_step(several[:8]).startswith("Nothing has to be changed")
    assert wording.wrong(several[:8]) == []
    assert wording.sentence(several[:8]).startswith("All 8 requirements are measured precisely enough")
    assert wording.sentence(several[:1]).startswith("The requirement is measured precisely enough")


def test_the_first_words_of_u_say_what_it_is():
    """Once, wherever the sentence begins."""
    for u, told in ((0.001, "enough"), (0.006, "usable, but less"), (0.03, "too uncertainly:")):
        text = wording.sentence([required(u=u), required(2, u=u, name="slot")])
        assert told in text
        assert text.count("the uncertainty U (95 %) of the measurement is ") == 1
        assert " U is " not in text


def test_what_is_said_agrees_with_its_colour():
    """To be done, worth doing, or nothing: by the worst requirement; the words of each begin accordingly."""
    well, within, over = required(), required(2, u=0.012, name="slot"), required(3, u=0.03)
    doubtful, open_ = required(4, status="short"), required(5, tolerance=None)
    needs = [wording.need([well, each]) for each in (well, within, open_, over, doubtful)]
    assert needs == ["none", "may", "may", "act", "act"]
    assert wording.next_step([well, within]) == (
        "Nothing has to be changed: set camera and lamp up at the places given here. For a smaller U of slot (no. 2): "
        "most of U comes from pixel noise; expose longer, come nearer, or take the mean of several pictures."
    )
    assert "smaller" not in wording.next_step([within, over])
    assert wording.next_step([open_]).startswith("Give each requirement its tolerance, the key `tolerance` of its `[[")
    assert wording.wrong([open_]) == ["No tolerance is given: whether U is small enough cannot be told."]
    assert wording.wrong([well, open_])[0].startswith("No tolerance is given for bore (no. 5): ")


def test_of_many_requirements_the_numbers_are_named():
    doubtful = [required(k, status="short", name=f"r{k}") for k in range(1, 6)]
    (line,) = wording.wrong([*doubtful, required(6)])
    assert line.startswith("Requirements no. 1, 2, 3, 4 and 5, status short: ")
    several = wording.sentence([*doubtful, required(6)])
    assert several.endswith(f"5 of 6 requirements are not measured: {MEANINGS['short']}.")


def test_what_has_no_value_is_not_measured_and_what_has_one_is_not_proven():
    short, hidden = required(1, status="short", name="a"), required(2, status="not_visible", name="b")
    doubtful = required(3, status="clutter", name="c")
    assert wording.sentence([short, doubtful]) == (
        f"C (no. 3) is not proven: its value must not be relied on. A (no. 1) is not measured: {MEANINGS['short']}."
    )
    assert wording.sentence([short, hidden, doubtful]).endswith("A (no. 1) and b (no. 2) are not measured: they have "
                                                                "no value.")  # fmt: skip
    lines = station_table.lines([doubtful, short])
    assert [line.cells[7] for line in lines] == ["not measured: short", "not proven: clutter"]
    assert [line.cells[5] for line in lines] == ["-", "-"]


def test_nothing_is_wrong_where_all_are_usable_and_those_that_are_no_more_are_named():
    well, within = required(), required(2, u=0.012, name="slot")
    assert wording.nothing_wrong([well]) == "Nothing."
    assert wording.nothing_wrong([well, within]) == (
        "Nothing is wrong: slot (no. 2) is usable (U is 60 % of half the tolerance zone)."
    )
    both = [within, dataclasses.replace(within, number=3, name="step", U=0.008)]
    assert wording.nothing_wrong([well, *both]).endswith(
        ": slot (no. 2) and step (no. 3) are usable (U is up to 60 % of half the tolerance zone)."
    )
    assert wording.nothing_wrong(both).startswith("Nothing is wrong: all 2 requirements are usable (U is up to 60 %")


def test_a_run_is_titled_by_its_part():
    """Its own title first; that of a campaign without one names the scene of the setting that is shown."""

    def told(title, name, part):
        scene = SimpleNamespace(title=part, name="block")
        return page._title(SimpleNamespace(title=title, scene=name),
                           SimpleNamespace(picture=SimpleNamespace(scene=scene)))  # fmt: skip

    assert told("Own", "large", "A block") == "Own"
    assert told("", "block", "") == "block"
    assert told("", "large", "A block") == "A block (campaign large)"
    assert told("", "large", "") == "block (campaign large)"


def test_the_table_of_settings_speaks_of_camera_and_lamp_and_explains_its_statuses(monkeypatch):
    rows = [setting(0, ("a", 0.01, "ok"), ("b", 0.1, "ok")), setting(1, ("a", 0.01, "ok"), ("b", 0.1, "short"))]
    monkeypatch.setattr(settings_table, "names", lambda found, some: (["noise.sigma", "sensor", "light"], {
        row.index: ["1", "(1.0, 2.0)", "(3.0, 4.0)"] for row in some}))  # fmt: skip
    made = settings_table.table(SimpleNamespace(rows=rows), {"a": 0.1, "b": 1.0}, 1)
    assert made.columns == ["setting", "noise.sigma", "camera", "lamp", "largest sigma", "proven",
                            "not proven, by status"]  # fmt: skip
    assert [row[-2:] for row in made.rows] == [["2 of 2", "-"], ["1 of 2", "short 1"]]
    assert f" short: {MEANINGS['short']}." in made.note
    assert "proven: value and sigma can be relied on" in made.note
    assert "ok:" not in made.note


def test_what_is_wrong_is_told_with_its_number():
    """Of several with one status the first that has a number; each status has its line and its remedy, the worst
    first."""
    faint = dataclasses.replace(required(2, status="low_contrast", name="b"), reason="edge e1 is dark")
    several = [required(1, status="clutter", name="a"), required(3, status="low_contrast", name="c"), faint]
    told = wording.wrong(several)
    assert told == [
        "C (no. 3) and b (no. 2), status low_contrast: of b, edge e1 is dark.",
        f"A (no. 1), status clutter: {MEANINGS['clutter']}.",
    ]
    assert wording.next_step(several) == (
        f"C (no. 3) and b (no. 2): {REMEDIES['low_contrast']}. A (no. 1): {REMEDIES['clutter']}."
    )


def test_the_worst_is_improved_first():
    """By its U over half the zone: what cannot be told is worst, of equals the first comes first."""
    a, b, c = required(1, u=0.03, name="a"), required(2, u=0.05, name="b"), required(3, u=0.05, name="c")
    assert wording.next_step([a, b, c]).startswith("B (no. 2): most of U comes from pixel noise; ")
    assert wording.next_step([c, b, a]).startswith("B (no. 2): ")
    assert wording.next_step([a, b, required(4, u=None, name="d")]).startswith("D (no. 4): ")
    wide = required(5, u=0.06, name="e", tolerance=Tolerance(plus=0.1, minus=0.1))
    assert wording.next_step([a, wide]).startswith("A (no. 1): ")


def test_every_status_says_what_to_do():
    assert set(REMEDIES) == set(MEANINGS)
    assert all(REMEDIES[status] for status in MEANINGS if status != "ok")
    assert all(line.endswith(f"; {REMEDIES[line.split(':')[0]]}.") for line in legend(MEANINGS))


def test_requirements_are_the_forecasts_beside_the_budgets_u(plate):
    found, told = requirements.predicted(plate), planner.predict(plate).measurands
    u = {each.name: each.U for each in planner.budget(plate).measurands}
    for each, forecast in zip(found, told, strict=True):
        assert (each.name, each.status, each.nominal) == (forecast.name, forecast.status, forecast.nominal)
        assert each.sigma == pytest.approx(math.sqrt(forecast.variance_object))
        assert pytest.approx(u[each.name]) == each.U
        assert 1.9 * each.sigma < each.U  # margin: k is 1.96, and there is more than noise


def test_one_that_cannot_be_measured_takes_nothing_from_the_others(plate):
    """As the second of five, its variance infinite: the others keep their U."""
    sigmas = [math.sqrt(each.variance_object) for each in planner.predict(plate).measurands]
    sigmas[1] = math.inf
    found = requirements.measurable_budget(plate, variances=[s * s for s in sigmas])
    assert [each.name for each in found] == ["hole to corner", "length", "square", "hole from front"]
    states = ["ok", "low_contrast", "ok", "ok", "ok"]
    made = requirements.requirements(plate, sigmas, [0.0] * 5, found, states)
    assert [each.U is None for each in made] == [False, True, False, False, False]
    assert made[1].grade == Grade.MISSING
    assert "Bore (no. 2) is not measured: too little" in wording.sentence(made)
    whole = {each.name: each.U for each in planner.budget(plate).measurands}
    assert pytest.approx(whole["length"]) == made[2].U


def test_what_a_correction_is_not_sure_of_is_in_u(plate):
    """U = 1.96 sqrt(sigma^2 + u(bias)^2) where the bias is taken off; what is not known at all adds nothing but its
    status."""
    sigmas, doubts = [0.001, 0.002, 0.001, 0.02, 0.001], [0.0005, 0.002, 0.0, 0.01, math.inf]
    found = requirements.measurable_budget(plate, variances=[s * s for s in sigmas], doubts=doubts)
    wanted = [1.959964 * math.hypot(s, u if math.isfinite(u) else 0.0) for s, u in zip(sigmas, doubts, strict=True)]
    assert [each.U for each in found] == pytest.approx(wanted)
    made = requirements.requirements(plate, sigmas, [0.0] * 5, found, ["ok"] * 4 + ["clutter"], doubts)
    assert [each.u_bias for each in made] == doubts
    assert made[4].grade == Grade.DOUBT
    assert station_table.lines(made)[0].cells[4] == "0 cm ± not known"


def crossing(one, other):
    """Whether two segments cross: each has the other's ends on both sides."""

    def side(a, b, c):
        return np.sign((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))

    return side(*one, other[0]) * side(*one, other[1]) < 0 and side(*other, one[0]) * side(*other, one[1]) < 0


@pytest.mark.parametrize("count", [1, 7, 30, 60])
def test_balloons_keep_apart_and_their_leaders_do_not_cross(count, rng):
    """Random anchors, some of them in the same place; of very many some stand closer."""
    size, corner = np.array([4.0, 3.0]), np.array([0.5, 0.3])
    anchors = [corner + rng.random((1 + k % 3, 2)) * size for k in range(count)]
    if count > 5:
        anchors[5] = anchors[2]
    frame = station_view.Frame(1.0, size, corner, 5.2, 3.6)
    spots, tied = station_view.balloons(anchors, frame.around(count))
    assert all((each == one).all(1).any() for each, one in zip(anchors, tied, strict=True))
    outside = (spots < corner) | (spots > corner + size)
    assert outside.any(1).all()
    apart = min((np.linalg.norm(a - b) for a, b in combinations(spots, 2)), default=1.0)
    assert apart > (0.25 if count < 40 else 0.1)  # margin: the order is said: balloons do not touch
    leaders = list(zip(tied, spots, strict=True))
    assert not any(crossing(a, b) for a, b in combinations(leaders, 2))


def test_marks_are_drawn_where_they_lie_in_the_image(plate, monkeypatch):
    """The image's extent on the figure tells where a px is; its window does not begin at the first px."""
    figures = []
    monkeypatch.setattr(station_view, "inline", lambda figure, key, label: figures.append(figure))
    found = [required(n, name=quantity.name) for n, quantity in enumerate(plate.scene.quantities, 1)]
    station_view.draw(plate, found, None, "the plate")
    (axis,) = figures[0].axes
    part, (left, right, low, high) = preview.window(plate.scene, plate), axis.images[0].get_extent()
    assert min(part.left, part.top) > 0
    drawn = np.concatenate([line.get_xydata() for line in axis.lines])
    for mark in station_view.marks(plate):
        for points in mark.lines:
            x = left + (points[:, 0] + 0.5 - part.left) / part.width * (right - left)
            y = high + (points[:, 1] + 0.5 - part.top) / part.height * (low - high)
            away = np.abs(np.stack([x, y], 1)[:, None] - drawn).max(-1).min(1)
            assert away.max() < 1e-9
    plt.close(figures[0])


def test_marks_lie_on_what_is_measured(plate):
    """Of a diameter the rim, all of it as far from the bore's centre as it is; of a width the foot is on the side."""
    scene, marks = plate.scene, station_view.marks(plate)
    names = [quantity.name for quantity in scene.quantities]
    rim = marks[names.index("bore")].lines[0]
    circle = scene.solid.circle("c2")
    pose = np.array(list(plate.sensor))
    around = project(circle.centre + circle.radius * np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0.0]]), pose, scene.camera)
    for point in around:
        assert np.linalg.norm(rim - point, axis=1).min() < 0.05 * np.ptp(rim[:, 0])
    *_, between = marks[names.index("length")].lines
    ends = scene.solid.vertices[list(scene.solid.edge("e4").ends)]
    assert between[0] == pytest.approx(project(ends.mean(0)[None], pose, scene.camera)[0])
    (a, b), foot = project(scene.solid.vertices[list(scene.solid.edge("e11").ends)], pose, scene.camera), between[1]
    along, off = b - a, foot - a
    assert abs(along[0] * off[1] - along[1] * off[0]) / np.hypot(*along) < 1e-6


def test_balloons_are_tied_to_what_lies_between_the_features(plate):
    """Well within it, the middle first."""
    tied = station_view._between(np.array([10.0, 40.0]), np.array([30.0, 20.0]))
    share = (tied - [10.0, 40.0]) / [20.0, -20.0]
    assert share[:, 0] == pytest.approx(share[:, 1])
    assert share[0, 0] == pytest.approx(0.5)
    assert ((share > 0.1) & (share < 0.9)).all()
    assert len(np.unique(share[:, 0].round(6))) == len(tied) > 3


def test_the_sketch_is_to_scale(plate):
    """From the side the camera stands at its distance, its polar angle from up; from above at the part of it across."""
    side, above = station_sketch.axes_of(plate)
    polar, azimuth = np.radians(list(plate.sensor))
    eye = 100.0 * np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    assert side @ eye == pytest.approx([100 * np.sin(polar), 100 * np.cos(polar)])
    assert above @ eye == pytest.approx([100 * np.sin(polar), 0.0], abs=1e-9)
    for pair in (side, above):
        assert pair @ pair.T == pytest.approx(np.eye(2))
    assert np.cross(*above) == pytest.approx([0, 0, 1])  # or it were a view from below, or in a mirror
    assert np.cross(*side) == pytest.approx([np.sin(azimuth), -np.cos(azimuth), 0])
    assert "camera 100 cm away, 15.0° from the vertical, azimuth 85.0°; lamp 100 cm away" in station_sketch.told(plate)


@pytest.mark.parametrize("name", ["plate", "two_lights"])
def test_lamps_are_drawn_where_they_stand(name, monkeypatch):
    """Each of the scene's, seen from the side and from above, in the scene's unit, with a ray to what is aimed at."""
    scene, kept = scenes.load(name), []
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
    monkeypatch.setattr(station_sketch, "inline", lambda figure, *given: kept.append(figure) or "")
    station_sketch.draw(picture)
    try:
        for figure, (right, up) in zip(kept, station_sketch.axes_of(picture), strict=True):
            (axis,) = figure.axes
            stars = [line.get_xydata()[0] for line in axis.lines if line.get_marker() == "*"]
            polar, azimuth = np.radians([list(pose) for pose in picture.lights]).T
            ways = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
            at = ways * [[light.distance] for light in scene.lights]
            assert np.array(stars) == pytest.approx(np.stack([at @ right, at @ up], -1), abs=1e-6)
            ends = [line.get_xydata()[1].tolist() for line in axis.lines if line.get_marker() == "None"]
            assert all(star.tolist() in ends for star in stars)
    finally:
        for figure in kept:
            plt.close(figure)


@pytest.mark.parametrize("azimuth", [0.0, 85.0, 200.0])
def test_the_view_from_above_shows_azimuth_0(plate, azimuth, monkeypatch):
    """An arrow along the part's x axis as the view turns it, within the view, off camera and lamp, named below it."""
    picture = Picture.of(plate.scene, (20, azimuth), (30, azimuth + 130))
    kept = []
    monkeypatch.setattr(station_sketch, "inline", lambda figure, *given: kept.append(figure) or "")
    station_sketch.draw(picture)
    try:
        side, above = (figure.axes[0] for figure in kept)
        assert not any(text.get_text() == "azimuth 0" for text in side.texts)
        (arrow,) = (text for text in above.texts if getattr(text, "arrow_patch", None) is not None)
        (letter,) = (text for text in above.texts if text.get_text() == "azimuth 0")
        way, turn = np.array(arrow.xy) - arrow.get_position(), np.radians(azimuth)
        assert way / np.linalg.norm(way) == pytest.approx([np.cos(turn), -np.sin(turn)], abs=1e-9)
        (left, right), (low, high) = above.get_xlim(), above.get_ylim()
        above.figure.canvas.draw()
        box, inside = letter.get_window_extent(), above.get_window_extent()
        assert inside.x0 < box.x0 < box.x1 < inside.x1
        assert inside.y0 < box.y0
        assert box.y1 < above.transData.transform([arrow.xy, arrow.get_position()])[:, 1].min()
        for x, y in (arrow.xy, arrow.get_position(), letter.get_position()):
            assert left + 0.06 * (right - left) < x < right - 0.06 * (right - left)  # margin: by half a letter's size
            assert low + 0.06 * (high - low) < y < high - 0.06 * (high - low)  # margin: by half a letter's size
        placed = [line.get_xydata()[0] for line in above.lines if line.get_marker() in ("*", "s")]
        assert len(placed) == 2
        away = [np.linalg.norm(place - arrow.xy) for place in placed]
        assert min(away) > 0.2 * (right - left)  # margin: the arrow and its letter are 0.2 long
    finally:
        for figure in kept:
            plt.close(figure)


def test_a_bars_parts_add_to_u_in_per_cent_of_the_tolerance(rig):
    found = planner.budget(rig)
    sources, table = budget_figure.parts(found.measurands, [0.02])
    (each,) = found.measurands
    assert table.sum() == pytest.approx(100 * each.U / 0.02)
    assert sources[-1] == "all others"
    shares = {row.source: row.contribution**2 / each.u**2 for row in each.contributions}
    largest = max(shares, key=shares.get)
    assert sources[0] == largest
    assert table[0, 0] == pytest.approx(100 * each.U / 0.02 * shares[largest])
    assert budget_figure.parts(found.measurands, [None])[1].sum() == pytest.approx(100)


def test_what_halving_a_source_gains_is_told(rig):
    """Of the largest: by hand, k being the same."""
    found = planner.budget(rig)
    (each,) = found.measurands
    best = max(each.contributions, key=lambda row: row.contribution)
    gain = 1 - math.sqrt(1 - 0.75 * best.contribution**2 / each.u**2)
    told = budget_figure.improved(found)[0]
    source = source_words.keyed(best.source)
    assert told == f"With half the uncertainty by {source} U is smaller: of {each.name} by {100 * gain:.0f} %."


def test_names_are_text_within_a_picture():
    """A name that is markup, or a formula, stays what it is; identifiers carry the picture's key."""
    figure, axis = plt.subplots()
    axis.set_title('<script>alert("x")</script> $\\frac{1}{2}$ & "')
    drawn = str(canvas.inline(figure, "key", '"><script>alert(1)</script>'))
    assert "<script" not in drawn
    assert "$\\frac{1}{2}$" in drawn
    identifiers = re.findall(r'id="([^"]*)"', drawn)
    assert identifiers
    assert all(each.startswith("key-") for each in identifiers)
    assert set(re.findall(r"url\(#([^)]*)\)", drawn)) <= set(identifiers)
    assert set(re.findall(r'href="#([^"]*)"', drawn)) <= set(identifiers)


def test_the_tables_cells_say_unit_zone_and_part():
    made = station_table.lines([required(3, u=0.004), required(4, status="clutter"), required(5, tolerance=None)])
    doubtful, well, free = made  # what fails comes first
    assert [line.number for line in made] == [4, 3, 5]
    assert [line.fails for line in made] == [True, False, False]
    assert well.cells[:5] == ("bore", "4 mm", "+0.03 -0.01 mm", "0.00050 mm", "+0.00010 mm")
    assert well.cells[5:] == ("0.00400 mm", "20 %", "precise enough", "pixel noise, 90 %")
    assert well.part == pytest.approx(0.2)
    assert (doubtful.part, doubtful.cells[5], doubtful.cells[7]) == (None, "-", "not proven: clutter")
    assert (free.part, free.cells[2], free.cells[5], free.cells[7]) == (None, "-", "0.0010 mm", "no tolerance given")
    bare = station_table.lines([required(3, u=0.004)], units=False)[0]
    assert bare.cells[1:6] == ("4 mm", "+0.03 -0.01", "0.00050", "+0.00010", "0.00400")
    lean = dataclasses.replace(required(u=0.004), unit="degrees", nominal=90.0)
    assert station_table.lines([lean])[0].cells[1:6] == ("90°", "+0.03 -0.01°", "0.00050°", "+0.00010°", "0.00400°")


def test_the_terms_explain_what_the_table_needs():
    """That rows are in another order, and what x and y of a position are; the names in the table without a point."""
    well, over = required(), required(2, u=0.03)
    assert station_table.note([over, well]) == station_table.note([well]) == station_table.NOTE
    assert station_table.note([well, over]) == f"{station_table.NOTE} What fails comes first."
    placed = required(name="bore from sides.x")
    assert station_table.lines([placed])[0].cells[0] == "bore from sides, x"
    assert station_table.note([placed]).endswith(
        "x, y: distances of a position from its first and its second datum edge."
    )
    told = [line.about for line in station_table.lines([placed, required(2, name="bore from sides.y"), well])]
    assert told == ["distance from its first datum edge", "distance from its second datum edge", ""]


@pytest.mark.parametrize("half", [0.02, 0.03, 0.07])
def test_a_ratio_follows_from_the_u_beside_it(half):
    """To the half of its last digit that it is rounded by, and what three digits of U leave: a two-hundredth."""
    for u in half * np.geomspace(0.01, 0.99, 97):
        cells = station_table.lines([required(u=u, tolerance=Tolerance(plus=half, minus=half))])[0].cells
        shown, printed = float(cells[6].split()[0]), 100 * float(cells[5].split()[0]) / half
        digit = 10.0 ** (np.floor(np.log10(shown)) - 1)
        assert abs(shown - printed) <= 0.5 * digit + 0.005 * printed


@pytest.mark.parametrize("name", ["plate", "bracket_mm", "backlight_plate"])
def test_the_cameras_scale_is_that_of_the_image_at_what_it_looks_at(name):
    """By two points of the scene a thousandth of the distance apart, across the camera's axis."""
    scene = scenes.load(name)
    pose, camera = np.array(list(scene.settings[0].sensor)), scene.camera
    azimuth = np.radians(pose[1])
    across = np.array([[-np.sin(azimuth), np.cos(azimuth), 0.0]]) * camera.distance / 2000
    one, other = project(np.array(camera.look_at) + np.concatenate([-across, across]), pose, camera)
    size, noise = f"{camera.width} x {camera.height} px", f"noise sigma {scene.noise.sigma:g} grey levels"
    scale = np.linalg.norm(one - other) / (camera.distance / 1000)
    assert camera_words.told(scene) == f"{size}, {scale:.3g} px per {scene.units} at the part, {noise}"


def test_pages_tell_the_camera(plate):
    """In their first paragraph on places, and in Markdown."""
    first = page.first_screen(station.of_picture(plate))
    assert first["places"].startswith(
        "256 x 240 px, 8 px per cm at the part, noise sigma 2.4 grey levels. Camera 100 cm"
    )
    assert first["section"].answer.endswith(f" Camera: {camera_words.told(plate.scene)}.")


def test_the_scale_of_the_sketch_is_a_length_of_its_view(plate, monkeypatch):
    """Black, as long as it says, within the view, of the scene's unit; the two views have scales of their own."""
    kept, said = [], []
    monkeypatch.setattr(station_sketch, "inline", lambda figure, *given: kept.append(figure) or "")
    station_sketch.draw(plate)
    try:
        for figure in kept:
            (axis,) = figure.axes
            (bar,) = (line for line in axis.lines if line.get_color() == "black")
            (start, level), (stop, same) = bar.get_xydata()
            text = axis.texts[-1].get_text()
            said.append(text)
            assert (f"{stop - start:g} cm", same) == (text, level)
            (left, right), (low, high) = axis.get_xlim(), axis.get_ylim()
            assert left < start < stop < (left + right) / 2
            assert low < level < low + 0.1 * (high - low)  # margin: it stands at the lower end, by its kind
        assert len(set(said)) == 2
    finally:
        for figure in kept:
            plt.close(figure)


@pytest.mark.parametrize(("agrees", "reasons"), [(True, ()), (False, ("rows",)), (False, ("not proven",))])
def test_the_first_screen_of_a_run_says_whether_it_was_checked(agrees, reasons):
    """What contradicts stands first in what is wrong and is to be looked into; what fails elsewhere stands last."""

    def row(index, *told):
        made = tuple(SimpleNamespace(status=status, ratio=ratio) for status, ratio in told)
        return SimpleNamespace(index=index, measurands=made)

    verdict = SimpleNamespace(agrees=agrees, reasons=reasons, inside=1, rows=1)
    rows = [row(0, ("ok", 1.0)), row(1, ("short", None)), row(2, ("ok", None)), row(3, ("ok", 1.1))]
    found = SimpleNamespace(verdict=verdict, rows=rows, overview=SimpleNamespace(images=60))
    first = {
        "what": "1 width",
        "wrong": ["It is dark."],
        "next": "Bring light.",
        "need": "none",
        "checked": "",
        "simulated": page.SIMULATED,
    }
    told = page._of_run(first, found, SimpleNamespace(number=1))
    after = f"In 2 of the 3 other settings not everything is proven ({MEANINGS['short']} (status short), once; "
    after += "not measured, once); this need not concern setting 1, shown here."
    assert told["wrong"][-2:] == ["It is dark.", after]
    assert told["what"] == "1 width. 4 settings of camera and lamp were tried; shown is the best, setting 1"
    if agrees:
        scatter = "of each setting the measured values scatter as predicted."
        assert told["checked"] == f"Check: in 60 simulated pictures {scatter}"
        photographed = page._of_run(first | {"simulated": ""}, found, SimpleNamespace(number=1))
        assert photographed["checked"] == f"Check: in 60 photographs {scatter}"
        assert (len(told["wrong"]), told["need"], told["next"]) == (2, "none", "Bring light.")
    else:
        assert told["wrong"][0].startswith("The predicted uncertainties did not pass their check: ")
        assert (len(told["wrong"]), told["need"], told["checked"]) == (3, "act", "")
        assert told["next"].startswith("`ice effects SCENE --check` tells") == (reasons == ("rows",))
        assert told["next"].endswith("Bring light.")


def test_numbers_in_sentences_lead_to_rows_that_there_are(plate, tmp_path):
    written = page.write_station(station.of_picture(plate), "Plate", tmp_path / "plan.html").read_text()
    rows = re.findall(r'<tr role="row" id="requirement-(\d+)"', written)
    assert sorted(map(int, rows)) == list(range(1, 1 + len(plate.scene.quantities)))
    assert set(re.findall(r'href="#requirement-(\d+)"', written)) <= set(rows)
    assert page.linked("no. 1, 3 and 4", [1, 4]).count("<a ") == 2


def test_a_bar_has_the_colour_of_its_balloon(plate, tmp_path, monkeypatch):
    """Of a requirement that is usable, whose balloon has another border."""
    made = station.of_picture(plate)
    usable = dataclasses.replace(made.requirements[0], status="ok", U=0.5 * made.requirements[0].tolerance.half)
    one = dataclasses.replace(made, requirements=(usable, *made.requirements[1:]))
    written = page.write_station(one, "Plate", tmp_path / "plan.html").read_text()
    look = station_table.LOOKS[Grade.WITHIN]
    assert look.fill != look.border
    assert f'style="width: 50.00%; background: {look.fill}"' in written


def test_grades_differ_without_colour():
    """Each has a shape, a border or a fill of its own: no two alike when all colours are greys."""
    looks = station_table.LOOKS
    shapes = {grade: (look.path, look.fill == look.border) for grade, look in looks.items()}
    assert len(set(shapes.values())) == len(looks) == len(Grade)


def test_many_lines_are_grouped_and_the_farthest_named():
    lines = [
        proof_figures.Line(f"r{k % 3}", k % 3 + 1, k + 1, "ok", 1.0 + 0.001 * k, 0.9, 1.2, 50, 0.0, 0.1, 1.0, None)
        for k in range(90)
    ]
    drawn = str(proof_figures.forest(lines))
    assert "r0, 30 settings" in drawn
    assert "r2, setting 90" in drawn
    assert "setting 45" not in drawn


def test_the_page_of_a_picture_needs_no_render(plate, tmp_path):
    written = page.write_station(station.of_picture(plate), "A <b>plate</b>", tmp_path / "plan.html").read_text()
    assert "A &lt;b&gt;plate&lt;/b&gt;" in written
    assert "in a drawing from the model: no shadows" in written
    assert written.index(page.SIMULATED) < written.index('id="sentence"')
    assert page.SIMULATED not in str(page.first_screen(station.of_picture(plate), is_simulated=False).values())
    assert written.count('<svg role="img"') == 4
    assert all(status in MEASURED for status in (each.status for each in requirements.predicted(plate)))


def test_a_page_does_not_sign_what_a_simulation_doubts(plate, tmp_path, monkeypatch):
    """Of a hollow part biases are those that renders tell: one of them unknown, the others taken off."""
    told, scene = planner.predict(plate).measurands, plate.scene
    count = len(scene.quantities)
    sigma, u = np.array([math.sqrt(each.variance_object) for each in told]), np.full(count, 1e-5)
    u[0] = 10 * sigma[0] + 10 * (scene.quantities[0].tolerance.half if scene.quantities[0].tolerance else 0)
    off = measure.Correction(
        scene.quantities, "gradient", None, 3 * sigma, 3 * sigma, {"reflectance": u}, {"reflectance": u},
        np.diag(sigma**2), np.diag(sigma**2), ("ok",) * count,
    )  # fmt: skip
    monkeypatch.setattr(station.budgets, "simulated", lambda picture: off)
    made = station.of_picture(plate, simulated=True)
    assert [each.status for each in made.requirements] == ["clutter", *["ok"] * (count - 1)]
    assert [each.bias for each in made.requirements] == [0.0] * count
    assert [each.u_bias for each in made.requirements] == pytest.approx(u)
    written = page.write_station(made, "Plate", tmp_path / "plan.html").read_text()
    assert f"{told[0].name}&#39; is not signed: clutter" in written
    plain = Picture.of(scenes.load("task1"), (30, 135), (15, 315))
    assert station.of_picture(plain, simulated=True).requirements[0].bias == pytest.approx(
        planner.predict(plain).measurands[0].bias_object
    )


@pytest.mark.parametrize(
    ("bias", "u", "told"),
    [
        (0.0123, 0.0021, "+0.0123 ± 0.0021"), (-0.00001, 0.0021, "0 ± 0.0021"), (0.01234, 0.032, "+0.012 ± 0.032"),
        (0.00012, 0.00021, "+0.00012 ± 0.00021"), (0.0, 0.000003, "0, ± less than 0.00001"),
        (0.0, 0.0, "0, ± less than 0.0001"),
        (0.0123, None, "+0.0123"), (0.0123, math.inf, "+0.0123 ± not known"), (None, 0.1, "not known"),
    ],
)  # fmt: skip
def test_a_bias_is_said_with_two_digits_of_its_uncertainty(bias, u, told):
    """Without one with those of sigma, and never with more than one digit more than that."""
    one = Requirement(1, "bore", "mm", 4.0, TOLERANCE, 0.0005, bias, u, 0.001, "ok", "")
    assert station_table._bias(one, 4) == told


def setting(index, *measured):
    """A run's row: (name, sigma, status) of each requirement."""
    told = [SimpleNamespace(name=n, predicted=sigma**2, status=status) for n, sigma, status in measured]
    return SimpleNamespace(index=index, measurands=told)


def test_the_best_setting_proves_most_and_then_is_the_least_uncertain():
    """By the largest sigma over half of its own zone; without zones by the product of all; of equals the first."""
    halves = {"a": 0.1, "b": 1.0}
    rows = [
        setting(0, ("a", 0.01, "ok"), ("b", 0.9, "ok")),
        setting(1, ("a", 0.02, "ok"), ("b", 0.3, "ok")),
        setting(2, ("a", 0.02, "ok"), ("b", 0.3, "ok")),
        setting(3, ("a", 0.001, "ok"), ("b", 0.001, "clutter")),
        setting(4, ("a", 0.04, "ok"), ("b", 0.01, "ok")),
    ]
    assert [station.worst(row, halves) for row in rows] == pytest.approx([0.9, 0.3, 0.3, 0.01, 0.4])
    assert [station.merit(row, halves)[0] for row in rows] == [0, 0, 0, 1, 0]
    assert station.best(SimpleNamespace(rows=rows[::-1]), halves) is rows[1]
    assert station.worst(rows[0], {}) is None
    assert station.best(SimpleNamespace(rows=rows[:3] + rows[4:]), {}) is rows[4]
    assert station.best(SimpleNamespace(rows=[setting(5, ("a", math.inf, "ok")), rows[0]]), {}) is rows[0]


def test_half_of_a_zone_is_between_its_limits_and_of_every_scene():
    def quantity(name, tolerance):
        return SimpleNamespace(name=name, tolerance=tolerance)

    one = [quantity("a", Tolerance(plus=0.3, minus=0.1)), quantity("b", None)]
    campaign = SimpleNamespace(scenes=[SimpleNamespace(quantities=each) for each in (one, [quantity("c", TOLERANCE)])])
    assert station.halves_of(campaign) == {"a": pytest.approx(0.2), "c": pytest.approx(0.02)}


@pytest.mark.parametrize("corrected", [True, False])
def test_the_station_of_a_run_is_told_by_what_was_measured(plate, corrected, monkeypatch):
    """Predicted variances and the statuses found; doubts where one value's bias was taken off, infinite for others."""
    names = [each.name for each in planner.predict(plate).measurands]
    doubts = [0.001, None, 0.003, None, 0.005] if corrected else [None] * 5
    rows = [
        SimpleNamespace(
            name=n, predicted=0.01 * (k + 1), status="ok" if k else "clutter", bias=0.1 * k, u_bias=u, value=k
        )
        for k, (n, u) in enumerate(zip(names, doubts, strict=True))
    ]
    row = SimpleNamespace(index=3, measurands=rows, main=SimpleNamespace(method="gradient"))
    campaign = SimpleNamespace(case=lambda index: SimpleNamespace(picture=plate) if index == 3 else None, scenes=[])
    store = SimpleNamespace(
        identity=lambda: {}, has_image=lambda index: False,
        propagated=lambda index, column: (None, 10.0 + float(column.split(":")[-1]) if ":" in column else 10.0),
    )  # fmt: skip
    asked = []
    monkeypatch.setattr(station, "measurable_budget", lambda *given, **more: asked.append((given, more)))
    made = station.of_run(campaign, SimpleNamespace(rows=[row]), store)
    ((picture,), more), states = asked[0], ["clutter", "ok", "ok", "ok", "ok"]
    assert picture is plate
    assert more.pop("variances") == pytest.approx([0.01, 0.02, 0.03, 0.04, 0.05])
    expected = {"doubts": [0.001, math.inf, 0.003, math.inf, 0.005]} if corrected else {"biases": [10.0] * 5}
    assert more == {"statuses": states, **expected}
    assert [each.sigma for each in made.requirements] == pytest.approx([0.1 * math.sqrt(k) for k in range(1, 6)])
    assert [each.bias for each in made.requirements] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])
    assert [each.u_bias for each in made.requirements] == doubts
    assert [each.status for each in made.requirements] == states
    assert made.number == 4


def proof_line(name="a", number=1, place=1, ratio=1.0, bias=0.0, half=None, status="ok"):
    return proof_figures.Line(name, number, place, status, ratio, 0.9, 1.2, 50, bias, 0.01, 0.5, half)


def test_what_is_far_from_1_is_so_by_its_factor():
    lines = [proof_line(ratio=r) for r in (1.0, 3.0, 0.25, 1.1, 0.8)] + [proof_line(ratio=1.0)] * 12
    assert [line.ratio for line in proof_figures._farthest(lines)][:4] == [0.25, 3.0, 0.8, 1.1]


def test_a_bias_is_told_in_per_cent_of_half_the_zone_or_in_sigmas():
    """0.02 of half a zone of 0.1 is 20 %, of sigma 0.5 it is 0.04; the largest is so beside its own zone."""
    assert proof_figures._biased(proof_line(bias=0.02, half=0.1), True) == pytest.approx((20.0, 19.6))
    assert proof_figures._biased(proof_line(bias=0.02, half=0.1), False) == pytest.approx((0.04, 0.0392))
    several = [proof_line(bias=-0.02, half=0.1), proof_line("wide", 2, bias=0.05, half=1.0), proof_line(bias=9.0)]
    assert proof_figures.bias_told(several).endswith("the largest, of a, is 20 % of it.")


@pytest.mark.parametrize(
    ("camera", "aligned"),
    [
        ((0.06, 0.0), ["left", "right"]),
        ((-0.06, 0.0), ["right", "left"]),
        ((0.0, 0.06), ["right", "left"]),
        ((0.0, 0.8), ["center", "center"]),
        ((-0.8, 0.0), ["center", "center"]),
    ],
)
def test_names_stand_side_by_side_where_camera_and_lamp_are_near(camera, aligned):
    """Within 0.7 of half the picture along both axes; the one on the left to the left. All is 2 wide and high."""
    figure = plt.figure()
    axis, part = figure.add_subplot(), np.array([[-1.0, -1], [1, 1]])
    lamp = np.array([0.15, 0.1])
    places = [("camera", camera + lamp, "k"), ("lamp", lamp, "k")]
    try:
        station_sketch._labels(axis, places, part, np.zeros(2))
        assert [text.get_ha() for text in axis.texts] == aligned
        assert axis.get_xlim() == pytest.approx((-1.6, 1.6))
        assert axis.get_ylim() == pytest.approx((-1.75, 1.45))
    finally:
        plt.close(figure)


@pytest.mark.parametrize(("height", "side"), [(0.5, "bottom"), (-0.04, "bottom"), (-0.06, "top")])
def test_names_stand_above_what_they_name_unless_it_is_below_the_middle(height, side):
    figure = plt.figure()
    axis = figure.add_subplot()
    try:
        places = [("lamp", np.array([0.5, height]), "k")]
        station_sketch._labels(axis, places, np.array([[-1.0, -1], [1, 1]]), np.zeros(2))
        assert [text.get_va() for text in axis.texts] == [side]
    finally:
        plt.close(figure)
