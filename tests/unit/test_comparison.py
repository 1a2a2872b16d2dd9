"""Comparison of runs: how often it cries wolf, and what it must see."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import typer
from mpmath import mp
from scipy import stats

from scenes import InvalidInput
from validation import comparison
from validation.cli.compare import compare_command


def document(rng, settings=4, n=1000, factor=1.0, shift=0.0, failed=0):
    """Results of normal distances; variance x factor, mean + shift and some failures in the last setting."""
    rows = []
    for i in range(settings):
        last = i == settings - 1
        scale, mean, lost = (np.sqrt(factor), shift, failed) if last else (1.0, 0.0, 0)
        values = 0.01 * (scale * rng.standard_normal(n - lost) + mean)
        rows.append({
            "sensor": [30, i], "light": [20, i], "method": "a", "n": n, "failed": lost, "classic": [],
            "empirical": values.var(ddof=1), "bias": values.mean(),
        })  # fmt: skip
    return {"scene": "made", "settings": rows}


def changes(rng, **options):
    return comparison.compare(document(rng), document(rng, **options)).changed


def test_equal_runs_differ_as_often_as_claimed(rng):
    """300 pairs of equal runs, at a level of 20 % for the table."""
    called = sum(bool(comparison.compare(document(rng), document(rng), 0.2).changed) for _ in range(300)) / 300
    # failures are equal here and never significant, so 8 of the 12 tests can be: 1 - 0.8^(8/12) = 13.8 % are expected
    low, high = stats.binom.interval(0.999, 300, 1 - 0.8 ** (8 / 12))
    assert low / 300 <= called <= high / 300


@pytest.mark.parametrize(
    ("options", "what"), [({"factor": 1.4}, "variance"), ({"shift": 0.3}, "mean"), ({"failed": 30}, "failed")]
)
def test_a_change_is_found_where_it_is(rng, options, what):
    found = changes(rng, **options)
    assert {(change.what, change.setting) for change in found} == {(what, "made sensor (30, 3) light (20, 3)")}


def test_a_setting_that_no_longer_measures_is_a_change(rng):
    before, after = document(rng), document(rng)
    after["settings"][0] |= {"failed": 1000, "empirical": None, "bias": None}
    assert [change.what for change in comparison.compare(before, after).changed] == ["failed"]


def test_only_what_both_have_is_compared(rng):
    found = comparison.compare(document(rng, settings=3), document(rng, settings=2))
    assert found.settings == 2
    assert found.only_before == ("made sensor (30, 2) light (20, 2) a",)
    with pytest.raises(InvalidInput, match="at least one setting and estimator in common, got none"):
        comparison.compare(document(rng) | {"scene": "other"}, document(rng))


def stored(path, **row):
    """A result with one setting in a file, read again."""
    judged = {"method": "a", "n": 5, "failed": 1, "empirical": 0.25, "bias": 0.5} | row
    setting = {**judged, "sensor": [30.0, 1.0], "light": [20.0, 2.0], "classic": []}
    (path / "result.json").write_text(json.dumps({"scene": "made", "settings": [setting]}))
    return comparison.read(path)["settings"][0]


@pytest.mark.parametrize("empirical", [0.0, 1e-30, 0.25, None])
@pytest.mark.parametrize("bias", [-0.5, 0.0])
def test_a_variance_is_none_or_beside_a_bias(tmp_path, empirical, bias):
    """0 is one: without noise all images are alike."""
    assert stored(tmp_path, empirical=empirical, bias=bias)["empirical"] == empirical


@pytest.mark.parametrize(
    "row", [{"empirical": 0.9e-30}, {"bias": None}, {"bias": None, "empirical": 0.0}, {"empirical": -1.0}, {"n": 0}]
)
def test_what_cannot_have_been_written_is_refused(tmp_path, row):
    """Variances that no image has, a variance without a bias, more failures than images."""
    with pytest.raises(InvalidInput, match=r"must be a run directory or its result.json, got: settings\[0\]"):
        stored(tmp_path, **row)


def test_every_image_may_have_failed(tmp_path):
    assert stored(tmp_path, n=5, failed=5, empirical=None, bias=None)["failed"] == 5
    assert stored(tmp_path, empirical=None, bias=None)["bias"] is None


def test_f_test_against_simulation(rng):
    """The p-value of a ratio of sample variances is uniform if the variances are equal."""
    a, b = rng.standard_normal((2, 2000, 30))
    p = [comparison.f_test(x, 30, y, 30) for x, y in zip(a.var(1, ddof=1), b.var(1, ddof=1), strict=True)]
    assert stats.kstest(p, "uniform").pvalue > 0.001


@pytest.mark.parametrize("text", ["", "[]", "{}", json.dumps({"settings": []})])
def test_what_is_no_result(tmp_path, text):
    (tmp_path / "result.json").write_text(text)
    with pytest.raises(InvalidInput, match=r"must be a run directory or its result.json, got"):
        comparison.read(tmp_path)


@pytest.mark.parametrize(("n", "m"), [(2, 3), (5, 8), (40, 3)])
@pytest.mark.parametrize("ratio", [0.05, 0.9, 1.0, 4.0])
def test_f_test_against_the_incomplete_beta_function(n, m, ratio):
    """n - 1 and m - 1 degrees of freedom, twice the smaller tail; which run comes first does not matter."""
    x = (n - 1) * ratio / ((n - 1) * ratio + m - 1)
    below = float(mp.betainc((n - 1) / 2, (m - 1) / 2, 0, x, regularized=True))
    assert comparison.f_test(3.0 * ratio, n, 3.0, m) == pytest.approx(min(2 * min(below, 1 - below), 1.0), rel=1e-9)
    assert comparison.f_test(3.0, m, 3.0 * ratio, n) == pytest.approx(min(2 * min(below, 1 - below), 1.0), rel=1e-9)


@pytest.mark.parametrize("angles", [[30.0], [30.0, 135.0, 0.0]])
@pytest.mark.parametrize("role", ["sensor", "light"])
def test_a_pose_is_two_angles(rng, tmp_path, role, angles):
    told = document(rng)
    told["settings"][0][role] = angles
    (tmp_path / "result.json").write_text(json.dumps(told))
    with pytest.raises(InvalidInput, match=r"must be a run directory or its result\.json, got"):
        comparison.read(tmp_path)


def test_what_only_one_run_has_is_named_by_its_first_and_counted(monkeypatch, capsys):
    """Of both runs; nothing is said where they have the same settings."""
    for before, after in ((["a", "b"], []), ([], ["c", "d", "e"])):
        found = SimpleNamespace(text="t", changed=(), only_before=before, only_after=after, to_json=dict)
        monkeypatch.setattr(comparison, "compare", lambda *given, found=found: found)
        monkeypatch.setattr(comparison, "read", lambda path: path)
        with pytest.raises(typer.Exit):
            compare_command(Path("x"), Path("y"), 0.01)
        words = "only before, not compared: 2, as a" if before else "only after, not compared: 3, as c"
        assert capsys.readouterr().out == f"t\n  {words}\n"
