"""What a trial and the sweeps of costs make of what they have measured."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import planner
from validation.batch.campaign import Campaign
from validation.batch.options import RunOptions
from validation.cost import locators, sampling, trial
from validation.cost.model import Rendered
from validation.cost.watch import AT_ONCE, Watch, at_once


def tried(seconds=4.0, linearity=(0.3, 0.1), phase=0.2, overhead=2.0, image=0.5, usable=True):
    """A setting of a trial."""
    return SimpleNamespace(
        seconds=seconds, linearity=lambda: linearity, phase=lambda: phase, overhead=overhead, image_seconds=image,
        usable=usable, status="short",
    )  # fmt: skip


@pytest.fixture
def trials(monkeypatch):
    """A trial of settings that are made up; warming up takes 6 s."""

    def run(*settings, workers=3):
        left = list(settings)
        monkeypatch.setattr(trial.variants, "choose", lambda: "scalar_rgb")
        monkeypatch.setattr(trial, "spread_cases", lambda campaign, count: list(range(count)))
        monkeypatch.setattr(trial, "_timed", lambda what: 6.0)
        monkeypatch.setattr(trial, "_Tried", lambda *_: left.pop(0))
        monkeypatch.setattr(trial, "_ladder", lambda good, *_: tuple(good))
        monkeypatch.setattr(trial.time, "process_time", lambda: 1.25)
        campaign = type("Campaign", (), {"name": "made", "__len__": lambda self: 20})()
        return trial.trial(campaign, settings=len(settings), options=RunOptions(workers=workers))

    return run


def test_a_trials_sums(trials):
    """Means of seconds, root mean squares of errors; of those that can be measured."""
    one, two, lost = tried(), tried(7.0, (0.5, 0.2), 0.4, 3.0, 0.75), tried(usable=False, overhead=99.0)
    found = trials(one, lost, two)
    assert (found.settings, found.workers, found.rendered) == (20, 3, (one, two))
    assert found.model == pytest.approx(math.sqrt((0.09 - 0.01 + 0.25 - 0.04) / 2))
    assert found.phase == pytest.approx(math.sqrt((0.04 + 0.16) / 2))
    assert (found.setting, found.image) == (2.5, 0.625)
    assert found.start == 1.25 + 6.0 - 4.0  # the first is rendered twice
    assert found.finish == pytest.approx(16 * trial._PICTURE_S)


def test_what_is_within_its_own_error_is_no_error_of_the_model(trials):
    found = trials(tried(linearity=(0.1, 0.2), seconds=9.0))
    assert (found.model, found.start) == (0.0, 1.25)


def test_a_trial_of_what_cannot_be_measured(trials):
    with pytest.raises(trial.InvalidInput, match="made: settings must be measurable for a trial, got short"):
        trials(tried(usable=False))


def test_renders_from_few_rays_to_many_until_they_are_enough(monkeypatch):
    monkeypatch.setattr(trial, "qualities", lambda *_: ["few", "some", "many", "most"])
    sigma = {"few": (0.3, 0.4), "some": (0.1, 0.2), "many": (0.03, 0.04), "most": (0.0, 0.0)}
    two = [SimpleNamespace(rendered=lambda q, k=k: (1.0 + 2 * k, sigma[q][k])) for k in (0, 1)]
    found = trial._ladder(two, 0.05, Watch())
    rms = [math.sqrt((a * a + b * b) / 2) for a, b in list(sigma.values())[:3]]
    assert found == tuple(
        Rendered(name, 2.0, pytest.approx(s)) for name, s in zip(("few", "some", "many"), rms, strict=True)
    )
    assert len(trial._ladder(two, 0.05, Watch(-1.0))) == 1


def test_linearity_is_of_the_same_noise(monkeypatch, rng):
    """Values of 1.1 times the linear ones and a tenth of their own: 1.21 + 0.01 times the variance, less 1."""
    linear, own = rng.standard_normal((2, trial._IMAGES))
    values = 5 + 1.1 * linear + 0.1 * own
    values[3] = np.nan
    left = [0]

    def expose(image, noise, rng, count, where):
        some = linear[left[0] : left[0] + count]
        return some[:, None, None] * np.ones((1, 2, 3)) / 6

    def measured(pictures, *_, **how):
        some = values[left[0] : left[0] + len(pictures)]
        left[0] += len(pictures)
        return SimpleNamespace(value_image=some[:, None])

    monkeypatch.setattr(trial.render, "expose", expose)
    monkeypatch.setattr(trial.measure, "measure", measured)
    monkeypatch.setattr(trial.measure, "region_of_interest", lambda *_: None)
    one = SimpleNamespace(
        case=SimpleNamespace(scene=SimpleNamespace(noise=None), setting=SimpleNamespace(sensor=None), index=2), seed=1,
        image=np.zeros((2, 3)), tell=lambda: None, found=SimpleNamespace(response=np.ones((2, 3))),
    )  # fmt: skip
    good = np.isfinite(values)
    delta, se = trial._Tried.linearity(one)
    assert delta == pytest.approx(values[good].var(ddof=1) / linear[good].var(ddof=1) - 1, rel=1e-9)
    rho = np.corrcoef(values[good], linear[good])[0, 1]
    assert se == pytest.approx(2 * math.sqrt((1 - rho**2) / (good.sum() - 1)), rel=1e-6)
    values[2:] = np.nan
    left[0] = 0
    assert trial._Tried.linearity(one) == (0.0, 0.0)


def test_how_the_variance_of_n_images_scatters(monkeypatch, rng):
    """As 1 / sqrt(2 (n - 1)), and so its slopes: of groups that have no image in common."""
    values = rng.standard_normal(200_000)
    left = [0]

    def measured(pictures, *_):
        some = values[left[0] : left[0] + pictures]
        left[0] += pictures
        return SimpleNamespace(value_px=some)

    monkeypatch.setattr(sampling.render, "expose", lambda image, noise, rng, count, where: count)
    monkeypatch.setattr(sampling.measure, "distance", measured)
    monkeypatch.setattr(sampling.measure, "region_of_interest", lambda *_: None)
    case = SimpleNamespace(scene=SimpleNamespace(noise=None), setting=SimpleNamespace(sensor=None))
    found = sampling.images_parameter(case, np.zeros((2, 3)), 5)
    assert [fit.theory for fit in found.fits] == [-0.5, -0.5]
    n, _, groups, scatter, width = np.array(found.rows).T
    straight = np.polyfit(np.log(n - 1), np.log(scatter), 1, w=np.sqrt(groups))[0]
    fitted = np.polyfit(np.log(n[2:]), np.log(width[2:]), 1)[0]
    assert [fit.slope for fit in found.fits] == pytest.approx([straight, fitted], rel=1e-6)
    for n, _, groups, scatter, _ in found.rows:
        assert groups == left[0] // n
        some = values[: groups * n].reshape(groups, n).var(1, ddof=1)
        assert scatter == pytest.approx(some.std(ddof=1) / some.mean(), rel=1e-9)


def test_pictures_in_memory():
    assert [at_once(AT_ONCE // 7, 50), at_once(AT_ONCE // 7, 5), at_once(2 * AT_ONCE, 5)] == [7, 5, 1]
    assert list(Watch(math.inf).samples(3, least=1)) == [0, 1, 2]


def test_settings_share_the_time_of_the_estimators_table(monkeypatch, task1):
    """60 s of two settings are 30 s each, which stand for none here."""
    rng, told = np.random.default_rng(4), []
    made = SimpleNamespace(left=60.0, tell=lambda: None)
    monkeypatch.setattr(locators, "Watch", lambda seconds, tell: told.append(seconds) or Watch(0.0, tell))
    monkeypatch.setattr(
        locators.measure, "distance", lambda images, *_: SimpleNamespace(value_px=rng.normal(size=len(images)))
    )
    case = Campaign.of(task1).case(0)
    image = planner.image(task1, case.setting.sensor, case.setting.light)
    found = locators.estimators_parameter([case, case], [image, image], 1, made)
    assert told == [30.0, 30.0]
    assert found.note.startswith("100 images of 2 settings")
