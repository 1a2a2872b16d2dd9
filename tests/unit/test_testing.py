"""The assertions for rendered images: as many false alarms as they claim, and no missed error."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from render.testing import assert_images_agree, assert_measures
from tests.oracle import polygon_image

CORNERS = np.array([[8.3, 6.2], [33.1, 9.4], [30.2, 31.8], [10.4, 27.9]])
SIGMA = 2.4 / np.sqrt(500)  # of the mean of 500 pictures


@pytest.fixture(scope="module")
def exact():
    return polygon_image(CORNERS, (40, 40), 0.6, 180.0, 20.0)


def failures(trials, check):
    count = 0
    for _ in range(trials):
        try:
            check()
        except AssertionError:
            count += 1
    return count


@pytest.mark.parametrize("stacks", [False, True])
def test_true_nulls_fail_as_often_as_claimed(exact, rng, tmp_path, stacks):
    """500 pairs at level 0.1: the number that fails lies within the central 99.9 % of the binomial distribution."""

    def check():
        if stacks:
            pair = exact + SIGMA * rng.standard_normal((2, 4, 40, 40))
            assert_images_agree(*pair, level=0.1, folder=tmp_path)
        else:
            assert_images_agree(exact + SIGMA * rng.standard_normal((40, 40)), exact, SIGMA**2, 0.1, tmp_path)

    count = failures(500, check)
    if stacks:
        assert count <= stats.binom.isf(5e-4, 500, 0.1)  # Welch's test is cautious with four renders each
    else:
        assert stats.binom.isf(1 - 5e-4, 500, 0.1) <= count <= stats.binom.isf(5e-4, 500, 0.1)


@pytest.mark.parametrize("error", ["brightness", "shift"])
def test_errors_are_found_and_pictures_written(exact, rng, tmp_path, error):
    """1 % of brightness, or 0.02 px of shift, in the mean of 500 pictures."""
    wrong = (
        20 + 1.01 * (exact - 20)
        if error == "brightness"
        else polygon_image(CORNERS + [0.02, 0], (40, 40), 0.6, 180, 20)
    )
    noisy = wrong + SIGMA * rng.standard_normal((40, 40))
    with pytest.raises(AssertionError, match="images must agree, got p = "):
        assert_images_agree(noisy, exact, SIGMA**2, folder=tmp_path, name=error)
    assert {path.name for path in tmp_path.iterdir()} == {f"{error}.png", f"{error}_reference.png", f"{error}_p.png"}


def test_pixels_without_noise_must_be_equal(exact, tmp_path):
    assert_images_agree(exact, exact, 0.0)
    with pytest.raises(AssertionError, match="1600 pixels differ"):
        assert_images_agree(exact + 1e-9, exact, 0.0, folder=tmp_path)


def test_measured_distance_is_held_to_its_own_uncertainty(rng):
    """2000 true expectations at level 0.05; then one that is 0.02 px off, which 100 images of sigma 0.01 px see."""

    def draw(shift=0.0, size=100):
        return SimpleNamespace(
            value_px=100 + shift + 0.01 * rng.standard_normal(size), variance_px2=np.full(size, 1e-4), status="ok"
        )

    count = failures(2000, lambda: assert_measures(draw(), 100.0, 0.05))
    assert stats.binom.isf(1 - 5e-4, 2000, 0.05) <= count <= stats.binom.isf(5e-4, 2000, 0.05)
    with pytest.raises(AssertionError, match=r"distance must be 100\.00000 px within"):
        assert_measures(draw(0.02), 100.0)
    assert_measures(draw(0.02), 100.0, systematic_px=0.02)
    with pytest.raises(AssertionError, match="distance must be measured"):
        assert_measures(SimpleNamespace(value_px=np.nan, variance_px2=np.inf, status="short"), 1.0)
