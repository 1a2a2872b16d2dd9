"""Does this code still measure what it measured when the reference was stored? `make reference` stores a new one."""

from pathlib import Path

import pytest

from validate import campaign, comparison, run
from validate.cli import app
from validate.export import write_json

pytestmark = pytest.mark.render

REFERENCE = Path(__file__).with_name("reference.json")
RENDERS = 500


def compare_with_reference(scenes, directory):
    """Exit status and output of ``ice compare``."""
    write_json(run(scenes, renders=RENDERS, seed=1, out=directory, workers=1), directory / "result.json")
    with pytest.raises(SystemExit) as ended:
        app(["compare", str(REFERENCE), str(directory)])
    return ended.value.code


def test_nothing_has_changed_beyond_chance(tmp_path, capsys):
    status = compare_with_reference(campaign.load(REFERENCE.with_suffix(".toml")), tmp_path)
    assert status == 0, capsys.readouterr().out
    settings = comparison.read(REFERENCE)["settings"]
    assert [row["n"] - row["failed"] for row in settings] == [RENDERS] * 4  # the reference itself measured something


def test_a_worse_sensor_is_noticed(tmp_path, capsys):
    """Negative control: noise 1.25 x larger in one setting of four, the result under the old setting's name."""
    loaded = campaign.load(REFERENCE.with_suffix(".toml"))
    scene = loaded.scenes[0]
    noisier = scene.model_copy(update={"noise": scene.noise.model_copy(update={"sigma": 1.25 * scene.noise.sigma})})
    grid = loaded.grid.model_copy(update={"sensor_polar": (25.0,), "light_azimuth": (300.0,)})
    changed = loaded.model_copy(update={"scenes": (noisier,), "grid": grid})
    assert compare_with_reference(campaign.Campaign.model_validate(changed.model_dump(mode="json")), tmp_path) == 1
    assert "gradient: variance" in capsys.readouterr().out
