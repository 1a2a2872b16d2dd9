"""Telecentric cameras through commands and pages, and one picture of their proof."""

import json

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from scenes import InvalidInput, Picture
from scenes.files.door import read_toml
from tests.commands import ice
from tests.proofs import kinds
from tests.proofs.telecentric import VALUES
from validation import copied_scene, fitted_scene
from validation.explore import preview

pytestmark = pytest.mark.render


def test_a_shafts_picture_scatters_as_propagated():
    """Tilted by 15 degrees, chief rays leaning by -0.3 degrees: variances inside the Sidak 1 %, means the shaft's."""
    small = {"width": 240, "height": 100, "pixel_pitch_um": 18.8, "telecentricity_deg": -0.3}
    scene = scenes.load("telecentric_shaft").with_(camera=small)
    rows, _ = kinds.rows(Picture.of(scene, (15, 80)), 150, np.random.default_rng(3), 3000, VALUES[scene.name])
    assert len(rows) == sum(row.counts for row in rows) == 3
    assert all(row.holds(len(rows)) for row in rows), [str(row) for row in rows]
    assert all(row.is_true for row in rows), [str(row) for row in rows]
    assert not any(row.holds(len(rows), 3.0) for row in rows)  # negative control


def test_a_telecentric_plate_is_predicted():
    told = json.loads(ice("predict", "telecentric_plate", "--json").stdout)
    assert [each["name"] for each in told["settings"][0]["measurands"]] == [*VALUES["telecentric_plate"]]
    for setting in told["settings"]:
        for each in setting["measurands"]:
            assert each["status"] == "ok"
            assert each["value"] == pytest.approx(VALUES["telecentric_plate"][each["name"]], abs=1e-6)


def test_a_preview_shows_the_part_as_large_however_near_it_is():
    """Drawn and by rays: dark pixels before the backlight; with leaning chief rays a nearer part looks larger."""
    plate = scenes.load("telecentric_plate")
    part = preview.Window(0, 0, plate.camera.width, plate.camera.height)

    def dark(angle, height):
        look_at = (*plate.camera.look_at[:2], plate.camera.look_at[2] - height)
        scene = plate.with_(camera={"telecentricity_deg": angle, "look_at": look_at}, uncertain=())
        return int((preview.drawn(scene, Picture.of(scene, (0, 90)), part) < 60).sum())

    assert dark(0.0, 20.0) == dark(0.0, 0.0)
    area = (24 * 18 - np.pi * (9 + 4 + 4)) * (0.18 / 9.9e-3 * part.scale) ** 2
    assert dark(0.0, 0.0) == pytest.approx(area, rel=0.01)
    assert dark(1.0, 20.0) > 1.02 * dark(1.0, 0.0)


def test_a_fit_tells_the_magnification(tmp_path):
    """In place of the distance, which changes nothing: 4 per cent off, with the pose, told within its errors."""
    lens = {"kind": "telecentric", "width": 256, "height": 240, "magnification": 0.004, "pixel_pitch_um": 5.0,
            "working_distance_mm": 1000.0, "telecentricity_deg": 0.2, "blur_px": 0.7, "exposure": 200.0}  # fmt: skip
    block = copied_scene.write({**read_toml(scenes.find("task1")), "camera": lens}, scenes.find("task1"),
                               tmp_path / "block.toml", "--output", "")  # fmt: skip
    true = {"camera.magnification": 0.00416, "camera.roll_deg": 3.0, "camera.blur_px": 0.8, "camera.exposure": 190.0,
            "sensor.polar": 33.0, "sensor.azimuth": 125.0, "light.polar": 25.0, "light.azimuth": 295.0}  # fmt: skip
    here = block.with_(**{key: value for key, value in true.items() if key.startswith("camera")})
    picture = Picture.of(here, (33, 125), (25, 295))
    shots = render.expose(planner.image(picture), here.noise, np.random.default_rng(4), 3)
    found = measure.fit(block, list(shots), (30, 120), (30, 300))
    assert set(found.statuses) == {"ok"}
    at = [found.names.index(key) for key in true]
    off, sigma = found.values[at] - list(true.values()), np.sqrt(np.diag(found.covariance))[at]
    assert np.abs(off / sigma).max() < 4.0
    assert sigma[0] < 1e-3 * true["camera.magnification"]
    written = fitted_scene.write(found, str(tmp_path / "block.toml"), tmp_path / "fitted.toml").camera
    assert (written.magnification, written.focal_px) == pytest.approx(
        (found.values[at[0]], found.scene.camera.focal_px)
    )


def test_a_telecentric_camera_has_no_focal_length_to_fit():
    block = scenes.load("task1")
    lens = {"kind": "telecentric", "width": 256, "height": 240, "magnification": 0.03, "pixel_pitch_um": 20.0,
            "working_distance_mm": 1000.0, "look_at": block.camera.look_at}  # fmt: skip
    with pytest.raises(InvalidInput, match="free must be some of k1, got 'focal'"):
        measure.fit(block.with_(camera=lens), [np.zeros((240, 256))], free=("focal",))
