"""A layout that is off by a shift and a turn is found to half a step, in each image of a stack by itself."""

import numpy as np
import pytest

from measure.features.alignment import align
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from tests.oracle import polygon_image

SHAPE = (90, 120)
CORNERS = np.array([[35.0, 25.0], [85.0, 30.0], [80.0, 66.0], [30.0, 60.0]])
MOVES = [(0.0, 0.0, 0.0), (3.0, -2.0, 0.0), (-4.0, 1.5, 1.0), (1.0, 4.0, -2.0), (0.0, -3.5, 1.5)]


def moved(corners, shift, degrees):
    middle, turn = corners.mean(0), np.radians(degrees)
    z = ((corners - middle) @ [1, 1j]) * np.exp(1j * turn)
    return np.column_stack([z.real, z.imag]) + middle + shift


@pytest.mark.parametrize("contrast", [100.0, -80.0])
def test_align(contrast, rng):
    layout = polygon_layout(CORNERS, Optics(SHAPE, 0.7, 4.0))
    images = np.array([
        polygon_image(moved(CORNERS, move[:2], move[2]), SHAPE, 0.7, contrast, 100.0) for move in MOVES
    ]) + 2 * rng.standard_normal((len(MOVES), *SHAPE))  # fmt: skip
    found = align(images, layout)
    assert found.shape == (len(MOVES), 3)
    for each, move in zip(found, MOVES, strict=True):
        assert np.abs(each[:2] - move[:2]).max() <= 0.5
        # margin: steps of a degree: one of the moves lies halfway
        assert abs(np.degrees(each[2]) - move[2]) <= 0.5 + 1e-9
        # margin: half pixels each way and half a degree at 60 px are 0.9 at most
        assert np.abs(moved(CORNERS, each[:2], np.degrees(each[2])) - moved(CORNERS, move[:2], move[2])).max() < 0.8
        assert np.allclose(each[:2] * 2, np.round(each[:2] * 2))


def test_where_nothing_is_seen_nothing_moves():
    layout = polygon_layout(CORNERS, Optics(SHAPE, 0.7, 4.0))
    assert align(np.zeros((2, *SHAPE)), layout).tolist() == [[0, 0, 0]] * 2
