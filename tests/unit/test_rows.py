"""Rows of a run from their numbers: of several scenes, measured by different methods; and why two budgets differ."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner.uncertainty import Input, budget, monte_carlo, validate
from planner.uncertainty.validation import _reasons
from scenes import Pose
from validation.batch.repeated import STATUSES, RepeatedValues
from validation.batch.rows import Rows

MODEL = {"paper": 2.0, "calibrated": 3.0, "bound": 1.5, "value_px": 80.0, "predicted_bias": 0.25}
MODEL["measurands"] = [MODEL | {"name": "m", "kind": "width", "unit": "mm", "value": 80.0}]


def method(index, place, count=40, lost=0, clean="ok"):
    rng = np.random.default_rng(100 * index + place)
    values = 80.0 + place + rng.normal(0, 0.5 + 0.1 * index, count)
    values[:lost] = np.nan
    return RepeatedValues(0.3 + 0.1 * index + 0.01 * place, values, {"short": lost} if lost else {}, clean)


@pytest.fixture
def made():
    """Two scenes of which the second has a method more, and the third another one; numbers by (setting, method)."""
    campaign = SimpleNamespace(
        at=lambda i: (SimpleNamespace(sensor=Pose(i, 2), light=Pose(3, i), paper_ice=None, paper_real=None), {"k": i}),
    )
    campaign = type("Campaign", (), {"at": staticmethod(campaign.at), "__len__": lambda self: 6})()
    rows, every = Rows(campaign), {}
    names = {0: ("a",), 1: ("a", "b", "c"), 3: ("a", "c"), 4: ("a", "b", "c"), 5: ("a",)}
    for index, methods in names.items():
        found = {
            name: method(index, place, lost=3 if (index, name) == (4, "c") else 0,
                         clean="clutter" if (index, name) == (1, "b") else "ok")
            for place, name in enumerate(methods)
        }  # fmt: skip
        every |= {(index, name): each for name, each in found.items()}
        rows.add(index, f"scene {len(methods)}", MODEL | {"paper": 2.0 + index}, found, [found["a"]])
    rows.finish(0.5)
    return rows, every


def test_each_row_has_its_own_methods(made):
    rows, every = made
    assert len(rows) == 5
    assert [row.index for row in rows] == [0, 1, 3, 4, 5]
    assert [row.scene for row in rows] == ["scene 1", "scene 3", "scene 2", "scene 3", "scene 1"]
    assert [[m.method for m in (row.main, *row.classic)] for row in rows] == [
        ["a"], ["a", "b", "c"], ["a", "c"], ["a", "b", "c"], ["a"]
    ]  # fmt: skip
    assert [row.paper for row in rows] == [1.0, 1.5, 2.5, 3.0, 3.5]
    assert [row.texture for row in rows] == [None] * 5
    assert rows.others == ["b", "c"]
    for row in rows:
        assert (row.sensor, row.parameters) == ((row.index, 2), {"k": row.index})
        for each in (row.main, *row.classic):
            found = every[row.index, each.method]
            good = found.distances[np.isfinite(found.distances)]
            assert each.empirical == pytest.approx(good.var(ddof=1))
            assert each.ratio == pytest.approx(good.var(ddof=1) / found.propagated)
            # margin: a ratio lies in its interval by its kind
            assert each.ratio_interval[0] < each.ratio < each.ratio_interval[1]
            assert each.bias == pytest.approx(good.mean() - 80)
            assert each.rmse == pytest.approx(np.sqrt(good.var(ddof=1) + (good.mean() - 80) ** 2))
            assert (each.n, each.failed, each.failures) == (40, 40 - len(good), found.failures)
    assert rows[1].classic[0].status == "clutter"
    assert rows[3].classic[1].status == "short"  # three of 40 are lost
    assert rows[-1] == rows[4]
    assert rows[1:4:2] == [rows[1], rows[3]]


def test_numbers_of_one_method_are_of_the_settings_that_have_it(made):
    """In the order of the settings, wherever the method stands among theirs."""
    rows, every = made
    for name, where in (("b", (1, 4)), ("c", (1, 3, 4))):
        told = rows.judged(name)
        assert told["propagated"].tolist() == [every[i, name].propagated for i in where]
        assert told["empirical"] == pytest.approx([np.nanvar(every[i, name].distances, ddof=1) for i in where])
        assert told["ratio"] == pytest.approx(told["empirical"] / told["propagated"])
        assert told["predicted_bias"].tolist() == [0.25] * len(where)
    assert rows.judged("b")["status"].tolist() == ["clutter", "ok"]
    assert rows.judged("c")["status"].tolist() == ["ok", "ok", "short"]
    assert rows.judged("c")["failed"].tolist() == [0, 0, 3]
    main = rows.judged()
    assert main["propagated"].tolist() == [every[i, "a"].propagated for i in (0, 1, 3, 4, 5)]


def test_reasons_are_told_from_their_limits_on():
    """A shift of the mean by delta, a middle of the interval that is off it by delta, and draws without a value."""
    inputs, c = [Input("x", 1.0, 0.04)], {"x": 200.0}
    gum = budget("width", "um", 200.0, inputs, c)
    delta = 0.05

    def reasons(**parts):
        told = {"y": 200.0, "u": gum.u, "spread": (0.0,) * 4, "symmetric": (190.0, 210.0), "failed": 0, "draws": 900}
        return _reasons(gum, SimpleNamespace(**(told | parts)), delta)

    plain = ["the distribution of the draws is neither normal nor Student's t"]
    uneven = ["the distribution of the draws is not symmetric"]
    assert reasons() == plain
    assert reasons(symmetric=(190.0, 210.09)) == plain
    assert reasons(symmetric=(190.0, 210.11)) == uneven
    assert reasons(symmetric=(189.89, 210.0)) == uneven
    for off, said in ((0.049, plain[0]), (0.051, "nonlinear: the mean of the draws is +0.051 from the value")):
        assert reasons(y=200.0 + off, symmetric=(190 + off, 210 + off))[0] == said
    assert reasons(y=200.051, symmetric=(190.051, 210.051), spread=(0.018, 0, 0, 0)) == plain
    assert reasons(u=gum.u - 0.049) == plain
    assert reasons(u=gum.u - 0.051)[0].startswith("nonlinear: the draws' standard deviation is 7.9, first order")
    assert reasons(u=gum.u - 0.051, spread=(0, 0.018, 0, 0)) == plain
    assert reasons(failed=100) == ["100 of 1000 draws gave no value"]
    assert validate(gum, monte_carlo(lambda x: 200 * x["x"], inputs, 1)).verdict == "agree"


def test_statuses_of_many_settings_ask_for_each_number_once(made):
    """Of a million settings each asking takes milliseconds, and images are lost from ten thousand."""
    rows, asked = made[0], []
    short = rows._failures.index({"short": 3})
    columns = {"clean": np.full(9, STATUSES.index("ok")), "failures": np.full(9, short), "n": np.full(9, 40)}

    def numbers(name):
        asked.append(name)
        return columns[name]

    assert rows._statuses(numbers).tolist() == ["short"] * 9
    assert sorted(asked) == sorted(columns)
