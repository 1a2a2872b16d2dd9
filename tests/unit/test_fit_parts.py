"""The parts of a fit: groups of photographs, noise curves, goodness of fit, parameters."""

from types import SimpleNamespace

import numpy as np
import pytest

import planner
from imaging.blurred.whole import signal_at
from measure.fitting import fit as fit_module
from measure.fitting.fit import _with_noise, fit
from measure.fitting.goodness import _curved, _score, p_value, parts
from measure.fitting.likelihood import Problem, most_likely
from measure.fitting.noise import Curve, by_neighbours, curve
from measure.fitting.parameters import Parameters
from measure.fitting.photograph import Pixels, Shots, grouped
from scenes import InvalidInput, Noise, Picture, Pose
from scenes.photograph import Photograph


@pytest.fixture(scope="module")
def small(task1):
    camera = task1.camera.model_copy(update={"width": 112, "height": 104, "focal_px": 350.0})
    return task1.model_copy(update={"camera": camera})


@pytest.fixture(scope="module")
def problem(small):
    picture = Picture.of(small, (35, 120), (25, 300))
    parameters = Parameters.of((picture,))
    image = planner.image(picture)
    pixels = Pixels.around(parameters.pictures_at(parameters.start(), 0))
    return Problem(parameters, (Shots(image, 1, None, (0,)),), (pixels,))


def test_photographs_of_one_pose_are_told_from_others(small, rng):
    clean = [planner.image(small, sensor, (25, 300)) for sensor in ((35, 120), (35, 120.6))]
    images = [clean[k] + rng.normal(0, 2, clean[k].shape) for k in (0, 1, 0, 0, 1)]
    assert [shots.members for shots in grouped(images)] == [(0, 2, 3), (1, 4)]
    assert grouped(images)[0].scatter.mean() == pytest.approx(4.0, rel=0.05)


def test_a_large_object_is_seen_in_squares(problem):
    """All edges are in, no pixel twice, and the whole is about as many pixels as asked for."""
    pictures = problem.parameters.pictures_at(problem.parameters.start(), 0)
    whole, some = Pixels.around(pictures), Pixels.around(pictures, 2000)
    assert whole.shape[0] == 1
    assert some.shape[1:] == (16, 16)
    assert some.x.size < whole.x.size
    assert np.unique(some.y * 1000 + some.x).size == some.x.size
    image = problem.shots[0].mean
    steep = np.argwhere(np.hypot(*np.gradient(image)) > 5)
    here = set(zip(some.y.tolist(), some.x.tolist(), strict=True))
    assert all((y, x) in here for y, x in steep.tolist())
    assert (some.of(image) == image[some.y, some.x]).all()


def test_photographs_of_two_sizes_are_refused():
    with pytest.raises(InvalidInput, match=r"photographs must be of one size, got 9 x 8, 8 x 8"):
        grouped([np.zeros((8, 9)), np.zeros((8, 8))])
    with pytest.raises(InvalidInput, match=r"photographs must be of one size, got none"):
        grouped([])


def test_photon_transfer_is_found_with_its_errors(rng):
    """Pulls of 200 curves: mean 0, sd 1; errors of two thirds are seen to be wrong."""
    signal, freedom, pulls = np.linspace(0, 150, 2000), np.full(2000, 5.0), []
    for _ in range(200):
        found = curve(signal, (3.0 + 0.05 * signal) * rng.chisquare(5, 2000) / 5, freedom)
        pulls.append((np.array([found.dark, found.gain]) - (3.0, 0.05)) / np.sqrt(np.diag(found.covariance)))
    square = np.square(pulls).sum(0)
    assert (np.abs(np.mean(pulls, 0)) < 4 / np.sqrt(200)).all()  # margin: 4 standard errors
    assert ((square > 130) & (square < 290)).all()  # chi-square of 200: 200 +- 20 (1 sd)
    assert (square * 1.5**2 > 290).all()  # margin: 450 is expected, 200 for the right ones


def test_no_gain_where_there_is_none_to_see():
    found = curve(np.full(50, 3.0), np.full(50, 2.0), np.full(50, 1.0))
    assert (found.dark, found.gain) == (pytest.approx(2.0), 0.0)
    falls = curve(np.linspace(0, 10, 50), np.linspace(3, 1, 50), np.full(50, 1.0))
    assert falls.gain == 0.0


def test_neighbours_do_not_take_a_smooth_misfit_for_noise(problem, rng):
    """A slope of 12 grey levels over the picture, of variance 12: the residual has it, its differences have not."""
    shots = problem.shots[0]
    signal = problem.signal(problem.parameters.start(), 0)
    noisy = shots.mean - 20.0 + rng.normal(0, 2, shots.mean.shape) + np.linspace(-6, 6, shots.mean.shape[1])
    values = by_neighbours(Shots(noisy, 1, None, (0,)), problem.pixels[0], signal, 4.0)
    told = curve(values[0], values[1], np.full(values[0].size, values[2]))
    assert told.dark + told.gain * 50 == pytest.approx(4.0, rel=0.1)
    # margin: the order is said: twice the 4 that neighbours tell
    assert np.var(problem.pixels[0].of(noisy) - signal) > 8


def test_derivatives_are_those_of_central_differences(problem):
    """Largest error of any parameter's column at most a percent of its largest value: steps of one side."""
    parameters, noise = problem.parameters, problem.parameters.scene.noise
    values, which = parameters.start(), np.arange(len(parameters.free))
    found = problem.jacobian(values, noise, which)
    for i in which:
        step = np.zeros(values.size)
        step[i] = 3 * parameters.free[i].step
        ahead, behind = (problem.expected(values + sign * step, noise) for sign in (1, -1))
        central = (ahead - behind) / (2 * step[i])
        assert np.abs(found[:, i] - central).max() < 0.012 * np.abs(central).max(), parameters.names[i]


def test_goodness_knows_noise_from_what_is_none(problem, rng):
    """White noise passes; a double edge, a stain of less than a standard deviation, and a curve of 0.8 do not.

    The curve is looked for at a known pose: a free light explains much of it on a face or two.
    """
    parameters = problem.parameters
    values, which = parameters.start(), np.arange(len(parameters.free))
    noise = parameters.scene.noise
    sigma = np.sqrt(problem.variance(values, noise))
    white = problem.jacobian(values, noise, which) / sigma[:, None]
    covariance = np.linalg.inv(white.T @ white)
    level = problem.expected(values, noise)

    def told(extra):
        rest = (rng.normal(0, sigma) + extra) / sigma
        rest = rest - white @ (covariance @ (white.T @ rest))
        return p_value(parts(rest, level / sigma, level, problem.pixels, white, covariance), np.inf)

    good = np.array([told(0.0) for _ in range(60)])
    assert (good < 0.05).mean() < 0.2  # margin: chance: 3 of 60 expected, 12 are 5 standard deviations more
    assert good.min() > 1e-4
    assert told(np.roll(level, 1) - level) < 1e-6
    y, x = problem.pixels[0].y - 40, problem.pixels[0].x - 50
    assert told(2.0 * (np.hypot(x, y) < 12)) < 1e-6
    white = white[:, [parameters.names.index(name) for name in ("camera.exposure", "noise.dark_level")]]
    covariance = np.linalg.inv(white.T @ white)
    assert told(255 * (level / 255) ** 0.8 - level) < 1e-6
    assert told(0.0) > 1e-4


def test_values_beyond_the_pole_are_told_as_usual(small):
    parameters = Parameters.of((Picture.of(small, (3, 120), (25, 300)),))
    values = parameters.start()
    values[parameters.names.index("sensor.polar")] = -2.0
    there, _ = parameters.settled(values, np.eye(values.size))
    pose = {name: there[parameters.names.index(name)] for name in ("sensor.polar", "sensor.azimuth", "camera.roll_deg")}
    assert pose == {"sensor.polar": 2.0, "sensor.azimuth": 300.0, "camera.roll_deg": -180.0}
    images = [signal_at(parameters.pictures_at(v, 0), *np.indices((100, 100)).reshape(2, -1))
              for v in (values, there)]  # fmt: skip
    np.testing.assert_allclose(*images, atol=1e-6)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"free": ["gamma"]}, r"free must be some of focal, k1, got 'gamma'"),
        ({"noise": "none"}, r"noise must be estimated or given, got 'none'"),
        ({"images": [np.zeros((9, 9))]}, r"photographs must be 112 x 104 px as the scene's camera, got 9 x 9"),
        ({"light": (15, 3)}, r"sensor must be given with light, got none"),
        ({"sensor": (15, 3)}, r"light must be given with sensor, got none"),
    ],
)
def test_bad_input(small, given, message):
    with pytest.raises(InvalidInput, match=message):
        fit(small, **({"images": [np.zeros((104, 112))]} | given))


def test_a_scene_without_settings_needs_a_pose(small):
    with pytest.raises(InvalidInput, match="sensor must be given for a scene without settings, got none"):
        fit(small.model_copy(update={"settings": ()}), [np.zeros((104, 112))])


def test_darkness_tells_nothing(small, rng):
    """A photograph of nothing: no infinite errors, no traceback, and what is not told is said to be held."""
    found = fit(small, [rng.normal(20, 2, (104, 112))], Pose(35, 120), Pose(25, 300))
    assert set(found.statuses) == {"ill_conditioned"}
    assert found.status == "low_contrast"
    assert (found.values == found.start).all()
    assert not found.covariance.any()


def test_sigma_and_gain_are_told_with_the_noise_s_own_covariance():
    """Of the variance's two numbers: sigma = sqrt(dark) has a variance of var(dark) / 4 sigma^2, the gain its own."""
    told = Curve(4.0, 0.1, np.array([[1.0, 0.3], [0.3, 0.25]]), 50.0)
    found = _with_noise(np.array([[7.0]]), told, Noise(sigma=2.0))
    assert found == pytest.approx(np.array([[7, 0, 0], [0, 1 / 16, 0.3 / 4], [0, 0.3 / 4, 0.25]]))


@pytest.mark.parametrize(("squares", "rounds"), [(40.0, 2), (60.0, 1)])
def test_what_is_far_off_is_not_fitted_twice(squares, rounds, monkeypatch):
    """Above 50 of the noise's variance, 9 here, what is left is no noise: weights and noise are not sought again."""
    fitted = []
    left = np.sqrt(9.0 * squares) * np.array([1.0, -1.0])
    problem = SimpleNamespace(
        variance=lambda values, noise: np.full(2, 9.0), observed=lambda: left,
        expected=lambda values, noise: np.zeros(2), jacobian=lambda values, noise, which: np.ones((2, 1)),
    )  # fmt: skip
    monkeypatch.setattr(fit_module, "Problem", lambda *given: problem)
    monkeypatch.setattr(fit_module, "most_likely", lambda *given: fitted.append(1) or np.zeros(1))
    parameters = SimpleNamespace(pictures_at=lambda values, k: None)
    white = fit_module._solved(parameters, (), np.zeros(1), None, np.array([0]), False)[3][1]
    assert len(fitted) == rounds
    assert white.tolist() == [[1 / 3], [1 / 3]]


def test_what_the_parameters_explain_already_is_no_direction_of_a_score(rng):
    """Of two columns of a camera's habits one is a sum of the Jacobian's, to rounding: one freedom is left."""
    jacobian, white = rng.normal(size=(50, 3)), rng.normal(size=50)
    other = rng.normal(size=50)
    along = np.stack([jacobian @ [1.0, -2.0, 0.5], other], 1)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    found = _score(white, along, jacobian, covariance)
    across = other - jacobian @ np.linalg.lstsq(jacobian, other, rcond=None)[0]
    assert found.freedom == 1
    assert found.squares == pytest.approx((across @ white) ** 2 / (across @ across), rel=1e-9)
    assert _score(white, along[:, :1], jacobian, covariance) == (0.0, 0.0)
    twice = _score(white, np.stack([other, 3 * other], 1), jacobian, covariance)
    assert twice == pytest.approx(found, rel=1e-6)


@pytest.mark.parametrize("known", [(True, True), (True, False), (False, True), (False, False)])
def test_a_tone_curve_is_known_where_every_photograph_tells_it(task1, known, monkeypatch):
    """One that does not say how its levels were made leaves it open."""
    told = []
    monkeypatch.setattr(fit_module, "_fitted", lambda *given: told.append(given[-1]))
    image = planner.image(Picture.of(task1, (30, 135), (15, 315)))
    fit(task1, [Photograph(image, 255.0, tone_known=each) for each in known], (30, 135), (15, 315))
    assert told == [all(known)]


@pytest.mark.parametrize("begin", [-3.0, 0.0, 0.2, 1.0, 7.0])
def test_a_search_begins_within_the_bounds(begin):
    """Wherever it is told to begin: levels that grow with one parameter between 0 and 1."""
    free = [SimpleNamespace(low=-np.inf, high=np.inf), SimpleNamespace(low=0.0, high=1.0)]
    slope = np.array([1.0, 2.0, -3.0])
    problem = SimpleNamespace(
        parameters=SimpleNamespace(free=free), smooth=False, observed=lambda: 0.7 * slope,
        expected=lambda values, noise: values[1] * slope + values[0],
        jacobian=lambda values, noise, which: slope[:, None], beside=lambda values, which: [],
    )  # fmt: skip
    found = most_likely(problem, np.array([0.0, begin]), None, np.array([1]), 1.0)
    assert found == pytest.approx([0.0, 0.7], abs=1e-4)


@pytest.mark.parametrize("brightest", [0.4, 3.0, 200.0])
def test_a_curved_response_is_the_derivative_of_a_power(brightest):
    """Of (level / brightest)^gamma at gamma 1, over the noise, by central differences; darkness and less has none."""
    level = brightest * np.array([1.0, 0.6, 0.03, 0.0, -0.2])
    found = _curved(level / 2.0, level)[:, 0]
    step, share = 1e-6, np.array([1.0, 0.6, 0.03])
    expected = brightest * (share ** (1 + step) - share ** (1 - step)) / (2 * step) / 2.0
    assert found == pytest.approx([*expected, 0.0, 0.0], rel=1e-6, abs=1e-6 * brightest)


@pytest.mark.parametrize(("counts", "repeated"), [((1, 1), False), ((1, 3), True), ((2, 1), True), ((2, 2), True)])
def test_photographs_are_repeated_where_of_some_pose_there_are_several(counts, repeated):
    shots = tuple(Shots(np.zeros((2, 2)), count, None, (0,)) for count in counts)
    assert fit_module._are_repeated(shots) == repeated
