"""A circle whose rim has another edge beside it: noise decides at some places which of the two is found."""

import numpy as np
import pytest
from scipy import sparse
from scipy.special import ndtr
from scipy.stats import chi2

import measure
import scenes
from imaging.features.locator import edge_blur
from measure.features import rim_noise, rims
from measure.features.optics import Optics
from tests.oracle import pinhole

POSE = (0.0, 0.0)
APART, COUNT = 2.5, 200  # px between both edges; noisy images


@pytest.fixture(scope="module")
def plate():
    """The plate with one measurand, the diameter of its hole's upper rim, seen from above."""
    data = scenes.load("plate").model_dump(exclude={"measurands", "settings"})
    listed = [{"name": "bore", "kind": "diameter", "features": [{"circle": "c2"}]}]
    return scenes.Scene.model_validate({**data, "measurands": listed})


def image(plate, least: float, apart: float = APART) -> np.ndarray:
    """Noise-free grey levels that rise by 90 in two steps: at the rim by a part, which falls to ``least`` from one
    side of the hole to the other, and ``apart`` px outside it by the rest."""
    camera, circle = plate.camera, plate.solid.circle("c2")
    ends = circle.centre + circle.radius * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0]]) - np.array(camera.look_at)
    one, other, aside = pinhole(ends, POSE, camera)
    middle = (one + other) / 2
    beside = np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), -1) - middle
    radius, away = np.linalg.norm(aside - middle), np.linalg.norm(beside, axis=-1)
    part = 1 - (1 - least) * (1 - np.cos(np.arctan2(beside[..., 1], beside[..., 0]))) / 2
    rises = (ndtr((away - radius - more) / edge_blur(camera.blur_px)) for more in (0.0, apart))
    return 40 + 90 * sum(share * rise for share, rise in zip((part, 1 - part), rises, strict=True))


def measured(plate, clean: np.ndarray):
    """What is propagated, and the variance over noisy images beside it."""
    told = measure.propagate(clean, plate, POSE).measurands
    rng = np.random.default_rng(7)
    noisy = (clean + plate.noise.sigma * rng.standard_normal((COUNT, *clean.shape))).astype(np.float32)
    return told, measure.measure(noisy, plate, POSE).value[:, 0].var(ddof=1)


@pytest.mark.parametrize("least", [1.0, 0.9])
def test_a_rim_of_which_one_edge_is_found_is_as_propagated(plate, least):
    """It is a lone one, or the other is a tenth as strong at most: the variance within its 99.9 % interval."""
    told, variance = measured(plate, image(plate, least))
    low, high = chi2.ppf([5e-4, 1 - 5e-4], COUNT - 1) / (COUNT - 1)
    assert told.status[0] in scenes.status.MEASURED
    assert low < variance / told.covariance[0, 0] < high  # margin: chance: an interval of 99.9 %
    # margin: chance; twice the variance is noticed
    assert not low < variance / (2 * told.covariance[0, 0]) < high


@pytest.mark.parametrize("least", [0.3, 0.2])
def test_where_noise_decides_between_two_edges_there_is_no_variance(plate, least, monkeypatch):
    """The other edge is the stronger one along a part of the rim. Without the drawn images the diameter has a value,
    and scatters by more than three times its variance."""
    clean = image(plate, least)
    told, _ = measured(plate, clean)
    assert told.status == ("ill_conditioned",)
    assert np.isnan(told.value[0])
    assert told.covariance[0, 0] == np.inf
    monkeypatch.setattr(rims, "is_linear", lambda *given: True)
    told, variance = measured(plate, clean)
    assert told.status[0] in scenes.status.MEASURED
    assert variance > 3 * told.covariance[0, 0]  # margin: 3.5 and 17 times, as is said


def test_noise_is_drawn_where_it_is_looked_at_and_around_it():
    """Four px around, not past the image's border; elsewhere there is none, and it is always the same."""
    clean, pixels = np.full((12, 20), 50.0), np.array([3, 25])
    first, *others = rim_noise.drawn(clean, pixels, Optics(clean.shape, noise_variance=4.0))
    away = np.abs(np.arange(240)[:, None] // 20 - pixels // 20) + np.abs(np.arange(240)[:, None] % 20 - pixels % 20)
    near = (away <= 4).any(1)
    levels = np.concatenate([each.at(np.arange(240)) for each in (first, *others)])
    assert (levels[:, ~near] == 50.0).all()
    assert levels[:, near].var() == pytest.approx(4.0, rel=5 * np.sqrt(2 / levels[:, near].size))
    again = next(rim_noise.drawn(clean, pixels, Optics(clean.shape, noise_variance=4.0)))
    np.testing.assert_array_equal(first[np.array([3])].at(pixels), again.at(pixels)[[3]])


def test_errors_to_first_order_are_those_of_the_noise():
    """A response that adds two pixels' levels tells the change of their sum."""
    clean = np.full((12, 20), 50.0)
    images = next(rim_noise.drawn(clean, np.array([105, 106]), Optics(clean.shape)))
    response = np.zeros((1, 240))
    response[0, [105, 106]] = 1.0
    told = images.first_order(sparse.csr_array(response))
    np.testing.assert_allclose(told[:, 0], images.at(np.array([105, 106])).sum(1) - 100.0, atol=1e-12)


NOISE = np.random.default_rng(4).standard_normal((128, 2))
FOUND = np.ones(128, bool)


@pytest.mark.parametrize(
    ("full", "found", "expected"),
    [
        (NOISE, FOUND, True),
        (NOISE * [1.0, 1.1], FOUND, True),
        (NOISE * [1.0, 1.13], FOUND, False),
        (NOISE / [1.0, 1.13], FOUND, False),
        (NOISE + [0.29, 0.0], FOUND, True),
        (NOISE + [0.0, 0.36], FOUND, False),
        (np.where(NOISE > 2.0, np.nan, NOISE), FOUND, False),
        (np.where(NOISE > 2.0, np.nan, NOISE), (NOISE <= 2.0).all(1), True),
        (NOISE, np.arange(128) < 63, False),
    ],
)
def test_which_errors_are_linear(full, found, expected):
    """A quarter more or less variance, 0.3 sigma of mean, half of the circles found."""
    assert rim_noise.is_linear(NOISE, full, found) == expected


def test_without_noise_nothing_is_asked():
    assert rim_noise.is_linear(np.zeros((128, 3)), np.zeros((128, 3)), np.zeros(128, bool))
