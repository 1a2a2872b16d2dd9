"""What holds where nobody says otherwise is said once."""

import inspect

import pytest

from planner import plan
from validation import run
from validation.cli.batch import validate_command
from validation.cli.calibrate import calibrate_command
from validation.cli.cost import cost_command
from validation.cli.plan import plan_command
from validation.cost.goal import reach
from validation.cost.sweep import sweep
from validation.cost.trial import trial


@pytest.mark.parametrize("function", [run, reach, sweep, trial, validate_command, cost_command, calibrate_command])
def test_one_seed(function):
    """A run from Python and one from the command line give the same numbers."""
    assert inspect.signature(function).parameters["seed"].default == 1995


def test_one_start():
    """The alternating search begins at the paper's pose, from Python and from the command line."""
    assert inspect.signature(plan).parameters["start"].default == (40, 41)
    assert inspect.signature(plan_command).parameters["start"].default == "40,41"
