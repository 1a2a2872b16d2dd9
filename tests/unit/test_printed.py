"""What commands print and write as JSON, compared with what the library says: by name and by column, no two alike."""

import csv
import json
import math
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import measure
import planner
import scenes
from planner.budgeting.budgets import budget
from planner.design import Choice
from planner.robustness import Move
from render import EffectTolerance
from render.phenomena import Decision, Influence
from scenes import Pose, Tolerance
from scenes.placement import Placement
from tests.boards import SMALL, poses, told
from tests.sides import sides
from validation import budgets
from validation.boards import Boards
from validation.cli import measurands, plan_json, plan_views
from validation.cli import predict as predict_cli
from validation.effects_check import RENDERED, Switched
from validation.inspection import Inspection
from validation.plan_check import CheckedSetting, PlanCheck
from validation.report import (
    budget_table,
    calibration_table,
    camera_table,
    effects_table,
    plan_table,
    scene_table,
    vary_table,
    views_table,
)  # fmt: skip
from validation.statistics import ratio_interval
from validation.vary_check import Scatter, VaryCheck
from validation.views_check import CheckedQuantity, ViewsCheck


def cells(table):
    """Headings and rows of a rich table."""
    return [str(c.header) for c in table.columns], [list(row) for row in zip(*(c.cells for c in table.columns))]  # noqa: B905


def titled(group, title):
    """Headings and rows of the table in a group whose title begins so."""
    return cells(next(t for t in group.renderables if str(getattr(t, "title", "")).strip().startswith(title)))


def words(group):
    """All that is text in a group of groups."""
    parts = getattr(group, "renderables", [group])
    return "\n".join(words(part) if hasattr(part, "renderables") else str(part) for part in parts)


def pose(found):
    return f"({found.polar_deg:.1f}, {found.azimuth_deg:.1f})"


def uneven(scene):
    """Tolerances that differ upwards, downwards and from measurand to measurand."""
    zones = [Tolerance(plus=0.03 * k, minus=0.011 / k) for k in range(1, 1 + len(scene.measurands))]
    told_ = [m.model_copy(update={"tolerance": z}) for m, z in zip(scene.measurands, zones, strict=True)]
    return scene.model_copy(update={"measurands": tuple(told_)})


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    """A block whose front, height and top are measured, tolerances unlike; nothing hidden."""
    return uneven(sides(tmp_path_factory.mktemp("sides"), "front", "height", "top"))


# --- predict


def test_predictions_are_printed_by_their_names(several):
    """Table and JSON of each measurand: in the object and in the image, sigma of the right variance."""
    picture = scenes.Picture.of(several, (35, 320), (20, 260))
    found = planner.predict(picture)
    told_ = predict_cli._facts(picture, found)
    assert (told_["sensor"], told_["light"]) == ([35, 320], [[20, 260]])
    keys = {"value": "value_object", "variance": "variance_object", "bias": "bias_object", "value_image": "value_image",
            "variance_image": "variance_image", "bias_image": "bias_image"}  # fmt: skip
    for each, row in zip(found.measurands, told_["measurands"], strict=True):
        assert {key: row[key] for key in ("name", "kind", "unit")} == {
            "name": each.name, "kind": each.kind, "unit": each.unit,
        }  # fmt: skip
        assert {key: row[key] for key in keys} == {key: getattr(each, name) for key, name in keys.items()}
    headings, rows = cells(predict_cli._table(several, "calibrated", [told_], False))
    assert headings == ["sensor", "light", "measurand", "value", "sigma", "bias", "unit", "in the image", "sigma",
                        "status"]  # fmt: skip
    for row, each in zip(rows, found.measurands, strict=True):
        assert row == [
            "(35.0, 320.0)", "(20.0, 260.0)", each.name, f"{each.value_object:.6g}", f"{each.variance_object**0.5:.3g}",
            f"{each.bias_object:.2g}", each.unit, f"{each.value_image:.6g}", f"{each.variance_image**0.5:.3g}",
            each.status,
        ]  # fmt: skip
    assert len({row[4] for row in rows} | {row[8] for row in rows}) == 6


def test_records_of_a_prediction_are_standard_deviations(several):
    for each in planner.predict(several, (35, 320), (20, 260)).measurands:
        row = each.as_row()
        assert (row["sigma"], row["sigma_image"]) == (
            pytest.approx(each.variance_object**0.5), pytest.approx(each.variance_image**0.5),
        )  # fmt: skip
        assert (row["plus"], row["minus"]) == (each.tolerance.plus, each.tolerance.minus)
        assert row["ratio"] == pytest.approx(each.variance_object**0.5 / ((row["plus"] + row["minus"]) / 2))


# --- measure


def test_measured_values_and_their_decisions_are_printed():
    """u 0.004 is of sigma 0.0024 and u(bias) 0.0032; U is the budget's, and may be much more."""
    quantity = SimpleNamespace(name="slot", kind="width", tolerance=Tolerance(plus=0.09, minus=0.02))
    other = SimpleNamespace(name="lean", kind="angle", tolerance=None)
    found = SimpleNamespace(
        picture=SimpleNamespace(scene=SimpleNamespace(zones=(), placement=Placement())),
        quantities=(quantity, other), sigma=np.array([0.0024, 0.5]),
        covariance=np.array([[5.76e-6, 2e-4], [2e-4, 0.25]]),
        u=np.array([0.004, np.nan]), u_bias=np.array([0.0032, np.nan]), bias=np.array([0.011, 0.0]),
        covariance_image=np.array([[0.09, 0.0], [0.0, 0.16]]), nominal=np.array([10.0, 30.0]), units=("mm", "degrees"),
        value=np.array([10.08, 29.5]), value_image=np.array([812.0, 28.5]), status=np.array(["ok", "ok"]),
        estimator="isophote",
    )  # fmt: skip
    rows = [SimpleNamespace(requirement=SimpleNamespace(U=U), decision=each, picture=1)
            for U, each in ((0.0131, "undecided"), (None, None))]  # fmt: skip
    whole = Inspection((SimpleNamespace(found=found),), tuple(rows))
    one, two = measurands.facts(whole)
    assert one == {
        "name": "slot", "kind": "width", "unit": "mm", "value": 10.08, "sigma": 0.0024, "value_image": 812.0,
        "bias": 0.011, "u_bias": 0.0032, "u": 0.004, "U": 0.0131,
        "sigma_image": pytest.approx(0.3), "nominal": 10.0, "tolerance": {"plus": 0.09, "minus": 0.02},
        "decision": "undecided", "status": "ok", "estimator": "isophote",
    }  # fmt: skip
    assert (two["value"], two["sigma"], two["sigma_image"], two["nominal"]) == (29.5, 0.5, pytest.approx(0.4), 30.0)
    assert (two["U"], two["decision"]) == (None, None)
    assert measurands.covariance(whole) == found.covariance.tolist()
    headings, rows = cells(measurands.table([one, two]))
    assert headings == ["name", "kind", "value", "u", "unit", "bias off", "u(bias)", "U", "nominal", "tolerance",
                        "decision", "status"]  # fmt: skip
    assert rows[0] == ["slot", "width", "10.0800", "0.0040", "mm", "0.011", "0.0032", "0.013", "10", "+0.09 -0.02",
                       "undecided", "ok"]  # fmt: skip
    assert rows[1] == ["lean", "angle", "29.50", "0.50", "degrees", "-", "-", "-", "30", "-", "-", "ok"]


@pytest.mark.parametrize(("state", "printed"), [("ok", "undecided"), ("clutter", "undecided (bias up to 0.006)")])
def test_what_a_correction_is_not_sure_of_is_printed(state, printed):
    row = {
        "name": "slot", "kind": "width", "unit": "mm", "value": 10.0, "sigma": 0.004, "bias": -0.034, "u_bias": 0.003,
        "u": 0.005, "U": 0.0098, "nominal": 10.0, "tolerance": {"plus": 0.09, "minus": 0.09}, "decision": "undecided",
        "status": state,
    }  # fmt: skip
    (told,) = cells(measurands.table([row]))[1]
    assert told[3] == "0.0050"
    assert told[5:8] == ["-0.034", "0.003", "0.0098"]
    assert told[-2:] == [printed, state]


# --- plan


@pytest.fixture(scope="module")
def planned(several):
    """By all pairs, with the trace of the paper's search."""
    found = planner.plan(several, step_deg=20, refined=False)
    steps = planner.plan(several, step_deg=20, search="alternating", start=(40, 320), refined=False)
    return replace(found, trace=steps.trace, partial_variance=steps.partial_variance, gap=0.125)


def of_three(found):
    """Three settings as if they had been rendered, in another order; the last could not be measured."""
    one, two, three = found.candidates[:3]
    rows = [
        CheckedSetting(c.sensor, c.light, (f"e{i}", "e9"), 0.01 * (i + 1), p, state, names, i + 1, after, p + 0.001)
        for i, (c, p, state, names, after) in enumerate([
            (one, 0.012, "ok", (), 2), (two, 0.0115, "ok", ("floor",), 1), (three, math.inf, "short", ("blur",), None),
        ])
    ]  # fmt: skip
    return PlanCheck(tuple(rows), rows[1], True, "", 3.5)


def robustly(found):
    moves = (Move("noise", 0.9, 0.81, 0.8, 1.5, 2.5),
             Move("roughness", 1.2, 1.4, 1.3, 3.5, 4.5))  # fmt: skip
    return planner.Robust(Pose(31.5, 42), Pose(21.25, 250.5), 0.5, 0.25, 0.75, moves, 50)


def test_the_plan_s_json_is_the_plan(planned, several):
    """Every number beside an independent prediction at the plan's poses; rendered and robust settings by key."""
    check, safe = of_three(planned), robustly(planned)
    told_ = json.loads(json.dumps(plan_json.facts(planned, check, safe, 1.25), allow_nan=False))
    again = planner.predict(planned.scene, planned.sensor, planned.light)
    for row, each, quantity in zip(told_["measurands"], again.measurands, several.measurands, strict=True):
        zone = quantity.tolerance
        sigma = each.variance_object**0.5
        wanted = {
            "value": each.value_object, "sigma": sigma, "sigma_image": each.variance_image**0.5,
            "ratio": sigma / ((zone.plus + zone.minus) / 2), "nominal": each.nominal,
        }  # fmt: skip
        assert {key: row[key] for key in wanted} == pytest.approx(wanted)
        assert row["tolerance"] == {"plus": zone.plus, "minus": zone.minus}
        assert (row["name"], row["kind"], row["unit"], row["status"]) == (
            each.name, each.kind, each.unit, each.status,
        )  # fmt: skip
    ratios = {row["name"]: row["ratio"] for row in told_["measurands"]}
    assert told_["limiting"] == max(ratios, key=ratios.get)
    assert told_["worst_ratio"] == pytest.approx(max(ratios.values()))
    assert told_["variance"] == pytest.approx(max(ratios.values()) ** 2)
    first = again.measurands[0]
    assert (told_["variance_object"], told_["variance_image"]) == pytest.approx(
        (first.variance_object, first.variance_image)
    )
    assert told_["sensor"] == list(planned.sensor)
    assert told_["light"] == list(planned.light)
    assert told_["grid"] == {
        "sensor": list(planned.grid_sensor), "light": list(planned.grid_light), "variance": planned.grid_variance,
    }  # fmt: skip
    trace = told_["alternating"]["trace"]
    assert len(trace) > 1
    for row, step in zip(trace, planned.trace, strict=True):
        assert row == {"fixed": step.fixed, "at": list(step.fixed_pose), "found": step.found,
                       "best": list(step.found_pose), "variance": step.variance}  # fmt: skip
    assert told_["alternating"]["variance"] == planned.partial_variance
    assert told_["alternating"]["gap"] == 0.125
    for row, c in zip(told_["candidates"], planned.candidates, strict=True):
        assert {key: row[key] for key in ("variance", "variance_object", "variance_image", "limiting")} == {
            key: getattr(c, key) for key in ("variance", "variance_object", "variance_image", "limiting")
        }
        assert (row["sensor"], row["light"]) == (list(c.sensor), list(c.light))
        here = planner.predict(planned.scene, c.sensor, c.light)
        worst = max(here.measurands, key=lambda each: each.ratio)
        assert row["limiting"] == worst.name
        assert (row["variance_object"], row["variance_image"], row["variance"]) == pytest.approx(
            (worst.variance_object, worst.variance_image, worst.ratio**2)
        )
    for row, one in zip(told_["checked"], check.settings, strict=True):
        assert (row["calibrated"], row["rank_before"], row["rank_after"], row["status"]) == (
            one.calibrated, one.rank_before, one.rank_after, one.status,
        )  # fmt: skip
        assert (row["sensor"], row["light"], row["edges"]) == (list(one.sensor), list(one.light), list(one.edges))
        assert row["without_formula"] == list(one.without_formula)
    assert [row["propagated"] for row in told_["checked"]] == [0.012, 0.0115, None]
    assert [row["ratio"] for row in told_["checked"]] == [pytest.approx(1.2), pytest.approx(0.575), None]
    assert told_["proposed"] == told_["checked"][1]
    assert told_["check"] == {"without_formula": ["floor", "blur"], "reason": None, "seconds": 3.5, "left_out": 0}
    assert {key: told_["robust"][key] for key in ("sensor", "light", "worst", "nominal", "plan_worst", "cases")} == {
        "sensor": [31.5, 42], "light": [21.25, 250.5], "worst": 0.5, "nominal": 0.25, "plan_worst": 0.75, "cases": 50,
    }  # fmt: skip
    assert told_["robust"]["moves"][1] == {"input": "roughness", "factor": 1.2, "variance": 1.4, "best": 1.3,
                                           "sensor_deg": 3.5, "light_deg": 4.5}  # fmt: skip


def test_the_plan_s_tables_are_its_json(planned):
    check, safe = of_three(planned), robustly(planned)
    made = plan_table.report(planned, check, safe, 1.25)
    text = words(made)
    headings, rows = titled(made, "Clearly different")
    assert headings == ["", "sensor", "light", "edges", "limited by", "largest ratio^2", "over best"]
    assert rows[0][:4] == ["best", pose(planned.sensor), pose(planned.light), " ".join(planned.scene.required)]
    assert rows[0][4:] == [planned.limiting, f"{planned.variance:.4g}", "1.000"]
    first = planned.candidates[0]
    itself = [pose(first.sensor), pose(first.light)] == [pose(planned.sensor), pose(planned.light)]
    for row, c in zip(rows[1:], planned.candidates[itself:], strict=True):
        over = f"{c.variance / planned.variance:.3f}"
        assert row == ["", pose(c.sensor), pose(c.light), " ".join(c.edges), c.limiting, f"{c.variance:.4g}", over]
    headings, rows = titled(made, "The paper's alternating search")
    assert headings == ["held fixed", "", "found", "", "largest ratio^2"]
    for row, s in zip(rows, planned.trace, strict=True):
        assert row == [s.fixed, pose(s.fixed_pose), s.found, pose(s.found_pose), f"{s.variance:.4g}"]
    headings, rows = titled(made.renderables[-2], "The best settings")
    assert headings == ["place", "now", "sensor", "light", "calibrated, 1e-6", "propagated", "with u(bias)",
                        "ratio", "status", "not in formulas"]  # fmt: skip
    assert [row[:2] + row[4:] for row in rows] == [
        ["1", "2", "1e+04", "1.2e+04", "1.3e+04", "1.200", "ok", ""],
        ["2", "1", "2e+04", "1.15e+04", "1.25e+04", "0.575", "ok", "floor"],
        ["3", "-", "3e+04", "-", "-", "-", "short", "blur"],
    ]  # fmt: skip
    for row, c in zip(rows, check.settings, strict=True):
        assert row[2:4] == [pose(c.sensor), pose(c.light)]
    headings, rows = titled(made.renderables[-1], "How the plan")
    assert headings == ["input", "factor", "variance there", "at the new best", "sensor, deg", "light, deg"]
    assert rows == [["noise", "0.9", "0.8100", "0.8000", "1.50", "2.50"],
                    ["roughness", "1.2", "1.4000", "1.3000", "3.50", "4.50"]]  # fmt: skip
    assert "variance 0.25, at worst 0.5 in 50 cases" in text
    assert "-33.3 % against the plan" in text
    assert f"sensor {pose(planned.sensor)}, light {pose(planned.light)}" in text
    p = planned.prediction
    assert f"Limited by {planned.limiting}, whose sigma is {100 * p.worst_ratio:.3g} % of its tolerance" in text
    for each in p.measurands:
        assert (
            f"sigma {each.variance_object**0.5:.3g} {each.unit}, {100 * each.ratio:.3g} % of +-{each.tolerance.half:g}"
            in text
        )
    assert f"{pose(check.proposed.sensor)}, light {pose(check.proposed.light)}, ok: -3.8 % variance" in text


def test_a_checked_place_says_what_decided_its_status(planned):
    *others, last = of_three(planned).settings
    told_ = replace(of_three(planned), settings=(*others, replace(last, reason="bore: edge e4 is 3 px long")))
    line = "short: too little of an edge is left in the image (place 3, bore: edge e4 is 3 px long); come nearer"
    assert line in words(plan_table.report(planned, told_, None, 1.0))
    assert line in words(plan_table.report(planned, replace(told_, proposed=None), None, 1.0))
    assert [row["reason"] for row in plan_json._checked(told_)["checked"]] == [None, None, "bore: edge e4 is 3 px long"]


def test_several_pictures_say_what_decided_a_status():
    """Of the first picture that knows; what is ok has no line."""
    whys = [("", "edge e4 is 3 px long"), ("", "edge e4 is 5 px long"), ("", "")]
    views = []
    for picture in (2, 0, 1):
        told_ = [SimpleNamespace(name=name, why=lambda _, why=why: why)
                 for name, why in zip(("across", "bore"), whys[picture], strict=True)]  # fmt: skip
        views.append(SimpleNamespace(prediction=SimpleNamespace(measurands=told_)))
    both = SimpleNamespace(status=("ok", "short"))
    found = planner.ViewSet(tuple(views), both, 1.0, (), None, None, None, None)
    assert (found.why(0), found.why(1)) == ("", "edge e4 is 3 px long")
    (line,) = views_table._statuses(found)
    assert str(line).startswith(
        "  short: too little of an edge is left in the image (bore: edge e4 is 3 px long); come"
    )
    assert views_table._statuses(replace(found, combination=SimpleNamespace(status=("ok", "ok")))) == []


def test_the_plan_of_one_measurand_is_told_in_object_and_image(task1):
    found = planner.plan(task1, step_deg=30, refined=False)
    made = plan_table.report(found, None, None, 1.0)
    headings, rows = titled(made, "Clearly different")
    assert headings == ["", "sensor", "light", "edges", "object, 1e-6 cm^2", "image, 1e-6 px^2", "over best"]
    for row, c in zip(rows, found.candidates, strict=True):
        assert row[0] == ("best" if c is found.candidates[0] else "")
        assert row[4:6] == [f"{1e6 * c.variance_object:.4g}", f"{1e6 * c.variance_image:.4g}"]
    again = planner.predict(task1, found.sensor, found.light)
    text = words(made)
    assert f"One picture's sigma is {again.variance_object**0.5:.3g} cm of {again.value_object:.4g} cm" in text
    assert f"in the image {again.variance_image**0.5:.3g} px of {again.value_image:.4g} px" in text


# --- several pictures


@pytest.fixture(scope="module")
def viewed(several):
    return planner.plan_views(several, 2, step_deg=20, refined=False)


def checked_views(found):
    """Made-up measurements, none alike; the last could not be measured, one is clutter."""
    rows = []
    for i, name in enumerate(("front", "height", "top")):
        predicted, n = 1e-6 * (4 + i), 290 - i
        ratio, other = 1.02 + 0.1 * i, 0.9 + 0.07 * i
        known = i < 2
        rows.append(CheckedQuantity(
            2, name, "cm", "ok", predicted, predicted * (1.05 + 0.01 * i) if known else math.inf,
            ratio * predicted if known else None, n, 300 - n, ratio if known else None,
            ratio_interval(ratio, n) if known else None, other if known else None,
            ratio_interval(other, n) if known else None, 1e-3 * (i + 1) if known else None,
            3e-4 * (1 - i), (1e-4, 7e-4, math.inf)[i], 5e-5 * i, i != 1,
        ))  # fmt: skip
    return ViewsCheck(tuple(rows), None, "made up", 2.0)


def test_the_tables_of_several_pictures_are_what_they_combine(viewed):
    """Sigmas, not variances, of each number of pictures; by hand from the single ones where noise is independent."""
    made = views_table.report(viewed, checked_views(viewed), 1.0)
    last = viewed.sets[-1]
    headings, rows = titled(made, "Each measurand")
    assert headings == ["name", "unit", "sigma of 1", "sigma of 2", "jointly", "taken from", "status"]
    for m, (row, each) in enumerate(zip(rows, last.views[0].prediction.measurands, strict=True)):
        assert row[:2] == [each.name, each.unit]
        for k, one in enumerate(viewed.sets):
            told_ = [view.prediction.measurands[m] for view in one.views]
            fine = [f for f in told_ if f.status == "ok"] or [f for f in told_ if math.isfinite(f.variance_object)]
            combined = 1 / sum(1 / f.variance_object for f in fine) if fine else math.inf
            assert row[2 + k] == (f"{combined**0.5:.3g}" if fine else "-")
        assert row[4] == f"{last.combination.covariance_least_squares[m, m] ** 0.5:.3g}"
        used = [str(v + 1) for v in range(2) if last.combination.used[v, m]]
        assert row[5] == f"no. {' '.join(used)}"
        assert row[6] == last.combination.status[m]
    headings, rows = titled(made, "Where")
    seen = [(pose(v.sensor), pose(v.light)) for each in viewed.sets for v in each.views]
    assert [tuple(row[2:4]) for row in rows] == seen
    headings, rows = titled(made, "N pictures")
    assert headings[:7] == ["pictures", "measured", "minimised", "worst ratio", "limited by", "one / it",
                            "repeats / it"]  # fmt: skip
    for row, each in zip(rows, viewed.sets, strict=True):
        assert row[:5] == [str(len(each.views)), f"{3 - len(each.lost)} of 3", f"{each.minimised:.4g}",
                           f"{each.worst_ratio:.3g}", each.limiting]  # fmt: skip
        assert row[5:7] == ["-" if v is None else f"{v:.3f}" for v in (each.over_one, each.over_repeats)]
        assert row[7:] == [f"{100 * (each.minimised / each.exhaustive - 1):.1f} %",
                           "-" if each.bound is None else f"{each.minimised / each.bound:.2f}"]  # fmt: skip


def test_measured_pictures_are_beside_what_was_predicted_of_them(viewed):
    """The bias in standard deviations; ratios with their intervals; what is not there is -."""
    check = checked_views(viewed)
    headings, rows = titled(views_table.report(viewed, check, 1.0), "Each picture rendered, 300")
    assert headings == ["pictures", "name", "measured / predicted", "least squares",
                        "bias taken off", "left", "propagated /", "failed", "status"]  # fmt: skip
    for i, (row, one) in enumerate(zip(rows[:2], check.rows, strict=False)):
        intervals = []
        for ratio, (low, high) in (
            (one.ratio, one.ratio_interval),
            (one.ratio_least_squares, one.interval_least_squares),
        ):
            intervals.append(f"{ratio:.3f} [{low:.3f}, {high:.3f}]{'' if low <= 1 <= high else ' *'}")
        sigma = (1e-6 * (4 + i)) ** 0.5
        off = f"{3e-4 * (1 - i) / sigma:+.2f} ± {(1e-4, 7e-4)[i] / sigma:.2f} sigma"
        assert row == ["2", one.name, *intervals, off, f"{1e-3 * (i + 1) / sigma:+.2f} sigma",
                       f"{1.05 + 0.01 * i:.3f}", str(10 + i), ["ok", "ok, not judged"][i]]  # fmt: skip
    assert rows[2][2:] == ["-", "-", "not known", "-", "-", "12", "ok"]


def test_the_json_of_several_pictures_is_what_they_combine(viewed):
    check = checked_views(viewed)
    told_ = json.loads(json.dumps(plan_views.facts(viewed, check, [], 1.5), allow_nan=False))
    for one, each in zip(told_["views"], viewed.sets, strict=True):
        both = each.combination
        assert one["count"] == len(each.views)
        assert one["poses"] == [{"sensor": list(v.sensor), "light": list(v.light)} for v in each.views]
        for name in ("minimised", "worst_ratio", "limiting", "over_one", "over_repeats", "exhaustive", "gap", "bound"):
            assert one[name] == getattr(each, name), name
        assert one["covariance"][0][0] == pytest.approx(float(both.covariance[0, 0]))
        for m, row in enumerate(one["measurands"]):
            wanted = [
                math.sqrt(v) if math.isfinite(v) else None
                for v in (both.covariance[m, m], both.covariance_least_squares[m, m])
            ]
            assert [row["sigma"], row["sigma_least_squares"]] == wanted
            assert row["weights"] == both.weights[:, m].tolist()
            assert row["pictures"] == [v + 1 for v in range(len(each.views)) if both.used[v, m]]
            singles = [v.prediction.measurands[m].variance_object for v in each.views]
            assert [s["sigma"] for s in row["single"]] == [math.sqrt(v) if math.isfinite(v) else None for v in singles]
            assert row["bias"] == pytest.approx(float(both.bias[m]), nan_ok=True)
    for row, one in zip(told_["check"]["rows"], check.rows, strict=True):
        for field in fields(one):
            value = getattr(one, field.name)
            value = list(value) if isinstance(value, tuple) else value
            assert row[field.name] == (None if value == math.inf else value), field.name


# --- varied


def test_the_gain_of_a_choice_is_printed_by_its_names():
    names = ("fixed", "same_poses", "best")
    chosen = {
        name: planner.Chosen(Choice(10.0 * k, None if k == 2 else 5.0 * k, f"lamp{k}"), None, Pose(10 * k, 20 * k),
                             Pose(11 * k, 21 * k), 1.0 / k, "ok", 0.5 * k)
        for k, name in enumerate(names, 1)
    }  # fmt: skip
    varied = planner.Varied(("analyser", "polarisation"), "time", **chosen, evaluated=77, guarantee="none")
    rows = [Scatter("width", 2.0, 2.1, 2.2, 1.0, 1000, 9, (2.01, 2.4), "ok"),
            Scatter("depth", 1.0, math.nan, 1.2, 1.0, 500, 4, (1.01, 1.4), "clutter")]  # fmt: skip
    check = VaryCheck(*rows, 1.9, 2.05, (1.7, 2.2), 0.03, "agree: made up")
    told_ = vary_table.facts(varied, check)
    assert (told_["gain"], told_["gain_same_poses"]) == (pytest.approx(3.0), pytest.approx(2.0))
    for k, name in enumerate(names, 1):
        assert told_[name] == {
            "analyser_deg": 10.0 * k, "polarisation_deg": None if k == 2 else 5.0 * k, "lamp": f"lamp{k}",
            "filter": None, "band": f"lamp{k}", "sensor": [10 * k, 20 * k], "light": [11 * k, 21 * k],
            "variance": 1.0 / k, "status": "ok", "exposure_time": 0.5 * k,
        }  # fmt: skip
    assert told_["check"]["fixed"] == {"measurand": "width", "predicted": 2.0, "propagated": 2.1, "measured": 2.2,
                                       "interval": [2.01, 2.4], "n": 1000, "failed": 9, "status": "ok"}  # fmt: skip
    assert told_["check"]["best"]["propagated"] is None
    assert {k: told_["check"][k] for k in ("gain", "predicted_gain", "gain_interval", "p_value")} == {
        "gain": 1.9, "predicted_gain": 2.05, "gain_interval": [1.7, 2.2], "p_value": 0.03,
    }  # fmt: skip
    made = vary_table.report(SimpleNamespace(varied=varied), check, 1.0)
    headings, lines = titled(made, "Fixed and best")
    assert headings == ["", "sensor", "light", "analyser", "polarisation", "band", "time", "minimised", "status"]
    assert lines[1] == ["best at its poses", "(20.0, 40.0)", "(22.0, 42.0)", "20.0", "none", "lamp2", "1", "0.5", "ok"]
    assert lines[2] == ["best", "(30.0, 60.0)", "(33.0, 63.0)", "30.0", "15.0", "lamp3", "1.5", "0.3333", "ok"]
    headings, lines = titled(made, "Both plans in 1000")
    assert headings == ["", "measurand", "predicted", "propagated", "measured", "interval", "failed", "status"]
    assert lines == [["fixed", "width", "2", "2.1", "2.2", "[2.01, 2.4]", "9", "ok"],
                     ["best", "depth", "1", "nan", "1.2", "[1.01, 1.4]", "4", "clutter"]]  # fmt: skip
    text = words(made)
    assert "3.000 in variance with poses of their own, 2.000 at its poses" in text
    assert "predicted 2.050, measured 1.900 with the 95 % F interval [1.700, 2.200]" in text


# --- budget


@pytest.fixture(scope="module")
def stated(several):
    known = scenes.Uncertainty(
        sensor_distance={"sd": 0.05, "dof": 6}, sensor_deg={"half_width": 0.2}, part_shift=0.01, process_sd=0.004
    )
    return budget(several.model_copy(update={"uncertainty": known}), (35, 320), (20, 260))


def test_a_budget_is_printed_row_by_row(stated, tmp_path):
    """The terminal's rows, the CSV and JSON: u, sensitivity, contribution, share and degrees of freedom."""
    facts = json.loads(json.dumps(budgets.facts(stated, [], None, None), allow_nan=False))
    assert facts["sensor"] == [35, 320]
    assert facts["lights"] == [[20, 260]]
    for each, row in zip(stated.measurands, facts["measurands"], strict=True):
        parts = [(c.sensitivity * c.u) ** 2 for c in each.contributions]
        u = math.sqrt(sum(parts))
        assert (row["value"], row["u"], row["U"], row["k"]) == pytest.approx((each.value, u, each.k * u, each.k))
        noise = math.sqrt(sum(p for p, c in zip(parts, each.contributions, strict=True) if c.source == "pixel noise"))
        assert row["repeatability"] == pytest.approx(noise)
        assert row["accuracy"] == pytest.approx(math.sqrt(u**2 - noise**2))
        dof = u**4 / sum(p**2 / c.dof for p, c in zip(parts, each.contributions, strict=True))
        assert row["dof"] == pytest.approx(dof)
        assert row["k"] == pytest.approx(stats.t.ppf(0.975, math.floor(dof)))
        for told_, c, part in zip(row["contributions"], each.contributions, parts, strict=True):
            assert (told_["source"], told_["u"], told_["sensitivity"]) == (c.source, c.u, c.sensitivity)
            assert (told_["contribution"], told_["share"]) == pytest.approx((math.sqrt(part), part / u**2))
            assert told_["dof"] == (None if math.isinf(c.dof) else c.dof)
        headings, rows = cells(budget_table.table(each))
        assert headings == ["source", "u", "sensitivity", "contribution", "share", "type", "dof"]
        order = sorted((c for c in each.contributions if c.share >= 5e-4), key=lambda c: -c.share)
        wanted = [
            [c.source, f"{c.u:.3g}", f"{c.sensitivity:.3g}", f"{c.contribution:.3g}", f"{100 * c.share:.1f} %", c.type,
             "-" if math.isinf(c.dof) else f"{c.dof:.0f}"]
            for c in order
        ]  # fmt: skip
        assert rows[: len(wanted)] == wanted
        places = budget_table.decimals(each.U)
        assert budget_table.sentence(each, "width", "ok") == (
            f"The width {each.name!r} is {each.value:.{places}f} cm +- {each.U:.{places}f} cm, k = {each.k:.1f}"
        )
        assert f"u_c = {u:.3g}, dof_eff = {dof:.0f}, k = {each.k:.3g}, U = {each.k * u:.3g} cm (95 %)" in (
            budget_table.summary(each)
        )
    from validation.cli.budget import write_csv

    write_csv(stated, tmp_path / "b.csv")
    with (tmp_path / "b.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    rows = [(each.name, c) for each in stated.measurands for c in each.contributions]
    for line, (name, c) in zip(lines, rows, strict=True):
        assert (line["measurand"], line["source"], line["type"]) == (name, c.source, c.type)
        assert [float(line[key]) for key in ("u", "sensitivity", "contribution", "share")] == pytest.approx(
            [c.u, c.sensitivity, c.contribution, c.share]
        )


def test_capability_is_of_the_whole_uneven_zone(stated):
    """U over half of it; the risk that the part is outside by both limits, which are not alike, by SciPy."""
    for m, (each, quantity) in enumerate(zip(stated.measurands, stated.picture.scene.quantities, strict=True)):
        told_ = budgets.capability(stated, m)
        zone = quantity.tolerance
        width = zone.plus + zone.minus
        nominal = stated.prediction.measurands[m].nominal
        law = stats.norm(each.value, each.u)
        outside = law.cdf(nominal - zone.minus) + law.sf(nominal + zone.plus)
        assert (told_["T"], told_["U_over_half_T"], told_["TUR"]) == pytest.approx(
            (width, 2 * each.U / width, width / (2 * each.U))
        )
        assert told_["specific_risk"] == pytest.approx(outside, abs=1e-300)
        process = stats.norm(nominal, 0.004)
        inside = process.cdf(nominal + zone.plus) - process.cdf(nominal - zone.minus)
        assert told_["global"]["conforming"] == pytest.approx(inside, rel=1e-9)
        accepted = stats.norm(nominal, math.hypot(0.004, each.u))
        wanted = accepted.cdf(nominal + zone.plus) - accepted.cdf(nominal - zone.minus)
        assert told_["global"]["accepted"] == pytest.approx(wanted, rel=1e-6)


# --- scene


def test_what_a_scene_shows_is_where_it_is():
    """The plate's circles, faces and edges by hand; each number under its heading."""
    plate = scenes.load("plate")
    facts, solid = scene_table.facts(plate), plate.solid
    made = scene_table.report(plate)
    headings, rows = titled(made, "Circles")
    assert headings == ["name", "x", "y", "z", "diameter", ""]
    for row, told_, circle in zip(rows, facts["circles"], solid.circles, strict=True):
        rim = np.array([solid.vertices[end] for name in circle.edges for end in solid.edge(name).ends])
        middle = (rim.max(0) + rim.min(0)) / 2
        across = np.ptp(rim, axis=0).max()
        assert [float(x) for x in row[1:4]] == pytest.approx(middle, abs=1e-3)
        assert float(row[4]) == pytest.approx(across, rel=5e-3)
        assert told_["diameter"] == pytest.approx(across, rel=5e-3)
        assert row[5] == ("hole" if circle.hole else "outer")
    headings, rows = titled(made, "Edges")
    for row in rows:
        ends = [solid.vertex(name) for name in row[1:3]]
        assert float(row[3]) == pytest.approx(np.linalg.norm(ends[1] - ends[0]), rel=1e-5)
    headings, rows = titled(made, "Vertices")
    for row in rows:
        assert [float(x) for x in row[1:]] == pytest.approx(solid.vertex(row[0]), abs=1e-5)
    headings, rows = titled(made, "Plane faces")
    for row in rows:
        f = solid.face_names.index(row[0])
        corners = solid.vertices[list(solid.faces[f])]
        assert [float(x) for x in row[1:4]] == pytest.approx(corners.mean(0), abs=1e-5)
        assert [float(x) for x in row[4].split()] == pytest.approx(solid.normals[f], abs=5e-3)
    view = plate.camera.distance * np.array([plate.camera.width, plate.camera.height]) / plate.camera.focal_px
    size = np.ptp(solid.vertices, axis=0)
    assert (
        f"Object {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} cm, field of view {view[0]:.4g} x {view[1]:.4g} cm"
        in words(made)
    )


def test_cylinders_and_turned_walls_are_told_by_diameter_and_radius():
    shaft = scenes.load("shaft")
    headings, rows = titled(scene_table.report(shaft), "Curved surfaces")
    assert headings == ["name", "kind", "x", "y", "z", "axis", "radius", "residual"]
    facts = scene_table.facts(shaft)["surfaces"]
    for row, told_, wall in zip(rows, facts, shaft.all_walls.curved, strict=True):
        assert row[:2] == [wall.name, wall.surface.kind]
        assert [float(x) for x in row[2:5]] == pytest.approx(wall.centre, abs=1e-5)
        assert float(row[6]) == pytest.approx(wall.surface.radius, rel=1e-5)
        low, high = wall.surface.ends
        assert told_["length"] == pytest.approx(high - low)


# --- calibrations


def test_the_table_of_locators_is_by_column():
    curve = SimpleNamespace(
        name="gradient", ratios=np.array([0.01, 0.02]), sigma_px=np.array([0.1, np.nan]), floor_px=0.0012, kappa2=7.5,
        correlation_px=1.8, linear_to=0.04, efficiency=0.55,
    )  # fmt: skip
    found = SimpleNamespace(
        curves=(curve,), scene="task1", scale_px=1.0, blur_px=0.6, closed_kappa2=8.1, closed_correlation_px=1.9,
        paper_kappa2=2.5, bound=3.3,
    )  # fmt: skip
    made = calibration_table.table(found)
    headings, rows = cells(made)
    assert headings == ["locator", "floor px", "kappa^2", "correlation px", "product px", "efficiency",
                        "linear to noise/contrast"]  # fmt: skip
    assert rows == [["gradient", "0.0012", "7.5", "1.8", "13.5", "0.55", "0.04"]]
    assert "kappa^2 8.100 over 1.90 px" in str(made.caption)
    assert "Bound of kappa^2 x length: 3.300 px" in str(made.caption)


@pytest.fixture(scope="module")
def calibrated():
    rng = np.random.default_rng(3)
    seen = poses(SMALL, 4, np.random.default_rng(4), 420.0)
    boards = []
    for i, at in enumerate(seen):
        truth = SMALL.corners(at)
        covariance = np.tile(np.diag([0.01, 0.02]) ** 2, (len(truth), 1, 1))
        board = told(truth + rng.normal(size=truth.shape) * [0.01, 0.02], covariance, SMALL.board)
        boards.append(replace(board, status=("outside",) * i + board.status[i:], noise=1 + 0.1 * i, blur_px=0.6 + i))
    found = measure.calibrate_camera(boards, SMALL.square, SMALL.size[::-1], "k1,p1", square_sd=0.01)
    files = tuple(Path(f"board{i}.png") for i in range(4))
    return found, Boards(files, tuple(boards), (), SMALL.size[::-1])


def test_a_camera_s_tables_files_and_json_are_its_numbers(calibrated, tmp_path):
    """Width before height, fx before fy, standard deviations beside values; the lens file is read as it was meant."""
    found, seen = calibrated
    facts = json.loads(json.dumps(camera_table.facts(found, seen, "mm"), allow_nan=False))
    assert facts["image"] == list(SMALL.size)
    assert facts["names"] == ["fx", "fy", "cx", "cy", "k1", "p1"]
    truth = [*SMALL.values[:5], SMALL.values[6]]
    sd = np.sqrt(np.diag(found.covariance))
    assert (np.abs(np.array(facts["values"]) - truth)[:4] < 0.05 * np.array(truth[:4])).all()
    assert facts["sd"] == pytest.approx(sd)
    assert np.array(facts["correlation"]) == pytest.approx(found.covariance / np.outer(sd, sd))
    lens = dict(zip(("fx", "fy", "cx", "cy"), facts["values"][:4], strict=True))
    assert facts["lens"] == lens | {"distortion": [facts["values"][4], 0, facts["values"][5], 0, 0]}
    headings, rows = cells(camera_table.parameters(found))
    assert headings == ["", "value", "+- (1 sigma)", "unit"]
    for row, name, value, s in zip(rows, found.names, found.values, sd, strict=True):
        assert row[0] == name
        # margin: two digits of sigma are printed: half of the last is 0.05 of it
        assert float(row[1]) == pytest.approx(value, abs=0.06 * s)
        assert row[2:] == [f"{s:.2g}", "px" if name in ("fx", "fy", "cx", "cy") else ""]
    headings, rows = cells(camera_table.boards(found, seen, "mm"))
    assert headings == ["file", "corners", "not ok", "noise", "blur px", "rms px", "distance mm", "+-"]
    for i, (row, told_) in enumerate(zip(rows, facts["boards"], strict=True)):
        left = found.residuals[i]
        left = left[np.isfinite(left).all(1)]
        assert len(left) == 54 - i
        rms = math.sqrt((left**2).sum(1).mean())
        away = found.poses[i][3:]
        size = np.linalg.norm(away)
        spread = math.sqrt(away @ found.pose_covariance[i][3:, 3:] @ away) / size
        lost = f"{i} outside" if i else "-"
        assert row == [f"board{i}.png", "9 x 6", lost, f"{1 + 0.1 * i:.2f}", f"{0.6 + i:.2f}", f"{rms:.4f}",
                       f"{size:.3f}", f"{spread:.2g}"]  # fmt: skip
        assert (told_["rms_px"], told_["distance"], told_["distance_sd"]) == pytest.approx((rms, size, spread))
        assert told_["pose_sd"] == pytest.approx(np.sqrt(np.diag(found.pose_covariance[i])))
    (tmp_path / "lens.toml").write_text(camera_table.lens_file(found))
    lens = measure.load_lens(tmp_path / "lens.toml")
    assert [lens.fx, lens.fy, lens.cx, lens.cy] == found.values[:4].tolist()
    assert list(lens.distortion) == [found.values[4], 0, found.values[5], 0, 0]
    assert camera_table.lens_file(found).splitlines()[2].startswith(f"fy = {float(found.values[1])!r}")
    assert f"+- {sd[1]:.2g} px" in camera_table.lens_file(found).splitlines()[2]


def test_the_lines_for_a_scene_are_those_of_the_boards_camera(calibrated, tmp_path):
    found, _ = calibrated
    document = Path(scenes.find("task1")).read_text()
    (tmp_path / "s.toml").write_text(
        document.replace("width = 256", "width = 320").replace("task1_part1", "").replace('same_scale = [""]', "")
    )
    lines = camera_table.scene_lines(found, str(tmp_path / "s.toml"), None)
    fx, fy, cx, cy = found.values[:4]
    assert f"focal_px = {math.sqrt(fx * fy)!r}" in lines
    assert f"{cx - 159.5:+.2f}, {cy - 119.5:+.2f} px" in lines


# --- effects


def test_a_choice_of_effects_saves_what_is_left_out():
    """Random rays are paid for once, by the dearest; what costs each picture alone is no part of a render."""
    known = sorted(RENDERED)[:4]
    costs = ((1.4, False, True), (1.3, False, False), (3.0, True, False), (2.0, True, True))
    decisions = [
        Decision(SimpleNamespace(name=name, cost=cost, random=random), on, "", Influence(0, 0))
        for name, (cost, random, on) in zip(known, costs, strict=True)
    ]
    jitter = Decision(SimpleNamespace(name="pose_jitter", cost=9.0, random=False), True, "", Influence(0, 0))
    assert effects_table.saving((*decisions, jitter)) == pytest.approx((1 + 2.0 + 0.4 + 0.3) / (1 + 1.0 + 0.4))


def test_effects_are_printed_by_name():
    effect = SimpleNamespace(name="floor", cost=1.4, switch="floor", random=False)
    decision = Decision(effect, True, "there is one", Influence(0.02, 0.3))
    assert effects_table.fact(decision) == {
        "name": "floor", "on": True, "reason": "there is one", "bias_px": 0.02, "variance": 0.3, "cost": 1.4,
        "switch": "floor",
    }  # fmt: skip
    headings, rows = cells(effects_table.table((decision,)))
    assert headings == ["effect", "", "reason", "bias px", "variance", "cost"]
    assert rows == [["floor", "on", "there is one", "0.02", "0.3", "1.4"]]
    setting = scenes.Setting(sensor=Pose(20, 100), light=Pose(40, 250))
    switched = [
        Switched(setting, "floor", Influence(0.01, 0.2), -0.012, 0.15, 0.003, 0.04, 3.0, 1.5),
        Switched(setting, "all", Influence(0.01, 0.2), -0.014, 0.15, 0.003, 0.04, 4.0, 0.5),
        Switched(setting, "all", Influence(0.01, 0.2), 0.012, -0.25, 0.003, 0.04, 5.0, 2.5),
    ]
    assert [row.holds for row in switched] == [True, False, False]
    assert json.loads(json.dumps(effects_table.checked(switched[0]))) == {
        "sensor": [20, 100], "light": [40, 250], "effect": "floor", "estimated": [0.01, 0.2],
        "measured": [-0.012, 0.15], "resolution": [0.003, 0.04], "seconds": 3.0, "seconds_auto": 1.5, "holds": True,
    }  # fmt: skip
    headings, rows = cells(effects_table.check_table(switched))
    assert headings == ["sensor, light", "effect", "bias px", "bound", "variance", "bound", "time", ""]
    assert rows[0][1:] == ["floor", "-0.0120", "0.01 +0.0030", "+0.1500", "0.2 +0.0400", "2.0", "ok"]
    assert rows[2][-2:] == ["2.0", "EXCEEDED"]
    assert "1 of 3 comparisons" in effects_table.total(switched)
    assert "auto 3.00 s, all 9.00 s: 3.0 times" in effects_table.total(switched)


@pytest.mark.parametrize(
    ("bias", "variance", "exceeded"), [(0.004, 0.019, False), (0.006, 0.0, True), (0.0, 0.03, True)]
)
def test_either_of_two_limits_keeps_an_effect(bias, variance, exceeded):
    assert EffectTolerance(bias_px=0.005, variance=0.02).exceeded_by(Influence(bias, variance)) == exceeded


# --- what is asked on the command line


class _Asked(Exception):
    """What the command handed on."""

    def __init__(self, *arguments, **named):
        super().__init__()
        self.arguments, self.named = arguments, named


def asked(monkeypatch, place, name, *arguments):
    """What ``place.name`` is called with by a command, which goes no further."""
    from validation.cli.application import app

    def stop(*given, **named):
        raise _Asked(*given, **named)

    monkeypatch.setattr(place, name, stop)
    with pytest.raises(_Asked) as end:
        app(list(arguments), standalone_mode=False)
    return end.value


LIMITS = {
    "sensor_polar_deg": (11, 61), "light_polar_deg": (12, 62), "sensor_azimuth_deg": (13, 63),
    "light_azimuth_deg": (14, 64), "camera_body": 5.5, "light_body": 6.5, "min_edge_px": 7.5,
    "min_clearance_px": 8.5, "min_separation_deg": 9.5,
}  # fmt: skip
PAIRS = ["--sensor-polar", "11,61", "--light-polar", "12,62", "--sensor-azimuth", "13,63", "--light-azimuth", "14,64",
         "--camera-body", "5.5", "--light-body", "6.5", "--min-edge", "7.5", "--min-clearance", "8.5",
         "--separation", "9.5"]  # fmt: skip


@pytest.mark.parametrize(
    ("function", "more"),
    [("plan", ["--search", "alternating", "--shares", "given", "--start", "41,42", "--edges", "best"]),
     ("plan_views", ["--views", "2"])],
)  # fmt: skip
def test_every_option_of_a_plan_is_its_own(monkeypatch, function, more):
    """Limits of the sensor, of the light and of both, all unlike, arrive under their names."""
    given = ["plan", "plate", "--over", "sum", "--step", "12", "--sensor", "21,31", *PAIRS, *more]
    told_ = asked(monkeypatch, planner, function, *given).named
    limits = told_["constraints"]
    assert {name: getattr(limits, name) for name in LIMITS} == LIMITS
    assert (limits.light_out_of_view, limits.same_mount) == (False, False)
    assert (told_["over"], told_["model"], told_["step_deg"]) == ("sum", "calibrated", 12.0)
    assert (told_["sensor"], told_["light"]) == (Pose(21, 31), None)
    if function == "plan":
        assert (told_["search"], told_["edges"], told_["shares"]) == ("alternating", "best", "given")
        assert told_["start"] == Pose(41, 42)


def test_tolerances_of_a_robust_plan_are_their_own(monkeypatch):
    names = [field.name for field in fields(planner.Tolerances)]
    given = [word for i, name in enumerate(names) for word in ("--tolerance", f"{name}=0.{i + 1}")]
    monkeypatch.setattr(planner, "plan", lambda *_, **__: SimpleNamespace(varied=None))
    _, tolerances, limits = asked(monkeypatch, planner, "robust", "plan", "task1", *PAIRS, *given).arguments
    assert [getattr(tolerances, name) for name in names] == pytest.approx([(i + 1) / 10 for i in range(len(names))])
    assert limits.light_polar_deg == (12, 62)


def test_options_of_a_run_are_their_own(monkeypatch, tmp_path):
    given = ["validate", "task1", "--renders", "77", "--seed", "5", "--workers", "3",
             "--leave-out-px", "0.01", "--leave-out-variance", "0.05", "--out", str(tmp_path / "r")]  # fmt: skip
    from validation.batch import job

    named = asked(monkeypatch, job, "RunFile", *given).arguments
    identity = named[1]
    assert named[0] == tmp_path / "r"
    assert (identity["renders"], identity["seed"]) == (77, 5)
    assert identity["tolerance"] == {"bias_px": 0.01, "variance": 0.05}
