"""A camera from boards: its covariance is that of its errors, and what does not fit is told."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import stats

import measure
from measure.boards import camera
from scenes import InvalidInput
from tests.boards import SMALL, poses, told


@pytest.fixture(scope="module")
def seen():
    return poses(SMALL, 8, np.random.default_rng(4), 420.0)


def boards(seen, rng, scale=1.0, rig=SMALL):
    """Corners with errors of a covariance of their own each; ``scale`` times as large as told."""
    found = []
    for pose in seen:
        truth = rig.corners(pose)
        root = 0.004 * rng.normal(size=(len(truth), 2, 2)) + 0.008 * np.eye(2)
        error = np.einsum("nij,nj->ni", root, rng.normal(size=truth.shape))
        found.append(told(truth + scale * error, root @ root.transpose(0, 2, 1), rig.board))
    return found


SHAPE = SMALL.size[::-1]


def test_covariance_is_that_of_the_errors(seen):
    """Chi-square of 60 calibrations' nine parameters, and of a pose's six; 1.3 times either way is rejected."""
    rng, total, pose_total = np.random.default_rng(2), 0.0, 0.0
    for _ in range(60):
        found = measure.calibrate_camera(boards(seen, rng), SMALL.square, SHAPE)
        away = found.values - SMALL.values
        total += away @ np.linalg.solve(found.covariance, away)
        turned = found.poses[2] - seen[2]
        pose_total += turned @ np.linalg.solve(found.pose_covariance[2], turned)
        assert found.names == ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
    for sum_of_squares, rows in ((total, 540), (pose_total, 360)):
        low, high = stats.chi2.ppf([0.003, 0.997], rows)
        assert low < sum_of_squares < high  # margin: chance, 99.4 %; 60 seeded calibrations
        assert not low < sum_of_squares / 1.3 < high  # margin: 1.3 lies beyond 99.4 %; 60 seeded calibrations
        assert not low < sum_of_squares * 1.3 < high  # margin: 1.3 lies beyond 99.4 %; 60 seeded calibrations


def test_chi_square_judges_the_corners_covariance(seen):
    rng = np.random.default_rng(3)
    good = measure.calibrate_camera(boards(seen, rng), SMALL.square, SHAPE)
    bad = measure.calibrate_camera(boards(seen, rng, 2.0), SMALL.square, SHAPE)
    assert (good.status, good.dispersion) == ("ok", 1.0)
    assert bad.status == "misfit"
    assert bad.dispersion == pytest.approx(4.0, rel=0.2)
    # margin: of one draw each; sd that are not enlarged are 50 % off
    assert bad.sd == pytest.approx(2 * good.sd, rel=0.3)


def test_a_model_that_is_too_small_is_a_misfit(seen):
    exact = [told(SMALL.corners(pose), np.tile(1e-4 * np.eye(2), (54, 1, 1)), SMALL.board) for pose in seen]
    small = measure.calibrate_camera(exact, SMALL.square, SHAPE, model="f,k1")
    whole = measure.calibrate_camera(exact, SMALL.square, SHAPE)
    assert small.names == ("fx", "cx", "cy", "k1")
    assert small.status == "misfit"
    assert whole.status == "ok"
    assert whole.values == pytest.approx(SMALL.values, abs=1e-5)
    assert small.lens.fx == small.lens.fy


def test_the_squares_size_scales_the_poses_alone(seen):
    rng = np.random.default_rng(5)
    found = boards(seen, rng)
    one = measure.calibrate_camera(found, 25.0, SHAPE)
    other = measure.calibrate_camera(found, 50.0, SHAPE, square_sd=0.1)
    assert (np.abs(other.values - one.values) < 1e-4 * one.sd).all()
    assert other.poses[:, 3:] == pytest.approx(2 * one.poses[:, 3:], rel=1e-6)
    added = other.pose_covariance[0, 3:, 3:] - 4 * one.pose_covariance[0, 3:, 3:]
    assert added == pytest.approx(np.outer(other.poses[0, 3:], other.poses[0, 3:]) * (0.1 / 50) ** 2, rel=1e-3)


def test_corners_that_were_not_measured_are_left_out(seen):
    found = boards(seen, np.random.default_rng(6))
    states = ("short", *found[0].status[1:])
    corners = np.where(np.arange(54)[:, None] == 0, np.nan, found[0].corners)
    less = measure.calibrate_camera([replace(found[0], corners=corners, status=states), *found[1:]], 25.0, SHAPE)
    assert less.freedom == measure.calibrate_camera(found, 25.0, SHAPE).freedom - 2
    assert np.isnan(less.residuals[0][0]).all()


@pytest.mark.parametrize("seed", range(12))
def test_boards_side_by_side_determine_no_focal_length(seed):
    """OpenCV begins with one below 0 in every fifth of them."""
    level = [np.array([0, 0, 0.1 * i, -100.0 + 5 * i, -62.0, 420.0 + 10 * i]) for i in range(4)]
    found = measure.calibrate_camera(boards(level, np.random.default_rng(seed)), 25.0, SHAPE, model="none")
    assert found.status == "ill_conditioned"


def test_a_bent_board_is_told_with_its_sags(seen):
    """Of 30 calibrations the sags and intrinsics scatter as told; taken for flat, the board is a misfit."""
    true, rng, total, away = np.array([1.2, -0.7]), np.random.default_rng(10), 0.0, []
    covariance = 0.01**2 * np.eye(2)
    flat = told(np.zeros((54, 2)), np.tile(covariance, (54, 1, 1)), SMALL.board)
    x, y = ((flat.places - [4, 2.5]) / [4, 2.5]).T
    places = np.column_stack([flat.places * SMALL.square, true[0] * (1 - x**2) + true[1] * (1 - y**2)])
    for _ in range(30):
        bent = []
        for pose in seen:
            image = cv2.projectPoints(places, pose[:3], pose[3:], SMALL.matrix, np.array(SMALL.distortion))[0]
            bent.append(replace(flat, corners=image.reshape(-1, 2) + 0.01 * rng.standard_normal((54, 2))))
        found = measure.calibrate_camera(bent, SMALL.square, SHAPE, curved=True)
        assert found.status == "ok"
        left = np.append(found.sags - true, found.values - SMALL.values)
        total += left[2:] @ np.linalg.solve(found.covariance, left[2:])
        away.append(np.linalg.solve(np.linalg.cholesky(found.sag_covariance), left[:2]))
    for squares, rows in ((float((np.array(away) ** 2).sum()), 60), (total, 270)):
        low, high = stats.chi2.ppf([0.003, 0.997], rows)
        assert low < squares < high  # margin: chance, 99.4 %; 30 seeded calibrations
        assert not low < squares * 2 < high  # margin: 2 lies beyond 99.4 %; 30 seeded calibrations
    assert measure.calibrate_camera(bent, SMALL.square, SHAPE).status == "misfit"


def test_the_covariance_is_one_that_budgets_read(seen):
    found = measure.calibrate_camera(boards(seen, np.random.default_rng(8)), 25.0, SHAPE, "f,k1,k2")
    assert found.for_budget.names == ("fx", "cx", "cy", "k1", "k2")
    assert found.for_budget.sd == pytest.approx(found.sd)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"square_size": 0.0}, "square_size must be a number more than 0, got 0.0"),
        ({"square_sd": -1.0}, "square_sd must be a number of at least 0"),
        ({"image_shape": (0, 4)}, "image_shape must be"),
        ({"model": "k9"}, "model must be none, splined, or some of f, k1, k2, p1, p2, k3, got 'k9'"),
        ({"model": np.zeros(3)}, "model must be none, splined, or"),
        ({"boards": True}, "boards must be a list of Boards"),
        ({"boards": []}, "boards must be at least 3"),
        ({"boards": [1, 2, 3]}, "boards must be a list of Boards"),
    ],
)
def test_what_is_no_calibration_is_refused(seen, change, match):
    given = {"boards": boards(seen, np.random.default_rng(1)), "square_size": 25.0, "image_shape": SHAPE} | change
    with pytest.raises(InvalidInput, match=match):
        measure.calibrate_camera(**given)


def test_boards_that_leave_the_lens_anywhere_are_refused_in_one_line():
    """Three alike, in the middle of the picture, gave a distortion of 1e10 and an internal error."""
    with pytest.raises(
        InvalidInput, match=r"boards must be .* the lens, got distortion 0, 1.25e\+06, 0, 0, -1.58e\+10"
    ):
        camera._lens(np.diag([900.0, 900.0, 1.0]), np.array([0, 1.247e6, 0, 0, -1.577e10]))
