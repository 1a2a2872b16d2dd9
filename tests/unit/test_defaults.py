"""What holds where nobody says otherwise is said once."""

import inspect

import pytest

from measure.features.optics import Optics
from planner import plan
from scenes import Locator, Noise
from validation import run
from validation.batch.options import RunOptions
from validation.cli.batch import validate_command
from validation.cli.calibrate import calibrate_command
from validation.cli.cost import cost_command
from validation.cli.plan import plan_command
from validation.cost.goal import reach
from validation.cost.sweep import sweep
from validation.cost.trial import trial


@pytest.mark.parametrize("function", [run, RunOptions, sweep, validate_command, cost_command, calibrate_command])
def test_one_seed(function):
    """A run from Python and one from the command line give the same numbers."""
    assert inspect.signature(function).parameters["seed"].default == 1995


@pytest.mark.parametrize("function", [reach, trial])
def test_one_record_of_options(function):
    assert inspect.signature(function).parameters["options"].default == RunOptions()


def test_one_start(task1):
    """The alternating search begins at the paper's pose, from Python and from the command line."""
    found, given = (
        plan(task1, search="alternating", step_deg=30, refined=False, **start) for start in ({}, {"start": (40, 41)})
    )
    assert found.poses == given.poses
    assert inspect.signature(plan).parameters["start"].default == (40, 41)
    assert inspect.signature(plan_command).parameters["start"].default == "40,41"


def test_one_locator():
    """Optics that nobody describes have the settings of a scene that nobody describes."""
    optics, locator = Optics((10, 10)), Locator()
    assert (optics.scale_px, optics.window_px) == (locator.scale_px, locator.window_px) == (1.0, 3.0)
    assert (optics.noise_variance, optics.dark_level, optics.sensor) == (1.0, 0.0, Noise(sigma=1.0))
