"""The board that is proposed next: what it is told to be worth, it is worth in calibrations with it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

import measure
import scenes
from measure.boards.next_pose import candidates, information, next_board
from measure.boards.projections import rays_of
from measure.boards.view import on_board
from scenes import InvalidInput, Picture
from tests.boards import SMALL, poses, told
from tests.unit.test_splined import Wavy
from tests.unit.test_splined import boards as wavy_boards
from validation.next_board import propose

SHAPE, SIGMA = SMALL.size[::-1], 0.01


def boards(seen, rng):
    found = []
    for pose in seen:
        truth = SMALL.corners(pose)
        covariance = np.broadcast_to(SIGMA**2 * np.eye(2), (len(truth), 2, 2)).copy()
        found.append(told(truth + SIGMA * rng.standard_normal(truth.shape), covariance, SMALL.board))
    return found


@pytest.fixture(scope="module")
def first():
    """A calibration by four boards."""
    seen = poses(SMALL, 4, np.random.default_rng(4), 420.0)
    given = boards(seen, np.random.default_rng(1))
    return seen, given, measure.calibrate_camera(given, SMALL.square, SHAPE, model="k1,k2,p1,p2")


def test_what_a_board_tells_of_a_camera_is_what_a_calibration_with_it_gains(first):
    """The proposed pose and others, added to the photographs: variances as told, and least of the proposed."""
    seen, _, found = first
    for which in ("fx", "k1"):
        gradient = np.array([float(name == which) for name in found.names])
        proposed = next_board(found, boards(seen, np.random.default_rng(1)), SMALL.square, found.errors.T @ gradient)
        order = np.argsort(proposed.variances)
        assert len(order) > 50
        left = []
        for n in (order[0], order[len(order) // 2], order[-1]):
            more = boards([*seen, proposed.poses[n]], np.random.default_rng(1))
            now = measure.calibrate_camera(more, SMALL.square, SHAPE, model="k1,k2,p1,p2")
            left.append(gradient @ now.covariance @ gradient)
            assert left[-1] == pytest.approx(
                proposed.variances[n], rel=0.1
            )  # at what each calibration finds: 3 % found
        before = gradient @ found.covariance @ gradient
        assert left[0] < left[1] < left[2] < 1.05 * before
        assert left[0] < 0.8 * before
        # negative control: a board that takes nothing for its own pose would tell more
        assert proposed.variances[order[0]] > 1.1 / (1 / before + _of_known_pose(found, proposed.pose, gradient))


def test_a_grid_of_markers_is_worth_what_is_told():
    """Four corners a marker, where they are, some of a photograph not seen: as a calibration with it gains. Negative
    control: markers' middles alone would tell another variance."""
    rig, share, rng = replace(SMALL, board=(4, 3), square=46.0), 0.7, np.random.default_rng(3)
    given, seen = [], poses(rig, 4, np.random.default_rng(4), 420.0)

    def of(pose):
        truth = rig.marker_corners(pose, share)
        covariance = np.broadcast_to(SIGMA**2 * np.eye(2), (len(truth), 2, 2)).copy()
        board = told(truth + SIGMA * rng.standard_normal(truth.shape), covariance, rig.board)
        return replace(board, marker=share)

    given = [of(pose) for pose in seen]
    given[0] = replace(given[0], status=("not_visible",) * 8 + given[0].status[8:])
    found = measure.calibrate_camera(given, rig.square, SHAPE, model="k1,k2,p1,p2")
    gradient = np.array([float(name == "fx") for name in found.names])
    proposed = next_board(found, given, rig.square, found.errors.T @ gradient)
    now = measure.calibrate_camera([*given, of(proposed.pose)], rig.square, SHAPE, model="k1,k2,p1,p2")
    assert gradient @ now.covariance @ gradient == pytest.approx(proposed.variances[proposed.best], rel=0.1)
    for pose in proposed.poses[::20]:
        there = rig.marker_corners(pose, share)
        assert (there > 4).all()
        assert (there < np.array(rig.size) - 5).all()
    few = replace(given[1], marker=0.0, corners=given[1].corners[::4])
    known = np.linalg.inv(found.covariance) + information(found, on_board(few, rig.square), proposed.pose, SIGMA)
    assert gradient @ np.linalg.inv(known) @ gradient > 1.2 * proposed.variances[proposed.best]


def _of_known_pose(found, pose, gradient):
    """Information about one number by a board whose pose is known, the others as they are."""
    places = np.mgrid[: SMALL.board[1], : SMALL.board[0]].reshape(2, -1)[::-1].T
    points = np.concatenate([SMALL.square * places, np.zeros((len(places), 1))], 1)
    lens = found.lens
    matrix = np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1.0]])
    by = cv2.projectPoints(points, pose[:3], pose[3:], matrix, np.array(lens.distortion))[1][:, 6:14] / SIGMA
    return float(gradient @ (by.T @ by) @ gradient)


def test_candidates_are_whole_in_the_image(first):
    found = first[2]
    board = boards(first[0][:1], np.random.default_rng(1))[0]
    for pose in candidates(found, board, SMALL.square)[::20]:
        there = SMALL.corners(pose)
        assert (there > 4).all()
        assert (there < np.array(SMALL.size) - 5).all()
    places = on_board(board, SMALL.square)
    small = information(found, places, first[0][0], 0.02)
    np.testing.assert_allclose(4 * small, information(found, places, first[0][0], 0.01))


def test_u_of_a_measurand_falls_as_told(first):
    """U by the calibration with the proposed board against what was told before it; unknown names in a line."""
    seen, given, found = first
    scene = scenes.load("task1").with_(uncertainty={"covariance": None})
    picture = Picture.of(scene, (30, 135), (15, 315))
    name = scene.quantities[0].name
    told_ = propose(found, given, SMALL.square, picture, name)
    assert told_.U_then < told_.U
    more = boards([*seen, np.array(told_.pose)], np.random.default_rng(1))
    after = measure.calibrate_camera(more, SMALL.square, SHAPE, model="k1,k2,p1,p2")
    again = propose(after, more, SMALL.square, picture, name)
    gained = told_.U - again.U
    assert gained == pytest.approx(told_.U - told_.U_then, rel=0.2)
    assert 0 < told_.tilt_deg < 50
    assert "U of" in told_.text
    with pytest.raises(InvalidInput, match="--next must be one of"):
        propose(found, given, SMALL.square, picture, "none")
    with pytest.raises(InvalidInput, match="must determine a camera before another is proposed"):
        next_board(replace(found, covariance=np.full_like(found.covariance, np.inf)), given, 1.0, np.zeros(8))


def test_what_a_board_tells_of_a_splined_lens_is_what_a_calibration_with_it_gains():
    """Where a ray is recorded, by the board that is proposed and by the worst one. U of a measurand with that lens."""
    seen = poses(SMALL, 12, np.random.default_rng(5), 420.0)
    given = wavy_boards(Wavy(1.5), seen, np.random.default_rng(6))
    found = measure.calibrate_camera(given, SMALL.square, SHAPE, "splined:6x5")
    ray = rays_of(found, np.array([[90.0, 70.0]]))

    def variance(camera):
        by_values = camera.model.seen(camera.values, ray)[1][0, 0]
        return by_values @ camera.covariance @ by_values

    slopes = found.errors.T @ found.model.seen(found.values, ray)[1][0, 0]
    assert slopes @ slopes == pytest.approx(variance(found), rel=1e-6)  # what moves no image is left out
    proposed = next_board(found, given, SMALL.square, slopes)
    for n in (proposed.best, int(proposed.variances.argmax())):
        more = wavy_boards(Wavy(1.5), [*seen, proposed.poses[n]], np.random.default_rng(6))
        now = variance(measure.calibrate_camera(more, SMALL.square, SHAPE, "splined:6x5"))
        assert now == pytest.approx(proposed.variances[n], rel=0.03)  # at what each calibration finds: 0.004 found
    assert proposed.variances.min() < 0.85 * variance(found) < 0.85 * proposed.variances.max() / 0.95
    told_ = propose(found, given, SMALL.square, Picture.of(scenes.load("task1"), (30, 135), (15, 315)), "distance")
    assert 0.5 * told_.U < told_.U_then < 0.95 * told_.U
