"""``ice plan --views``: pictures planned together, and checked by rendering and measuring them."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

import planner
import scenes
from render import Quality
from tests.sides import sides, written
from validation import statistics
from validation.cli.main import main
from validation.views_check import check_views, judge

QUICK = Quality(samples=1, edge_samples=16, random_samples=4)


def ice(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["ice", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code, *capsys.readouterr()


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    scene = sides(tmp_path_factory.mktemp("sides"), "front", "top", "across")
    found = planner.plan_views(scene, 2, step_deg=20, refined=False)
    return found, check_views(found, 300, quality=QUICK)


@pytest.mark.render
def test_combined_values_scatter_as_predicted(checked):
    """Two pictures, rendered and measured 300 times each, combined by the plan's weights: chi-square, 1 % for all."""
    found, check = checked
    assert check.verdict.agrees, check.verdict.text
    last = [row for row in check.rows if row.pictures == 2]
    assert [row.name for row in last] == [quantity.name for quantity in found.scene.quantities]
    assert sum(row.judged for row in last) >= 2
    assert all(row.failed == 0 and row.n == 300 for row in last)
    for row in (row for row in check.rows if row.judged):
        # margin: the claim: both models agree to a tenth
        assert row.propagated / row.predicted == pytest.approx(1, abs=0.1)
        assert row.interval_least_squares[0] < 1.1  # margin: chance: an interval of 300 seeded pictures
        assert row.interval_least_squares[1] > 0.9  # margin: chance: an interval of 300 seeded pictures


@pytest.mark.render
def test_least_squares_scatters_as_predicted():
    """Two settings of the plate, whose values are correlated: 2 to 3 % less variance, which 300 images bear out.

    Negative control: that of the worse picture alone, about twice as large, is outside every interval.
    """
    plate = scenes.load("plate")
    poses = [(setting.sensor, setting.light) for setting in plate.settings[1:3]]
    views = tuple(planner.View(*pair, planner.predict(plate, *pair)) for pair in poses)
    both = planner.combine([view.prediction for view in views])
    chosen = planner.ViewSet(views, both, 1.0, (), None, None, None, None)
    found = planner.Views(plate, "minimax", "calibrated", None, (chosen,), 0, 0, "", None)
    gain = np.diag(both.covariance_least_squares) / both.variances
    rows = check_views(found, 300, seed=2, quality=QUICK).rows
    assert gain[:2] == pytest.approx([0.972, 0.977], abs=0.005)  # margin: 2.8 and 2.3 %, as they are said
    for row, *single in zip(rows, *(view.prediction.measurands for view in views), strict=True):
        low, high = statistics.ratio_interval(row.ratio_least_squares, row.n, 0.998)  # 1 % for all five
        assert low < 1 < high  # margin: chance: an interval of 300 seeded pictures, 99.8 %
        if row.name != "hole from front":  # which is taken from one picture alone
            # margin: twice as large is what is said
            assert high < max(each.variance_object for each in single) / row.predicted


@pytest.mark.render
@pytest.mark.parametrize("factor", [0.0, 1.5])
def test_wrong_predictions_are_contradicted(checked, factor):
    """Negative control: variances predicted 1.5 times as large, and as nothing."""
    _, check = checked
    rng = np.random.default_rng(3)
    told = []
    for row in check.rows:
        values = rng.normal(size=row.n)  # as independent as can be
        ratio = np.inf if factor == 0 else row.ratio / factor
        told.append((replace(row, ratio=ratio, predicted=row.predicted * factor), values))
    assert not judge(told, 0.0).verdict.agrees


@pytest.mark.render
def test_json_and_picture(monkeypatch, capsys, tmp_path):
    out = tmp_path / "out"
    code, printed, _ = ice(monkeypatch, capsys, "plan", written(tmp_path, "front", "back"), "--views", 2, "--step", 30,
                           "--json", "--out", out)  # fmt: skip
    found = json.loads(printed)
    assert code == 0
    one, two = found["views"]
    assert {"count", "poses", "minimised", "worst_ratio", "limiting", "lost", "hard", "over_one", "over_repeats",
            "exhaustive",
            "gap", "bound", "measurands", "covariance", "covariance_least_squares"} == set(two)  # fmt: skip
    assert len(one["lost"]) == 1
    assert sum(row[k] is None for k, row in enumerate(one["covariance"])) == 1
    assert (two["count"], two["lost"], two["over_one"]) == (2, [], None)
    assert sorted(m["pictures"] for m in two["measurands"]) == [[1], [2]]
    assert all(m["sigma"] == m["single"][m["pictures"][0] - 1]["sigma"] for m in two["measurands"])
    assert found["check"]["verdict"].startswith("agree")
    assert found["pictures"] == [str(out / "views.png"), str(out / "plan.html")]
    assert (out / "views.png").read_bytes()[:4] == b"\x89PNG"


def test_table(monkeypatch, capsys, tmp_path):
    scene = written(tmp_path, "front", "top")
    code, printed, _ = ice(monkeypatch, capsys, "plan", scene, "--views", 2, "--step", 30, "--no-check")
    assert code == 0
    assert "repeats / it" in printed
    assert "taken from" in printed
    assert "Not checked" not in printed


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--views", "0"], "--views must be 1 to 12, got 0"),
        (["--views", "99"], "--views must be 1 to 12, got 99"),
        (["--views-share", "sensor"], "--views must be given with --views-share, got nothing beside 'sensor'"),
        (["--views", "2", "--views-share", "both"], "--views-share must be one of sensor, light, got 'both'"),
        (["--views", "2", "--search", "alternating"], "--search must be left out with --views, got alternating"),
        (["--views", "2", "--edges", "best"], "--edges must be left out with --views, got best"),
        (["--views", "2", "--objective", "image"], "objective must be object for several pictures, got 'image'"),
        (["--views", "2", "--tolerance", "noise=0.1"], "--tolerance must be left out with --views, got noise=0.1"),
    ],
)
def test_bad_input_is_one_line(monkeypatch, capsys, arguments, line):
    code, printed, said = ice(monkeypatch, capsys, "plan", "task1", *arguments)
    assert (code, printed, said) == (2, "", line + "\n")
