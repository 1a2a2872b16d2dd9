"""ChArUco boards: corners beside markers at the covariance told, boards seen in part, and what is refused."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import stats

import measure
from imaging.boards.windows import Marked, windows
from measure.boards.chessboard import measured
from measure.photo.noise import noise_sigma
from scenes import InvalidInput
from tests.boards import SMALL, poses
from tests.commands import ice

RIG = replace(SMALL, board=(5, 4), square=26.0)  # some 30 px a square
NAME, SHARE, NOISE = "DICT_5X5_100", 0.7, 2.0


@pytest.fixture(scope="module")
def seen():
    return poses(RIG, 4, np.random.default_rng(6), 330.0)


@pytest.fixture(scope="module")
def images(seen):
    return [RIG.charuco(pose, NAME, SHARE, 3) for pose in seen]


def test_the_drawn_board_is_opencvs(seen, images):
    """Warped from OpenCV's own picture of the board, but for the lens: what is bright and dark is the same."""
    rig = replace(RIG, distortion=(0.0,) * 5)
    ours = rig.charuco(seen[0], NAME, SHARE, 3)
    board = cv2.aruco.CharucoBoard((6, 5), 1.0, SHARE, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100))
    side = 40  # a marker's cells are 4 px
    flat = board.generateImage((6 * side, 5 * side)).astype(np.float32) * (140 / 255) + 40
    turn = cv2.Rodrigues(seen[0][:3])[0]
    onto = rig.matrix @ np.column_stack([turn[:, 0], turn[:, 1], seen[0][3:]]) @ np.diag([rig.square, rig.square, 1])
    onto = onto @ np.array([[1 / side, 0, 0.5 / side - 1], [0, 1 / side, 0.5 / side - 1], [0, 0, 1]])
    warped = cv2.warpPerspective(flat, onto, rig.size, borderValue=180.0)
    smooth = [cv2.GaussianBlur(each, (0, 0), 2.0) for each in (warped, ours, np.roll(ours, 2, 1))]
    assert np.abs(smooth[0] - smooth[1]).max() < 20  # of 140
    assert np.abs(smooth[0] - smooth[2]).max() > 28


def test_without_noise_corners_are_where_they_are(seen, images):
    found = measure.charuco(images[0], RIG.board, NAME, SHARE, 0.1)
    assert set(found.status) == {"ok"}
    assert np.abs(found.corners - RIG.corners(seen[0])).max() < 2.5e-3


def test_covariance_is_that_of_the_corners(seen, images):
    """Chi-square of 4 boards in 2 draws; 1.5 times the covariance, and windows that reach into the markers, are
    rejected."""
    rng, total, rows = np.random.default_rng(5), 0.0, 0
    for image, pose in zip(images, seen, strict=True):
        truth = RIG.corners(pose)
        for _ in range(2):
            noisy = image + rng.normal(0, NOISE, image.shape)
            clear = measure.charuco(noisy, RIG.board, NAME, SHARE, NOISE)
            good = clear.measured
            assert good.sum() >= 16
            assert set(clear.status) <= {"ok", "not_visible"}
            away = (clear.corners - truth)[good]
            total += np.einsum("ni,nij,nj->", away, np.linalg.inv(clear.covariance[good]), away)
            rows += away.size
        plain = measured(noisy, truth.reshape(4, 5, 2), NOISE)
        assert plain.status.count("misfit") > 10
    low, high = stats.chi2.ppf([0.005, 0.995], rows)
    assert low < total < high  # margin: chance, 99 %; 8 seeded pictures
    assert not low < total / 1.5 < high  # margin: 1.5 lies beyond 99 %; 8 seeded pictures
    assert not low < total * 1.5 < high  # margin: 1.5 lies beyond 99 %; 8 seeded pictures


def test_noise_that_corners_leave_is_the_pictures(images):
    """From the image alone; second differences of all of it are 3 % too large."""
    rng = np.random.default_rng(5)
    noisy = [image + NOISE * rng.standard_normal(image.shape) for image in images]
    told = [measure.charuco(image, RIG.board, NAME, SHARE).noise for image in noisy]
    assert np.mean(told) == pytest.approx(NOISE, rel=0.01)  # 0.001 found
    assert np.mean([noise_sigma(image) for image in noisy]) > 1.02 * NOISE


def test_windows_keep_clear_of_markers():
    """Upright squares of 40 px with a gap of 6 px: none of a marker's square but within 6 px less three sigma."""
    grid = np.stack(np.meshgrid(20.0 + 40 * np.arange(4), 20.0 + 40 * np.arange(3)), -1)
    found = windows(np.zeros((130, 170)), grid, Marked(0.15), 0.8)
    clear = 3 * np.hypot(0.8, 12**-0.5)
    row, column = np.indices((3, 4)).reshape(2, -1)
    for k, corner in enumerate(grid.reshape(-1, 2)):
        away = found.places[k][found.there[k]] - corner
        beside = away[away.prod(1) * (-1 if (row[k] + column[k]) % 2 == 0 else 1) > 0]
        assert 6 - clear - 1 < np.abs(beside).min(1).max() < 6 - clear
        free = away[away.prod(1) * (-1 if (row[k] + column[k]) % 2 == 0 else 1) < 0]
        assert np.abs(free).min(1).max() > 3.9
    assert not windows(np.zeros((130, 170)), grid, Marked(0.05), 0.8).room.any()


def test_a_board_seen_in_part(seen, images):
    """Cut off, and covered in the middle: corners that are left keep their places on the board."""
    truth = RIG.corners(seen[1])
    image = images[1] + np.random.default_rng(2).normal(0, NOISE, images[1].shape)
    cut = image[:, : int(truth[:, 0].mean())]
    found = measure.charuco(cut, RIG.board, NAME, SHARE, NOISE)
    assert found.shape == RIG.board
    assert 4 <= found.measured.sum() < 14
    assert "not_visible" in found.status
    away = (found.corners - truth)[found.measured]
    assert np.abs(away).max() < 5 * np.sqrt(np.nanmax(found.covariance))
    x, y = truth[7]
    cv2.circle(image, (round(x), round(y)), 14, 90.0, -1)
    covered = measure.charuco(image, RIG.board, NAME, SHARE, NOISE)
    assert not covered.measured[7]
    assert 4 <= covered.measured.sum() < 20


def test_a_board_that_begins_with_a_marker(seen):
    """As OpenCV printed those of an even number of rows before 4.6: 6 x 6 squares."""
    rig = replace(RIG, board=(5, 5), square=22.0)
    pose = seen[2] + [0, 0, 0, 5, -5, 0]
    found = measure.charuco(rig.charuco(pose, NAME, SHARE, 3, older=True), (5, 5), NAME, SHARE, 0.3)
    good = found.measured
    assert good.sum() > 20
    assert np.abs(found.corners - rig.corners(pose))[good].max() < 5e-3


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"shape": None}, "shape must be columns and rows of inner corners, got none"),
        ({"shape": (2, 4)}, "shape must be columns and rows of inner corners, 3 to 200 each, got"),
        ({"dictionary": "DICT_9X9"}, "dictionary must be one of DICT_4X4_100, .*, got 'DICT_9X9'"),
        ({"shape": (20, 20)}, "dictionary must have the board's 220 markers, got DICT_5X5_100, which has 100"),
        ({"marker": 1.0}, "marker must be a number more than 0 and less than 1, got 1.0"),
        ({"marker": float("nan")}, "marker must be a number more than 0 and less than 1, got nan"),
        ({"noise": 0}, "noise must be a number more than 0"),
        ({}, "image must show a ChArUco board of 5 x 4 inner corners and markers of DICT_5X5_100, got none"),
    ],
)
def test_what_is_refused(given, said):
    asked = {"shape": (5, 4), "dictionary": NAME, "marker": SHARE} | given
    with pytest.raises(InvalidInput, match=said):
        measure.charuco(np.random.default_rng(1).normal(100, 3, (120, 160)), **asked)


def test_command(images, tmp_path):
    """A camera from four boards, one of them cut off; and an option that lacks another."""
    rng = np.random.default_rng(8)
    for k, image in enumerate(images):
        shot = np.clip(np.rint(image + NOISE * rng.standard_normal(image.shape)), 0, 255).astype(np.uint8)
        if k == 3:
            shot[:, :120] = 180
        cv2.imwrite(str(tmp_path / f"{k}.png"), shot)
    files = ["calibrate-camera", *(f"{k}.png" for k in range(4)), "--square", RIG.square, "--model", "k1,k2,p1,p2"]
    board = ("--charuco", NAME, "--shape", "5x4", "--marker", SHARE * RIG.square)
    done = ice(*files, *board, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [each["shape"] for each in told["boards"]] == [[5, 4]] * 4
    assert told["boards"][3]["status"]["not_visible"] > 0
    assert (np.abs(np.array(told["values"]) - RIG.values[:8]) < 4 * np.array(told["sd"])).all()
