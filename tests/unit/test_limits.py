"""Limits of fits and general tolerances against rows of the standards' tables that are written here anew."""

import pytest

from scenes.parts.limits import CLASSES, general, of_fit


@pytest.mark.parametrize(
    ("size", "fit", "upper", "lower"),
    [  # micrometres, as in tables of preferred fits (ISO 286-2)
        (3, "H7", 10, 0), (6, "H7", 12, 0), (10, "H7", 15, 0), (18, "H7", 18, 0), (30, "H7", 21, 0), (50, "H7", 25, 0),
        (80, "H7", 30, 0), (120, "H7", 35, 0), (180, "H7", 40, 0), (250, "H7", 46, 0), (315, "H7", 52, 0),
        (400, "H7", 57, 0), (500, "H7", 63, 0), (25, "H8", 33, 0), (25, "H11", 130, 0), (25, "f7", -20, -41),
        (25, "g6", -7, -20), (25, "h6", 0, -13), (25, "h9", 0, -52), (25, "h11", 0, -130), (25, "k6", 15, 2),
        (25, "m6", 21, 8), (25, "n6", 28, 15), (25, "p6", 35, 22), (25, "d9", -65, -117), (25, "e8", -40, -73),
        (25, "F8", 53, 20), (25, "G7", 28, 7), (25, "E9", 92, 40), (25, "D10", 149, 65), (25, "js6", 6.5, -6.5),
        (25, "JS7", 10.5, -10.5), (100, "g6", -12, -34), (100, "p6", 59, 37), (400, "f7", -62, -119),
    ],
)  # fmt: skip
def test_fits(size, fit, upper, lower):
    plus, minus = of_fit(size, fit)
    assert (1000 * plus, -1000 * minus) == pytest.approx((upper, lower), abs=1e-9)  # margin: rounding of mm


@pytest.mark.parametrize(
    ("size", "fit"),
    [(25, "K7"), (25, "P7"), (25, "k8"), (25, "H4"), (25, "H14"), (501, "H7"), (0, "H7"), (25, "7H"), (25, "")],
)
def test_what_the_tables_here_do_not_have(size, fit):
    assert of_fit(size, fit) is None


def test_ranges_end_with_their_last_size():
    assert [of_fit(size, "H7")[0] for size in (30, 30.001)] == [0.021, 0.025]
    assert [general(size, "m") for size in (30, 30.001)] == [0.2, 0.3]


def test_general_tolerances():
    sizes = (0.5, 3, 6, 30, 120, 400, 1000, 2000, 4000)
    assert [general(size, "m") for size in sizes] == [0.1, 0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0]
    assert [general(size, "c") for size in sizes] == [0.2, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 4.0]
    assert [general(size, "f") for size in sizes] == [0.05, 0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, None]
    assert [general(size, "v") for size in sizes] == [None, None, 0.5, 1.0, 1.5, 2.5, 4.0, 6.0, 8.0]
    assert [general(size, "m") for size in (0.49, 4001)] == [None, None]
    assert CLASSES == ("f", "m", "c", "v")
