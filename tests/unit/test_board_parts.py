"""Parts of chessboards and of the camera that saw them, each by numbers written out."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from scipy import sparse
from scipy.stats import chi2

from imaging.boards.fitting import Crossings
from imaging.boards.windows import steps, windows
from measure.boards import chessboard
from measure.boards.approximate import even
from measure.boards.camera import CameraCalibration, _calibration, _check
from measure.boards.chessboard import _board, _clipped, _nothing, _started, check_shape
from measure.boards.elimination import Block, covariance, minimised
from measure.boards.growing import _alternates, _alternation, _next, grown, trimmed
from measure.boards.noise import least_noise, of_board
from measure.boards.parameters import read_model
from measure.boards.view import on_board
from measure.photo import board_noise
from measure.photo.binned import binned
from measure.photo.board_noise import board_covariance
from scenes import InvalidInput
from scenes.photograph import Photograph
from tests.boards import told

SHEARED = np.array([[14.0, 3.0], [-5.0, 21.0]])  # one step along a row, and one down a column


def sheared(rows, columns, first=(40.0, 30.0)):
    row, column = np.mgrid[:rows, :columns]
    return column[..., None] * SHEARED[0] + row[..., None] * SHEARED[1] + first


def test_opposite_quadrants_less_the_others():
    """Of a random image, at the pixels 0.3 of the way to the next corners in both directions."""
    grey = np.random.default_rng(1).integers(0, 256, (40, 50)).astype(np.uint8)
    corners = np.array([[20.0, 15.0], [30.0, 22.0]])
    toward = np.array([[[20.0, 10.0], [-10.0, 20.0]], [[10.0, 0.0], [0.0, 30.0]]])
    found = _alternation(grey, corners, toward)
    for k, (a, b) in enumerate((((6, 3), (-3, 6)), ((3, 0), (0, 9)))):
        x, y = corners[k].astype(int)
        total = 0.0
        for one, other in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            total += one * other * float(grey[y + one * a[1] + other * b[1], x + one * a[0] + other * b[0]])
        assert found[k] == pytest.approx(total / 2)


@pytest.mark.parametrize(
    ("change", "alternate"), [(-0.75, True), (-0.65, False), (0.75, False), (-1.3, True), (0.0, False)]
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_line_alternates_as_the_one_before_it(change, alternate, sign):
    """Three crossings, the other way round and 0.7 as strongly; each line has its own steps to the next corners."""
    grey = np.full((120, 200), 120, np.uint8)
    before, line = (np.array([[40.0, y], [90.0, y], [150.0, y]]) for y in (30.0, 80.0))
    toward = np.array([[[[10.0, 0], [0, 20]]] * 3, [[[30.0, 0], [0, 10]]] * 3])

    def cross(place, size, level):
        x, y = place.astype(int)
        for one, other in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            grey[y + other * size[1], x + one * size[0]] = round(120 + one * other * level)

    for k, place in enumerate(before):
        cross(place, (3, 6), sign * 40)
        cross(line[k], (9, 3), sign * 40 * (change if k == 1 else -1))
    assert _alternates(grey, before, line, toward) is alternate


@pytest.fixture(scope="module")
def board():
    """Grey levels of 5 x 8 squares of 12 by 14 px on white, and its 4 x 7 inner corners."""
    y, x = np.mgrid[:110, :130]
    row, column = (y - 20) // 14, (x - 15) // 12
    dark = (row + column) % 2 == 0
    inside = (row >= 0) & (row < 5) & (column >= 0) & (column < 8)
    grey = cv2.GaussianBlur(np.where(dark & inside, 40, 200).astype(np.uint8), (0, 0), 1.0)
    places = np.stack(np.meshgrid(26.5 + 12 * np.arange(7), 33.5 + 14 * np.arange(4)), -1)
    return grey, places


def test_a_part_grows_to_the_whole_board(board):
    grey, places = board
    for part in (np.s_[:3, :3], np.s_[1:, 4:], np.s_[:3, 2:6], np.s_[1:4, 1:4]):
        found = grown(grey, places[part])
        assert found.shape == places.shape
        assert found == pytest.approx(places, abs=0.2)


def test_lines_on_the_rim_are_taken_off(board):
    """On each side, also two at once; and nothing is left of a board of two lines."""
    grey, places = board
    more = np.stack(np.meshgrid(14.5 + 12 * np.arange(9), 19.5 + 14 * np.arange(6)), -1)
    for rows, columns in ((np.s_[:5], np.s_[1:8]), (np.s_[1:], np.s_[1:8]), (np.s_[1:5], np.s_[:8]),
                          (np.s_[1:5], np.s_[1:]), (np.s_[:], np.s_[:])):  # fmt: skip
        assert trimmed(grey, more[rows, columns]).tolist() == places.tolist()
    assert trimmed(grey, more[:4, :]) is not None
    assert trimmed(grey, more[:3, :]) is None


@pytest.mark.parametrize(
    "astray",
    [
        {(0, 3): (0, -16)}, {(0, 7): (-6, -15)}, {(0, 0): (-4, 3), (4, 8): (9, 9)}, {(2, 5): (3.8, 0)},
        {(0, 3): (16, 0), (0, 5): (0, -16)}, {(0, 0): (-4, 1), (0, 4): (-2, 6), (0, 5): (-5, -16)},
    ],
)  # fmt: skip
def test_corners_astray_are_moved_to_where_their_neighbours_say(astray):
    """Onto the rim, to another corner, a quarter of a step; beside the board's corners, too. The others stay."""
    row, column = np.mgrid[:5, :9]
    wider = (1 + 0.008 * column + 0.01 * row)[..., None]
    true = 60.0 + np.stack([15 * column - 3 * row, 14 * row + 2 * column], -1) * wider
    grid = true.copy()
    for index, off in astray.items():
        grid[index] += off
    found = even(grid)
    others = np.ones((5, 9), bool)
    others[tuple(np.transpose(list(astray)))] = False
    assert (found[others] == true[others]).all()
    assert np.abs(found - true).max() < 0.1 * 15
    assert (even(true) == true).all()


def test_steps_to_the_next_corners():
    """Central differences, at the rim one-sided ones: along the row first."""
    grid = sheared(3, 4)
    assert steps(grid) == pytest.approx(np.broadcast_to(SHEARED, (3, 4, 2, 2)))
    grid[1, 2] += [1.0, 7.0]
    found = steps(grid)
    assert found[1, 1, 0] == pytest.approx(SHEARED[0] + [0.5, 3.5])
    assert found[1, 3, 0] == pytest.approx(SHEARED[0] - [1, 7])
    assert found[0, 2, 1] == pytest.approx(SHEARED[1] + [1, 7])
    assert found[2, 2, 1] == pytest.approx(SHEARED[1] - [1, 7])


def test_pixels_that_tell_of_a_corner():
    """Up to 0.48 of the way to the next ones, and 5 px beside one of the two edges: by distances from lines."""
    image = np.random.default_rng(2).normal(100, 20, (110, 120))
    grid = sheared(3, 4)
    found = windows(image, grid)
    assert found.room.all()
    y, x = np.mgrid[:110, :120]
    for corner, places, levels, there in zip(grid.reshape(-1, 2), found.places, found.levels, found.there, strict=True):
        away = np.stack([x, y], -1) - corner
        share = np.abs(away @ np.linalg.inv(SHEARED))
        beside = [np.abs(away @ [-v[1], v[0]]) / np.hypot(*v) for v in SHEARED]
        taken = (share < 0.48).all(-1) & (np.min(beside, axis=0) < 5)
        assert sorted(map(tuple, places[there].astype(int).tolist())) == sorted(
            zip(x[taken].tolist(), y[taken].tolist(), strict=True)
        )
        assert levels[there] == pytest.approx(image[tuple(places[there].astype(int).T[::-1])])
        assert (levels[~there] == 0).all()


@pytest.mark.parametrize(("width", "height", "room"), [(6.2, 30, True), (5.8, 30, False), (30, 6.2, True),
                                                       (30, 5.8, False)])  # fmt: skip
def test_windows_need_room(width, height, room):
    """Half a square of 3 px, either way."""
    grid = np.stack(np.meshgrid(40 + width * np.arange(3), 35.0 + height * np.arange(4)), -1)
    assert (windows(np.zeros((160, 140)), grid).room == room).all()


@pytest.mark.parametrize(
    ("first", "shape", "without"),
    [
        ((4, 30), (100, 100), ()), ((3, 30), (100, 100), (0, 3, 6)), ((30, 4), (100, 100), ()),
        ((30, 3), (100, 100), (0, 1, 2)), ((30, 30), (100, 55), ()), ((30, 30), (100, 54), (2, 5, 8)),
        ((30, 30), (55, 100), ()), ((30, 30), (54, 100), (6, 7, 8)),
    ],
)  # fmt: skip
def test_windows_lie_in_the_image(first, shape, without):
    """Of squares of 10 px they reach 4 px to either side."""
    grid = np.stack(np.meshgrid(first[0] + 10.0 * np.arange(3), first[1] + 10.0 * np.arange(3)), -1)
    assert tuple(np.flatnonzero(~windows(np.zeros(shape), grid).room)) == without


def test_what_a_fit_of_crossings_begins_with():
    found = _started(sheared(3, 4), steps(sheared(3, 4)).reshape(-1, 2, 2))
    assert found[:, :2] == pytest.approx(sheared(3, 4).reshape(-1, 2))
    assert found[:, 2] == pytest.approx(np.full(12, np.arctan2(3, 14)))
    assert found[:, 3] == pytest.approx(np.full(12, np.arctan2(21, -5)))
    assert np.exp(found[:, 4]) == pytest.approx(np.full(12, 0.8))


def test_statuses_of_corners():
    """Of five with room the first is faint, the second does not end, the third leaves too much, the fourth is cut."""
    room = np.array([True, False, True, True, True, True])
    shape = np.arange(25.0).reshape(5, 5)
    square = 4 * np.array([10.0, 10.0, 80.0, 10.0, 10.0])
    fitted = Crossings(
        shape, np.arange(1, 6)[:, None, None] * np.array([[2.0, 1.0], [1.0, 3.0]]), square, np.full(5, 12),
        np.array([5.9, 6.1, 9, 9, 9]), np.array([True, False, True, True, True]),
    )  # fmt: skip
    found = _board((3, 2), room, fitted, 2.0, np.array([False, False, False, True, False]))
    assert found.status == ("low_contrast", "short", "ill_conditioned", "misfit", "clutter", "ok")
    assert found.measured.tolist() == [False, False, False, True, True, True]
    assert found.corners[3].tolist() == [10.0, 11.0]
    assert np.isnan(found.corners[:3]).all()
    assert found.covariance[5] == pytest.approx(4 * 5 * np.array([[2, 1], [1, 3]]))
    assert found.covariance[3] == pytest.approx(4 * 3 * 80 / 12 * np.array([[2, 1], [1, 3]]))
    assert found.p_value[5] == pytest.approx(chi2.sf(10, 12))
    assert found.blur_px == pytest.approx(np.exp(14))
    assert found.places.tolist() == [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]


@pytest.mark.parametrize(("more", "state"), [(1.001, "misfit"), (0.999, "ok")])
def test_one_corner_of_a_hundred_boards_is_a_false_alarm(more, state):
    """Sidak's limit for six corners."""
    limit = more * chi2.isf(1 - 0.99 ** (1 / 6), 12)
    fitted = Crossings(
        np.zeros((6, 5)), np.tile(np.eye(2), (6, 1, 1)), 9 * np.array([limit, 12, 12, 12, 12, 12]), np.full(6, 12),
        np.full(6, 99.0), np.ones(6, bool),
    )  # fmt: skip
    assert _board((3, 2), np.ones(6, bool), fitted, 3.0, np.zeros(6, bool)).status == (state, *["ok"] * 5)


@pytest.mark.parametrize(("left", "told"), [(0.8, 0.8), (1.5, 1.0)])
def test_noise_is_the_lesser_of_the_pictures_and_of_what_crossings_leave(left, told):
    """Of drawn residuals of 400 crossings, one in five of them with three times as much; of the converged alone."""
    rng = np.random.default_rng(2)
    image = rng.normal(100, 1.0, (300, 400))
    share = np.where(np.arange(400) % 5 == 0, 3.0, 1.0) * left
    square = share**2 * rng.chisquare(60, 400)
    fitted = Crossings(*np.zeros((2, 400)), square, np.full(400, 60), np.full(400, 99.0), np.ones(400, bool))
    assert of_board(image, None, fitted) == pytest.approx(told, rel=0.06)  # 0.03 found: a fifth moves the median
    assert of_board(image, 0.3, fitted) == 0.3
    lost = Crossings(*np.zeros((2, 400)), square, np.full(400, 60), np.full(400, 99.0), np.zeros(400, bool))
    assert of_board(image, None, lost) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("end", [0.0, 255.0, 1023.0])
def test_the_end_of_the_scale_in_a_window(end):
    """In more than a fiftieth of its own pixels; a level that is no end of a sensor's scale is none."""
    levels = np.full((3, 100), 90.0)
    levels[:, :3] = end
    levels[1, 1:3] = 91.0
    there = np.ones((3, 100), bool)
    there[2, :3] = False
    some = SimpleNamespace(levels=levels, there=there)
    image = np.concatenate([levels, levels])
    assert _clipped(image, some).tolist() == [True, False, False]
    some.levels = np.where(levels == end, 300.0, levels)
    assert not _clipped(np.where(image == end, 300.0, image), some).any()


def test_noise_of_next_to_none():
    assert least_noise(np.array([[3.0, 7.0], [9.0, 2.0]])) == pytest.approx(12**-0.5)
    assert least_noise(np.array([[3.0, 7.5], [9.0, 2.0]])) == pytest.approx(7e-9)


def test_nothing_is_told_of_squares_that_are_too_small():
    found = _nothing((4, 3), 2.5)
    assert (found.shape, found.status, found.noise) == ((4, 3), ("short",) * 12, 2.5)
    assert (found.corners.shape, found.covariance.shape, found.p_value.shape) == ((12, 2), (12, 2, 2), (12,))
    assert np.isnan(found.covariance).all()


@pytest.mark.parametrize(("shape", "good"), [((3, 200), True), ((200, 3), True), ([4, 5], True), ((2, 5), False),
                                             ((5, 2), False), ((5, 201), False), ((201, 5), False)])  # fmt: skip
def test_limits_of_a_boards_shape(shape, good):
    if good:
        assert check_shape(shape) == tuple(shape)
    else:
        with pytest.raises(InvalidInput, match="shape must be columns and rows of inner corners, 3 to 200 each, got"):
            check_shape(shape)


def test_a_missing_board_is_named_by_its_shape(monkeypatch):
    monkeypatch.setattr(chessboard, "approximate_corners", lambda image, shape: None)
    with pytest.raises(InvalidInput, match="image must show a whole chessboard of 5 x 4 inner corners, got none"):
        chessboard.chessboard(np.zeros((40, 50)), (5, 4))


@pytest.mark.parametrize(
    ("text", "names", "fixed"),
    [
        ("none", "fx fy cx cy", "K1 K2 K3 T"), ("f", "fx cx cy", "K1 K2 K3 T"), ("k2", "fx fy cx cy k2", "K1 K3 T"),
        ("p2,k1", "fx fy cx cy k1 p2", "K2 K3"), ("f, k3", "fx cx cy k3", "K1 K2 T"),
        ("k1,k2,p1,p2,k3", "fx fy cx cy k1 k2 p1 p2 k3", ""),
    ],
)  # fmt: skip
def test_free_intrinsics(text, names, fixed):
    """Values there and back, the columns of derivatives, and what OpenCV holds."""
    model = read_model(text)
    assert model.names == tuple(names.split())
    values = np.arange(11.0, 11 + len(model.names))
    matrix, coefficients = model.camera(values)
    known = dict(zip(model.names, values, strict=True))
    assert matrix.tolist() == [[11, 0, known["cx"]], [0, known.get("fy", 11), known["cy"]], [0, 0, 1]]
    assert coefficients.tolist() == [known.get(name, 0) for name in ("k1", "k2", "p1", "p2", "k3")]
    assert model.values(matrix, coefficients).tolist() == values.tolist()
    by_all = np.arange(2 * 9.0).reshape(2, 9)
    order = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"]
    expected = np.stack([by_all[:, order.index(name)] for name in model.names], 1)
    if "fy" not in model.names:
        expected[:, 0] = by_all[:, 0] + by_all[:, 1]
    assert model.derivatives(by_all).tolist() == expected.tolist()
    flags = {"K1": cv2.CALIB_FIX_K1, "K2": cv2.CALIB_FIX_K2, "K3": cv2.CALIB_FIX_K3, "T": cv2.CALIB_ZERO_TANGENT_DIST}
    assert model.flags == sum(flags[name] for name in fixed.split())


def blocks_of(rng, boards=3):
    """Linear residuals of four shared unknowns of very different sizes and of six numbers of each board, and the same
    as one matrix."""
    shared = rng.normal(size=(boards, 20, 4)) * [1.0, 1e6, 1e-5, 3.0]
    own = rng.normal(size=(boards, 20, 6)) * [1, 1, 1, 1e-3, 1e-3, 1e-3]
    right = rng.normal(size=(boards, 20))
    whole = np.zeros((20 * boards, 4 + 6 * boards))
    for i in range(boards):
        whole[20 * i : 20 * i + 20, :4] = shared[i]
        whole[20 * i : 20 * i + 20, 4 + 6 * i : 10 + 6 * i] = own[i]
    return shared, own, right, whole


def test_covariance_of_shared_unknowns_and_poses():
    """That of the whole normal matrix; infinite where a column is nothing, or nearly another."""
    shared, own, _, whole = blocks_of(np.random.default_rng(3))
    prior = np.array([[0.0, 0.0, 1e5, 0.0]])
    every = np.concatenate([whole, np.pad(prior, [(0, 0), (0, 18)])])
    size = np.linalg.norm(every, axis=0)
    unit = np.linalg.inv((every / size).T @ (every / size))

    def found():
        return covariance([Block(np.zeros(20), *each) for each in zip(shared, own, strict=True)], prior)

    assert found() * np.outer(size, size) == pytest.approx(unit, rel=1e-9, abs=1e-12)
    shared[..., 3] = shared[..., 0] * (1 + 1e-13)
    assert (found() == np.inf).all()
    shared[..., 3] = 0
    assert found().shape == (22, 22)
    assert (found() == np.inf).all()


def test_least_squares_with_poses_eliminated():
    """Of linear residuals the solution of the whole matrix, a prior's rows among them."""
    shared, own, right, whole = blocks_of(np.random.default_rng(4))
    prior = np.array([[2.0, 0.0, 0.0, 0.0]])

    def blocks(point):
        residuals = [a @ point[0] + b @ p - r for a, b, p, r in zip(shared, own, point[1], right, strict=True)]
        return [Block(*each) for each in zip(residuals, shared, own, strict=True)]

    def cost(point):
        return sum(block.residual @ block.residual for block in blocks(point)) + 4 * point[0][0] ** 2

    every = np.concatenate([whole, np.pad(prior, [(0, 0), (0, 18)])])
    expected = np.linalg.lstsq(every, np.append(right.ravel(), 0.0))[0]
    found = minimised(blocks, cost, prior, (np.ones(4), np.ones((3, 6))), lambda shared: True)
    assert np.append(*map(np.ravel, found)) == pytest.approx(expected, rel=1e-7)
    held = minimised(blocks, cost, prior, (np.ones(4), np.ones((3, 6))), lambda shared: shared[0] > 0.5)
    assert held[0][0] > 0.5


@pytest.mark.parametrize("rounding", [0.0, 1e-12])
def test_least_squares_end_before_the_level_of_rounding(rounding):
    """Of residuals that bend, of some 1e3 in all, with what another machine may round otherwise: as near as 1e-5 of
    each sigma to the least, in a few looks."""
    rng = np.random.default_rng(6)
    shared, own, right, whole = blocks_of(rng)
    right, looks, prior = 5 * right, [], np.zeros((0, 4))
    rows = whole.reshape(3, 20, -1)

    def residuals(point):
        left = [a @ point[0] + b @ p - r for a, b, p, r in zip(shared, own, point[1], right, strict=True)]
        return [each + 1e-3 * each**2 + rounding * rng.normal(size=20) * np.abs(each) for each in left], left

    def blocks(point):
        return [Block(r, a * (1 + 2e-3 * e)[:, None], b * (1 + 2e-3 * e)[:, None])
                for r, e, a, b in zip(*residuals(point), shared, own, strict=True)]  # fmt: skip

    def cost(point):
        looks.append(1)
        return sum(r @ r for r in residuals(point)[0])

    found = minimised(blocks, cost, prior, (np.zeros(4), np.zeros((3, 6))), lambda shared: True)
    assert len(looks) <= 12  # 6 found, 27 where rounding alone decides
    matrix = np.concatenate([(1 + 2e-3 * e)[:, None] * part for e, part in zip(residuals(found)[1], rows, strict=True)])
    decrement = np.linalg.lstsq(matrix, np.concatenate(residuals(found)[0]))[0]
    assert np.linalg.norm(matrix @ decrement) < 1e-5


def test_places_of_corners_on_a_board():
    board = told(np.zeros((6, 2)), np.tile(np.eye(2), (6, 1, 1)), (3, 2))
    assert on_board(board, 2.5).tolist() == [[0, 0, 0], [2.5, 0, 0], [5, 0, 0], [0, 2.5, 0], [2.5, 2.5, 0], [5, 2.5, 0]]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((np.inf, 0, (4, 5)), "square_size must be a number more than 0, got inf"),
        ((1.1e9, 0, (4, 5)), "square_size must be a number more than 0"),
        ((True, 0, (4, 5)), "square_size must be a number more than 0, got True"),
        (("a", 0, (4, 5)), "square_size must be a number more than 0, got 'a'"),
        ((1.0, np.nan, (4, 5)), "square_sd must be a number of at least 0, got nan"),
        ((1.0, 0, (4, 40000)), r"image_shape must be \(height, width\) in px, got \(4, 40000\)"),
        ((1.0, 0, (4, 5, 3)), "image_shape must be"), ((1.0, 0, 45), "image_shape must be"),
        ((1.0, 0, (4, 5.5)), "image_shape must be"), ((1.0, 0, (4, 0)), "image_shape must be"),
    ],
)  # fmt: skip
def test_arguments_of_a_calibration(given, message):
    with pytest.raises(InvalidInput, match=message):
        _check(*given)
    _check(1e9, 0.0, (1, 1 << 15))


def calibration(chi_square, rows=40, covariance=1.0, scale_sd=0.0):
    """Of a pinhole and two boards, 16 parameters."""
    values = np.array([800.0, 810.0, 320.0, 240.0])
    poses = np.array([[0.1, 0.2, 0.3, 10.0, -20.0, 500.0], [0.3, -0.1, 0.2, -30.0, 40.0, 600.0]])
    root = np.random.default_rng(4).normal(size=(16, 16))
    whole = covariance * root @ root.T
    found = SimpleNamespace(
        parameters=np.concatenate([values, poses.ravel()]), covariance=whole, chi_square=chi_square, rows=rows,
        told=16.0, sags=np.zeros(2), sag_covariance=np.zeros((2, 2)),
        residuals=(np.array([[3.0, 4.0], [np.nan, np.nan]]), np.array([[0.0, 1.0]])),
    )  # fmt: skip
    return _calibration(None, read_model("none"), (480, 640), found, scale_sd), whole, poses


def test_what_is_told_of_a_calibration():
    """24 degrees of freedom; residuals of length 5 and 1; larger squares are further away, and not turned."""
    found, whole, poses = calibration(30.0, scale_sd=0.01)
    assert found.p_value == pytest.approx(chi2.sf(30, 24))
    assert (found.freedom, found.dispersion, found.status) == (24, 1.0, "ok")
    assert found.rms_px == pytest.approx(np.sqrt(13))
    assert found.covariance == pytest.approx(whole[:4, :4])
    for i, block in enumerate(found.pose_covariance):
        more = 0.01 * np.array([0, 0, 0, *poses[i, 3:]])
        some = slice(4 + 6 * i, 10 + 6 * i)
        assert block == pytest.approx(whole[some, some] + np.outer(more, more))
    assert found.sd == pytest.approx(np.sqrt(np.diag(whole)[:4]))
    assert found.correlation == pytest.approx(whole[:4, :4] / np.outer(found.sd, found.sd))
    assert found.image_shape == (480, 640)
    assert (found.lens.fx, found.lens.fy, found.lens.cx, found.lens.cy) == (800, 810, 320, 240)


@pytest.mark.parametrize(("p", "dispersed"), [(0.0101, False), (0.0099, True)])
def test_residuals_that_chance_leaves_once_in_a_hundred(p, dispersed):
    found, whole, _ = calibration(chi2.isf(p, 24))
    assert found.dispersion == pytest.approx(chi2.isf(p, 24) / 24 if dispersed else 1)
    assert found.status == ("misfit" if dispersed else "ok")
    assert found.covariance == pytest.approx(found.dispersion * whole[:4, :4])
    assert found.pose_covariance[1] == pytest.approx(found.dispersion * whole[10:, 10:])


@pytest.mark.parametrize(("sd", "state"), [(79.9, "ok"), (80.1, "ill_conditioned")])
def test_a_focal_length_to_a_tenth_is_none(sd, state):
    _, whole, _ = calibration(24.0)
    assert calibration(24.0, covariance=sd**2 / whole[0, 0])[0].status == state


def test_without_freedom_nothing_is_judged():
    found = calibration(30.0, rows=16)[0]
    assert isinstance(found, CameraCalibration)
    assert np.isnan(found.p_value)
    assert (found.freedom, found.dispersion) == (0, 1.0)


@pytest.mark.parametrize(("shift", "alike"), [(0.0, True), (0.09, True), (0.11, False), (-0.09, True), (-0.11, False)])
def test_joint_covariance_of_a_boards_corners(shift, alike, monkeypatch):
    """Of three corners the second is not measured, the third was enlarged by 2.25: that it keeps."""
    rows = np.random.default_rng(5).normal(size=(6, 12))
    rows[2:4] = 0
    alone = 4.0 * (rows**2).sum(1)
    blocks = np.stack([np.diag(alone[:2]), np.full((2, 2), np.nan), 2.25 * np.diag(alone[4:])])
    blocks[0, 0, 1] = blocks[0, 1, 0] = 0.3
    board = SimpleNamespace(corners=np.zeros((3, 2)), covariance=blocks, noise=2.0)
    monkeypatch.setattr(board_noise, "respond", lambda *given: sparse.csr_array(rows))
    grown = (1 + shift) * 4.0 * rows @ rows.T

    def covariance_of_many(given, sigma):
        assert sigma.tolist() == [[3.0, 4.0]]
        return grown.copy()

    correlation = SimpleNamespace(white=False, covariance_of_many=covariance_of_many)
    seen = SimpleNamespace(correlation=correlation, curve=SimpleNamespace(variance=lambda levels: levels**2))
    found, same = board_covariance(np.array([[3.0, 4.0]]), board, None, seen)
    factor = np.array([1, 1, 0, 0, 1.5, 1.5])
    kept = np.array([0, 1, 4, 5])
    assert found[np.ix_(kept, kept)] == pytest.approx((grown * np.outer(factor, factor))[np.ix_(kept, kept)])
    assert np.isnan(found[2:4, 2:4]).all()
    assert same is alike

    correlation.white = True
    plain, same = board_covariance(np.array([[3.0, 4.0]]), board, None, seen)
    assert same is True
    assert plain[:2, :2] == pytest.approx(blocks[0])
    assert plain[4:, 4:] == pytest.approx(blocks[2])
    assert (plain[:2, 4:] == 0).all()


def test_larger_pixels_are_mean_levels():
    levels = np.random.default_rng(6).normal(100, 9, (7, 11))
    found = binned(Photograph(levels, full=255.0), 3, True)
    assert found.levels == pytest.approx(levels[:6, :9].reshape(2, 3, 3, 3).mean((1, 3)))
    assert (found.full, found.compressed) == (None, True)
    assert binned(Photograph(levels), 2, False).levels.shape == (3, 5)


@pytest.mark.parametrize(("height", "there"), [(84, False), (85, True)])
def test_a_line_needs_room_to_the_image_s_rim(board, height, there):
    """Half a step (6 px) and 2 px, from corners at 75.5 px: to the last row but one of 84 there are 7.5."""
    grey, places = board
    found = _next(grey[:height], places[:3])
    assert (found is not None) is there
    if there:
        assert found == pytest.approx(places[3], abs=0.2)
