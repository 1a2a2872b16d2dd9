"""Parts of a recipe: formulas written out, its sensor's noise, Student's factors, its modules, its decisions."""

import math

import numpy as np
import pytest
from scipy.special import stdtrit

from imaging.sensor import recorded
from measure.estimators.windows import places_across, second_derivatives
from planner.uncertainty.budget import coverage_factor
from scenes import InvalidInput, Noise
from validation.recipe import code
from validation.recipe import places as places_of
from validation.recipe.places import Places, SideBySide
from validation.recipe.sensor import Sensor
from validation.recipe.told import Characteristic, Coverage, with_budget
from validation.recipe.traced import Tape, numbers


def _written(function, at):
    """A function of an array of numbers, written out near a place."""
    tape = Tape()
    outputs = np.ravel(function(numbers(tape.inputs(at))))
    text = "\n    ".join(["def found(p):", *tape.code(list(outputs))])
    names = {name: getattr(math, name) for name in ("atan2", "cos", "hypot", "sin", "sqrt", "tan")}
    exec(text, names)
    return names["found"]


def _angle(p):
    """The angle at the first of three points, and its foot's distance: what measurands are made of."""
    one, two = (p[2:4] - p[:2])[None], (p[4:6] - p[:2])[None]
    unit = one / np.linalg.norm(one, axis=-1)[..., None]
    across = np.stack([-unit[..., 1], unit[..., 0]], -1)
    side = np.einsum("...i,...i->...", across, two)
    sign = np.sign(side)
    return np.stack([np.arctan2(np.abs(side), np.einsum("...i,...i->...", unit, two)), sign * side * 2.0 + 0.0 * side])


def test_a_formula_written_out_is_the_function():
    rng, at = np.random.default_rng(3), np.array([0.0, 0.1, 3.0, 0.2, 2.0, 2.5])
    found = _written(_angle, at)
    for _ in range(20):
        near = at + rng.normal(0, 0.2, 6)
        np.testing.assert_allclose(found(near.tolist()), np.ravel(_angle(near)), rtol=1e-14)
    assert found([*at[:4], 2.0, -2.5]) is None  # the third point is on the other side: the sign was another one


def test_what_changes_nothing_is_not_written():
    tape = Tape()
    (a,) = tape.inputs([2.0])
    same = 0.0 + (1.0 * a + 0.0 * a - 0.0) / 1.0
    assert tape.code([same]) == ["return (p[0], )"]


@pytest.mark.parametrize("function", [lambda p: p[0] if p[0] else p[1], lambda p: np.linalg.solve(p[:, None], p[:1])])
def test_what_cannot_be_written_out_is_an_error(function):
    with pytest.raises(TypeError):
        function(numbers(Tape().inputs([1.0])))


@pytest.mark.parametrize("noise", [
    Noise(sigma=2.0), Noise(sigma=1.6, bits=8, dark_level=16), Noise(sigma=3.0, bits=8, gain=0.4, dark_level=10),
])  # fmt: skip
def test_noise_as_the_sensor_has_it(noise):
    full = np.inf if noise.bits is None else 255.0
    sensor = Sensor(noise.variance, noise.shot_gain, noise.dark_level, full)
    for top in (120.0, 251.0, 280.0):
        levels = np.random.default_rng(1).uniform(0, top, 500)
        found = np.broadcast_to(sensor.variance(levels), levels.shape)
        np.testing.assert_allclose(found, recorded(noise, levels).noise_variance, rtol=1e-11, atol=1e-15)


def test_students_factor_beyond_the_table():
    coverage = Coverage(tuple(coverage_factor(0.95, dof) for dof in range(1, 1001)), coverage_factor(0.95))
    for dof in (1.0, 9.7, 1000.0, 1001.0, 1500.5, 4e4, 1e7):
        assert coverage.factor(dof) == pytest.approx(float(stdtrit(math.floor(dof), 0.975)), rel=1e-12)
    assert coverage.factor(math.inf) == coverage_factor(0.95)
    assert abs(coverage.factor(1001.0) / coverage.normal - 1) > 1e-4  # negative control: the expansion is felt


def test_expanded_uncertainty_by_the_gum():
    """Noise 3, bias 4, others 12 with 8 degrees of freedom: u = 13, at 13^4 / (12^4 / 8) = 11.01 degrees of freedom."""
    coverage = Coverage(tuple(coverage_factor(0.95, dof) for dof in range(1, 101)), coverage_factor(0.95))
    one = Characteristic("a", "distance", "mm", 10.0, (40.0, 30.0), True, 0, 144.0, 12.0**4 / 8, (0.0, 0.5))
    assert one.expanded(3.0, 4.0, coverage) == pytest.approx(13 * stdtrit(11, 0.975), rel=1e-12)
    whole = math.sqrt(144 + 9 + 1.5**2)
    assert one.expanded(3.0, None, coverage) == pytest.approx(whole * stdtrit(9, 0.975), rel=1e-12)
    assert one.decided(0.0, 19.9, "ok") == "pass"
    assert one.decided(0.0, 20.1, "ok") == "undecided"
    assert one.decided(0.0, 19.9, "clutter") == one.decided(0.0, None, "ok") == "undecided"


def test_a_measurand_s_numbers_have_a_budget_together_or_none():
    groups = {"a": 0, "b": 0, "c": 1}
    rows = [Characteristic(n, "offset", "mm", 1.0, None, True, g, 1.0, 0.0, (0.0, 0.0)) for n, g in groups.items()]
    assert with_budget(rows, [1.0, math.inf, 1.0], whole=False) == [False, False, True]
    assert with_budget(rows, [1.0, math.inf, 1.0], whole=True) == [False] * 3
    assert with_budget(rows, [1.0, 1.0, 1.0], whole=True) == [True] * 3


def test_a_recipe_s_modules_need_numpy_alone(monkeypatch):
    names = set(code.sources())
    assert "validation.recipe.runtime" in names
    assert "measure.estimators.crossings" in names
    assert not names & {"measure.estimators.crossing", "scenes", "measure", "imaging.sensor"}
    monkeypatch.setattr(code, "FRONT", "measure.estimators.crossing")  # negative control: it takes SciPy
    with pytest.raises(InvalidInput, match=r"must need NumPy alone, got (scipy|pydantic|cv2|skimage)"):
        code.sources()


def _around(angles):
    """Places on a circle in a picture of 60 x 80 pixels, and their normals."""
    normals = np.stack([np.cos(angles), np.sin(angles)], -1)
    return np.array([41.3, 28.7]) + 12.4 * normals, normals


@pytest.mark.parametrize("large", [0, 1 << 30], ids=["two bands", "one"])
def test_places_tell_the_locator_s_function(monkeypatch, large):
    """Of a noisy picture at all places, in bands or whole, by the windows themselves."""
    monkeypatch.setattr(places_of, "_LARGE", large)
    image, scale, window = np.random.default_rng(4).uniform(0, 200, (60, 80)), 1.2, 3.0
    parts = [_around(np.linspace(first, first + 2.0, 9)) for first in (0.2, 3.0)]
    each = [Places.of(*part, np.ones(9), np.ones(9), (scale, window), image.shape) for part in parts]
    pixels = np.unique(np.concatenate([places.near.ravel() for places in each]))
    side = SideBySide(tuple(places.among(pixels) for places in each))
    assert [len(places.bands) for places in side.each] == [2 if large == 0 else 1] * 2

    at, normals = (np.concatenate(some) for some in zip(*parts, strict=True))
    offsets, across, toward = places_across(at, normals, window)
    values, first = second_derivatives(across, toward, scale)
    size = values.shape[1]
    windows = np.array([image[y : y + size, x : x + size] for x, y in first])
    expected = (values * windows).sum((1, 2)).reshape(len(at), offsets.size)
    np.testing.assert_allclose(side.profiles(image.ravel()[pixels]).T, expected, rtol=0, atol=1e-11)
    middle = values.reshape(len(at), offsets.size, -1)[:, offsets.size // 2]
    np.testing.assert_allclose(side.gain_of_noise, np.linalg.norm(middle, axis=-1), rtol=1e-13)
