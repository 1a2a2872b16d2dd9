"""What is drawn over a photograph: where, how large, and which words, of made up shapes without symmetry."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from validation.report import overlay

CORNERS = np.array([[40.0, 20.0], [220.0, 35.0], [205.0, 90.0], [30.0, 70.0]])  # to the right, down, to the left, up
LENGTHS = np.linalg.norm(np.roll(CORNERS, -1, 0) - CORNERS, axis=1)
SPREAD = np.array([[0.09, 0.02], [0.02, 0.04]])
WIDE, TALL = (100, 300), (500, 100)  # rows and columns: 4 and 3 times as large in the drawing


def shape(**parts):
    """Something found; of what is not said there is nothing."""
    empty = {
        "kind": "rectangle", "status": "ok", "measured": True, "candidate": None, "corners": None, "ellipse": None,
        "covariance": None, "residuals": (), "quantities": (),
    }  # fmt: skip
    return SimpleNamespace(**(empty | parts))


def quantity(name, value, sigma=0.031, unit="px"):
    return SimpleNamespace(name=name, value=value, sigma=sigma, unit=unit)


def side(rms=0.5):
    """An edge's distance from its line, at two of its places."""
    places, normals = np.array([[60.0, 22.0], [90.0, 24.0]]), np.array([[0.0, 1.0], [0.6, 0.8]])
    return SimpleNamespace(rms=rms, places=places, normals=normals, offsets=np.array([0.5, -0.25]))


def quad(**parts):
    """A quadrilateral whose corners are known with ever smaller variances."""
    whole = np.zeros((8, 8))
    for i in range(4):
        whole[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = SPREAD / (i + 1)
    told = tuple(quantity(f"side {i + 1}", length) for i, length in enumerate(LENGTHS))
    return shape(**{"corners": CORNERS, "covariance": whole, "quantities": told, "residuals": (side(),)} | parts)


def drawn(*found, size=WIDE, candidates=()):
    shown = overlay.figure(np.arange(np.prod(size), dtype=float).reshape(size), of(*found, candidates=candidates))
    return shown, shown.axes[0]


def of(*found, candidates=()):
    return SimpleNamespace(found=found, candidates=candidates)


@pytest.mark.parametrize(
    ("size", "left", "width", "height"), [(WIDE, 0, 1200, 400), (TALL, 450, 300, 1500)], ids=["wide", "tall"]
)
def test_the_picture_fills_the_drawing_one_way(size, left, width, height):
    """1200 px wide or 1500 tall; below it a line of text for the shape and one about what is enlarged."""
    shown, axes = drawn(quad(), size=size)
    total = height + round(44 * 2.6) + (44 if len(shown.texts) == 3 else 0)
    assert shown.get_size_inches() * 100 == pytest.approx([1200, total])
    box = (left / 1200, 1 - height / total, width / 1200, height / total)
    assert axes.get_position().bounds == pytest.approx(box)
    assert (shown.images[0].ox, shown.images[0].oy) == (left, total - height)
    assert shown.images[0].get_array().shape[:2] == (height, width)
    assert (axes.get_xlim(), axes.get_ylim()) == ((-0.5, size[1] - 0.5), (size[0] - 0.5, -0.5))
    first = shown.texts[0]
    assert first.get_position() == pytest.approx((0.012, 1 - (height + 44 * 0.9) / total))
    assert shown.texts[1].get_position()[1] == pytest.approx(first.get_position()[1] - 44 / total)


def test_a_mark_of_the_shapes_colour_is_beside_its_line():
    shown, _ = drawn(quad(), shape(status="short", measured=False))
    marks = [(m.get_x(), m.get_y(), m.get_width(), m.get_height(), to_hex(m.get_facecolor())) for m in shown.patches]
    lines = [text for text in shown.texts if "dots" not in text.get_text()]
    total = shown.get_size_inches()[1] * 100
    assert len(marks) == len(lines)
    for (x, y, width, height, _), text in zip(marks, lines, strict=True):
        assert (x, width, height) == pytest.approx((0, 0.008, 35.2 / total))
        assert y + height / 2 == pytest.approx(text.get_position()[1])
    assert [marks[0][4], marks[-1][4]] == ["#00e676", "#ffd600"]


def test_a_line_that_is_too_long_is_set_smaller():
    """A letter is 0.62 of the text's size wide; 976 of 1000 of the width are for letters: 59 of them, not 60."""
    fine = quad(residuals=(side(1e-5),), covariance=1e-10 * quad().covariance)
    shown, _ = drawn(fine)
    sizes = {len(text.get_text()): text.get_fontsize() for text in shown.texts}
    letter = 0.62 * 23 * 100 / 72
    for length, size in sizes.items():
        assert size == pytest.approx(min(23, 0.976 * 1200 / letter / length * 23))
    assert min(sizes.values()) < 23 == max(sizes.values())


def test_grey_is_stretched_between_the_darkest_and_the_brightest():
    """All but a thousandth at either end; smaller it is averaged, larger repeated."""
    image = np.array([[10.0, 30.0], [20.0, 50.0]])
    assert overlay._grey(image, 2.0).shape == (4, 4)
    assert overlay._grey(image, 2.0)[[0, 0, 2, 3], [0, 3, 1, 2]].tolist() == [0, 127, 63, 255]
    fine = np.kron(image, np.ones((2, 2))) + np.tile([[-3.0, 3.0], [3.0, -3.0]], (2, 2))
    assert overlay._grey(fine, 0.5).tolist() == [[0, 127], [63, 255]]
    assert overlay._grey(np.full((2, 3), 7.0), 1.0).tolist() == [[0, 0, 0], [0, 0, 0]]


def test_how_much_is_enlarged():
    """A usual residual to 9 px of the drawing and the largest ellipse to 26, or less: to 1, 2 or 5 times 10^k."""
    largest = np.linalg.eigvalsh(SPREAD)[-1]
    found = of(quad(residuals=(side(0.2), side(0.5), side(9.0))), quad(covariance=0.25 * quad().covariance))
    residual, corner = overlay._factors(found, 3.0)
    assert residual == 5  # 9 px over 3 times a median of 0.5 is 6
    # margin: digits of the number beside it
    assert 26 / 3 / np.sqrt(5.991 * largest) == pytest.approx(11.4, abs=0.1)
    assert corner == 10
    assert overlay._factors(of(shape()), 3.0) == (1, 1)


def test_corners_without_covariance_have_no_part_in_it():
    """Of a board whose corners are not all measured."""
    whole = quad().covariance.copy()
    whole[:2] = whole[:, :2] = np.nan
    assert overlay._largest(quad(covariance=whole)) == pytest.approx(np.linalg.eigvalsh(SPREAD)[-1] / 2)
    assert overlay._largest(quad(covariance=np.full((8, 8), np.nan))) == 0
    assert overlay._largest(quad(covariance=-1e-20 * np.eye(8))) == 0  # rounding
    _, axes = drawn(quad(covariance=whole))
    assert [tuple(each.center) for each in axes.patches] == [tuple(corner) for corner in CORNERS[1:]]


def test_ellipses_hold_95_percent_of_the_place():
    """Five times as large as they are; their long axis along the covariance's larger eigenvector."""
    shown, axes = drawn(quad())
    assert "95 % of place x 5" in shown.texts[-1].get_text()
    sizes, turned = np.linalg.eigh(SPREAD)
    for i, each in enumerate(axes.patches):
        assert tuple(each.center) == tuple(CORNERS[i])
        assert (each.height, each.width) == pytest.approx(2 * 5 * np.sqrt(5.991 * sizes / (i + 1)))
        way = np.array([np.cos(np.radians(each.angle)), np.sin(np.radians(each.angle))])
        assert abs(way @ turned[:, 1]) == pytest.approx(1)


def test_dots_stand_off_by_the_residual_enlarged():
    """By 2 times: a residual of 0.9 px is 3.6 px of the drawing."""
    one = side(0.9)
    shown, axes = drawn(quad(residuals=(one,)))
    assert "edge's distance x 2" in shown.texts[-1].get_text()
    assert axes.lines[-1].get_xydata() == pytest.approx(one.places + np.array([[0.0, 1.0], [-0.3, -0.4]]))


def test_outlines_are_closed():
    """What was found and not measured dashed, candidates dotted."""
    outline = np.array([[3.0, 4.0], [50.0, 6.0], [30.0, 44.0]])
    candidate = SimpleNamespace(outline=outline)
    _, axes = drawn(quad(), shape(candidate=candidate, measured=False, status="short"), candidates=[candidate])
    assert [line.get_linestyle() for line in axes.lines if line.get_linestyle() != "None"] == [":", "-", "--"]
    assert axes.lines[0].get_xydata().tolist() == [*outline.tolist(), [3.0, 4.0]]
    assert axes.lines[1].get_xydata().tolist() == [*CORNERS.tolist(), [40.0, 20.0]]


def test_an_ellipse_is_drawn_along_its_own_outline():
    ellipse = np.array([120.0, 60.0, 40.0, 25.0, 17.0])
    _, axes = drawn(shape(kind="ellipse", ellipse=ellipse, covariance=np.diag([0.04, 0.09, 1.0, 1.0, 1.0])))
    x, y = axes.lines[0].get_xydata().T - ellipse[:2, None]
    c, s = np.cos(np.radians(17)), np.sin(np.radians(17))
    along, across = c * x + s * y, c * y - s * x
    assert (along / 40) ** 2 + (across / 25) ** 2 == pytest.approx(np.ones(len(x)))
    (oval,) = axes.patches
    assert tuple(oval.center) == (120.0, 60.0)
    assert oval.width / oval.height == pytest.approx(1.5)


def test_a_board_is_drawn_by_its_corners():
    _, axes = drawn(quad(kind="chessboard", residuals=(), quantities=()))
    assert axes.lines[0].get_marker() == "+"
    assert axes.lines[0].get_xydata().tolist() == CORNERS.tolist()
    assert [text.get_text() for text in axes.texts] == ["1"]  # no lengths


def test_sides_lengths_stand_outside_along_them():
    """30 px of the drawing off the middle; sides that are too short for their words have none."""
    _, axes = drawn(quad())
    words = {text.get_text(): text for text in axes.texts if "px" in text.get_text()}
    assert list(words) == [f"{LENGTHS[i]:.3f} ± 0.031 px" for i in (0, 2)]
    for i, text in zip((0, 2), words.values(), strict=True):
        start, stop = CORNERS[i], CORNERS[(i + 1) % 4]
        off = np.array(text.get_position()) - (start + stop) / 2
        assert np.linalg.norm(off) == pytest.approx(30 / 4)
        assert off @ (stop - start) == pytest.approx(0, abs=1e-9)
        assert off @ ((start + stop) / 2 - CORNERS.mean(0)) > 0
        slope = (stop - start)[1] / (stop - start)[0]
        assert text.get_rotation() % 360 == pytest.approx(-np.degrees(np.arctan(slope)) % 360)


@pytest.mark.parametrize(("length", "is_there"), [(75.0, False), (75.5, True)])
def test_words_need_room_along_their_side(length, is_there):
    """19 letters of 19.8 px, of which 80 % are 301 px: 75.3 px of a photograph that is drawn 4 times as large."""
    corners = np.array([[40.0, 20.0], [40.0 + length, 20.0], [50.0, 60.0], [20.0, 60.0]])
    _, axes = drawn(shape(corners=corners, quantities=(quantity("side 1", 1000.0),)))
    assert ("1000.000 ± 0.031 px" in [text.get_text() for text in axes.texts]) == is_there


def test_a_number_stands_in_the_middle_where_it_is_free():
    """Else at the middle of the first side: 44 px of the drawing are 11 here."""
    middle, first = CORNERS.mean(0), CORNERS[:2].mean(0)
    for by, place in ((np.array([6.0, 8.0]), first), (np.array([8.0, 9.0]), middle)):
        near = shape(candidate=SimpleNamespace(outline=CORNERS + by, family="", identifier=1))
        _, axes = drawn(near, shape(candidate=SimpleNamespace(outline=CORNERS)))
        places = {text.get_text(): text.get_position() for text in axes.texts}
        assert places == {"1": pytest.approx(middle + by), "2": pytest.approx(place)}


def test_eight_shapes_are_told_of():
    lines = overlay._lines(of(*[shape(measured=False, status=f"s{k}") for k in range(11)]), 5, 2)
    assert [text for text, _ in lines] == [*(f"{k + 1} rectangle: s{k}" for k in range(8)), "and 3 more"]
    assert [lines[0][1], lines[7][1], lines[8][1]] == ["#00e676", "#18ffff", ""]
    assert overlay._colour(9) == "#00e676"
    assert len(overlay._lines(of(*[shape(measured=False)] * 8), 5, 2)) == 8


def test_what_is_enlarged_is_told_where_anything_is():
    """Also where one of two has residuals."""
    lines = overlay._lines(of(quad(), shape(measured=False)), 20, 50)
    assert lines[-1] == ("dots: edge's distance x 20;  red: 95 % of place x 50", "")
    assert not [text for text, _ in overlay._lines(of(shape(measured=False)), 20, 50) if "dots" in text]


def test_long_lines_are_broken_between_values():
    """At 58 letters; further lines of a shape have its colour, too."""
    lines = overlay._lines(of(quad(residuals=())), 1, 1)
    assert max(len(text) for text, _ in lines) <= int(0.96 * 1200 / (0.62 * 23 * 100 / 72)) == 58
    assert [text.startswith("   ") for text, _ in lines] == [False, True]
    assert {colour for _, colour in lines} == {"#00e676"}
    assert all("±\xa0" in text and " ± " not in text for text, _ in lines)


def test_what_is_told_of_a_shape():
    tag = SimpleNamespace(family="36h11", identifier=7, outline=CORNERS)
    told = (quantity("side 1", 50.0), quantity("diagonal 1", 70.0), quantity("centre x", 3.0),
            quantity("angle", 90.0, 0.1, "degrees"), quantity("width", 20.0, 0.5))  # fmt: skip
    found = overlay._told(shape(kind="tag", candidate=tag, quantities=told))
    assert found.replace("\xa0", " ") == "36h11 7, ok: 50.000 ± 0.031, 20.00 ± 0.50 px"
    assert overlay._told(shape(status="short", measured=False, quantities=told)) == "rectangle: short"
    assert overlay._told(quad(kind="chessboard", status="clutter")) == "chessboard: 4 corners, clutter"


@pytest.mark.parametrize(
    ("sigma", "text"),
    [(0.0312, "83.209 ± 0.031"), (0.0, "83.2091 ± 0.0000"), (12.4, "83 ± 12"), (1.24, "83.2 ± 1.2"),
     (3e-9, "83.209100 ± 0.000000"), (250.0, "83 ± 250")],
)  # fmt: skip
def test_two_digits_of_a_standard_deviation(sigma, text):
    assert overlay._with_sigma(83.2091, sigma) == text


@pytest.mark.parametrize(("factor", "nice"), [(70.0, 50.0), (0.3, 0.2), (1.99, 1.0), (2.0, 2.0), (0.02, 0.02)])
def test_nice_factors(factor, nice):
    assert overlay._nice(factor) == pytest.approx(nice)
