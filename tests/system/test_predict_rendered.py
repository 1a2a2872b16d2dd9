"""``ice predict --render``: what a simulation tells stands where the formulas' numbers stood, each in its place."""

import json

import numpy as np
import pytest

import measure
import scenes
from tests.commands import ice
from validation import budgets

POSE = ("--sensor", "31,137", "--light", "17,311")


@pytest.fixture
def told(monkeypatch):
    """Of the quantities of plate: no two numbers are alike; the last is not known."""
    quantities = scenes.load("plate").quantities
    count = len(quantities)
    number = np.arange(1.0, count + 1)
    made = measure.Correction(
        quantities, "gradient", None, 1e-3 * number, 2e-2 * number, {"rendering": 3e-4 * number},
        {"rendering": 4e-3 * number}, np.diag((5e-3 * number) ** 2), np.diag((6e-2 * number) ** 2),
        ("ok",) * (count - 1) + ("short",),
    )  # fmt: skip
    asked = []
    monkeypatch.setattr(budgets, "simulated", lambda picture: asked.append(picture) or made)
    return made, asked


def test_every_number_is_the_simulations(told):
    made, asked = told
    found = json.loads(ice("predict", "plate", *POSE, "--render", "--json").stdout)
    (picture,) = asked
    assert (tuple(picture.sensor), tuple(picture.lights[0])) == ((31, 137), (17, 311))
    assert found["rendered"] is True
    assert found["settings"][0]["status"] == "short"
    rows = found["settings"][0]["measurands"]
    for key, column in (
        ("variance", made.sigma**2), ("bias", made.bias), ("u_bias", made.u_bias), ("bias_image", made.bias_image),
        ("variance_image", np.diag(made.covariance_image)),
    ):  # fmt: skip
        assert [row[key] for row in rows] == pytest.approx(list(column), rel=1e-12)
    assert [row["status"] for row in rows] == list(made.status)


def test_the_table_tells_bias_and_its_uncertainty(told):
    text = ice("predict", "plate", *POSE, "--render").stdout
    assert "0.001 ± 0.0003" in text
    assert "by simulated pictures" in text
    assert "`--render`" not in text


def test_clutter_names_the_option():
    """Where a formula doubts, a simulation may not; without doubt nothing is named."""
    assert "`--render` simulates" in ice("predict", "grey_floor").stdout
    assert "`--render`" not in ice("predict", "task1").stdout


def test_of_another_model_nothing_is_simulated():
    done = ice("predict", "task1", "--render", "--model", "paper")
    assert done.returncode == 2
    assert "--render must be left out with --model paper, got both" in done.stderr
