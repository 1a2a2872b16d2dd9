"""``ice measure --together``."""

import json

import numpy as np
import pytest

import render
import scenes
from imaging.blurred.whole import image
from tests.commands import ice


def test_several_pictures_are_adjusted_together(tmp_path):
    """Three pictures of known sensors are one measurement, corrected, with U; what has no meaning together is told."""
    scene, files = scenes.load("task1"), []
    for k, sensor in enumerate(((30, 135), (30, 160), (45, 110))):
        clean = image(scenes.Picture.of(scene, sensor, (15, 315)))
        np.save(tmp_path / f"{k}.npy", render.expose(clean, scene.noise, np.random.default_rng(k), 1)[0])
        files.append(f"{tmp_path / f'{k}.npy'} {sensor[0]},{sensor[1]} 15,315")
    first = [str(tmp_path / "0.npy"), "task1", "--sensor", "30,135", "--light", "15,315"]
    also = [word for file in files[1:] for word in ("--also", file)]
    told = json.loads(ice("measure", *first, *also, "--together", "known", "--json").stdout)
    (row,) = told["measurands"]
    assert row["status"] == "ok"
    assert abs(row["value"] - row["nominal"]) < 5 * row["sigma"]
    assert row["u_bias"] < row["sigma"]
    assert row["U"] > 1.9 * row["sigma"]
    plain = json.loads(ice("measure", *first, *also, "--together", "known", "--as-measured", "--json").stdout)
    assert (plain["measurands"][0]["u_bias"], plain["measurands"][0]["U"]) == (None, None)
    assert plain["measurands"][0]["value"] == pytest.approx(row["value"] + row["bias"], abs=0.02 * row["sigma"])
    assert {point["name"] for point in told["points"]} >= {"v3", "v6"}
    open_ = ice("measure", *first, *also[:2], "--together", "unknown")
    assert open_.returncode == 1
    assert "unplaced" in open_.stdout
    for words, says in (
        (["--together", "known"], "--together must be used with --also, got 'known' alone"),
        ([*also, "--together", "sure"], "--together must be one of known, uncertain, unknown, got 'sure'"),
        ([*also, "--together", "known", "--serial", "7"], "--serial must be left out with --together, got it"),
    ):
        wrong = ice("measure", *first, *words)
        assert wrong.returncode == 2
        assert says in wrong.stderr
