"""Light between surfaces against the closed forms of form factors: a cylinder's wall, two plates at a right angle."""

import numpy as np
import pytest

import scenes
from imaging.light.bore import _form_factors
from imaging.light.exchange import Patches, form_factors


@pytest.mark.parametrize("deep", [0.5, 2.0, 4.0])
def test_a_bore_sees_itself(deep):
    """Form factors from an open cylinder's wall, and from depths of it, to the wall: 1 less those to its end discs."""
    between, at_nodes, nodes = _form_factors(1 / deep)
    deeper = deep**2 + 2
    to_disc = (1 - (deeper - np.sqrt(deeper**2 - 4)) / 2) / (2 * deep)
    assert between[0].real.sum(1).mean() == pytest.approx(1 - 2 * to_disc, rel=0.015)
    z = nodes * deep
    away = [(x**2 + 2) / (2 * np.sqrt(x**2 + 4)) - x / 2 for x in (z, deep - z)]
    assert at_nodes[0].real.sum(1) == pytest.approx(1 - away[0] - away[1], rel=0.015)
    # margin: the order is said
    assert np.ptp(at_nodes[0].real.sum(1)) > 0.05 * at_nodes[0].real.sum(1).max()  # it is no constant


def test_plates_at_a_right_angle():
    """A point y before a corner of an upright w x h: (atan(w / y) - y / s atan(w / s)) / 2 pi, s^2 = y^2 + h^2."""
    height, width, y = 2.0, 3.0, 0.7
    cells = [((i + 0.5) / 4, (j + 0.5) / 12) for i in range(4) for j in range(12)]
    middles = np.array([[0.0, width * v, height * u] for u, v in cells])
    half = np.array([[0, s * width / 24, t * height / 8] for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    corners = np.repeat(half[:, None], len(middles), 1)
    area = np.full(len(middles), width / 12 * height / 4)
    patches = Patches(middles, np.tile([1.0, 0, 0], (len(middles), 1)), corners, area, area)
    found = form_factors(np.array([[y, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]), patches).sum()
    slant = np.hypot(y, height)
    expected = (np.arctan(width / y) - y / slant * np.arctan(width / slant)) / (2 * np.pi)
    assert found == pytest.approx(expected, rel=1e-6)
    behind = form_factors(np.array([[-y, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]), patches)
    assert not behind.any()


def test_a_convex_body_has_none():
    from imaging.light.between import light_between
    from imaging.pictures import Pictures

    pictures = Pictures.of(scenes.load("task1"), (30, 135), (15, 315))
    assert light_between(pictures, np.zeros((3, 3)), np.zeros(3, int)) == 0
