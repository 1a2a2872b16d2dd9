"""Grids of dots: centres under perspective, their covariance, and a camera calibrated from them."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial import KDTree

import measure
from measure.boards.camera import DEFAULT_MODEL
from measure.boards.eccentricity import offsets
from measure.boards.parameters import read_model
from measure.photo.noise import noise_sigma
from scenes import InvalidInput
from tests.boards import SMALL, poses
from tests.commands import ice

RIG = replace(SMALL, board=(7, 5), square=14.0)
RADIUS, NOISE = 0.32, 1.0


@pytest.fixture(scope="module")
def seen():
    return poses(RIG, 4, np.random.default_rng(6), 250.0)


@pytest.fixture(scope="module")
def images(seen):
    return [RIG.dots(pose, RADIUS, 4) for pose in seen]


@pytest.fixture(scope="module")
def grids(images):
    rng = np.random.default_rng(7)
    return [measure.dot_grid(image + NOISE * rng.standard_normal(image.shape), (7, 5), NOISE) for image in images]


def _whitened(grid, away):
    return np.einsum("nij,nj->ni", np.linalg.inv(np.linalg.cholesky(grid.covariance)), away).ravel()


def test_centres_are_those_of_the_images_of_dots(grids, seen):
    """Over four boards; the images of the dots' own centres are not where the dots are seen."""
    away, raw = [], []
    for grid, pose in zip(grids, seen, strict=True):
        assert grid.measured.all()
        truth = RIG.corners(pose)
        nearest = KDTree(truth).query(grid.corners)[1]
        assert sorted(nearest) == list(range(35))
        there = replace(grid, radius=RADIUS, shape=RIG.board)  # in the order of `truth`
        ahead = offsets(there, RIG.square, pose, read_model(DEFAULT_MODEL), RIG.values)[nearest]
        away.append(_whitened(grid, grid.corners - truth[nearest] - ahead))
        raw.append(_whitened(grid, grid.corners - truth[nearest]))
    away, raw = np.concatenate(away), np.concatenate(raw)  # 280 numbers: their standard deviation is known to 4 %
    assert 0.82 < away.std() < 1.18
    assert abs(away.mean()) < 4 / np.sqrt(280)
    assert np.sqrt((raw**2).mean()) > 1.5


def test_noise_is_told_by_what_dots_leave(images):
    """Second differences of the picture take dots' borders for noise, 4 % of it."""
    rng = np.random.default_rng(8)
    seen = [image + NOISE * rng.standard_normal(image.shape) for image in images]
    assert np.mean([measure.dot_grid(each).noise for each in seen]) == pytest.approx(NOISE, rel=0.015)
    assert np.mean([noise_sigma(each) for each in seen]) > 1.03 * NOISE


def test_radius_is_about_the_dots(grids):
    assert [grid.radius for grid in grids] == pytest.approx([RADIUS] * 4, rel=0.06)


def test_middle_of_an_ellipse_is_the_closed_form():
    """A circle seen at a slant through a pinhole: its conic's centre, Q = H^-T C H^-1, centre by Q's minors."""
    pose, matrix = np.array([0.7, -0.4, 0.2, -20.0, -30.0, 240.0]), RIG.matrix
    turn = cv2.Rodrigues(pose[:3])[0]
    homography = matrix @ np.column_stack([turn[:, 0], turn[:, 1], pose[3:]])
    grid = measure.Board((3, 2), np.zeros((6, 2)), np.zeros((6, 2, 2)), ("ok",) * 6, np.ones(6), 1.0, 0.7, RADIUS)
    found = offsets(grid, RIG.square, pose, read_model("none"), matrix[[0, 1, 0, 1], [0, 1, 2, 2]])
    for place, off in zip(grid.places * RIG.square, found, strict=True):
        (x, y), r = place, RADIUS * RIG.square
        conic = np.array([[1, 0, -x], [0, 1, -y], [-x, -y, x**2 + y**2 - r**2]])
        seen = np.linalg.inv(homography).T @ conic @ np.linalg.inv(homography)
        middle = -np.linalg.solve(seen[:2, :2], seen[:2, 2])
        point = homography @ [x, y, 1]
        assert off == pytest.approx(middle - point[:2] / point[2], abs=1e-4, rel=2e-3)
    assert np.abs(found).max() > 0.02


def test_a_camera_is_calibrated_from_dots(grids):
    """Within 4 sigma; the same dots, taken for points, fit worse."""
    found = measure.calibrate_camera(grids, RIG.square, RIG.size[::-1], "k1,k2,p1,p2")
    assert found.status == "ok"
    assert (np.abs(found.values - RIG.values[:8]) < 4 * found.sd).all()
    points = measure.calibrate_camera([replace(grid, radius=0.0) for grid in grids], RIG.square, RIG.size[::-1])
    assert points.chi_square > found.chi_square


def test_a_grid_seen_in_part(images):
    """A covered dot has no centre, a blotted one neither, and those cut off are no dots."""
    whole = measure.dot_grid(images[0], noise=NOISE)
    spot = whole.corners[whole.shape[0] + 1]
    image = images[0].copy()
    cv2.circle(image, tuple(np.rint(spot).astype(int).tolist()), 9, float(image.max()), -1)
    found = measure.dot_grid(image, noise=NOISE)
    assert found.shape == whole.shape
    assert found.measured.sum() == 34
    cut = measure.dot_grid(images[0][:, : int(whole.corners[:, 0].max())], noise=NOISE)
    assert 20 <= cut.measured.sum() < 35


def test_bright_dots(images):
    found = measure.dot_grid(255 - images[1], noise=NOISE)
    assert (found.shape, bool(found.measured.all())) == ((7, 5), True)


def test_what_shows_no_grid():
    noise = 100 + np.random.default_rng(1).standard_normal((200, 200))
    with pytest.raises(InvalidInput, match="image must show a grid of at least 3 x 3 dots, got none"):
        measure.dot_grid(noise)
    with pytest.raises(InvalidInput, match="noise must be a number more than 0"):
        measure.dot_grid(noise, noise=-1.0)


def test_a_grid_of_another_shape(images):
    with pytest.raises(InvalidInput, match="image must show a whole grid of 9 x 6 dots, got 7 x 5"):
        measure.dot_grid(images[0], (9, 6))


def test_command(images, tmp_path):
    rng = np.random.default_rng(8)
    for k, image in enumerate(images):
        shot = np.clip(np.rint(image + 2 * rng.standard_normal(image.shape)), 0, 255).astype(np.uint8)
        cv2.imwrite(str(tmp_path / f"{k}.png"), shot)
    asked = ("--square", RIG.square, "--model", "k1,k2,p1,p2", "--dots", "--json")
    done = ice("calibrate-camera", *(f"{k}.png" for k in range(4)), *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [each["shape"] for each in told["boards"]] == [[7, 5]] * 4
    assert (np.abs(np.array(told["values"]) - RIG.values[:8]) < 4 * np.array(told["sd"])).all()
