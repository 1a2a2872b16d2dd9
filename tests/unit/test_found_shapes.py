"""What is found in a photograph before it is measured: outlines moved, told apart, beside each other and within."""

from types import SimpleNamespace

import numpy as np
import pytest

from measure.find import chessboard
from measure.find.candidate import CHESSBOARD, ELLIPSE, QUADRILATERAL, TAG, Candidate
from measure.find.chessboard import _alternation, find_chessboard
from measure.find.coarse import Coarse
from measure.find.distinct import outside, same
from measure.find.four_sides import _goes_on, _sides, deviation, four_sides, near, polygon, shaped
from measure.find.support import Steepest, contrast, sign_of, steepest
from tests.boards import SMALL
from tests.oracle import polygon_image

POSE = np.array([0.35, -0.25, 0.1, -105.0, -62.0, 370.0])


def box(x, y, width, height, kind=QUADRILATERAL, grid=None):
    outline = np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]], float)
    return Candidate(kind, outline, 1.0, 10.0, 1.0, grid=grid)


def test_all_of_a_shape_is_moved():
    whole = Candidate(
        ELLIPSE, np.array([[1.0, 2], [4, 3], [2, 7]]), 0.9, -8.0, 5.0, np.array([3.0, 4, 9, 7, 30]), 17, "family",
        np.arange(12.0).reshape(2, 3, 2),
    )  # fmt: skip
    moved = whole.moved(np.array([10, -20]))
    assert moved.outline.tolist() == [[11, -18], [14, -17], [12, -13]]
    assert moved.parameters.tolist() == [13, -16, 9, 7, 30]
    assert moved.grid.tolist() == (whole.grid + [10, -20]).tolist()
    assert (moved.identifier, moved.family, moved.contrast) == (17, "family", -8.0)
    bare = box(1, 2, 5, 3).moved(np.array([10, -20]))
    assert bare.outline[2].tolist() == [16, -15]
    assert bare.parameters is None
    assert bare.grid is None


def test_what_a_shape_is():
    """Mean, area, both sizes and distances, of a trapezium and of an ellipse."""
    trapezium = Candidate(QUADRILATERAL, np.array([[0.0, 0], [10, 0], [7, 4], [1, 4]]), 1.0, 1.0, 1.0)
    assert trapezium.centre == pytest.approx([4.5, 2])
    assert trapezium.area == pytest.approx(32)
    assert trapezium.sizes == pytest.approx((8, (5 + np.sqrt(17)) / 2))
    assert [trapezium.distance(np.array(p)) for p in ((5, 1), (5, -3), (12, 0))] == pytest.approx([-1, 3, 2])
    round_ = Candidate(ELLIPSE, trapezium.outline, 1.0, 1.0, 1.0, np.array([1.0, 2, 9, 5, 30]))
    assert round_.sizes == (18, 10)


@pytest.mark.parametrize(
    ("x", "y", "size", "kept"),
    [
        (20, 30, 40, False), (10, 30, 48, False), (20, 30, 52, True), (200, 30, 40, True), (70, 30, 40, True),
        (20, 190, 40, True),
    ],
)  # fmt: skip
def test_a_board_in_a_tags_cells_is_none(x, y, size, kept):
    """Its middle is in the tag and it is no larger than 1.5 of it; the tag is 40 px wide."""
    board, tag = box(x, y, size, size, CHESSBOARD, np.zeros((3, 3, 2))), box(20, 30, 40, 40, TAG)
    assert [one.kind for one in outside([board, tag])] == ([TAG, CHESSBOARD] if kept else [TAG])


@pytest.mark.parametrize(
    ("x", "y", "width", "height", "kept"),
    [
        (30, 40, 8, 6, False), (70, 40, 10, 6, False), (70, 40, 12, 6, True), (0, 40, 9, 6, False),
        (-2, 40, 9, 6, True), (30, 60, 8, 10, False), (30, 60, 8, 12, True), (30, 10, 8, 12, False),
        (30, 8, 8, 12, True),
    ],
)  # fmt: skip
def test_what_lies_in_a_chessboard_or_around_it_by_two_squares(x, y, width, height, kept):
    """Inner corners from 20 to 60 and 30 to 50 px, five of them along: squares of 10 px, and a pixel beside them."""
    board = box(20, 30, 40, 20, CHESSBOARD, np.zeros((3, 5, 2)))
    assert len(outside([box(x, y, width, height), board])) == 1 + kept


@pytest.mark.parametrize("pixel", [1.0, 2.0])
@pytest.mark.parametrize(
    ("other", "alike"),
    [
        ((0, 0, 100, 80), True), ((0, 0, 100, 47), False), ((0, 0, 100, 49), True), ((3, 0, 100, 80), True),
        ((26, 0, 100, 80), False), ((24, 0, 100, 80), True), ((101, 0, 100, 80), False), ((0, 81, 100, 80), False),
        ((5.9, 5.9, 88.2, 68.2), None), ((7, 7, 86, 66), False), ((2.9, 2.9, 94.2, 74.2), True),
    ],
)  # fmt: skip
def test_outlines_that_are_the_same(other, alike, pixel):
    """0.6 of the area in common, and not 3 px inside everywhere, coarse ones; whichever is named first."""
    one, other = box(0, 0, 100, 80), box(*other)
    alike = pixel == 2 if alike is None else alike
    assert same(one, other, pixel) is alike
    assert same(other, one, pixel) is alike


@pytest.mark.parametrize("shift", [(0, 0), (300, 10)])
def test_deviation_from_four_sides(shift):
    """Of 40 points on two sides and 2 px beside two of them: root mean square and the second largest of 40."""
    corners = np.array([[0.0, 0], [100, 0], [100, 60], [0, 60]]) + shift
    x = np.linspace(10, 90, 20)
    outline = np.concatenate([np.stack([x, 0 * x], 1), np.stack([x[::-1], 60 + 0 * x], 1)]) + shift
    outline[[3, 30]] += [0, 2]
    outline[5] += [0, -1]
    rms, quantile = deviation(outline, corners)
    assert rms == pytest.approx(np.sqrt((4 + 4 + 1) / 40), rel=1e-6)
    assert quantile == pytest.approx(1)


@pytest.mark.parametrize(("side", "away", "good"), [(60, 1.49, True), (60, 1.51, False), (300, 5.9, True),
                                                    (300, 6.1, False)])  # fmt: skip
def test_an_outline_may_leave_the_sides_by_so_much(side, away, good):
    """1.5 px, or a fiftieth of a large one: the root of its area."""
    corners = np.array([[0.0, 0], [2 * side, 0], [2 * side, side / 2], [0, side / 2]])
    assert near(corners, away) == good


@pytest.mark.parametrize(
    ("corners", "good"),
    [
        ([[0, 0], [30, 0], [30, 8], [0, 8]], True), ([[0, 0], [30, 0], [30, 7.9], [0, 7.9]], False),
        ([[0, 0], [60, 0], [90, 14.3], [30, 14.3]], True), ([[0, 0], [60, 0], [90, 13.7], [30, 13.7]], False),
        ([[0, 0], [60, 0], [30, 14.3], [-30, 14.3]], True), ([[0, 0], [60, 0], [30, 13.7], [-30, 13.7]], False),
        ([[0, 0], [60, 0], [20, 15], [0, 60]], False),
        ([[0, 0], [60, -10.5], [66, 0], [60, 10.5]], False), ([[0, 0], [60, -15], [66, 0], [60, 15]], True),
        ([[0, 0], [40, -3], [80, 0], [40, 60]], False), ([[0, 0], [40, -10], [80, 0], [40, 60]], True),
    ],
)  # fmt: skip
def test_shapes_of_quadrilaterals(corners, good):
    """Sides of 8 px, angles of 25 degrees (14.0 in 30) and their supplements, no corner that points inwards."""
    corners = np.array(corners, float)
    for k in range(4):
        assert shaped(np.roll(corners, k, 0)) is good
    assert shaped(corners[::-1]) is good


def test_an_outline_with_a_corner_less_is_none():
    """Of a triangle, a pentagon and a quadrilateral."""
    side = np.linspace(0, 1, 40, endpoint=False)[:, None]

    def outline(corners):
        corners = np.array(corners, float)
        ends = zip(corners, np.roll(corners, -1, 0), strict=True)
        return np.concatenate([a + side * (b - a) for a, b in ends]).astype(np.float32)

    four = [[10, 10], [90, 14], [84, 70], [16, 62]]
    found = polygon(outline(four))
    assert sorted(map(tuple, found.round().tolist())) == sorted(map(tuple, np.array(four, float).tolist()))
    assert polygon(outline([[10, 10], [90, 14], [40, 70]])) is None
    assert polygon(outline([[10, 30], [50, 5], [90, 30], [75, 80], [25, 80]])) is None


COUNTS = np.array([0, 1, 1, 0, 0, 0, 1, 0, 1, 0], bool)


def test_gaps_support_and_straightness():
    """The longest gap, also where it is at either end; offsets of edges alone."""
    offsets = np.where(COUNTS, np.arange(10) / 2, 100.0)
    seen = Steepest(offsets, np.ones(10), COUNTS)
    assert seen.support == 0.4
    assert seen.longest_gap == 3
    assert seen.straightness == pytest.approx(np.sqrt((0.25 + 1 + 9 + 16) / 4))
    assert Steepest(offsets, np.ones(10), np.roll(COUNTS, -6)).longest_gap == 3
    assert Steepest(offsets, np.ones(10), COUNTS & False).longest_gap == 10
    assert Steepest(offsets, np.ones(10), COUNTS & False).straightness == np.inf


def ramp(down, right, noise=1.0):
    """Levels linear in place, of 60 x 90 px."""
    y, x = np.mgrid[:60, :90].astype(np.float32)
    one = np.ones_like(x)
    return Coarse(right * x + down * y, right * one, down * one, 1, noise, noise, noise)


def test_slopes_and_contrast_across_an_outline():
    """Levels fall by 2 to the right and rise by 5 down; normals to the lower right."""
    coarse = ramp(5.0, -2.0, 0.5)
    places = np.array([[30.0, 20], [40, 25], [35, 30], [50, 30]])
    normals = np.tile([0.6, 0.8], (4, 1))
    slope = -2 * 0.6 + 5 * 0.8
    assert coarse.across(places, normals, np.array([-1.0, 0, 3])) == pytest.approx(np.full((4, 3), slope), rel=1e-5)
    assert coarse.levels(places) == pytest.approx([40, 45, 80, 50])
    assert contrast(coarse, places, normals) == pytest.approx(-6 * slope / 0.5, rel=1e-5)
    assert sign_of(coarse, places, normals) == 1
    assert sign_of(coarse, places, -normals) == -1
    assert coarse.size.tolist() == [90, 60]


@pytest.mark.parametrize(("noise", "counted"), [(0.69, True), (0.71, False)])
def test_edges_stand_out_by_four_standard_deviations(noise, counted):
    """Of a slope of 2.8; the other way round none does."""
    coarse = ramp(5.0, -2.0, noise)
    places, normals = np.tile([[30.0, 20], [40, 25], [35, 30]], (2, 1)), np.tile([0.6, 0.8], (6, 1))
    seen = steepest(coarse, places, normals, np.array([1, 1, 1, -1, -1, -1]), 1.5, np.array([0, 0, 0, 1, 1, 1]))
    assert seen.slopes == pytest.approx([2.8] * 3 + [-2.8] * 3, rel=1e-5)
    assert seen.counts.tolist() == [counted] * 3 + [False] * 3


@pytest.mark.parametrize(("right", "told"), [(84.5, False), (83.5, True), (60.5, True)])
def test_a_side_goes_on_where_three_places_beyond_its_corner_say_so(right, told):
    """Levels that rise downwards everywhere: upper and lower sides never end. Of fewer nothing is told."""
    corners = np.array([[3.5, 20], [right, 20], [right, 40], [3.5, 40]])
    assert _goes_on(ramp(5.0, 0.0, 0.5), corners, np.array([-1.0, 1, 1, 1]), np.full(4, 5.0)) is told


def test_a_side_does_not_go_on_where_there_is_no_slope():
    corners = np.array([[30.5, 20], [60, 20], [60, 40], [30.5, 40]])
    assert not _goes_on(ramp(0.0, 0.0, 0.5), corners, np.ones(4), np.full(4, 5.0))


def test_the_steepest_place_is_found_in_its_direction():
    """A bright stripe: up where it begins, 2 px inwards; down where it ends, 3 px outwards."""
    image = np.full((60, 90), 50.0)
    image[:, 38:44] = [85, 120, 120, 120, 120, 85]
    coarse = Coarse.of(image)
    places, normals = np.array([[40.0, y] for y in (20, 25, 30, 35)]), np.tile([1.0, 0], (4, 1))
    for sign, place in ((1, -2.0), (-1, 3.0)):
        assert steepest(coarse, places, normals, sign, 4.0).offsets == pytest.approx([place] * 4)
    assert (steepest(coarse, places, normals, 1, 1.0).offsets == -1).all()
    assert (steepest(coarse, places, normals, -1, 1.0).offsets == 1).all()


def test_a_large_image_is_seen_in_squares():
    """Of 1.6 million pixels in squares of 2; places and levels of the finer one."""
    y, x = np.mgrid[:1001, :1601]
    coarse = Coarse.of(3.0 * x + 5.0 * y)
    assert coarse.factor == 2
    assert coarse.smooth.shape == (500, 800)
    assert coarse.size.tolist() == [800, 500]
    assert coarse.fine(np.array([[0.0, 0], [10, 20]])).tolist() == [[0.5, 0.5], [20.5, 40.5]]
    assert coarse.smooth[100, 200] == pytest.approx(3 * 400.5 + 5 * 200.5, rel=1e-5)
    assert coarse.gx[100, 200] == pytest.approx(6, rel=1e-3)
    assert coarse.gy[100, 200] == pytest.approx(10, rel=1e-3)


@pytest.mark.parametrize(("shape", "asked"), [((31, 90), 0), ((90, 31), 0), ((32, 90), 1), ((90, 32), 1)])
def test_a_chessboard_needs_32_pixels(shape, asked, monkeypatch):
    calls = []
    monkeypatch.setattr(
        chessboard.cv2, "findChessboardCornersSBWithMeta", lambda *given: calls.append(given) or (False, None, None)
    )
    assert find_chessboard(Coarse.of(np.random.default_rng(1).normal(100, 9, shape))) is None
    assert len(calls) == asked
    assert all(grey.min() == 0 and grey.max() == 255 for grey, *_ in calls)


def test_what_is_said_of_a_board():
    """The outer corners in order around it, part and size of alternating squares, and its lines' length."""
    image = SMALL.image(POSE)
    noisy = image + np.random.default_rng(2).normal(0, 2, image.shape)
    found = find_chessboard(Coarse.of(noisy))
    grid = found.grid
    assert grid.shape in ((6, 9, 2), (9, 6, 2))
    assert found.outline.tolist() == [grid[0, 0].tolist(), grid[0, -1].tolist(), grid[-1, -1].tolist(),
                                      grid[-1, 0].tolist()]  # fmt: skip
    assert found.support == 1.0
    assert found.contrast == pytest.approx(140 / 2, rel=0.1)
    length = sum(np.linalg.norm(np.diff(grid, axis=k), axis=-1).sum() for k in (0, 1))
    assert found.score == pytest.approx(found.contrast * np.sqrt(length), rel=1e-6)


@pytest.mark.parametrize(("weak", "good"), [(1.0, True), (0.4, True), (0.3, False)])
def test_alternation_of_squares(weak, good):
    """Two inner rows of three corners, twelve squares with those around: 17 pairs, of which a wrong square spoils 3.

    Another by 0.4 of the usual step is one, by 0.3 it is none.
    """
    grid = np.stack(np.meshgrid([20.0, 30, 40], [15.0, 25]), -1)
    middles = np.stack(np.meshgrid([15.0, 25, 35, 45], [10.0, 20, 30]), -1).reshape(-1, 2)
    levels = np.where(np.indices((3, 4)).sum(0) % 2, 40.0, 100.0)
    levels[0, 1] = 100.0  # bright where dark is due
    levels[2, 3] = 100 - 60 * weak  # dark, beside two bright ones

    def seen(places):
        assert places == pytest.approx(middles)
        return levels.ravel()

    told = _alternation(SimpleNamespace(levels=seen, noise=4.0), grid)
    assert told == (pytest.approx((14 if good else 12) / 17), pytest.approx(15))


@pytest.mark.parametrize("turned", [1, -1])
def test_places_along_four_sides(turned):
    """A place a pixel, a tenth of each side left out at its ends, with unit normals that lead away from the middle."""
    corners = np.array([[10.0, 12.0], [90.0, 20.0], [84.0, 71.0], [17.0, 55.0]])[::turned]
    places, normals, piece, lengths = _sides(corners, 0.1)
    ends = np.roll(corners, -1, 0)
    assert lengths == pytest.approx(np.hypot(*(ends - corners).T))
    assert np.bincount(piece).tolist() == lengths.astype(int).tolist()
    assert np.hypot(*normals.T) == pytest.approx(np.ones(len(normals)))
    for side in range(4):
        of, along = piece == side, (ends - corners)[side] / lengths[side]
        assert normals[of] @ along == pytest.approx(np.zeros(of.sum()), abs=1e-12)
        assert (((corners.mean(0) - places[of]) * normals[of]).sum(1) < 0).all()
        share = (places[of] - corners[side]) @ along / lengths[side]
        assert share == pytest.approx(np.linspace(0.1, 0.9, of.sum()))


def test_sides_of_no_area_have_normals():
    """A bow tie, whose two halves cancel."""
    _, normals, *_ = _sides(np.array([[0.0, 0], [40, 40], [40, 0], [0, 40]]), 0.1)
    assert np.hypot(*normals.T) == pytest.approx(np.ones(len(normals)))


@pytest.mark.parametrize(("gap", "good"), [(0, True), (8, True), (14, False)])
def test_a_side_may_lack_three_hundredths_of_itself(gap, good):
    """Of 208 px 6.2; a patch of one level over a side hides it but for what blurring brings in at both ends."""
    corners = np.array([[30.3, 28.6], [238.1, 35.2], [231.7, 219.4], [27.2, 212.9]])
    image = polygon_image(corners, (250, 270), 0.8, 100.0, 40.0) + np.random.default_rng(1).normal(0, 1, (250, 270))
    image[26:40, 120 : 120 + gap] = 90.0
    found = four_sides(Coarse.of(image), corners)
    assert (found is not None) is good
    if found is not None:
        assert found.outline == pytest.approx(corners, abs=0.5)
