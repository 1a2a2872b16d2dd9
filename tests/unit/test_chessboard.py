"""Corners of chessboards: unbiased, at the covariance told, honest about windows that are no crossing."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import stats

import measure
from imaging.boards.fitting import fit_crossings
from imaging.boards.saddle import response
from imaging.boards.windows import windows
from measure.boards.bend import bends
from measure.boards.chessboard import measured
from scenes import InvalidInput
from tests.boards import SMALL, in_order, poses
from tests.oracle import polygon_image

POSE = np.array([0.35, -0.25, 0.1, -105.0, -62.0, 370.0])


@pytest.fixture(scope="module")
def clean():
    return SMALL.image(POSE)


def test_the_simulated_board_is_the_exact_image_where_nothing_is_bent():
    rig = replace(SMALL, distortion=(0.0,) * 5, board=(4, 3), square=40.0)
    image, exact = rig.image(POSE), np.full(rig.size[::-1], 180.0)
    larger = replace(rig, board=(6, 5))
    pose = POSE.copy()
    pose[3:] -= cv2.Rodrigues(pose[:3])[0] @ (np.array([1.0, 1.0, 0]) * rig.square)
    grid = larger.corners(pose).reshape(5, 6, 2)
    for row in range(4):
        for column in range(5):
            if (row + column) % 2:
                corners = grid[[row, row, row + 1, row + 1], [column, column + 1, column + 1, column]]
                exact += (40.0 - 180.0) * polygon_image(corners, exact.shape, rig.blur, 1.0)
    assert np.abs(image - exact)[4:-4, 4:-4].max() < 0.01 * 140  # beyond the image brute force knows nothing


def test_slopes_of_a_crossing_are_central_differences():
    rng = np.random.default_rng(1)
    places = rng.uniform(-6, 6, (3, 40, 2))
    shape = np.column_stack(
        [rng.uniform(-0.3, 0.3, (3, 2)), [0.2, 1.0, -0.4], [1.5, 2.8, 1.4], np.log([0.5, 0.8, 1.5])]
    )
    bend = np.array([[0.0, 0.0], [0.01, -0.02], [0.02, 0.01]])
    found = response(places, shape, bend)
    for k in range(5):
        step = np.zeros(5)
        step[k] = 1e-5
        ahead, back = response(places, shape + step, bend).signs, response(places, shape - step, bend).signs
        assert np.abs((ahead - back) / 2e-5 - found.slopes[..., k]).max() < 1e-6


def test_without_noise_corners_are_where_they_are(clean):
    found = measure.chessboard(clean, (9, 6), noise=0.1)
    assert np.abs(found.corners - in_order(found, SMALL.corners(POSE))).max() < 2.5e-3
    assert abs(found.blur_px - SMALL.blur) < 0.0125
    assert set(found.status) == {"ok"}


def test_a_poor_beginning_does_not_show(clean):
    """Corners first taken to be up to 3 px off also tell wrongly how the lens bends edges, until they are found."""
    truth = SMALL.corners(POSE)
    begun = truth + np.random.default_rng(1).uniform(-2, 2, truth.shape)
    found = measured(clean, begun.reshape(6, 9, 2), 0.1)
    assert np.abs(found.corners - truth).max() < 2.5e-3


def test_covariance_is_that_of_the_corners(clean):
    """Chi-square of 6 x 54 corners; half and double the covariance are rejected."""
    rng, truth, total, rows = np.random.default_rng(5), SMALL.corners(POSE), 0.0, 0
    for _ in range(6):
        found = measure.chessboard(clean + rng.normal(0, 2.0, clean.shape), (9, 6), noise=2.0)
        away = found.corners - in_order(found, truth)
        total += np.einsum("ni,nij,nj->", away, np.linalg.inv(found.covariance), away)
        rows += away.size
    low, high = stats.chi2.ppf([0.005, 0.995], rows)
    assert low < total < high  # margin: chance, 99 %; 6 seeded pictures
    assert not low < total / 1.3 < high  # margin: 1.3 lies beyond 99 %; 6 seeded pictures
    assert not low < total * 1.3 < high  # margin: 1.3 lies beyond 99 %; 6 seeded pictures


def crossing(parameters, shape=(31, 31)):
    """Exact image of two edges that cross: x, y, both directions, logarithm of the blur, four levels; its quadrants."""
    x, y, one, other, blur = parameters[:5]
    along = [60 * np.array([np.cos(a), np.sin(a)]) for a in (one, other)]
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    sides = [(s * along[0], t * along[1]) for s, t in signs]
    corner = np.array([x, y])
    parts = [
        polygon_image([corner, corner + u, corner + u + v, corner + v], shape, np.exp(blur), 1.0) for u, v in sides
    ]
    return sum(level * part for level, part in zip(parameters[5:], parts, strict=True)), parts


def test_a_corner_has_the_cramer_rao_bound():
    """Its covariance against the inverse Fisher information from central differences of exact images."""
    at = np.array([15.3, 14.8, 0.2, 1.6, np.log(0.7), 40.0, 180.0, 40.0, 180.0])
    image, parts = crossing(at)
    way = 24 * np.array([[np.cos(at[2]), np.sin(at[2])], [np.cos(at[3]), np.sin(at[3])]])
    grid = at[:2] + np.arange(-1, 2)[None, :, None] * way[0] + np.arange(-1, 2)[:, None, None] * way[1]
    middle = windows(image, grid).some(np.arange(9) == 4)
    found = fit_crossings(middle, at[None, :5] + [0.1, 0.1, 0.01, -0.02, 0.1], np.zeros((1, 2)), 1e-4)
    assert found.shape[0, :2] == pytest.approx(at[:2], abs=1e-5)

    x, y = middle.places[0][middle.there[0]].astype(int).T
    columns = []
    for k in range(5):
        step = np.eye(9)[k] * 1e-4
        columns.append((crossing(at + step)[0] - crossing(at - step)[0])[y, x] / 2e-4)
    columns += [part[y, x] * field for part in parts for field in (1.0, (x - 15) / 10, (y - 15) / 10)]
    matrix = np.stack(columns, 1)
    assert found.unit_covariance[0] == pytest.approx(np.linalg.inv(matrix.T @ matrix)[:2, :2], rel=1e-3)


def test_lines_that_a_lens_bends_are_known_to_be_bent(clean):
    """Curvature of the middle row against the circle through three images of its own straight line."""
    found = bends(SMALL.corners(POSE).reshape(6, 9, 2))
    fine = replace(SMALL, board=(3, 1), square=5.0)
    at = POSE.copy()
    at[3:] += cv2.Rodrigues(POSE[:3])[0] @ np.array([4 * 25.0 - 5.0, 5 * 25.0, 0])
    (ax, ay), (bx, by), (cx, cy) = fine.corners(at)
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    sides = np.hypot(bx - ax, by - ay) * np.hypot(cx - bx, cy - by) * np.hypot(cx - ax, cy - ay)
    assert found[5, 4, 0] == pytest.approx(2 * area / sides, rel=0.1)


@pytest.mark.parametrize("shape", [(5, 4), (9, 6), (7, 7)])
def test_corners_are_counted(shape):
    rig = replace(SMALL, board=shape, square=18.0)
    pose = poses(rig, 1, np.random.default_rng(2), 330.0)[0]
    found = measure.chessboard(rig.image(pose, 3) + np.random.default_rng(1).normal(0, 1.0, (240, 320)))
    assert found.shape == shape
    # margin: the order is said: from the top left
    assert np.linalg.norm(found.corners[0]) < np.linalg.norm(found.corners[-1])


def test_something_in_front_of_a_corner_is_a_misfit(clean):
    image = clean + np.random.default_rng(1).normal(0, 1.0, clean.shape)
    x, y = SMALL.corners(POSE)[20]
    cv2.circle(image, (round(x + 5), round(y + 2)), 2, 90.0, -1)
    found = measure.chessboard(image, (9, 6), noise=1.0)
    plain = measure.chessboard(clean, (9, 6), noise=1.0)
    which = int(np.argmin(np.hypot(*(found.corners - [x, y]).T)))
    assert found.status[which] == "misfit"
    assert found.covariance[which, 0, 0] > 2 * plain.covariance[which, 0, 0]
    assert sum(each != "ok" for each in found.status) <= 2


def test_the_end_of_the_scale_is_told(clean):
    noisy = clean * 1.6 + np.random.default_rng(1).normal(0, 2.0, clean.shape)
    found = measure.chessboard(np.clip(np.rint(noisy), 0, 255), (9, 6))
    assert not set(found.status) & {"ok"}


def test_sharpened_pictures_are_measured_and_told(clean):
    """Edges under an unsharp mask are narrower than any blur: corners stay, the status says that no model fits."""
    sharp = clean + 0.8 * (clean - cv2.GaussianBlur(clean, (0, 0), 1.0))
    found = measure.chessboard(sharp + np.random.default_rng(1).normal(0, 1.0, clean.shape), (9, 6), noise=1.0)
    assert found.measured.all()
    assert np.abs(found.corners - in_order(found, SMALL.corners(POSE))).max() < 0.09
    assert found.status.count("misfit") > 40


@pytest.mark.parametrize("shape", [(2, 6), (9,), (9, 6.5), "9x6", (9, 500)])
def test_a_shape_that_is_none_is_refused(clean, shape):
    with pytest.raises(InvalidInput, match="shape must be columns and rows"):
        measure.chessboard(clean, shape)


def test_an_image_without_a_board_is_refused():
    with pytest.raises(InvalidInput, match="image must show a whole chessboard of at least 3 x 3"):
        measure.chessboard(np.random.default_rng(1).normal(100, 3, (60, 80)))


@pytest.mark.parametrize("noise", [0, -1.0, float("nan"), "x", 1e300, True])
def test_noise_that_is_none_is_refused(noise):
    with pytest.raises(InvalidInput, match="noise must be a number more than 0"):
        measure.chessboard(np.zeros((60, 80)), noise=noise)


def test_squares_that_are_too_small_are_told():
    found = measure.chessboard(np.kron((np.indices((8, 8)).sum(0) % 2) * 200.0 + 20, np.ones((6, 6))))
    assert set(found.status) == {"short"}
    assert np.isnan(found.corners).all()
