"""Asking for an accuracy or a time, end to end on a small scene."""

import json

import numpy as np
import pytest

import render
import validation
from tests.commands import ice
from validation.batch import campaign
from validation.batch.options import RunOptions
from validation.cost import locators, sampling, size, watch
from validation.cost.goal import Goal, reach
from validation.cost.trial import trial
from validation.cost.watch import Watch

pytestmark = pytest.mark.render


def test_accuracy_asked_for_is_reached_in_every_setting(small_toml, tmp_path):
    said, options = [], RunOptions(workers=1, out=tmp_path)
    loaded = campaign.load(small_toml)
    found, reached = reach(loaded, Goal(0.15), options, said.append)
    assert reached.widest == pytest.approx(0.15, rel=0.1)
    assert "images a setting" in said[0]
    for row in found.rows:  # what is said of all sources holds at least the interval itself
        low, high = row.main.ratio_interval
        assert (high - low) / 2 <= 1.001 * max(reached.half_widths)
    assert len(set(reached.images)) > 1  # settings stopped on their own
    again, _ = reach(loaded, Goal(0.15), options)  # nothing is left to be done
    assert [row.main.empirical for row in again.rows] == [row.main.empirical for row in found.rows]


def test_images_of_a_later_stage_change_nothing_before(small_toml, tmp_path):
    loaded = campaign.load(small_toml)
    grown = validation.run(loaded, 60, 1, tmp_path / "grown", 1, more=lambda store: [90, 60, 60, 60])
    plain = validation.run(loaded, 60, 1, tmp_path / "plain", 1)
    assert [row.main.n for row in grown.rows] == [90, 60, 60, 60]
    assert [r.main.empirical for r in grown.rows[1:]] == [r.main.empirical for r in plain.rows[1:]]
    assert grown.rows[0].main.empirical != plain.rows[0].main.empirical


def test_the_trial_measures(small_toml):
    found = trial(campaign.load(small_toml), settings=2)
    assert found.image > 0
    assert found.rendered[0].seconds > 0
    assert all(0 < rendered.sigma < 0.2 for rendered in found.rendered)
    assert 0 < found.phase < 0.2
    assert np.isfinite(found.model)
    assert found.model < 0.1


def test_two_goals_are_refused_in_one_line(small_toml):
    done = ice("validate", small_toml, "--budget", "9s", "--accuracy", "0.1")
    line = "--budget must be given without --accuracy, got both (9s, 0.1)"
    assert (done.returncode, done.stderr.strip()) == (2, line)


def test_json_tells_the_goal(small_toml, tmp_path):
    done = ice("validate", small_toml, "--accuracy", "0.8", "--out", tmp_path, "--workers", "1", "--json")
    document = json.loads(done.stdout)
    assert document["goal"]["half_width"] == pytest.approx(0.8, rel=0.1)
    assert set(document["goal"]["errors"]) == {"sampling", "render", "phase", "model"}


def test_a_larger_image_tells_relatively_more(task1, monkeypatch):
    """The parameter `size` of `ice cost`: n times the pixels a side, about n^-1.5 of the relative error."""
    monkeypatch.setattr(size, "_FACTORS", (0.5, 1.0, 2.0))
    monkeypatch.setattr(size, "_IMAGES", 2)
    case = campaign.Campaign.of(task1).case(0)
    found = size.size_parameter(case, "scalar_rgb", 1)
    _, small, large = (row[-1] for row in found.rows)
    # margin: the power is said to be "about" 1.5; half a power more is 40 %
    assert small / large == pytest.approx(2**1.5, rel=0.1)


def test_few_pictures_are_in_memory_and_the_fewest_taken_when_time_is_over(task1, monkeypatch):
    """Of `ice cost`: as for 25 pictures of task1 at once, and no time."""
    case, counts = campaign.Campaign.of(task1).case(0), []
    image = render.image(task1, case.setting.sensor, case.setting.light, variant="scalar_rgb")
    monkeypatch.setattr(watch, "AT_ONCE", 25 * image.size)
    exposed = render.expose
    monkeypatch.setattr(render, "expose", lambda *how: counts.append(how[3]) or exposed(*how))
    found = sampling.images_parameter(case, image, 1, Watch(0.0))
    assert [row[0] for row in found.rows] == [10, 20, 40, 80]
    assert (max(counts), sum(counts)) == (25, 825)
    counts.clear()
    found = locators.estimators_parameter([case], [image], 1, Watch(0.0))
    assert (max(counts), sum(counts)) == (25, 25)
    assert found.note.startswith("25 images of 1 settings")
