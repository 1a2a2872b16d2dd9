"""``ice plan`` from end to end, and robust plans."""

import json
import sys

import cv2
import numpy as np
import pytest

import planner
import scenes
from planner.robustness import altered
from scenes import InvalidInput
from tests.pairs import evaluate_pairs
from validation.cli import main as cli


def ice(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["ice", *arguments])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    return stop.value.code or 0, *capsys.readouterr()


def test_json_and_pictures(monkeypatch, capsys, tmp_path):
    arguments = (
        "plan",
        "task1",
        "--step",
        "20",
        "--json",
        "--out",
        str(tmp_path),
        "--tolerance",
        "noise=0.1",
        "--check",
        "2",
    )
    code, out, _ = ice(monkeypatch, capsys, *arguments)
    document = json.loads(out)
    assert code == 0
    assert document["status"] == "ok"
    assert document["variance"] == pytest.approx(document["variance_object"])
    assert document["grid"]["variance"] >= document["variance"]  # margin: a refinement is no worse, by its kind
    assert document["alternating"]["gap"] >= 0
    assert len(document["candidates"]) == 10
    # margin: the worst of a neighbourhood is no better, by its kind
    assert document["robust"]["worst"] >= document["variance"]
    first, second = document["checked"]
    assert (first["sensor"], first["light"]) == (document["sensor"], document["light"])
    assert first["calibrated"] == pytest.approx(document["variance_object"])
    assert document["proposed"] in (first, second)
    assert document["order_changed"] is (second["rank_after"] == 1)
    assert document["check"]["seconds"] > 0
    assert len(document["pictures"]) == 6
    assert "How well" in (tmp_path / document["pictures"].pop()).read_text()
    for path in document["pictures"]:
        assert cv2.imread(str(tmp_path / path)).std() > 10  # drawn, not blank


def test_table_one_of_the_paper(monkeypatch, capsys):
    arguments = ("--search", "alternating", "--model", "paper", "--objective", "image", "--no-check")
    code, out, _ = ice(monkeypatch, capsys, "plan", "task1_part1", *arguments)
    assert code == 0
    assert "alternating search" in out
    assert "(40.0, 40.4)" in out
    assert "Guarantee: none" in out
    assert "rendered" not in out


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("--objective", "both"), "objective must be one of object, image, got 'both'"),
        (("--tolerance", "weight=1"), "--tolerance must be one of diffuse_reflectance, "),
        (("--tolerance", "noise=x"), "--tolerance noise must be a number, got 'x'"),
        (("--sensor-polar", "10"), "--sensor-polar must be two numbers LOW,HIGH (degrees), got '10'"),
        (("--sensor", "200,0"), "--sensor: polar_deg must be between 0 and 180, got 200"),
        (("--check", "0"), "--check must be at least 1, got 0"),
        (("--min-edge", "1e6"), "constraints must leave a pose for sensor and light, got none"),
    ],
)
def test_bad_input_is_one_line(monkeypatch, capsys, arguments, line):
    code, out, errors = ice(monkeypatch, capsys, "plan", "task1", "--step", "10", *arguments)
    assert (code, out) == (2, "")
    assert line in errors
    assert errors.count("\n") == 1


def test_robust_plan(task1):
    """Its worst case is not beaten by the plan that trusts its inputs, and no case within the tolerances exceeds it."""
    glossy = task1.model_copy(update={
        "material": scenes.Material(specular_fraction=0.3, refractive_index=1.5, roughness=0.3)
    })  # fmt: skip
    plan = planner.plan(glossy, step_deg=30, refined=False)
    tolerances = planner.Tolerances(roughness=0.2, noise=0.1, sensor_deg=1.0)
    found = planner.robust(plan, tolerances)
    assert found.cases == 4 * 5
    assert found.nominal <= found.worst <= found.plan_worst
    pair = (np.array([list(pose)]) for pose in (found.sensor, found.light))
    extreme = altered(glossy, {"roughness": 0.8, "noise": 1.1})
    assert evaluate_pairs(extreme, *pair, "calibrated", "object")[0] <= found.worst * (1 + 1e-9)
    assert {move.input for move in found.moves} == {"roughness", "noise"}
    louder = next(move for move in found.moves if move.input == "noise" and move.factor > 1)
    noise = task1.noise
    assert louder.variance == pytest.approx(
        noise.model_copy(update={"sigma": 1.1 * noise.sigma}).variance / noise.variance
    )
    assert all(move.best <= move.variance * (1 + 1e-9) for move in found.moves)
    with pytest.raises(InvalidInput, match="tolerances must be given"):
        planner.robust(plan, planner.Tolerances())
