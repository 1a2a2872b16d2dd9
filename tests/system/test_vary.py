"""``ice plan --vary`` from end to end: both choices rendered, and measured in noisy pictures."""

import dataclasses
import json
import re
import sys

import pytest

import planner
import scenes
from render import Quality
from validation import vary_check
from validation.cli import main as cli

QUICK = Quality(samples=1, edge_samples=16, random_samples=4)
HELD = ("--sensor", "45,225", "--light", "45,105", "--vary", "analyser,polarisation", "--hold", "white", "--check", "1")


def ice(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["ice", *arguments])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    return stop.value.code or 0, *capsys.readouterr()


@pytest.mark.render
def test_json(monkeypatch, capsys):
    code, out, _ = ice(monkeypatch, capsys, "plan", "glossy_metal", *HELD, "--json")
    varied = json.loads(out)["varied"]
    assert code == 0
    assert (varied["vary"], varied["hold"]) == (["analyser", "polarisation"], "white")
    # margin: same poses are among all, by their kind; half as much again is what is said
    assert varied["gain"] >= varied["gain_same_poses"] > 1.5
    assert varied["fixed"]["analyser_deg"] is None
    assert 0 <= varied["best"]["analyser_deg"] < 180  # margin: an angle of half a turn
    assert varied["best"]["exposure_time"] == 4  # two ideal polarisers
    check = varied["check"]
    assert check["verdict"].startswith("agree")
    assert check["gain_interval"][0] < check["predicted_gain"] < check["gain_interval"][1]
    assert check["gain_interval"][0] > 1  # margin: the order is said: a gain that pictures bear out
    for row in (check["fixed"], check["best"]):
        assert row["n"] == 1000
        # margin: chance: an interval of 1000 seeded pictures
        assert row["interval"][0] < row["predicted"] < row["interval"][1]


@pytest.mark.render
def test_a_wrong_prediction_is_contradicted(monkeypatch, capsys):
    """The gain of the lamp as it is, and twice that; what is printed without a check says nothing of pictures."""
    found = planner.plan(scenes.load("copper"), sensor=(50, 278), light=(51, 88), vary=("band",))
    assert found.varied.best.choice.lamp == "red LED"
    true = vary_check.check_varied(found, quality=QUICK)
    assert true.agrees
    assert true.interval[0] > 1.1  # margin: the order is said: a gain that pictures bear out
    halved = dataclasses.replace(true.best, predicted=true.best.predicted / 2)
    assert not vary_check.judged(true.fixed, halved).agrees
    held = ("--sensor", "50,278", "--light", "51,88")
    code, out, _ = ice(monkeypatch, capsys, "plan", "copper", *held, "--vary", "band", "--no-check")
    assert code == 0
    assert "red LED" in out
    assert "noisy pictures" not in out


@pytest.mark.render
def test_the_page_shows_the_choice_that_is_proposed(monkeypatch, capsys, tmp_path):
    """U and places on it are those of the best choice; the own one stands beside it; nothing is said of pictures."""
    held = "--sensor", "50,278", "--light", "51,88"
    code, out, _ = ice(
        monkeypatch, capsys, "plan", "copper", *held, "--vary", "band", "--no-check", "--out", str(tmp_path)
    )
    assert code == 0
    (line,) = (line for line in out.splitlines() if line.startswith("Proposed, with what was varied: red LED"))
    gain = re.search(r"has ([\d.]+) times the variance", line)[1]
    page = (tmp_path / "plan.html").read_text()
    for told in ("What was varied: band", f"has {gain} times the variance", "Held equal: exposure time", "own lamp"):
        assert told in page
    assert "Rendered and measured" not in page
    best = planner.plan(scenes.load("copper"), sensor=(50, 278), light=(51, 88), vary=("band",)).varied.best
    sigma = planner.predict(best.scene, best.sensor, best.light).variance_object ** 0.5
    u = float(re.search(r"uncertainty U \(95 %\) of ([\d.]+) cm".replace(" %", "\N{NO-BREAK SPACE}%"), page)[1])
    assert u == pytest.approx(1.96 * sigma, rel=0.1)  # margin: two digits are told, and the model's error adds a little


def test_errors_are_one_line(monkeypatch, capsys):
    code, _, error = ice(monkeypatch, capsys, "plan", "task1", "--vary", "colour")
    assert (code, error.count("\n")) == (2, 1)
    assert "--vary must be some of analyser, polarisation, band, each once, got 'colour'" in error
    code, _, error = ice(monkeypatch, capsys, "plan", "task1", "--hold", "white")
    assert code == 2
    assert "--hold must be left out without --vary, got 'white'" in error
