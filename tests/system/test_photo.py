"""A quadrilateral in a photograph, without a pose: found, measured, with and without lens distortion."""

import numpy as np
import pytest

import measure
from measure.find.search import find_quadrilateral
from measure.photo.lens import Intrinsics
from measure.photo.noise import noise_sigma
from measure.photo.profiles import edge_sigma
from scenes import InvalidInput
from tests.benchmarks.estimators import random_block
from tests.oracle import polygon_image

SHAPE = (240, 320)
LENS = Intrinsics(fx=400.0, fy=400.0, cx=160.0, cy=120.0, distortion=(-0.25, 0.08, 0.001, -0.0005))


def ring(corners):
    """The corners in the order that `find_quadrilateral` promises."""
    return np.roll(corners, -int(np.argmin(corners.sum(1))), axis=0)


def matched(found, true):
    """Largest distance of the corners, whichever way round they are given."""
    return min(np.abs(found - np.roll(way, k, 0)).max() for way in (true, true[::-1]) for k in range(4))


@pytest.fixture
def corners(rng):
    return random_block(rng) * 1.7 + 25


@pytest.mark.parametrize(("contrast", "background"), [(120.0, 20.0), (-90.0, 200.0)])
@pytest.mark.parametrize("blur", [0.6, 1.5])
def test_found_and_measured(corners, rng, contrast, background, blur):
    """Bright on dark and dark on bright; corners within 4 standard deviations, blur and noise to 25 % and 5 %."""
    image = polygon_image(corners, SHAPE, blur, contrast, background) + 2 * rng.standard_normal(SHAPE)
    assert matched(find_quadrilateral(image), corners) < 4
    assert noise_sigma(image) == pytest.approx(2, rel=0.05)
    assert edge_sigma(image, corners) == pytest.approx(blur, rel=0.25)  # margin: 25 % is what is said
    for estimator in measure.ESTIMATORS:
        found = measure.measure_quadrilateral(image, estimator)
        assert found.status == "ok"
        # margin: 4.5 standard deviations of one picture
        assert matched(found.corners, corners) < 4.5 * np.sqrt(np.diag(found.covariance).max()) + 0.02


def test_quantities_and_their_errors(corners, rng):
    """Sides, diagonals and angles of 100 photographs: standard deviation as reported (standard error 7 %)."""
    clean = polygon_image(corners, SHAPE, 0.7, 100.0, 20.0)
    shots = [clean + 2 * rng.standard_normal(SHAPE) for _ in range(100)]
    runs = [measure.measure_quadrilateral(shot, "gradient", corners=corners) for shot in shots]
    values = np.array([[quantity.value for quantity in run.measurands] for run in runs])
    reported = np.array([[quantity.sigma for quantity in run.measurands] for run in runs]).mean(0)
    assert [quantity.unit for quantity in runs[0].measurands] == ["px"] * 6 + ["deg"] * 4
    assert values[:, 6:].sum(1) == pytest.approx(np.full(100, 360.0))
    ratio = values.std(0, ddof=1) / reported
    assert np.abs(ratio - 1).max() < 4 / np.sqrt(2 * 99)
    assert np.abs(ratio / 1.5 - 1).min() > 4 / np.sqrt(2 * 99)


def distorted(corners):
    """The polygon as a barrel lens shows it: every side bows outwards, drawn with 200 corners a side."""
    steps = np.linspace(0, 1, 200, endpoint=False)[:, None]
    sides = [a + steps * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
    return polygon_image(LENS.distort(np.concatenate(sides)), SHAPE, 0.7, 100.0, 20.0)


def test_distortion_is_undone_on_the_points(corners, rng):
    """With the lens known the corners are those of the straight polygon; without it off by more than half a pixel."""
    image = distorted(corners) + rng.standard_normal(SHAPE)
    with_lens = measure.measure_quadrilateral(image, lens=LENS)
    without = measure.measure_quadrilateral(image, "gradient")
    # margin: 4.5 standard deviations of one picture
    assert matched(with_lens.corners, corners) < 4.5 * np.sqrt(np.diag(with_lens.covariance).max()) + 0.005
    assert matched(without.corners, corners) > 0.5  # margin: the order is said


def test_straighten_is_the_inverse_of_distort(rng):
    points = rng.uniform([20, 20], [300, 220], (50, 2))
    assert LENS.straighten(LENS.distort(points)) == pytest.approx(points, abs=1e-6)


def test_nothing_to_be_found(rng):
    with pytest.raises(InvalidInput, match="image must show a convex quadrilateral, got none"):
        measure.measure_quadrilateral(np.full(SHAPE, 7.0))


def test_bad_lens(tmp_path):
    path = tmp_path / "lens.toml"
    path.write_text("fx = -1.0\nfy = 1.0\ncx = 0.0\ncy = 0.0\n")
    with pytest.raises(InvalidInput, match=r"lens\.toml: fx must be greater than 0, got -1\.0"):
        measure.load_lens(path)


def test_corners_that_are_known(corners, rng):
    """Two quadrilaterals: the one whose approximate corners are given is measured, not the more prominent one."""
    other = np.array([[8.0, 180], [60, 182], [58, 232], [9, 228]])
    image = polygon_image(corners, SHAPE, 0.7, 120.0, 20.0) + polygon_image(other, SHAPE, 0.7, 40.0, 0.0)
    image += rng.standard_normal(SHAPE)
    found = measure.measure_quadrilateral(image, corners=other + rng.uniform(-2, 2, other.shape))
    assert found.status == "ok"
    # margin: 4.5 standard deviations of one picture
    assert np.abs(found.corners - other).max() < 4.5 * np.sqrt(np.diag(found.covariance).max())


@pytest.mark.parametrize(
    "bad", [[[1.0, 1]], [[10.0, 10], [20, 20], [20, 10], [10, 20]], [[-5.0, 10], [20, 10], [20, 20], [-5, 20]]]
)
def test_corners_of_no_quadrilateral(bad):
    with pytest.raises(InvalidInput, match="corners must"):
        measure.measure_quadrilateral(np.zeros(SHAPE), corners=bad)
