"""Places of a rim count by as much as they are known: what is told of it does not jump as what hides it grows."""

from dataclasses import replace

import numpy as np
import pytest

import scenes
from imaging.features import rim_look
from imaging.features.circles import HALF, _lacking, calibrated_circle, rim
from imaging.features.locator import MIN_CONTRAST, kappa2
from imaging.features.rim_look import _counted
from imaging.pictures import Pictures
from tests.oracle import pinhole

POSE = (0.0, 0.0)
REACHES = np.arange(4.3, 4.7, 0.02)  # px from the hole's middle to a shadow that grows


@pytest.fixture(scope="module")
def plate():
    return scenes.load("plate")


def looked_at(plate, reach: float, monkeypatch) -> np.ndarray:
    """ln sigma of a radius as places count by and by, and all or nothing: a dark hole; right of a line all is black."""
    circle, camera = plate.solid.circle("c2"), plate.camera
    ends = circle.centre + circle.radius * np.array([[1, 0, 0], [-1, 0, 0]]) - np.array(camera.look_at)
    centre = np.array([camera.width - 1, camera.height - 1]) / 2
    one, other = pinhole(ends, POSE, camera) - centre
    middle, radius = (one + other) / 2, np.linalg.norm(one - other) / 2

    def levels(_, points):
        beside = points - middle
        across = beside @ (one - other) / (2 * radius)
        return np.where(across > reach, 20.0, np.where(np.linalg.norm(beside, axis=-1) < radius, 40.0, 130.0))

    monkeypatch.setattr(rim_look, "seen_at", levels)
    seen = rim(Pictures(plate, np.array(POSE), (np.array([25.0, 170.0]),), closely=True), circle)
    scale, told = plate.locator.scale_px, (seen, replace(seen, known=1.0 * (seen.known >= HALF)))
    both = [calibrated_circle(each, kappa2(scale, each.blur), scale, MIN_CONTRAST**2)[2, 2] for each in told]
    return np.log(both) / 2


def test_what_is_told_of_a_rim_does_not_jump_as_it_is_hidden(plate, monkeypatch):
    """A shadow goes over a hole in steps of 0.02 px. A place of 192 that is gone at once takes 4 % of sigma."""
    told = np.array([looked_at(plate, reach, monkeypatch) for reach in REACHES])
    soft, hard = np.abs(np.diff(told, axis=0)).max(0)
    assert soft < 0.015
    assert hard > 0.03  # all or nothing: what the steps are to show
    assert told[:, 0] == pytest.approx(told[:, 1], abs=0.1)  # sigma itself is about the same


def test_how_much_a_place_counts():
    """All without an excess, a half at the limit, none from twice it on or where it is not known."""
    assert _counted(np.array([0, 1, 2, 7, np.inf, np.nan])) == pytest.approx([1, 0.5, 0, 0, 0, 0])
    assert np.all(np.diff(_counted(np.linspace(0, 2, 50))) < 0)


@pytest.mark.parametrize("arc", [0.1, 0.4, 2.0])
def test_what_correlation_lacks_where_shares_change(arc, rng):
    """Beside the double integral over shares that are constant around each place, errors correlating as exp(-u^2 / 4).

    A trapezium, and any shares at all; the ends of hard pieces alone are something else.
    """
    ramp = np.linspace(0, 1, 9)[1:-1]
    whole = np.zeros(int(16 / arc))
    for shares in (np.concatenate([ramp, np.ones(12), ramp[::-1]]), rng.uniform(0, 1, 30)):
        share = np.concatenate([whole, shares, whole])
        fine = 40
        each = np.repeat(share, fine)
        at = (np.arange(each.size) + 0.5) * arc / fine
        some = each > 0
        kernel = np.exp(-((at[some, None] - at[some]) ** 2) / 4)
        double = each[some] @ kernel @ each[some] * (arc / fine) ** 2
        lacks = (2 * np.sqrt(np.pi) * (share**2).sum() * arc - double) / 2
        found = _lacking(share[:, None], np.full(share.size, arc))[0, 0]
        assert found == pytest.approx(lacks, rel=2e-3)
        if arc < 1:
            assert (np.diff(share) ** 2).sum() != pytest.approx(lacks, rel=0.2)
