"""Sensitivities of the budget against central differences of measured pictures."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import measure
import scenes
from imaging.pictures import Pictures
from measure.believed import believed
from planner.budgeting.features import Features
from planner.budgeting.sensitivities import sensitivities
from planner.budgeting.sources import sources
from planner.budgeting.station import Station
from validation.stations import clean_image

_BENT = "camera.lens.distortion[0]"
_NUMBERS = {"camera.focal_px": 2.0, "camera.distance": 0.1, "camera.look_at[2]": 0.05, _BENT: 0.02}
_BESIDE = scenes.Uncertainty(
    sensor_deg=0.1, sensor_roll_deg=0.2, part_shift=0.05, part_tilt_deg=0.1, principal_point_px=1.0
)


@lru_cache
def _known() -> tuple[scenes.Picture, Features, tuple, np.ndarray]:
    uncertain = tuple(scenes.UncertainNumber(key=key, sd=sd) for key, sd in _NUMBERS.items())
    scene = scenes.load("task1").model_copy(update={"uncertain": uncertain, "uncertainty": _BESIDE})
    picture = scenes.Picture.of(scene, (30, 135), (15, 315))
    features = Features(Pictures.of(picture))
    given = sources(scene)
    return picture, features, given, sensitivities(features, given, biased=False)


_SEEN = [*_NUMBERS, "sensor_deg.polar", "sensor_roll_deg", "part_tilt_deg.x", "part_shift.z"]


@pytest.mark.parametrize("name", _SEEN)
def test_sensitivities_are_those_of_measured_pictures(name: str) -> None:
    """A block of 12.5 x 7.5 x 2.5 cm seen at 30 degrees, its pictures exact, measured by ``arrangement``: 1 %, and
    5 % for the distortion, which bends edges that the estimator takes for straight."""
    picture, features, given, slopes = _known()
    which = [source.name for source in given].index(name)
    source, here = given[which], Station.nominal(features.pictures)
    step = source.told.u / 2
    images = np.stack([clean_image(source.moved(here, sign * step)) for sign in (1, -1)])
    ahead, behind = measure.measure(images, picture).value[:, 0]
    assert (ahead - behind) / (2 * step) == pytest.approx(slopes[0, which], rel=5e-2 if name == _BENT else 1e-2)


def test_what_moves_along_with_the_part_is_no_error() -> None:
    """Shifts in the plane and a turn about its normal leave a length as it is."""
    _, _, given, slopes = _known()
    names = [source.name for source in given]
    harmless = [names.index(name) for name in ("part_shift.x", "part_shift.y", "part_tilt_deg.z")]
    assert np.abs(slopes[0, harmless]).max() < 1e-9


def test_linear_and_nonlinear_values_agree() -> None:
    """Of a plate with a hole: five measurands by eleven inputs, through lines and circles."""
    scene = scenes.load("plate").model_copy(update={"uncertainty": _BESIDE})
    picture = scenes.Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
    features = Features(Pictures.of(picture))
    given, here = sources(scene), Station.nominal(features.pictures)
    slopes = sensitivities(features, given, biased=False)
    sizes = np.array([source.told.u for source in given]) / 10
    moved = [s.moved(here, sign * size) for s, size in zip(given, sizes, strict=True) for sign in (1, -1)]
    values = believed(picture, features.errors(moved)).reshape(len(given), 2, -1)
    differences = (values[:, 0] - values[:, 1]) / (2 * sizes[:, None])
    assert np.abs(differences - slopes.T).max() < 1e-5 * np.abs(slopes).max()
    assert np.abs(1.3 * differences - slopes.T).max() > 1e-2 * np.abs(slopes).max()
