"""Ellipses and chessboards under noise that is not white: the told covariance is that of re-shots."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import sparse

from measure.boards.chessboard import measured, respond
from measure.features.optics import Optics
from measure.find.ellipse import fitted_ellipse
from measure.photo.board_noise import board_covariance
from measure.photo.correlation import Correlation
from measure.photo.ellipses import measure_ellipse
from measure.photo.recording import recording
from scenes.photograph import Photograph
from tests.pattern_image import chessboard_cells, pattern_image
from tests.photographs import ellipse

ELLIPSE = np.array([60.3, 55.7, 38.0, 27.0, 30.0])
BOARD = np.array([[20.0, 18.0], [176.0, 24.0], [170.0, 134.0], [26.0, 140.0]])


def shots(clean, count, rng, blur=0.6):
    """Smoothed after they were taken."""
    for _ in range(count):
        yield np.rint(cv2.GaussianBlur(clean + 6 * rng.standard_normal(clean.shape), (0, 0), blur))


def board_picture():
    """Exact, of 6 x 4 squares, and its inner corners (rows, columns, 2), px."""
    square = np.array([[0, 0], [6, 0], [6, 4], [0, 4]], np.float32)
    turn = cv2.getPerspectiveTransform(square, BOARD.astype(np.float32))
    places = np.stack(np.meshgrid(np.arange(1.0, 6), np.arange(1.0, 4)), -1)
    grid = cv2.perspectiveTransform(places.reshape(1, -1, 2), turn).reshape(places.shape)
    return pattern_image(chessboard_cells(6, 4), BOARD, (160, 196)), grid


def test_ellipse(rng):
    """24 shots: scatter over the told sigma within four standard errors of 1; white noise would tell half of it."""
    clean = 50 + 100 * ellipse(ELLIPSE, (112, 120))
    found = [measure_ellipse(Photograph(image, 255.0), ELLIPSE + [0.4, -0.3, 0.3, 0.2, 0]) for image in
             shots(clean, 24, rng)]  # fmt: skip
    assert {one.status for one in found} == {"correlated"}
    variance = np.var([one.parameters for one in found], 0, ddof=1)
    ratio = np.sqrt(np.mean(variance / np.mean([np.diag(one.covariance) for one in found], 0)))
    assert ratio == pytest.approx(1.0, abs=4 / np.sqrt(2 * 5 * 23))  # margin: 4 standard errors
    optics = Optics(clean.shape, 1.0, found[0].noise ** 2, 1.0, 5.0)
    white, _ = fitted_ellipse(next(shots(clean, 1, rng)), ELLIPSE, optics, False)
    # margin: the order is said: noise taken for white tells half
    assert np.sqrt(found[0].covariance[0, 0] / white.covariance[0, 0]) > 1.5


def test_large_ellipse_by_points(rng):
    """One shot: its errors are as told, and told as twice and more of what white noise makes."""
    true = np.array([200.3, 190.7, 170.0, 160.0, 20.0])
    (image,) = shots(50 + 100 * ellipse(true, (380, 400)), 1, rng)
    found = measure_ellipse(Photograph(image, 255.0), true + [0.4, -0.3, 0.3, 0.2, 0])
    assert found.status == "correlated"
    error = found.parameters - true
    # margin: chance, 0.1 %
    assert error @ np.linalg.solve(found.covariance, error) < 21  # 0.1 % of five degrees of freedom


def test_chessboard(rng):
    """8 shots of 15 corners: chi-square of all coordinates jointly; the covariance without correlation is rejected."""
    clean, grid = board_picture()
    total = alone = 0.0
    for image in shots(clean, 8, rng):
        seen = recording(Photograph(image, 255.0))
        board = measured(image, grid, float(np.sqrt(seen.curve.variance(image.mean()))))
        covariance, alike = board_covariance(image, board, grid, seen)
        assert not alike
        error = (board.corners - grid.reshape(-1, 2)).ravel()
        total += error @ np.linalg.solve(covariance, error)
        alone += sum(e @ np.linalg.solve(c, e) for e, c in zip(error.reshape(-1, 2), board.covariance, strict=True))
    freedom = 8 * 30
    # margin: 4 standard errors, and 15 % of what is told
    assert total / freedom == pytest.approx(1.0, abs=0.15 + 4 * np.sqrt(2 / freedom))
    assert alone / freedom > 1.8  # margin: 20 standard errors from 1


def test_rows_of_a_board_are_its_derivatives(rng):
    """Against noise that is added to an exact picture: to first order the corners move by the rows times it."""
    clean, grid = board_picture()
    noise = 0.05 * rng.standard_normal(clean.shape)
    still, moved = measured(clean, grid, 1.0), measured(clean + noise, grid, 1.0)
    told = respond(clean, still, grid) @ noise.ravel()
    assert told == pytest.approx((moved.corners - still.corners).ravel(), abs=0.1 * np.abs(told).max())


def test_a_board_of_which_nothing_is_measured_moves_with_no_pixel():
    """A row of zeros for each coordinate of its 15 corners."""
    clean, grid = board_picture()
    still = measured(clean, grid, 1.0)
    none = replace(still, status=("short",) * len(still.status))
    rows = respond(clean, none, grid)
    assert (rows.shape, rows.nnz) == ((30, clean.size), 0)


def test_many_functions_of_few_pixels(rng):
    """The same as of a few functions, with and without correlation, at the image's borders too."""
    kernel = np.zeros((7, 7))
    kernel[3, 3], kernel[3, 4], kernel[3, 2], kernel[4, 3], kernel[2, 3] = 1.0, 0.3, 0.3, 0.2, 0.2
    rows, sigma = rng.standard_normal((4, 30)), rng.uniform(1, 2, (12, 10))
    pixels = np.sort(rng.choice(120, 30, replace=False))
    whole = np.zeros((4, 120))
    whole[:, pixels] = rows
    correlation = Correlation(kernel, 0.0)
    found = correlation.covariance_of_many(sparse.csr_array(whole), sigma)
    assert found == pytest.approx(correlation.covariance(rows, pixels, sigma.flat[pixels], 10))
    kernel[:], kernel[3, 3] = 0.0, 1.0
    alone = Correlation(kernel, 1.0).covariance_of_many(sparse.csr_array(whole), sigma)
    assert alone == pytest.approx((whole * sigma.ravel() ** 2) @ whole.T)
