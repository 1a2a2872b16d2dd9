"""What is reported of several quantities, and pictures that are taken from poses of their own."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from measure import measurands
from render import series
from scenes import Jitter, Noise, Pose


@pytest.mark.parametrize("lead", [(2,), (), (2, 1)])
def test_only_what_is_measured_has_a_value(lead, task1, rng, monkeypatch):
    """NaN beside it, and infinite variances; covariances only between what both are measured."""
    images, quantity = int(np.prod(lead)), task1.quantities[0]
    quantities = (quantity, replace(quantity, nominal=7.5), quantity)
    status = np.array([["ok", "low_contrast", "misfit"], ["clutter", "ok", "not_visible"]])[:images]
    image, plane = (
        SimpleNamespace(value=rng.random((images, 3)), covariance=rng.random((images, 3, 3))) for _ in range(2)
    )
    known = SimpleNamespace(quantities=quantities, value_object=np.array([1.0, 2.0, 3.0]))
    p_value = rng.random(images)
    found = SimpleNamespace(
        known=known,
        status=status,
        image=image,
        plane=plane,
        shape=SimpleNamespace(p_value=p_value),
        forms={},
        placed=np.einsum("ni,nj->nij", *[rng.random((images, 3))] * 2),
    )
    first = object()
    monkeypatch.setattr(measurands, "of_first", lambda *given: (first, *given))
    picture = SimpleNamespace(scene=task1)
    saturated = np.arange(images) + 3
    told = measurands._gathered(found, picture, "strip", saturated, lead)
    assert told.estimator == "strip"
    assert told.saturated.tolist() == saturated.reshape(lead).tolist()
    assert told.u_bias.shape == (*lead, 3)
    assert (told.u_placed**2).ravel() == pytest.approx(found.placed[:, range(3), range(3)].ravel())
    assert told.first == (first, found, picture, lead)
    assert told.units == ("cm",) * 3
    own = quantity.nominal if quantity.nominal is not None else 1.0
    assert told.nominal.tolist() == [own, 7.5, quantity.nominal if quantity.nominal is not None else 3.0]
    assert told.status.shape == told.value.shape == told.value_image.shape == (*lead, 3)
    assert told.p_value.shape == lead
    assert told.p_value.ravel() == pytest.approx(p_value)
    for n in range(images):
        good = [state in ("ok", "clutter", "misfit") for state in status[n]]
        for part, values, covariances in (
            (image, told.value_image, told.covariance_image), (plane, told.value, told.covariance)
        ):  # fmt: skip
            values, covariances = values.reshape(images, 3)[n], covariances.reshape(images, 3, 3)[n]
            for i in range(3):
                assert values[i] == part.value[n, i] if good[i] else np.isnan(values[i])
                for j in range(3):
                    if good[i] and good[j]:
                        assert covariances[i, j] == part.covariance[n, i, j]
                    else:
                        assert covariances[i, j] == np.inf if i == j else np.isnan(covariances[i, j])


@pytest.mark.parametrize("off", [0.0, 2.0])
def test_each_picture_has_poses_of_its_own(off, task1, monkeypatch):
    """Sensor and light are set anew for each picture; one picture's noise is not another's."""
    poses = []

    def image(scene, sensor, light, **how):
        poses.append((sensor, light, how))
        return np.full((4, 5), 10.0 * len(poses))

    monkeypatch.setattr(series, "image", image)
    scene = task1.model_copy(update={"jitter": Jitter(sensor_deg=off, light_deg=off), "noise": Noise(sigma=0.5)})
    sensor, light = Pose(30, 135), Pose(15, 315)
    found = series.shots(scene, sensor, light, np.random.default_rng(5), 3, effects="all")
    assert found.shape == (3, 4, 5)
    assert found.mean((1, 2)) == pytest.approx([10.0, 20.0, 30.0], abs=0.6)  # margin: 5 standard errors of 20 pixels
    assert np.abs(found[0] - 10 - (found[1] - 20)).min() > 1e-6
    assert all(how == {"effects": "all"} for _, _, how in poses)
    if off:
        assert len({pose for pair in poses for pose in pair[:2]}) == 6
    else:
        assert {pair[:2] for pair in poses} == {(sensor, light)}
    again = series.shots(scene, sensor, light, np.random.default_rng(5), 3, effects="all")
    assert again - found == pytest.approx(np.full(found.shape, 30.0))
