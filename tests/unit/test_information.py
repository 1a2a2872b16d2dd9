"""The bound's lines and what is known before, from the vertices' covariance written out."""

import numpy as np
import pytest

from imaging.blurred.arrangement import arrangement_of
from imaging.blurred.model import BlurredModel
from imaging.features.measurand import measurands
from imaging.geometry.projection import direction
from imaging.models.bound import bound, information, known, line_rows
from planner import Pictures
from planner.robustness import Tolerances, _with_pose_errors, altered
from scenes import InvalidInput

SENSOR, LIGHT = np.array([30.0, 135.0]), np.array([15.0, 315.0])


def test_variance_of_a_line(task1):
    """A displacement at the first end is that end's, across the line; a rotation that of both ends over the length."""
    pictures = Pictures.of(task1, SENSOR, LIGHT)
    errors, told = bound(pictures), information(pictures)
    view, required, covariance = errors.measurands.view, told.model.arrangement.required, told.vertices()
    for e, (start, stop) in enumerate(required):
        along = told.model.arrangement.vertices[stop] - told.model.arrangement.vertices[start]
        length = np.linalg.norm(along)
        normal = np.array([-along[1], along[0]]) / length
        first, last = (covariance[2 * v : 2 * v + 2] for v in (start, stop))
        here, there = slice(2 * start, 2 * start + 2), slice(2 * stop, 2 * stop + 2)
        offset = normal @ first[:, here] @ normal
        both = normal @ first[:, there] @ normal
        tilt = (offset + normal @ last[:, there] @ normal - 2 * both) / length**2
        mixed = (both - offset) / length
        for a, b in ((1.0, 0.0), (0.0, 1.0), (0.7, 20.0), (0.7, -20.0)):
            found = errors.line_variance(np.full(len(required), a), np.full(len(required), b))[e]
            assert found == pytest.approx(a * a * offset + 2 * a * b * mixed + b * b * tilt, rel=1e-9)
    assert view.lengths == pytest.approx(
        np.linalg.norm(np.diff(told.model.arrangement.vertices[required], axis=1)[:, 0], axis=1)
    )


def test_rows_of_lines(task1):
    """Each line's displacement and rotation by its two ends, which lie on it."""
    pictures = Pictures.of(task1, SENSOR, LIGHT)
    seen = measurands(pictures)
    required = arrangement_of(pictures).required
    count = int(required.max()) + 3
    rows = line_rows(seen, required, count).reshape(len(required), 2, count, 2)
    for e, (start, stop) in enumerate(required):
        normal = rows[e, 0, start]
        assert np.linalg.norm(normal) == pytest.approx(1)
        assert normal @ seen.view.along[e] == pytest.approx(0, abs=1e-9)
        assert rows[e, 1, stop] == pytest.approx(normal / seen.view.lengths[e])
        assert rows[e, 1, start] == pytest.approx(-normal / seen.view.lengths[e])
        rest = np.setdiff1d(np.arange(count), (start, stop))
        assert not rows[e][:, rest].any()
        assert not rows[e, 0, stop].any()


def test_what_is_known_before(task1):
    """A lit face's level to 100 % of it, the blur to its own known part; the required ends may be anywhere."""
    arrangement = arrangement_of(Pictures.of(task1, SENSOR, LIGHT))
    y, x = np.mgrid[60:180, 60:190]
    model = BlurredModel(arrangement, x.ravel(), y.ravel(), np.arange(len(arrangement.vertices)))
    found = known(model)
    first = 2 * model.free.size
    assert found.mean[:first] == pytest.approx(arrangement.vertices[model.free].ravel())
    assert found.mean[-1] == pytest.approx(model.start().blur)
    at = first
    for region in arrangement.regions:
        expected = np.full(region.count, 1.0 if region.known else 0.0)
        assert np.diag(found.precision)[at : at + region.count] == pytest.approx(expected * region.known)
        assert found.mean[at : at + region.count] == pytest.approx(region.known * np.eye(region.count)[0])
        at += region.count
    assert at == len(found.mean) - 1
    shift, ends = np.zeros(first), np.isin(model.free, arrangement.required)
    shift[0::2], shift[1::2] = 3.0, -2.0
    assert shift @ found.precision[:first, :first] @ shift == pytest.approx(0, abs=1e-9)
    alone = np.zeros(first)
    alone[np.repeat(~ends, 2)] = 1.0
    assert alone @ found.precision[:first, :first] @ alone > 0


@pytest.mark.parametrize(("name", "most"), [("noise", 1.0), ("roughness", 1.0), ("sensor_deg", 90.0)])
def test_tolerances_have_limits(name, most):
    """From 0 to less than all of it, or a right angle."""
    for good in (0.0, 0.5, most * (1 - 1e-9)):
        assert getattr(Tolerances(**{name: good}), name) == good
    for bad in (-1e-9, most, 2 * most, float("nan"), float("inf")):
        with pytest.raises(InvalidInput, match=f"tolerance of {name} must be at least 0 and small"):
            Tolerances(**{name: bad})


def test_altered_values_stop_at_their_limits(task1):
    material = task1.material.model_copy(
        update={"diffuse_reflectance": 0.8, "specular_fraction": 0.5, "refractive_index": 1.1, "roughness": 0.6}
    )
    scene = task1.model_copy(update={"material": material})
    names = ("diffuse_reflectance", "specular_fraction", "roughness", "refractive_index", "noise")
    down, up = (altered(scene, dict.fromkeys(names, factor)) for factor in (0.5, 3.0))
    assert [getattr(down.material, name) for name in names[:4]] == pytest.approx([0.4, 0.25, 0.3, 1.0])
    assert [getattr(up.material, name) for name in names[:4]] == pytest.approx([1.0, 1.0, 1.8, 3.3])
    assert (down.noise.sigma, up.noise.sigma) == pytest.approx((0.5 * scene.noise.sigma, 3 * scene.noise.sigma))
    thin = scene.model_copy(update={"material": material.model_copy(update={"refractive_index": 0.6})})
    assert altered(thin, {"refractive_index": 0.5}).material.refractive_index == pytest.approx(0.3)  # 1 is none there


def test_pose_errors():
    """The pair itself, then the sensor or the light or both off by their angle in four ways."""
    sensor, light = SENSOR, LIGHT
    assert len(_with_pose_errors(sensor, light, Tolerances(noise=0.1))[0]) == 1
    pairs = _with_pose_errors(sensor, light, Tolerances(sensor_deg=1.0, light_deg=2.0))
    ways = [np.array([direction(pose) for pose in poses]) for poses in pairs]
    for way, true, off in zip(ways, (sensor, light), (1.0, 2.0), strict=True):
        apart = np.degrees(np.arccos(np.clip(way @ direction(true), -1, 1)))
        assert len(way) == 25
        assert (apart < 1e-5).sum() == 5
        assert apart[apart > 1e-5] == pytest.approx(np.full(20, off), rel=0.02)
