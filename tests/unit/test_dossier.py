"""A dossier's parts: digests of what was read, rates of false alarms, what standards ask and where it is answered."""

import hashlib
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

import planner
import scenes
from scenes.load import BUNDLED
from tests.docs.pages import DOCS
from validation import coverage, statistics
from validation.batch.measurands import JudgedMeasurand
from validation.dossier import alarms, inputs
from validation.dossier.asked import ASKED
from validation.dossier.controls import Control
from validation.dossier.limits import LIMITS
from validation.report.dossier_page import HEADINGS


def row(**said):
    """A measurand of which a thousand pictures were measured as predicted."""
    told = {
        "name": "width", "kind": "width", "unit": "mm", "value": 10.0, "paper": 1e-4, "calibrated": 1e-4,
        "predicted": 1e-4, "empirical": 1e-4, "n": 1000, "failed": 0, "ratio": 1.0, "ratio_interval": (0.9, 1.1),
        "bias": 0.0, "predicted_bias": 0.0, "bound": 1e-4, "status": "ok", "independent": 1.0, "u_bias": 0.002,
        "render_noise": 0.001,
    }  # fmt: skip
    return JudgedMeasurand(**told | said)


def test_true_tables_are_contradicted_as_often_as_stated():
    found = alarms.drawn([row(), row(predicted=4e-4, u_bias=0.015), row(status="clutter")], 2000, 3)
    assert (found.tables, found.pictures, found.stated) == (2000, 1000, 0.01)
    assert found.holds
    assert found.low <= found.rate <= found.high
    assert found.rate < 0.02  # margin: 0.01 and 4.5 standard errors
    assert found.rate > 0.001  # some are: the tables differ


def test_a_verdict_that_cries_too_often_is_found(monkeypatch):
    """Negative control: judged at a level of 10 %, stated at 1 %."""
    honest = statistics.verdict
    monkeypatch.setattr(statistics, "verdict", lambda *told, **more: honest(*told, level=0.1, **more))
    assert not alarms.drawn([row(), row()], 500, 3).holds


def test_nothing_is_drawn_of_what_may_not_be_relied_on():
    found = alarms.drawn([row(status="clutter")], 100, 3)
    assert (found.tables, found.alarms, found.low, found.high) == (0, 0, 0.0, 1.0)


@pytest.mark.parametrize(("times", "wrong"), [(1.0, 0), (3.0, 40)])
def test_blocks_of_a_run_are_judged_each_by_itself(times, wrong):
    """Of 1000 values 40 blocks of 25; a scatter three times too large is found in all of them."""
    values = 10.0 + 0.02 + times * 0.01 * np.random.default_rng(5).standard_normal(1000)
    run = SimpleNamespace(rows=[SimpleNamespace(index=0, main=SimpleNamespace(method="gradient"),
                                                measurands=[row(correction=0.02)])])  # fmt: skip
    found = alarms.in_blocks(run, SimpleNamespace(distances=lambda index, name: values))
    assert (found.tables, found.pictures) == (40, 25)
    assert (found.alarms > 35) if wrong else (found.alarms <= 3)  # margin: 0.4 expected, 4 or more in 1e-3


def test_what_was_read_is_known_by_its_content(tmp_path):
    """The whole scene has the same digest from another folder, and another one with another part."""
    for name in ("plate.toml", "plate.ply"):
        shutil.copy(BUNDLED / name, tmp_path / name)
    here, there = scenes.load("plate"), scenes.load(tmp_path / "plate.toml")
    file, part, whole = inputs.files("plate", here)
    assert file.sha256 == hashlib.sha256((BUNDLED / "plate.toml").read_bytes()).hexdigest()
    assert (part.name, part.sha256) == ("plate.ply", hashlib.sha256((BUNDLED / "plate.ply").read_bytes()).hexdigest())
    assert whole.sha256 == hashlib.sha256(inputs.record(here).encode()).hexdigest()
    assert inputs.files(tmp_path / "plate.toml", there) == (file, part, whole)
    (tmp_path / "plate.ply").write_bytes((BUNDLED / "plate.ply").read_bytes() + b"\n")
    _, other, changed = inputs.files(tmp_path / "plate.toml", there)
    assert other.sha256 != part.sha256
    assert changed.sha256 != whole.sha256
    assert str(tmp_path) not in inputs.record(there)


def test_versions_are_those_of_all_that_is_needed():
    found = inputs.versions("scalar_rgb")
    assert {"ice-vision", "python", "numpy", "scipy", "mitsuba"} <= set(found)
    assert "pytest" not in found
    assert len(found["code (SHA-256)"]) == 64
    assert set(inputs.processor()) | set(inputs.host()) == {"processor", "numpy", "blas", "embree", "system", "cores",
                                                            "python"}  # fmt: skip


def test_a_control_holds_where_its_own_test_finds_it():
    told = {"name": "a", "planted": "b", "pooled": None, "mean": None, "verdict": ""}
    assert Control(wanted=("rows", "pooled"), found=("pooled", "bias"), **told).holds
    assert not Control(wanted=("bias",), found=("rows",), **told).holds
    assert Control(wanted=(), found=(), **told).holds
    assert not Control(wanted=(), found=("rows",), **told).holds


def test_coverage_by_drawing_is_that_stated_and_half_an_interval_is_too_short():
    scene = scenes.load("calibrated_rig")
    found = planner.budget(scene, scene.settings[0].sensor, scene.settings[0].light)
    (told,) = coverage.drawn(found, 4000, 7)
    assert told.holds
    assert abs(told.held - 0.95) < 0.014  # margin: 4 standard errors
    assert told.sigma == pytest.approx(told.u, rel=0.045)  # margin: 4 standard errors
    (short,) = found.measurands
    short = SimpleNamespace(**{name: getattr(short, name) for name in ("name", "unit", "p", "u", "value", "sources")},
                            U=short.U / 2)  # fmt: skip
    half = SimpleNamespace(measurands=(short,), statuses=("ok",))
    told = coverage._of(half, 0, found.measurands[0].value + found.measurands[0].u
                        * np.random.default_rng(1).standard_normal(500), np.full(500, "ok"))  # fmt: skip
    assert not told.holds


def test_every_question_is_answered_somewhere_or_left_to_the_laboratory():
    for each in ASKED:
        assert set(each.headings) <= set(HEADINGS), each
        assert each.headings or each.laboratory, each
    assert {"7.11.2", "7.11.3 b", "7.11.6"} <= {each.clause for each in ASKED}


def test_the_page_tells_of_all_limits():
    text = (DOCS / "dossier.md").read_text()
    assert [f"| {' | '.join(each)} |" in text for each in LIMITS] == [True] * len(LIMITS)
