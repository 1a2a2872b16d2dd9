"""A photograph with its rows for columns, or mirrored, or twice as bright, is measured as the same one, turned."""

import math

import numpy as np
import pytest

import measure
from measure.features.optics import Optics
from tests.oracle import polygon_image

SHAPE = (150, 210)
CORNERS = np.array([[41.3, 35.2], [171.6, 51.9], [150.4, 120.7], [33.8, 100.1]])
ELLIPSE = np.array([104.3, 69.6, 41.0, 22.0, 25.0])
WAYS = ["transposed", "mirrored", "upside down", "brighter"]


@pytest.fixture(scope="module")
def photograph():
    rng = np.random.default_rng(4)
    clean = polygon_image(CORNERS, SHAPE, 0.9, 110.0, 40.0)
    return clean + np.sqrt(1.0 + 0.01 * clean) * rng.standard_normal(SHAPE)


def turned(image, way):
    pictures = {"transposed": image.T, "mirrored": image[:, ::-1], "upside down": image[::-1], "brighter": 2 * image}
    return np.ascontiguousarray(pictures[way])


def places(points, way, shape=SHAPE):
    """Where places (..., 2) are in the turned picture."""
    x, y = np.moveaxis(np.asarray(points, float), -1, 0)
    height, width = shape
    moved = {
        "transposed": (y, x), "mirrored": (width - 1 - x, y), "upside down": (x, height - 1 - y), "brighter": (x, y),
    }  # fmt: skip
    return np.stack(moved[way], -1)


def flip(way):
    """How differences (x, y) turn."""
    return {"transposed": np.array([[0, 1], [1, 0]]), "mirrored": np.diag([-1, 1]), "upside down": np.diag([1, -1]),
            "brighter": np.eye(2)}[way]  # fmt: skip


@pytest.fixture(scope="module")
def plain(photograph):
    return measure.measure_quadrilateral(photograph, corners=CORNERS)


@pytest.mark.parametrize("way", WAYS)
def test_a_quadrilateral_is_turned(photograph, plain, way):
    """Corners, their covariances, sides and angles by their own corners; noise in grey levels, blur in px."""
    found = measure.measure_quadrilateral(turned(photograph, way), corners=places(CORNERS, way))
    wanted = places(plain.corners, way)
    order = [int(np.linalg.norm(found.corners - corner, axis=1).argmin()) for corner in wanted]
    assert sorted(order) == [0, 1, 2, 3]
    assert found.corners[order] == pytest.approx(wanted, abs=2e-3)
    for k, other in enumerate(order):
        part = np.s_[2 * k : 2 * k + 2]
        here = flip(way) @ plain.covariance[part, part] @ flip(way).T
        there = found.covariance[2 * other : 2 * other + 2, 2 * other : 2 * other + 2]
        assert there == pytest.approx(here, rel=0.05, abs=0.02 * np.trace(here))
    assert found.blur_px == pytest.approx(plain.blur_px, rel=0.01)
    assert found.noise == pytest.approx(plain.noise * (2 if way == "brighter" else 1), rel=0.02)
    assert found.status == plain.status
    for quantity in ("value", "sigma"):
        if hasattr(plain.measurands[0], quantity):
            one, two = (sorted(getattr(m, quantity) for m in each.measurands) for each in (plain, found))
            assert two == pytest.approx(one, rel=0.02)


@pytest.fixture(scope="module")
def ellipse():
    angle = 2 * np.pi * np.arange(400) / 400
    turn = math.radians(ELLIPSE[4])
    along = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    ring = ELLIPSE[:2] + np.column_stack([41.0 * np.cos(angle), 22.0 * np.sin(angle)]) @ along
    rng = np.random.default_rng(5)
    return polygon_image(ring, SHAPE, 0.9, 110.0, 40.0) + 1.5 * rng.standard_normal(SHAPE)


@pytest.mark.parametrize("way", WAYS)
def test_an_ellipse_is_turned(ellipse, way):
    """Centre and axes stay, the angle turns; variances go with them, those of x for y."""
    optics = Optics(SHAPE, 0.9, 2.25, 1.0, 3.0)
    one = measure.find_ellipse(ellipse, ELLIPSE, optics)
    assert one.parameters == pytest.approx(ELLIPSE, abs=0.05)
    angle = {"transposed": 90 - ELLIPSE[4], "brighter": ELLIPSE[4]}.get(way, -ELLIPSE[4])
    expected = np.array([*places(ELLIPSE[:2], way), 41.0, 22.0, angle])
    factor = 2 if way == "brighter" else 1
    there = Optics(SHAPE[::-1] if way == "transposed" else SHAPE, 0.9, 2.25 * factor**2, 1.0, 3.0)
    two = measure.find_ellipse(turned(ellipse, way), expected, there)
    assert two.centre == pytest.approx(places(one.centre, way), abs=1e-3)
    assert two.parameters[2:4] == pytest.approx(one.parameters[2:4], abs=1e-3)
    wanted = {"transposed": 90 - one.parameters[4], "brighter": one.parameters[4]}.get(way, -one.parameters[4])
    assert (two.parameters[4] - wanted + 90) % 180 - 90 == pytest.approx(0.0, abs=0.01)
    assert two.covariance[..., :2, :2] == pytest.approx(
        flip(way) @ one.covariance[..., :2, :2] @ flip(way).T, rel=0.02, abs=0.01 * one.covariance[[0, 1], [0, 1]].sum()
    )
    assert np.diag(two.covariance)[2:] == pytest.approx(np.diag(one.covariance)[2:], rel=0.02)


@pytest.mark.parametrize("way", WAYS)
def test_the_modulation_transfer_of_a_side_is_turned(photograph, way):
    one = measure.mtf(photograph, CORNERS, 1)
    two = measure.mtf(turned(photograph, way), places(CORNERS, way), 1)
    normal = [np.array([math.cos(math.radians(r.direction_deg)), math.sin(math.radians(r.direction_deg))])
              for r in (one, two)]  # fmt: skip
    assert abs(float(normal[1] @ flip(way) @ normal[0])) == pytest.approx(1.0, abs=1e-6)
    part = one.mtf > 0.3
    assert two.mtf[part] == pytest.approx(one.mtf[part], abs=0.05)
    assert two.mtf50 == pytest.approx(one.mtf50, abs=4 * one.mtf50_error)
    assert two.mtf50_error == pytest.approx(one.mtf50_error, rel=0.2)


@pytest.mark.parametrize("way", WAYS)
def test_the_noise_curve_of_a_photograph_is_turned(photograph, way):
    one, two = measure.noise_curve(photograph), measure.noise_curve(turned(photograph, way))
    levels, factor = np.array([45.0, 100.0, 145.0]), 2 if way == "brighter" else 1
    # margin: classes of levels begin at another pixel
    assert two.variance(factor * levels) == pytest.approx(factor**2 * one.variance(levels), rel=0.05)
    assert one.variance(levels) == pytest.approx(1 + 0.01 * levels, rel=0.25)
