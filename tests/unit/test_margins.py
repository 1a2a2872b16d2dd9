"""The recorder of margins sees every kind of comparison that a test makes, and says how near each is to its limit."""

import ast
import builtins
import math

import numpy as np
import pytest

from tests.margins import __main__ as listing
from tests.margins import recorder

NAMES = {"x": 0.5, "a": np.array([0.1, -0.4]), "b": np.array([0.2, 0.8]), "n": 3, "np": np, "pi": math.pi}


@pytest.fixture
def seen(monkeypatch):
    """Ratios that a line of a test gives."""
    monkeypatch.setattr(builtins, recorder._NAME, recorder.compared, raising=False)

    def run(line, **more):
        monkeypatch.setattr(recorder, "_worst", {})
        tree = ast.fix_missing_locations(recorder._Compared().visit(ast.parse(line)))
        exec(compile(tree, str(recorder.TESTS / "sample.py"), "exec"), NAMES | more)
        return [pytest.approx(one["ratio"]) for one in recorder._worst.values()]

    return run


@pytest.mark.parametrize(
    ("line", "ratio"),
    [
        ("assert x < 2", 0.25),
        ("assert 2.0 > x", 0.25),
        ("assert not x >= 2", 0.25),
        ("assert -x > -2", 0.25),
        ("assert x > -1e-9", 0.0),
        ("assert 0.4 < x < 0.8", 0.5),  # from the middle, over half the width
        ("assert x < 1 < 10", 0.5),
        ("assert not 0.9 < x < 1.0", 1 / 9),
        ("assert abs(x - 0.4) < 0.2 and n == 3", 0.5),
        ("assert (np.abs(a) < 0.8).all()", 0.5),
        ("assert (b > 0.1).any()", 0.125),
        ("assert not (b > 1.6).any()", 0.5),
        ("assert np.abs(a).max() < 0.8", 0.5),
        ("assert all(value < 1.6 for value in b)", 0.5),
        ("assert any(value > 0.4 for value in b)", 0.5),
        ("assert x == 0 or x < 2", 0.25),
        ("def close(): return x <= 1\nassert close()", 0.5),
    ],
)
def test_each_kind_of_comparison(seen, line, ratio):
    assert seen(line) == [ratio]


@pytest.mark.parametrize(
    "line", ["assert n < 4", "assert n < 4.0", "assert 'a' < 'b'", "assert b[b > 0.5].size", "assert x != 3"]
)
def test_what_has_no_margin_is_not_recorded(seen, line):
    assert seen(line) == []


def test_what_does_not_hold_fails_and_is_recorded(monkeypatch, seen):
    with pytest.raises(AssertionError):
        seen("assert x < 0.25")
    assert [one["ratio"] for one in recorder._worst.values()] == [2.0]


@pytest.mark.parametrize(
    ("found", "ratio"),
    [
        (recorder._approximately(pytest.approx(1.0, rel=0.1), 1.05), 0.5),
        (recorder._approximately(pytest.approx([1.0, 2.0], abs=0.1), [1.0, 2.05]), 0.5),
        (recorder._approximately(pytest.approx({"a": 2.0}), {"a": 2 + 1e-6}), 0.5),
        (recorder._not_approximately(pytest.approx(np.ones(2), abs=0.1), np.array([1.0, 1.2])), 0.5),
        (recorder._allclose(1.0, 1.0 + 1e-3, rtol=0, atol=2e-3), 0.5),
        (recorder._math_isclose(1.0, 2.0, rel_tol=1.0), 0.5),
    ],
)
def test_each_kind_of_closeness(found, ratio):
    assert found[2] == pytest.approx(ratio)


def test_a_comment_explains_its_statement_alone(tmp_path, monkeypatch):
    (tmp_path / "sample.py").write_text(
        "assert x < 1  # margin: so it is\nassert y < 1\n# margin: this, too,\n# is long\nassert f(\n    2,\n) < 1\n"
    )
    monkeypatch.setattr(listing, "_ROOT", tmp_path)
    reasons = [listing._reason("sample.py", *listing._statement("sample.py", line)) for line in (1, 2, 6)]
    assert reasons == ["so it is", "", "this, too, is long"]
