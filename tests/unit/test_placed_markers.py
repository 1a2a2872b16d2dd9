"""A board with markers beside the part, ChArUco's or tags alone: its print, its corners, where it is found."""

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
_TAGS = {"kind": "markers", "dictionary": "DICT_APRILTAG_36h11", "marker": 9.0, "shape": [3, 2], "corner": [-16, 42, 0],
         "pitch": {"value": 12.0, "sd": 2e-4}}  # fmt: skip
_CLOCKWISE = [2, 3, 1, 0]  # of a marker's corners, row by row from below: as OpenCV has them


@pytest.fixture(scope="module", params=[_BOARD, _TAGS], ids=["charuco", "markers"])
def picture(tmp_path_factory, request):
    scene = printed.scene(tmp_path_factory.mktemp("boards"), "block")
    return Picture.of(scene.with_(placement={"board": request.param}), parts.SENSOR, parts.LIGHT)


@pytest.fixture(scope="module")
def clean(picture):
    return printed.seen(picture, np.zeros(6))


@pytest.fixture(scope="module")
def tool(picture):
    return BoardTool(picture, measurands(Pictures.of(picture)).placing.board)


@pytest.mark.parametrize("kind", ["charuco", "markers"])
@pytest.mark.parametrize("shape", [(5, 4), (5, 3)])
def test_bright_and_dark_cover_a_board_once(kind, shape):
    board = Board(kind=kind, shape=shape, pitch=3.0, corner=(1, 2, 3), dictionary="DICT_4X4_50", marker=1.8)
    bright, dark = (np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() / 2
                    for t in board.triangles)  # fmt: skip
    assert bright + dark == pytest.approx(np.prod(board.size), rel=1e-12)
    (x, y), (u, v) = np.moveaxis(board.dark_polygons, -1, 0), np.moveaxis(np.roll(board.dark_polygons, -1, 1), -1, 0)
    assert (x * v - y * u).sum() / 2 * 9 == pytest.approx(dark, rel=1e-12)  # bright cells count against


def test_what_is_printed_is_opencvs_board():
    """Dark polygons filled, the board upright, against OpenCV's own picture of it: 40 px a square, 4 px a cell."""
    for shape in ((5, 4), (5, 3)):
        board = Board(kind="charuco", shape=shape, pitch=1.0, corner=(0, 0, 0), dictionary="DICT_4X4_50", marker=0.6)
        columns, rows = shape
        flat = np.full((40 * (rows + 1), 40 * (columns + 1)), 255, np.uint8)
        for outline in board.dark_polygons:
            (x, y), area = 40 * (outline + 1).T, cv2.contourArea(outline.astype(np.float32), True)
            low, high = np.rint([x.min(), y.min()]).astype(int), np.rint([x.max(), y.max()]).astype(int)
            flat[len(flat) - high[1] : len(flat) - low[1], low[0] : high[0]] = 0 if area > 0 else 255
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        known = cv2.aruco.CharucoBoard((columns + 1, rows + 1), 1.0, 0.6, dictionary)
        np.testing.assert_array_equal(flat, known.generateImage(flat.shape[::-1]))


@pytest.mark.parametrize("picture", [_TAGS], indirect=True)
def test_tags_are_where_opencv_reads_them(clean, tool):
    """Numbers and corners, to what OpenCV tells them."""
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
    detector.setDetectorParameters(_by_contour())
    corners, numbers, _ = detector.detectMarkers(np.clip(np.rint(clean), 0, 255).astype(np.uint8))
    expected = tool.grid.reshape(2, 3, 4, 2)[::-1].reshape(6, 4, 2)[:, _CLOCKWISE]
    assert sorted(numbers.ravel().tolist()) == list(range(6))
    for number, four in zip(numbers.ravel(), corners, strict=True):
        assert np.abs(four[0] - expected[number]).max() < 2  # px; 0.62 found, cells are 4.5 px wide


def _by_contour():
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
    return parameters


def test_points_are_as_well_known_as_told(tool, clean):
    """Without noise where they are; with it, 16 x 30 coordinates, chance 26 %; and what a pixel moves."""
    still, rng = tool.measured(clean), np.random.default_rng(4)
    assert set(still.status) == {"ok"}
    assert np.abs(still.corners - tool.grid.reshape(-1, 2)).max() < 3e-3
    off, noise = tool.points(still)
    ratio = np.einsum("nii->n", noise) / np.einsum("nii->n", tool.told.noise)
    assert ratio.mean() == pytest.approx(1, abs=0.12)
    white = []
    for _ in range(16):
        away, _ = tool.points(tool.measured(clean + tool._noise * rng.standard_normal(clean.shape)))
        white.append(np.linalg.solve(np.linalg.cholesky(tool.told.noise), (away - off)[..., None]))
    square, chance = np.square(white).mean(), 4 * np.sqrt(2 / np.size(white))
    assert abs(square - 1) < chance
    assert abs(square / 1.6 - 1) > chance  # negative control
    small = 0.02 * rng.standard_normal(clean.shape)
    moved = tool.found(clean + small)[0] - tool.found(clean)[0]
    told = tool.response(clean) @ small.ravel()
    assert np.abs(moved - told).max() < 0.15 * np.abs(told).max()


def test_a_part_is_found_by_its_board(picture):
    there = np.array([3.0, -2.0, 1.5, 2.0, -2.0, 2.5])
    clean = printed.seen(picture, there)
    (image,) = render.expose(clean, picture.scene.noise, np.random.default_rng(1), 1)
    where = measure.locate(image, picture, estimator="gradient")
    assert where.status == "ok", where.reason
    assert np.abs(difference(there, where.placement) / np.sqrt(np.diag(where.covariance))).max() < 5
    turned = measure.locate(np.ascontiguousarray(image[::-1]), picture)  # a mirrored board is none
    assert turned.status == "not_visible"


def test_a_render_shows_the_board_of_the_image_model(tmp_path):
    """Mitsuba's triangles against polygons blurred in closed form; a chessboard is another picture."""
    scene = printed.scene(tmp_path, "block", camera={"width": 220, "height": 250, "focal_px": 750.0})
    small, tags = {"shape": [4, 3], "corner": [-12, 46, 0]}, {"shape": [2, 1], "corner": [-11, 44, 0]}
    pictures = [Picture.of(scene.with_(placement={"board": board}), (25, 290), (30, 40))
                for board in (_BOARD | small, _TAGS | tags, {"kind": "chessboard", "pitch": 6.0} | small)]  # fmt: skip
    drawn = [printed.seen(each, np.zeros(6)) for each in pictures]
    for picture, seen in zip(pictures[:2], drawn, strict=False):
        made = render.image(picture)
        assert np.abs(made - seen).max() < 1.0  # of 150 levels; 0.4 found
        assert np.abs(made - drawn[2]).max() > 60  # negative control


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"kind": "chessboard"}, "dictionary and marker must be left out of a chessboard, got 3.6"),
        ({"kind": "dots", "marker": None}, "dictionary and marker must be left out of a dots, got DICT_4X4_50"),
        ({"marker": 6.0}, "marker must be less than pitch, 6, got 6"),
        ({"dictionary": None}, "dictionary must be one of DICT_4X4_100"),
        ({"shape": [20, 20]}, "dictionary must have the board's 220 markers, got DICT_4X4_50, which has 50"),
        ({"dot_radius": 1.0}, "dot_radius must be left out of a charuco, got 1"),
        ({"shape": [2, 5]}, r"shape must be at least 3 both ways of a charuco, got \[2, 5\]"),
        ({"kind": "markers", "shape": [1, 1]}, r"shape must be of at least 2 markers, got \[1, 1\]"),
        ({"kind": "markers", "shape": [8, 8]}, "dictionary must have the board's 64 markers, got DICT_4X4_50, which"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(changes, says):
    with pytest.raises(InvalidInput, match=says):
        scenes.load("bracket_station").with_(placement={"from": "board", "board": {**_BOARD, "pitch": 6.0} | changes})
