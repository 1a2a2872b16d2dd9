"""Errors of an arrangement's corners told to be linear in the noise, or not, by draws whose numbers are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from measure.features import linearity
from measure.features.linearity import _is_linear, _is_linear_nearby, is_reliable

INDEX, ROWS = np.array([1, 3]), np.array([[0.6, -0.8]])
SPREAD = np.tile([-2.0, -1.0, 1.0, 2.0], 64)  # mean 0, square 2.5


def nearby(beyond, full=SPREAD, rows=ROWS):
    """Whether they are linear where so many of the draws are said to have so much left, in standard deviations."""
    spread = np.sqrt(2.5)
    linear, steps, left = np.zeros((3, 256, 5))
    linear[:, 1], steps[:, 1] = SPREAD / 0.6, full / 0.6
    left[: len(beyond), 3] = spread * np.array(beyond) / 0.8

    def drawn(count):
        assert count == 256
        return SimpleNamespace(linear=linear, steps=steps, left=left)

    return _is_linear_nearby(SimpleNamespace(expansion=SimpleNamespace(drawn=drawn)), INDEX, rows)


@pytest.mark.parametrize(
    ("count", "left", "linear"), [(0, 0.0, True), (256, 0.099, True), (12, 0.101, True), (13, 0.101, False)]
)
def test_one_draw_in_twenty_may_leave_the_expansion(count, left, linear):
    """By a tenth of a standard deviation of what is measured."""
    assert nearby([left] * count) is linear


def test_the_worse_of_two_quantities_has_left_it():
    """The second is told by what is well within."""
    rows = np.array([[0.6, -0.8], [0.6, 0.0]])
    assert nearby([0.101] * 12, rows=rows)
    assert not nearby([0.101] * 13, rows=rows)


def test_within_the_expansion_the_errors_decide():
    assert nearby([], SPREAD * 1.04)
    assert not nearby([], SPREAD * 1.06)


@pytest.mark.parametrize(
    ("full", "linear"),
    [
        (SPREAD + 0.19 * np.sqrt(2.5), True), (SPREAD + 0.21 * np.sqrt(2.5), False),
        (SPREAD - 0.19 * np.sqrt(2.5), True), (SPREAD - 0.21 * np.sqrt(2.5), False),
        (SPREAD * np.sqrt(1.09), True), (SPREAD * np.sqrt(1.11), False),
        (SPREAD / np.sqrt(1.09), True), (SPREAD / np.sqrt(1.11), False),
    ],
)  # fmt: skip
def test_bias_and_variance_of_full_errors(full, linear):
    """A fifth of a standard deviation and a tenth of the variance, either way; the worse of two quantities decides."""
    columns = np.stack([SPREAD, SPREAD[::-1]], 1)
    assert _is_linear(columns[:, :1], full[:, None], 0.0) is linear
    assert _is_linear(columns, np.stack([full, SPREAD[::-1]], 1), 0.0) is linear
    assert _is_linear(columns[:, ::-1], np.stack([SPREAD[::-1], full], 1), 0.0) is linear


def test_full_errors_of_the_same_spread_but_other_ones():
    """Turned by an angle in the plane of two uncorrelated rows of draws: 2 sin(angle / 2) of them apart."""
    other = np.tile([-1.0, 2.0, -2.0, 1.0], 64)
    assert SPREAD @ other == 0
    for angle, linear in ((0.29, True), (0.31, False)):
        full = SPREAD * np.cos(angle) + other * np.sin(angle)
        assert _is_linear(SPREAD[:, None], full[:, None], 0.0) is linear


def test_few_draws_are_given_leeway():
    """Two root mean squares of what they differ by over the root of their number: of 16 draws a half."""
    small = SPREAD[:16, None]
    spread = np.sqrt(2.5)
    for shift, linear in ((0.39, True), (0.41, False)):  # 0.2 + 0.5 x shift
        assert _is_linear(small, small + shift * spread, 0.5) is linear
    for factor, linear in ((1.09, True), (1.24, False)):  # 2 ln(1.09) = 0.17 against 0.095 + 0.09; 0.43 against 0.34
        assert _is_linear(small, small * factor, 0.5) is linear


@pytest.fixture
def asked(monkeypatch):
    """A tool of one quantity whose full errors are those given by count, and the counts that it was asked for."""
    counts = []

    def made(full, here=1.0, wherever=1.0, nearby=False):
        monkeypatch.setattr(linearity, "_is_linear_nearby", lambda *given: nearby)
        monkeypatch.setattr(linearity, "asked_of", lambda corners: ROWS)

        def drawn(centre, count):
            counts.append(count)
            linear, errors = np.zeros((2, count, 5))
            linear[:, 1], errors[:, 1] = SPREAD[:count] / 0.6, full(SPREAD[:count]) / 0.6
            return linear, errors

        def covariance(size):
            whole = np.diag([50.0, 1.0, 70.0, 1.0, 90.0])
            whole[INDEX, INDEX] = size
            return whole

        tool = SimpleNamespace(
            arrangement=SimpleNamespace(corners=np.array([0])), index=lambda corners: INDEX, drawn=drawn,
            wherever=lambda centre: covariance(wherever),
        )  # fmt: skip
        state = SimpleNamespace(vertices=np.zeros((1, 2)))
        return is_reliable(tool, SimpleNamespace(covariance=covariance(here), state=state)), counts

    return made


@pytest.mark.parametrize(
    ("shift", "told"),
    [(0.0, (True, [24])), (0.3, (True, [24, 96])), (9.0, (False, [24])), (0.24, (False, [24, 96]))],
)
def test_so_many_images_are_measured_in_full_as_decide_it(asked, shift, told):
    """A few; more where these leave it open."""

    def full(errors):
        if told[0] and len(errors) == 96:
            return errors
        return errors + shift * np.sqrt(2.5)

    assert asked(full) == told


def test_what_is_linear_nearby_is_not_measured_in_full(asked):
    assert asked(lambda errors: errors + 9, nearby=True) == (True, [])


@pytest.mark.parametrize(
    ("here", "wherever", "told"), [(2.0, 2.49, True), (2.0, 2.51, False), (np.inf, 2.0, False), (np.nan, 2.0, False)]
)
def test_what_is_known_of_other_vertices_must_not_decide(asked, here, wherever, told):
    """A quarter more of variance without it; of a variance that is none nothing is told."""
    assert asked(lambda errors: errors, here, wherever, nearby=True)[0] is told
