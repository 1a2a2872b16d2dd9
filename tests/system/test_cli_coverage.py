"""`ice plan` of a part whose requirements no one picture sees: the fewest pictures that do."""

import json

import pytest

from tests.commands import ice
from tests.sides import written

pytestmark = pytest.mark.render


def test_a_plan_of_what_no_picture_sees_says_how_many_do(tmp_path):
    done = ice("plan", written(tmp_path, "front", "back"), "--step", "30", "--json")
    assert done.returncode == 1, done.stderr
    told = json.loads(done.stdout)["coverage"]
    assert [picture["measures"] for picture in told["pictures"]] in (
        [["front"], ["back"]], [["back"], ["front"]],
    )  # fmt: skip


def test_coverage_is_printed(tmp_path):
    file = written(tmp_path, "front", "back", "top")
    done = ice("plan", file, "--step", "30", "--coverage")
    assert done.returncode == 0, done.stderr
    assert "2 pictures measure all 3 measurands; no one picture of the grid does." in done.stdout.replace("\n", " ")
    refused = ice("plan", file, "--coverage", "--views", "2")
    assert refused.returncode == 2
    assert "--views must be left out with --coverage" in refused.stderr
    lost = ice("plan", file, "--step", "30", "--coverage", "--sensor", "0,0")
    assert lost.returncode == 1
    assert "front: not_visible (the camera does not see e2 and e3" in lost.stdout
