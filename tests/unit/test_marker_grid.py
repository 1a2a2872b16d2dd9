"""Grids of ArUco and AprilTag markers: their corners at the covariance told, grids seen in part, what is refused."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import stats

import measure
from imaging.boards.windows import wedges
from measure.boards.marker_grid import Markers
from measure.boards.printed import MARKERS, Printed
from measure.photo.noise import noise_sigma
from scenes import InvalidInput
from tests.boards import SMALL, poses
from tests.commands import ice

RIG = replace(SMALL, board=(4, 3), square=46.0)  # some 50 px from marker to marker
NAME, SHARE, NOISE = "DICT_APRILTAG_36h11", 0.75, 2.0


@pytest.fixture(scope="module")
def seen():
    return poses(RIG, 4, np.random.default_rng(3), 410.0)


@pytest.fixture(scope="module")
def images(seen):
    return [RIG.markers(pose, NAME, SHARE, 3) for pose in seen]


@pytest.fixture(scope="module")
def noisy(images):
    rng = np.random.default_rng(5)
    return [np.rint(image + NOISE * rng.standard_normal(image.shape)) for image in images]


@pytest.fixture(scope="module")
def grids(noisy):
    return [measure.marker_grid(image, RIG.board, NAME, SHARE, NOISE) for image in noisy]


def test_without_noise_corners_are_where_they_are(seen, images):
    found = measure.marker_grid(images[0], RIG.board, NAME, SHARE, 0.3)
    assert set(found.status) == {"ok"}
    assert np.abs(found.corners - RIG.marker_corners(seen[0], SHARE)).max() < 5e-3
    assert abs(found.blur_px - RIG.blur) < 0.015


def test_covariance_is_that_of_the_corners(seen, grids):
    """Chi-square of 4 x 48 corners; 1.4 times the covariance, and OpenCV's places, are rejected."""
    total = rows = 0
    for found, pose in zip(grids, seen, strict=True):
        good = found.measured
        assert good.sum() >= 40
        away = (found.corners - RIG.marker_corners(pose, SHARE))[good]
        total += np.einsum("ni,nij,nj->", away, np.linalg.inv(found.covariance[good]), away)
        rows += away.size
    low, high = stats.chi2.ppf([0.005, 0.995], rows)
    assert low < total < high  # margin: chance, 99 %; 4 seeded pictures
    assert not low < total / 1.4 < high  # margin: 1.4 lies beyond 99 %; 4 seeded pictures
    assert not low < total * 1.4 < high  # margin: 1.4 lies beyond 99 %; 4 seeded pictures


def test_noise_that_corners_leave_is_the_pictures(noisy):
    """With what rounding adds, from the image alone; second differences of all of it are 3 % too large."""
    true = np.hypot(NOISE, 12**-0.5)
    told = [measure.marker_grid(image, RIG.board, NAME, SHARE).noise for image in noisy]
    assert np.mean(told) == pytest.approx(true, rel=0.01)  # 0.004 found
    assert np.mean([noise_sigma(image) for image in noisy]) > 1.02 * true


def test_places_on_the_board(grids):
    """Four corners of each marker, row by row."""
    places = grids[0].places.reshape(3, 4, 2, 2, 2)
    assert places[0, 0].tolist() == [[[0, 0], [SHARE, 0]], [[0, SHARE], [SHARE, SHARE]]]
    assert places[2, 3, 1, 0].tolist() == [3, 2 + SHARE]


def test_markers_that_are_none_of_the_board_are_left_out(seen):
    """One read far off, one read twice, one of a number that the board has not."""
    layout = Markers(SHARE, 8, 4, 3)
    truth = RIG.marker_corners(seen[0], SHARE).reshape(-1, 4, 2)
    read = [(number, four[[0, 1, 3, 2]]) for number, four in enumerate(truth)]
    assert layout.sorted(read).reshape(-1, 4, 2) == pytest.approx(truth)
    read[5] = (5, read[5][1] + [60.0, 9.0])
    grid = layout.sorted([*read, (7, read[0][1]), (12, read[0][1])]).reshape(-1, 4, 2)
    assert [n for n, four in enumerate(grid) if np.isnan(four).any()] == [5, 7]


def test_windows_keep_clear_of_what_is_printed():
    """An upright marker of 48 px in 8 cells, the next one 12 px away: half of that, and 6 px of border less 3 sigma."""
    quad = np.array([[[60.0, 60], [108, 60]], [[60, 108], [108, 108]]])
    found = wedges(np.zeros((170, 170)), quad[None], 0.25, 1 / 8, 0.8)
    assert found.room.all()
    clear = 3 * np.hypot(0.8, 12**-0.5)
    for places, there, corner, inward in zip(
        found.places, found.there, quad.reshape(-1, 2), [(1, 1), (-1, 1), (1, -1), (-1, -1)], strict=True
    ):
        into = (places[there] - corner) * inward
        assert into.min() >= -6
        within = into[(into > 0).all(1)].min(1)
        assert 6 - clear - 1 < within.max() < 6 - clear
    assert not wedges(np.zeros((170, 170)), quad[None], 0.25, 1 / 30, 0.8).room.any()
    assert not wedges(np.zeros((170, 170)), quad[None], 0.04, 1 / 8, 0.8).room.any()


def test_a_camera_is_calibrated_from_markers_seen_in_part(seen, noisy, grids):
    """Within 4 sigma, of four pictures of which one is cut off."""
    cut = noisy[3].copy()
    cut[:, : int(RIG.marker_corners(seen[3], SHARE)[:, 0].mean())] = 180.0
    part = measure.marker_grid(cut, RIG.board, NAME, SHARE, NOISE)
    assert 8 <= part.measured.sum() <= 28
    assert "not_visible" in part.status
    found = measure.calibrate_camera([*grids[:3], part], RIG.square, RIG.size[::-1], "k1,k2,p1,p2")
    assert found.status == "ok"
    assert (np.abs(found.values - RIG.values[:8]) < 4 * found.sd).all()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"shape": None}, "shape must be columns and rows of markers, got none"),
        ({"dictionary": 7}, "dictionary must be one of DICT_4X4_100, .*, got '7'"),
        ({"shape": (30, 20)}, "dictionary must have the board's 600 markers, got DICT_APRILTAG_36h11, which has 587"),
        ({"marker": True}, "marker must be a number more than 0 and less than 1, got True"),
        ({}, "image must show a grid of 4 x 3 markers of DICT_APRILTAG_36h11, got none of them"),
    ],
)
def test_what_is_refused(given, said):
    asked = {"shape": (4, 3), "dictionary": NAME, "marker": SHARE} | given
    with pytest.raises(InvalidInput, match=said):
        measure.marker_grid(np.random.default_rng(1).normal(100, 3, (120, 160)), **asked)


def test_a_kind_of_board_is_measured_by_its_name(noisy, grids):
    printed = Printed(MARKERS, RIG.board, NAME, SHARE)
    printed.check()
    assert printed.measured(noisy[0], NOISE).corners == pytest.approx(grids[0].corners, nan_ok=True)
    with pytest.raises(InvalidInput, match="shape must be columns and rows of markers, got none"):
        replace(printed, shape=None).check()


def test_command(noisy, tmp_path):
    for k, image in enumerate(noisy[:3]):
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.clip(image, 0, 255).astype(np.uint8))
    files = ["calibrate-camera", *(f"{k}.png" for k in range(3)), "--square", RIG.square, "--model", "k1"]
    done = ice(*files, "--markers", NAME, "--shape", "4x3", "--marker", SHARE * RIG.square, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert [each["shape"] for each in json.loads(done.stdout)["boards"]] == [[4, 3]] * 3


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--dots", "--markers", NAME], "--dots, --charuco, --markers must be one at most, got --dots and --markers"),
        (["--marker", "9"], "--marker must be left out of a board without markers, got 9"),
        (["--markers", NAME, "--marker", "9"], "--shape must be given with --markers, got none"),
        (["--charuco", NAME, "--shape", "4x3"], "--marker must be more than 0 and less than --square, 20, got None"),
        (["--charuco", "DICT_1", "--shape", "4x3", "--marker", "9"], "dictionary must be one of DICT_4X4_100"),
    ],
)
def test_options_that_do_not_go_together(more, said, tmp_path):
    done = ice("calibrate-camera", "0.png", "1.png", "2.png", "--square", "20", *more, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
