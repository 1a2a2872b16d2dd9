"""Corners of straightened sides: their covariance by many noisy pictures of one bent quadrilateral."""

import numpy as np
import pytest

import measure
from measure.features.calipers import edge_calipers
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from measure.photo.lens import Intrinsics, _bent, _room, straight_corners
from scenes import InvalidInput
from tests.oracle import polygon_image

SHAPE, NOISE = (100, 120), 2.0
LENS = Intrinsics(fx=150.0, fy=150.0, cx=60.0, cy=50.0, distortion=(-0.25, 0.08, 0.001, -0.0005))
CORNERS = np.array([[30.0, 22.0], [93.0, 30.0], [86.0, 80.0], [24.0, 74.0]])
OPTICS = Optics(SHAPE, 0.7, NOISE**2)


def picture():
    steps = np.linspace(0, 1, 100, endpoint=False)[:, None]
    sides = [a + steps * (b - a) for a, b in zip(CORNERS, np.roll(CORNERS, -1, 0), strict=True)]
    return polygon_image(LENS.distort(np.concatenate(sides)), SHAPE, 0.7, 100.0, 20.0)


def test_covariance_of_all_corners(rng):
    """150 pictures: variances within 4 standard errors (46 %), 2.5 times them refused; correlations to 0.33."""
    clean, layout = picture(), polygon_layout(CORNERS, OPTICS)
    true = straight_corners(clean, layout, LENS)
    assert true.corners == pytest.approx(CORNERS, abs=0.01)
    found = [straight_corners(clean + NOISE * rng.standard_normal(SHAPE), layout, LENS) for _ in range(150)]
    values = np.array([each.corners.ravel() for each in found])
    told = np.mean([each.covariance for each in found], axis=0)
    ratio, within = values.var(0, ddof=1) / np.diag(told), 4 * np.sqrt(2 / 149)
    assert np.abs(ratio - 1).max() < within  # margin: 4 standard errors
    assert np.abs(ratio / 2.5 - 1).min() > within  # margin: 150 % are beyond 4 standard errors
    sigma = np.sqrt(np.diag(told))
    # margin: 4 standard errors and more
    assert np.abs(np.corrcoef(values.T) - told / np.outer(sigma, sigma)).max() < 4 / np.sqrt(150)
    assert (np.array([each.used for each in found]) > 20).all()


def test_sides_without_edge_points():
    with pytest.raises(InvalidInput, match="side s1 must have edge points in the image, got none"):
        straight_corners(picture(), polygon_layout(CORNERS - [0, 60], OPTICS), LENS)


def test_focal_lengths_have_a_least():
    for bad in (0.0009, 1e-300):
        with pytest.raises(ValueError, match=r"a focal length must be at least 0\.001 px"):
            Intrinsics(fx=bad, fy=1.0, cx=0.0, cy=0.0)
    assert Intrinsics(fx=0.001, fy=0.002, cx=1.0, cy=2.0).matrix.tolist() == [[0.001, 0, 1], [0, 0.002, 2], [0, 0, 1]]
    assert Intrinsics(fx=1.0, fy=1.0, cx=0, cy=0, distortion=(0.1, 0.2)).coefficients.tolist() == [0.1, 0.2, 0, 0, 0]


@pytest.mark.parametrize(
    "lens",
    [
        Intrinsics(fx=0.13, fy=0.1, cx=51.0, cy=50.5, distortion=(0.0277,)),
        Intrinsics(fx=159.0, fy=144.0, cx=58.5, cy=49.6, distortion=(20.0, 31.6, -19.2)),
    ],
)
def test_a_lens_that_leaves_no_side_in_the_image_is_refused(lens):
    with pytest.raises(InvalidInput, match=r"side s\d must have edge points in the image, got none"):
        measure.measure_quadrilateral(picture(), lens=lens)


@pytest.mark.parametrize("count", range(7))
def test_up_to_five_coefficients(count):
    """k1, k2, p1, p2, k3; each within a million."""
    given = tuple(0.01 * (i + 1) for i in range(count))
    if count > 5:
        with pytest.raises(ValueError, match="at most 5 items"):
            Intrinsics(fx=1.0, fy=1.0, cx=0.0, cy=0.0, distortion=given)
        return
    lens = Intrinsics(fx=1.0, fy=1.0, cx=0.0, cy=0.0, distortion=given)
    assert lens.coefficients.tolist() == [*given, *[0.0] * (5 - count)]
    for bad in (1.1e6, -1.1e6, float("nan")):
        with pytest.raises(ValueError, match="distortion"):
            Intrinsics(fx=1.0, fy=1.0, cx=0.0, cy=0.0, distortion=(bad,))
    assert Intrinsics(fx=1.0, fy=1.0, cx=0.0, cy=0.0, distortion=(1e6, -1e6)).distortion == (1e6, -1e6)


def test_room():
    """Window, four scales and a pixel from the border: 8 px for a window of 3 and a scale of 1."""
    places = np.array([[8.0, 8.0], [7.9, 50.0], [50.0, 7.9], [111.0, 91.0], [111.1, 50.0], [50.0, 91.1]])
    assert _room(places, OPTICS).tolist() == [True, False, False, True, False, False]


def test_bent_stations():
    """On the bent side, and normals across it: each next station lies along the tangent."""
    caliper = edge_calipers(polygon_layout(CORNERS, OPTICS), 4.0, 0.0)[0]
    t, place, toward = _bent(caliper, LENS)
    assert LENS.straighten(place) == pytest.approx(caliper.at(t, np.zeros(1)), abs=1e-6)
    assert np.linalg.norm(toward, axis=1) == pytest.approx(np.ones(len(t)))
    chord = place[2:] - place[:-2]
    assert np.abs((chord * toward[1:-1]).sum(1)).max() < 1e-3
    turned = np.array([-caliper.direction[1], caliper.direction[0]])
    assert (toward @ turned > 0.9).all()  # margin: a cosine, which is 1 at most
