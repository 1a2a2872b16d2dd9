"""How a circle is found again in a picture of another station: the fit of its rim, and where there is none."""

from dataclasses import replace

import numpy as np
import pytest

import scenes
from imaging.features.circles import RimImage
from planner.budgeting.features import _fit
from planner.budgeting.station import Station, records

POINTS = 7


def test_stations_are_recorded_together(rng):
    """From straight above, by a pinhole's formula: of two cameras, part and axis beside their places, turned."""
    scene = scenes.load("task1")
    scene = scene.with_(camera={**scene.camera.model_dump(), "lens": {}, "look_at": (0.0, 0.0, 0.0), "roll_deg": 0.0})
    other = scene.with_(camera={**scene.camera.model_dump(), "focal_px": 1.5 * scene.camera.focal_px})
    here = Station(scene, np.zeros(2), ())
    moved = replace(here, shift=(0.3, -0.2, 0.5), principal_px=(2.0, -3.0), stretch=(1.01, 0.98))
    stations = [here, replace(moved, scene=other), moved, replace(moved, roll_deg=90.0)]
    points = rng.uniform(-1, 1, (5, 3))
    x, y, z = (points + np.array(moved.shift)).T
    width, height, distance = scene.camera.width, scene.camera.height, scene.camera.distance
    middle = np.array([width - 1, height - 1]) / 2
    scale = scene.camera.focal_px / (distance - z)
    aside = middle + np.array(moved.principal_px)
    found = records(stations, points)
    plain = middle + scene.camera.focal_px * points[:, 1::-1] / (distance - points[:, 2:])
    assert found[0] == pytest.approx(plain, abs=1e-9)
    assert found[2] == pytest.approx(aside + np.stack([1.01 * scale * y, 0.98 * scale * x], -1), abs=1e-9)
    assert found[1] - aside == pytest.approx(1.5 * (found[2] - aside), abs=1e-9)
    assert found[3] == pytest.approx(aside + np.stack([1.01 * scale * x, -0.98 * scale * y], -1), abs=1e-9)


def rim(rng, **parts):
    """Seven points of uneven arcs and contrasts, of which all are seen well, and three parameters."""
    made = {
        "design": rng.normal(size=(POINTS, 3)), "arc": rng.uniform(0.5, 2, POINTS),
        "squared": rng.uniform(400, 900, POINTS), "noise_variance": 2.5, "known": np.ones(POINTS),
    }  # fmt: skip
    return RimImage(**(made | parts))


def test_the_fit_weighs_by_contrast_and_arc(rng):
    """Against NumPy's least squares of rows scaled by the weights' roots."""
    seen, offsets = rim(rng), rng.normal(size=POINTS)
    root = np.sqrt(seen.squared / seen.noise_variance * seen.arc)
    expected = np.linalg.lstsq(seen.design * root[:, None], offsets * root, rcond=None)[0]
    assert _fit(seen) @ offsets == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("how", ["disturbed", "weak"])
def test_points_that_are_not_found_have_no_weight(rng, how):
    """Disturbed ones, and those below five sigma of contrast: 62.5 squared here."""
    seen = rim(rng)
    if how == "disturbed":
        other = RimImage(**{**vars(seen), "known": 1.0 * (np.arange(POINTS) != 4)})
    else:
        other = RimImage(**{**vars(seen), "squared": np.where(np.arange(POINTS) == 4, 62.4, seen.squared)})
    fit = _fit(other)
    assert np.flatnonzero(np.abs(fit).max(0) == 0).tolist() == [4]
    kept = np.arange(POINTS) != 4
    assert fit @ seen.design == pytest.approx(np.eye(3), abs=1e-9)
    assert fit[:, kept].shape == (3, 6)


@pytest.mark.parametrize("how", ["nothing seen", "a column of zeros", "two columns alike"])
def test_a_rim_that_tells_no_circle_is_found_nowhere(rng, how):
    """NaN for each of the three parameters and seven points."""
    seen = rim(rng)
    changed = {"squared": np.zeros(POINTS)} if how == "nothing seen" else {"design": seen.design.copy()}
    if how == "a column of zeros":
        changed["design"][:, 1] = 0
    if how == "two columns alike":
        changed["design"][:, 1] = 3 * changed["design"][:, 0]
    found = _fit(RimImage(**{**vars(seen), **changed}))
    assert found.shape == (3, POINTS)
    assert np.isnan(found).all()
