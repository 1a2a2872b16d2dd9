"""How well a splined lens is known as an input of a budget: against its calibration, drawn lenses, files."""

import json

import numpy as np
import pytest

import measure
import planner
import scenes
from imaging.bundles.bundle import Bundle
from imaging.bundles.unknowns import Freedom
from imaging.geometry.lens import image_centre, undistorted
from imaging.geometry.projection import project, rays, sensor_position
from imaging.models import variance_model
from imaging.pictures import Pictures
from measure.boards.projections import rays_of
from planner.budgeting.features import Features
from planner.budgeting.sources import sources
from planner.budgeting.station import Station
from scenes import InvalidInput, Picture
from tests.boards import SMALL, poses
from tests.unit.test_splined import SHAPE, Wavy, boards
from validation.report import camera_table

EXTENT, CONTROL = (-0.6, -0.6, 0.6, 0.6), (5, 7)
SENSOR, LIGHT = (30.0, 135.0), (15.0, 315.0)


def rows(rng, size):
    """Control points of a field with bends, as smooth as a lens."""
    y, x = (np.linspace(-1, 1, count) for count in CONTROL)
    return (size * np.vander(y, 4) @ rng.standard_normal((4, 4)) @ np.vander(x, 4).T).tolist()


def scene_with(rng, size=2e-4, count=9):
    bent = {"right": rows(rng, 0.005), "down": rows(rng, 0.005)}
    lens = {"kind": "splined", "plane": "normalised", "extent": EXTENT, **bent}
    modes = [{"focal_px": float(rng.normal()), "right": rows(rng, size), "down": rows(rng, size)} for _ in range(count)]
    return scenes.load("task1").with_(camera={"lens": lens}, uncertainty={"lens_modes": modes})


@pytest.fixture(scope="module")
def scene():
    return scene_with(np.random.default_rng(2))


@pytest.fixture(scope="module")
def calibrated():
    given = boards(Wavy(1.5), poses(SMALL, 12, np.random.default_rng(5), 420.0), np.random.default_rng(6))
    return measure.calibrate_camera(given, SMALL.square, SHAPE, "splined:6x5")


def test_modes_move_the_image_as_the_calibration_says(calibrated):
    """Covariance of images of rays, from each mode's lens by differences; the largest first."""
    places = np.random.default_rng(3).uniform([30, 30], [290, 210], (12, 2))
    seen = rays_of(calibrated, places)
    seen = seen[np.isfinite(calibrated.lens.spline.bent(seen[:, :2] / seen[:, 2:])).all(1)]
    assert len(seen) > 8
    by_values = calibrated.model.seen(calibrated.values, seen)[1].reshape(2 * len(seen), -1)
    wanted = by_values @ calibrated.covariance @ by_values.T
    lens, flat = calibrated.lens.spline, seen[:, :2] / seen[:, 2:]
    moved = []
    for mode in calibrated.lens_modes:
        one, other = (
            (calibrated.values[0] + step * mode.focal_px) * mode.moved(lens, step).bent(flat) for step in (0.5, -0.5)
        )
        moved.append((one - other).ravel())
    told = np.transpose(moved) @ moved
    assert told == pytest.approx(wanted, abs=1e-4 * np.diag(wanted).max())
    assert len(moved) > 20
    few = np.transpose(moved[5:]) @ moved[5:]  # negative control: without the first five
    assert np.diag(few).max() < 0.9 * np.diag(wanted).max()


def on_top(camera, sensor, image):
    """Where places (n, 2) in the image lie on the plane of the block's top, (n, 2)."""
    at, ray = sensor_position(camera, sensor), rays(undistorted(image, camera) - image_centre(camera), sensor, camera)
    return (at + ray * ((2.5 - at[2]) / ray[:, 2:]))[:, :2]


def meeting(first, second):
    """Where straight lines through places (n, 2) meet."""
    lines = []
    for places in (first, second):
        normal = np.linalg.svd(places - places.mean(0))[2][1]
        lines.append((*normal, normal @ places.mean(0)))
    rows = np.array(lines)
    return np.linalg.solve(rows[:, :2], rows[:, 2])


def test_a_budget_has_what_other_lenses_do(scene):
    """A distance between lines' meetings, measured by the lens as it is said in pictures of lenses with some of one
    error, by differences.

    Negative control: half of the errors.
    """
    picture, sensor = Picture.of(scene, SENSOR, LIGHT), np.array(SENSOR)
    (told,) = (row for row in planner.budget(picture)["distance"].contributions if row.source == "camera calibration")
    along = np.linspace(0.03, 0.97, 30)[:, None]
    ends = [scene.solid.vertices[list(scene.solid.edge(name).ends)] for name in ("e4", "e9", "e7", "e11")]
    points = np.array([(1 - along) * one + along * other for one, other in ends])

    def measured(mode, step):
        lens, focal = mode.moved(scene.camera.lens, step), scene.camera.focal_px + step * mode.focal_px
        camera = scene.camera.tried(lens=lens, focal_px=focal)
        edges = [on_top(scene.camera, sensor, project(each, sensor, camera)) for each in points]
        return np.linalg.norm(meeting(*edges[:2]) - meeting(*edges[2:]))

    slopes = np.array([(measured(each, 0.1) - measured(each, -0.1)) / 0.2 for each in scene.uncertainty.lens_modes])
    assert told.contribution == pytest.approx(np.linalg.norm(slopes), rel=0.01)
    assert told.contribution > 1.1 * np.linalg.norm(slopes[::2])


def _noise(picture):
    return variance_model("calibrated")(Pictures.of(picture)).of_features


def test_several_pictures_have_them_as_unknowns_of_their_camera(scene):
    """What each error does to pictures' lines, by the budget's recorded points, moves a value as far as the adjustment
    says that it may be off by it; one camera is another thing than two."""
    pictures = [Picture.of(scene, (30.0, azimuth), LIGHT) for azimuth in (135.0, 225.0)]
    noise, moved = [_noise(each) for each in pictures], 0.0
    adjusted = Bundle.of(pictures, Freedom("known")).adjusted(noise)
    for picture, pull in zip(pictures, adjusted.by_features, strict=True):
        features, rows = Features(Pictures.of(picture)), []
        here = Station.nominal(features.pictures)
        for each in (one for one in sources(scene) if one.name.startswith("lens mode")):
            ahead, behind = features.errors([each.moved(here, 0.01), each.moved(here, -0.01)])
            rows.append((ahead - behind) / 0.02)
        moved = moved + pull @ np.transpose(rows)
    told = adjusted.by_priors["camera"]
    assert told.shape == moved.shape == (1, 9)
    assert np.abs(told + moved).max() < 0.005 * np.abs(told).max()  # 0.0011 is found; the signs are opposite
    apart = Bundle.of(pictures, Freedom("known", cameras="each")).adjusted(noise).known_before
    assert adjusted.known_before["camera"] > 1.05 * np.hypot(apart["camera 1"], apart["camera 2"])
    budget, told = planner.bundle_budget(pictures, "known")["distance"], planner.predict_bundle(pictures, "known")
    (row,) = (row for row in budget.contributions if row.source == "camera")
    assert row.contribution == pytest.approx(told.known_before["camera"][0])
    assert not any(row.source.startswith("lens mode") for row in budget.contributions)


def test_what_modes_cannot_be_is_told_in_a_line(scene, tmp_path):
    told = [mode.model_dump() for mode in scene.uncertainty.lens_modes]
    with pytest.raises(InvalidInput, match=r"lens_modes must be left out unless camera\.lens is splined, got brown_co"):
        scenes.load("task1").with_(uncertainty={"lens_modes": told})
    with pytest.raises(InvalidInput, match="must have 5 rows of 7 control points as the lens, got others in down of"):
        scene.with_(uncertainty={"lens_modes": [told[0], told[1] | {"down": told[1]["down"][:4]}]})
    with pytest.raises(InvalidInput, match=r"uncertainty\.covariance must be left out with lens_modes, got both"):
        scene.with_(uncertainty={"covariance": {"names": ["fx"], "matrix": [[1.0]]}})
    fewer = scene.with_(uncertainty={"lens_modes": told[:8]})
    two = [Picture.of(each, (30.0, azimuth), LIGHT) for each, azimuth in ((scene, 135.0), (fewer, 225.0))]
    with pytest.raises(InvalidInput, match=r"of one camera must be of the same uncertainty\.lens_modes, got others"):
        Bundle.of(two, Freedom("known"))
    assert Bundle.of(two, Freedom("known", cameras="each")).adjusted([_noise(each) for each in two]).is_told.all()
    given = boards(Wavy(0.0), poses(SMALL, 8, np.random.default_rng(5), 420.0), np.random.default_rng(7))
    plain = measure.calibrate_camera(given, SMALL.square, SHAPE)
    with pytest.raises(InvalidInput, match="model must be splined for modes of its lens"):
        _ = plain.lens_modes


def test_what_a_calibration_writes_is_what_a_scene_reads(calibrated, tmp_path):
    """Lens and modes, by the lines that the command prints; a file that has none is named."""
    beside, scene = tmp_path / "lens_modes.json", tmp_path / "scene.toml"
    beside.write_text(camera_table.uncertainty_file(calibrated))
    text = scenes.find("task1").read_text().replace("width = 256\nheight = 240", "width = 320\nheight = 240")
    scene.write_text(text)
    lines = camera_table.scene_lines(calibrated, str(scene), beside).replace("[camera]\n", "")
    camera, rest = lines.split("\n", 1)
    scene.write_text(f"{text.replace('focal_px = 800.0', camera)}\n{rest}\n")
    told = scenes.load(str(scene))
    assert told.camera.lens == calibrated.lens.spline
    assert told.uncertainty.lens_modes == calibrated.lens_modes
    beside.write_text(json.dumps({"names": []}))
    with pytest.raises(InvalidInput, match=r"lens_modes\.json: modes must be a list, got NoneType"):
        scenes.load(str(scene))
