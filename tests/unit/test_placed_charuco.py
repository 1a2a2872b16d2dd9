"""A ChArUco board beside the part: how it is printed, what its corners tell, where it is found, its render."""

import cv2
import numpy as np
import pytest

import measure
import render
import scenes
from imaging.features.measurand import measurands
from imaging.pictures import Pictures
from imaging.placed import difference
from measure.features.board import BoardTool
from scenes import Board, InvalidInput, Picture
from tests import placements as parts
from tests import printed

_BOARD = {"kind": "charuco", "dictionary": "DICT_4X4_50", "marker": 3.6, "shape": [5, 3], "corner": [-14, 46, 0],
          "pitch": {"value": 6.0, "sd": 2e-4}}  # fmt: skip


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    scene = printed.scene(tmp_path, "block", camera={"width": 220, "height": 250, "focal_px": 750.0})
    small = {"shape": [4, 3], "corner": [-12, 46, 0]}
    pictures = [Picture.of(scene.with_(placement={"board": board | small}), (25, 290), (30, 40))
                for board in (_BOARD, {"kind": "chessboard", "pitch": 6.0})]  # fmt: skip
    made, (drawn, plain) = render.image(pictures[0]), (printed.seen(each, np.zeros(6)) for each in pictures)
    assert np.abs(made - drawn).max() < 1.0  # of 150 levels; 0.4 found
    assert np.abs(made - plain).max() > 60  # negative control


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"kind": "chessboard"}, "dictionary and marker must be left out of a chessboard, got 3.6"),
        ({"kind": "dots", "marker": None}, "dictionary and marker must be left out of a dots, got DICT_4X4_50"),
        ({"marker": 6.0}, "marker must be less than pitch, 6, got 6"),
        ({"dictionary": None}, "dictionary must be one of DICT_4X4_100"),
        ({"shape": [20, 20]}, "dictionary must have the board's 220 markers, got DICT_4X4_50, which has 50"),
        ({"dot_radius": 1.0}, "dot_radius must be left out of a charuco, got 1"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(changes, says):
    with pytest.raises(InvalidInput, match=says):
        scenes.load("bracket_station").with_(placement={"from": "board", "board": {**_BOARD, "pitch": 6.0} | changes})
