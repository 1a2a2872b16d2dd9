"""`ice msa`: a station's measurement system before it exists, and a study beside it."""

import json

import numpy as np

from tests.commands import ice

ASKED = ("msa", "calibrated_rig", "--json")


def test_a_study_is_compared_component_by_component(tmp_path):
    done = ice(*ASKED)
    assert done.returncode == 0, done.stderr
    (told,) = json.loads(done.stdout)["measurands"]
    assert told["study"] is None
    rng, name = np.random.default_rng(7), told["name"]
    for times, status, wrong in ((1.0, 0, []), (2.5, 1, ["repeats"])):
        values = told["operators"] * rng.standard_normal((3, 1, 1)) + 0.01 * rng.standard_normal((1, 10, 1))
        values = 10 + values + times * told["repeats"] * rng.standard_normal((3, 10, 3))
        lines = [f"{o},{p},{values[o, p, r]}" for o in range(3) for p in range(10) for r in range(3)]
        (tmp_path / "study.csv").write_text("\n".join([f"operator,part,{name}", *lines]))
        found = ice(*ASKED, "--study", tmp_path / "study.csv")
        assert found.returncode == status, found.stderr
        (row,) = json.loads(found.stdout)["measurands"]
        assert row["study"]["too_large"] == wrong
        printed = ice(*ASKED[:2], "--study", tmp_path / "study.csv")
        assert ("larger than predicted: repeats" in printed.stdout) == bool(wrong)


def test_what_a_study_can_find_is_told_of_its_size():
    """Two parts tell little of repeats; the smallest study that does is told."""
    likely = {}
    for size in ("2,2,2", "3,10,3"):
        (row,) = json.loads(ice(*ASKED, "--size", size).stdout)["measurands"]
        told = row["found_if_doubled"]
        assert ",".join(str(told[key]) for key in ("operators", "parts", "repeats")) == size
        likely[size] = told["components"]["repeats"]
    assert likely["2,2,2"] < 0.7  # margin: 0.46
    assert likely["3,10,3"] > 0.99  # margin: 1.0
    assert set(row["smallest_study"]) == {"operators", "parts", "repeats"}
    refused = ice("msa", "calibrated_rig", "--size", "3,1,3")
    assert (refused.returncode, refused.stderr) == (
        2, "--size must be of 2 to 1000 operators, parts and repeats, got '3,1,3'\n",
    )  # fmt: skip


def test_costs_come_together():
    refused = ice("msa", "calibrated_rig", "--cost-accepted", "10")
    assert (refused.returncode, refused.stderr) == (
        2, "--cost-accepted must be used with --cost-rejected, got one of them\n",
    )  # fmt: skip
