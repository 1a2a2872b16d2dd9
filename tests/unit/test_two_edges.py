"""An edge beside which another one runs for a part of its length: no noise decides which of the two a line goes along.

The picture: a border of contrast 60 along x, and one of a share of it, brightening the same way, that crosses it at a
small angle: within the search window along a part, as of a shadow that meets the border.
"""

import numpy as np
import pytest
from scipy.special import ndtr

from imaging.features.locator import edge_blur
from measure.estimators import crossings
from measure.estimators.gradient import gradient_locator
from measure.estimators.separate import PointEstimator
from measure.features.calipers import Caliper
from measure.features.lines import trapezoid
from measure.features.optics import Optics
from scenes import status

OPTICS = Optics((40, 120), blur_px=0.7, noise_variance=2.25, scale_px=1.0)
PLACES, COUNT, CONTRAST = np.arange(20.0, 101.0, 2.0), 400, 60.0
MOST = 0.1  # of the variance: what of a line's errors no derivative tells


def caliper() -> Caliper:
    return Caliper("e", np.array([0.0, 20.2]), np.array([1.0, 0.0]), 120.0, PLACES, status.OK, OPTICS, np.zeros(2))


def border(away: np.ndarray) -> np.ndarray:
    """0 on one side, 1 on the other, so many px away."""
    return ndtr(away / edge_blur(OPTICS.blur_px))


Y, X = np.mgrid[:40, :120].astype(float)
AWAY = Y - 20.2


def image(share: float, angle: float, where: float) -> np.ndarray:
    """Both borders; the other one crosses the first ``where`` px along, at an angle, degrees."""
    slant = np.radians(angle)
    return 40 + CONTRAST * (border(AWAY) + share * border((AWAY - (X - where) * np.tan(slant)) * np.cos(slant)))


def estimator() -> PointEstimator:
    return PointEstimator(caliper(), gradient_locator(OPTICS, caliper()))


def errors(clean: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the line's level and slope in noisy images, (n, 2): to first order, in full; and the statuses."""
    tool = estimator()
    noise = np.random.default_rng(3).normal(0, np.sqrt(OPTICS.noise_variance), (COUNT, *clean.shape))
    found, here = tool.estimate(clean + noise, OPTICS.noise_variance), tool.estimate(clean[None], OPTICS.noise_variance)
    told = noise.reshape(COUNT, -1)[:, tool.pixels] @ tool.respond_within(clean, tool.pixels).T
    full = np.concatenate([found.level - here.level, found.slope - here.slope], 1)
    return told, full, np.append(found.state, here.state)


def tells_errors(clean: np.ndarray) -> bool:
    """Whether drawn noise says that the derivatives tell the errors."""
    tool = estimator()
    return bool(np.isfinite(tool.respond_within(clean, tool.pixels, asked=True)).all())


def untold(clean: np.ndarray) -> float:
    """Largest part of the variances that is not the first order's."""
    told, full, _ = errors(clean)
    return float(((full - told).var(0) / told.var(0)).max())


CROSSED = [(share, angle, where) for share in (0.5, 0.8, 1.3) for angle in (5.0, 12.0, -12.0) for where in (20, 85)]


@pytest.mark.parametrize(("share", "angle", "where"), CROSSED)
def test_a_line_s_errors_are_linear_where_another_edge_crosses(share, angle, where):
    """The one is stronger: a point that would jump counts the less the nearer it is to that."""
    clean = image(share, angle, where)
    assert untold(clean) < MOST
    assert tells_errors(clean)


def plainly_found(monkeypatch) -> None:
    """Every point counts as a whole, the steepest descent from one place to the next is taken."""

    monkeypatch.setattr(crossings, "surest", crossings.bracket)
    monkeypatch.setattr(crossings, "counted", lambda found, spread, size: np.ones(found.start.shape))


def test_points_that_jump_would_scatter_the_line(monkeypatch):
    """Without that a point that noise takes from one edge to the other leaves several times the variance untold."""
    plainly_found(monkeypatch)
    assert untold(image(1.3, 5.0, 20)) > 3
    assert untold(image(1.3, 12.0, 85)) > 10


@pytest.mark.parametrize(("angle", "where"), [(5.0, 20), (12.0, 20), (12.0, 85)])
def test_where_both_are_as_strong_drawn_noise_says_that_no_variance_is_told(angle, where):
    """Where they part, a point slides from one to the other: no derivative tells how far."""
    clean = image(1.0, angle, where)
    assert untold(clean) > MOST
    assert not tells_errors(clean)


@pytest.mark.parametrize(("apart", "expected"), [(0.0, "ok"), (1.4, "ill_conditioned")])
def test_two_edges_side_by_side_are_no_edge(apart, expected):
    """As strong, parallel, one on either side: noise decides at every place which of them is found."""
    clean = 40 + CONTRAST * (border(AWAY - apart) + border(AWAY + apart))
    assert estimator().estimate(clean[None], OPTICS.noise_variance).state[0, 0] == expected


@pytest.mark.parametrize("contrast", [5.3, 7.0, 12.0])
def test_a_faint_edge_is_no_pair(contrast):
    """Of a contrast that is just enough, over the noise: found in all images, as scattered as told."""
    clean = 40 + contrast * np.sqrt(OPTICS.noise_variance) * border(AWAY)
    _, _, states = errors(clean)
    assert np.isin(states, (status.OK, status.LOW_CONTRAST)).all()
    assert (states[-1], tells_errors(clean)) == (status.OK, True)
    assert untold(clean) < MOST


@pytest.mark.parametrize("is_whole", [True, False])
def test_how_much_points_count_is_derived(is_whole, monkeypatch):
    """Against central differences of the line through them; without it the derivatives are others."""
    if not is_whole:
        monkeypatch.setattr(crossings, "counted_by", lambda rows, spread: np.zeros(rows.shape))
    clean, tool = image(1.3, 12.0, 85), estimator()
    counted = tool.locator.locate(clean[None]).weights / trapezoid(PLACES)
    assert ((counted > 0.2) & (counted < 0.98)).any()
    toward, step = np.random.default_rng(8).standard_normal((20, *clean.shape)), 1e-3
    above, below = (tool.estimate(clean + sign * step * toward, OPTICS.noise_variance) for sign in (1, -1))
    told = toward.reshape(20, -1)[:, tool.pixels] @ tool.respond_within(clean, tool.pixels).T
    for k, name in enumerate(("level", "slope")):
        difference = (getattr(above, name) - getattr(below, name))[:, 0] / (2 * step)
        off = np.abs(difference - told[:, k]).max() / np.abs(told[:, k]).max()
        assert (off < 5e-3) == is_whole, off


def test_a_lone_edge_is_found_as_ever():
    """All its points count as a whole."""
    noise = np.random.default_rng(1).normal(0, 1.5, (50, 40, 120))
    points = estimator().locator.locate(image(0.0, 5.0, 20) + noise)
    np.testing.assert_array_equal(points.weights, np.broadcast_to(trapezoid(PLACES), (50, PLACES.size)))
    assert (points.certain == 1).all()
