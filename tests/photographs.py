"""Photographs with what a person sees in them: those that scikit-image ships, and some made here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import skimage

from measure.find.candidate import CHESSBOARD, CIRCLE, ELLIPSE, QUADRILATERAL, TAG, Candidate
from tests.oracle import polygon_image
from tests.pattern_image import chessboard_cells, pattern_image, tag_cells

ROUND = (CIRCLE, ELLIPSE)
_NOISE = 1.5


@dataclass(frozen=True)
class Seen:
    """One shape that a person sees: kinds that it may be called, its centre, px, and the root of its area, px."""

    kinds: tuple[str, ...]
    x: float
    y: float
    size: float

    def like(self, one: Candidate) -> bool:
        """Whether a candidate is it: centre within 3 px and 3 %, size within 3 px and 6 %."""
        near = np.linalg.norm(one.centre - [self.x, self.y]) < 3 + 0.03 * self.size
        # margin: as a person sees it: what is no candidate is another shape altogether
        return one.kind in self.kinds and near and abs(np.sqrt(one.area) - self.size) < 3 + 0.06 * self.size


@dataclass(frozen=True)
class Photo:
    """A photograph: how it is made or read, what a person says, and how many shapes more may be found."""

    image: Callable[[], np.ndarray]
    said: str
    seen: tuple[Seen, ...] = ()
    others: int = 0

    def missed(self, found: tuple[Candidate, ...]) -> list[str]:
        """What is wrong with what was found; nothing is said where it is what a person sees."""
        wrong = [f"not found: {each}" for each in self.seen if not any(each.like(one) for one in found)]
        more = [one for one in found if not any(each.like(one) for each in self.seen)]
        if len(more) > self.others:
            wrong += [f"also found: {one.kind} at {one.centre.round()}" for one in more]
        return wrong


def _file(name: str) -> Callable[[], np.ndarray]:
    return lambda: cv2.imread(str(Path(skimage.__file__).parent / "data" / name), cv2.IMREAD_GRAYSCALE).astype(float)


def _noisy(image: np.ndarray, seed: int = 1) -> np.ndarray:
    return np.clip(np.rint(image + _NOISE * np.random.default_rng(seed).standard_normal(image.shape)), 0, 255)


def turned(width: float, height: float, degrees: float, shape=(200, 260)) -> np.ndarray:
    """Corners (4, 2) of a rectangle centred on an image and turned."""
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    box = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 * [width, height]
    return box @ turn + (np.array(shape[::-1]) - 1) / 2


def rectangle(width: float, height: float, degrees: float, shape=(200, 260), seed: int = 1) -> np.ndarray:
    """It, bright on dark, with noise."""
    return _noisy(polygon_image(turned(width, height, degrees, shape), shape, 0.8, 135.0, 50.0), seed)


def _tripod() -> np.ndarray:
    """Dark legs that meet at the top, between them slivers of ground; they leave the picture below."""
    image = np.full((240, 320), 160.0)
    for foot in (60.0, 150.0, 250.0):
        leg = np.array([[157.0, 30], [163, 30], [foot + 5, 239], [foot - 5, 239]])
        image += polygon_image(leg, image.shape, 0.8, -60.0, 0.0)
    return _noisy(np.maximum(image + polygon_image([[40.0, 180], [280, 180], [280, 188], [40, 188]], image.shape, 0.8,
                                                   -60.0, 0.0), 60.0))  # fmt: skip


_BRICKS = [np.array([[x, 80.0], [x + 100, 80], [x + 100, 130], [x, 130]]) for x in (50.3, 156.3)]


def _bricks() -> np.ndarray:
    """Two bricks with a joint of 6 px between them."""
    return _noisy(sum(polygon_image(brick, (210, 310), 0.8, -70.0, 75.0) for brick in _BRICKS))


_FRAME = turned(200, 130, 8, (220, 300)), turned(184, 114, 8, (220, 300))


def _frame() -> np.ndarray:
    outer, inner = (polygon_image(corners, (220, 300), 0.8, 100.0, 0.0) for corners in _FRAME)
    return _noisy(60 + outer - inner)


_PLATE = np.array([[80.3, 60.2], [560.4, 75.0], [548.0, 420.7], [70.0, 400.0]])
_HOLES = (160.0, 140.0, 30.0), (470.0, 150.0, 18.0), (460.0, 330.0, 42.0), (170.0, 320.0, 24.0)


def disc(x: float, y: float, radius: float, shape, blur: float = 0.8) -> np.ndarray:
    """A blurred disc of level 1 as a polygon of 180 corners."""
    return ellipse((x, y, radius, radius, 0.0), shape, blur)


def ellipse(parameters, shape, blur: float = 0.8) -> np.ndarray:
    """The same of an ellipse x, y, a, b, angle (degrees) that lies in the image as a whole."""
    x, y, a, b, angle = parameters
    t = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    swollen = np.sqrt(2 * np.pi / 180 / np.sin(2 * np.pi / 180))  # of the same area
    cosine, sine = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    u, v = swollen * a * np.cos(t), swollen * b * np.sin(t)
    corners = np.stack([x + cosine * u - sine * v, y + sine * u + cosine * v], 1)
    low = np.maximum(np.floor(corners.min(0) - 8), 0).astype(int)
    high = np.minimum(np.ceil(corners.max(0) + 9).astype(int), shape[::-1])
    image = np.zeros(shape)
    part = tuple((high - low)[::-1].tolist())
    image[low[1] : high[1], low[0] : high[0]] = polygon_image(corners - low, part, blur, 1.0, 0.0)
    return image


@lru_cache(maxsize=1)
def plate() -> np.ndarray:
    """A plate with four holes."""
    image = polygon_image(_PLATE, (480, 640), 0.8, 120.0, 50.0)
    return _noisy(image - 120 * sum(disc(*hole, image.shape) for hole in _HOLES))


_TAG = np.array([[70.3, 40.2], [160.3, 48.0], [154.0, 135.0], [61.0, 128.0]])


@lru_cache(maxsize=20)
def tag(family: str, number: int, turn: int = 0) -> np.ndarray:
    """One tag on bright paper; its first corner is one of four."""
    return _noisy(pattern_image(tag_cells(family, number), np.roll(_TAG, turn, 0), (200, 240)))


_BOARD = np.array([[50.0, 40.0], [330.0, 55.0], [318.0, 230.0], [62.0, 240.0]])


@lru_cache(maxsize=1)
def board() -> np.ndarray:
    """A chessboard of 8 x 6 squares, seen from aside."""
    return _noisy(pattern_image(chessboard_cells(8, 6), _BOARD, (280, 380)))


_FACES = (
    np.array([[70.0, 80.0], [175.0, 50.0], [235.0, 95.0], [125.0, 130.0]]),
    np.array([[70.0, 80.0], [125.0, 130.0], [127.0, 205.0], [75.0, 150.0]]),
    np.array([[125.0, 130.0], [235.0, 95.0], [230.0, 165.0], [127.0, 205.0]]),
)


def _block() -> np.ndarray:
    """Three faces of a block: bright, dark and between."""
    levels = 140.0, 30.0, 70.0
    return _noisy(40 + sum(polygon_image(face, (240, 320), 0.8, level, 0.0)
                           for face, level in zip(_FACES, levels, strict=True)))  # fmt: skip


def _quadrilateral(corners: np.ndarray) -> Seen:
    corners = np.asarray(corners, float)
    return Seen((QUADRILATERAL,), *corners.mean(0), float(np.sqrt(cv2.contourArea(corners.astype(np.float32)))))


def _disc(x: float, y: float, radius: float) -> Seen:
    return Seen(ROUND, x, y, float(np.sqrt(np.pi) * radius))


def _ellipse(x: float, y: float, a: float, b: float) -> Seen:
    return Seen(ROUND, x, y, float(np.sqrt(np.pi * a * b)))


MADE = {
    "turned by 45 degrees": Photo(
        lambda: rectangle(100, 60, 45), "a rectangle", (_quadrilateral(turned(100, 60, 45)),)
    ),
    "square on its corner": Photo(lambda: rectangle(60, 60, 45), "a square", (_quadrilateral(turned(60, 60, 45)),)),
    "tripod": Photo(_tripod, "legs of a tripod; no quadrilateral"),
    "two bricks": Photo(_bricks, "two bricks", tuple(map(_quadrilateral, _BRICKS))),
    "frame": Photo(_frame, "a frame: two rectangles", tuple(map(_quadrilateral, _FRAME))),
    "plate": Photo(plate, "a plate with four holes", (_quadrilateral(_PLATE), *(_disc(*hole) for hole in _HOLES))),
    "block": Photo(_block, "a block: three faces", tuple(map(_quadrilateral, _FACES))),
    "AprilTag": Photo(lambda: tag("APRILTAG_36h11", 17), "a tag", (Seen((TAG,), *_TAG.mean(0), 88.2),)),
    "ArUco": Photo(lambda: tag("4X4_1000", 3), "a tag", (Seen((TAG,), *_TAG.mean(0), 88.2),)),
    "board from aside": Photo(board, "a chessboard", (Seen((CHESSBOARD,), 190.0, 138.0, 150.0),)),
    "noise": Photo(lambda: _noisy(np.full((300, 400), 100.0)), "nothing"),
    "plain": Photo(lambda: np.full((300, 400), 100.0), "nothing"),
}

_COINS = (
    (102, 196, 38), (336, 124, 34), (212, 193, 42), (154, 127, 33), (154, 198, 34), (244, 263, 42), (205, 124, 35),
    (102, 126, 33), (45, 124, 36), (335, 44, 51), (114, 266, 38), (271, 119, 44), (347, 187, 56), (172, 261, 48),
    (301, 263, 45), (358, 268, 39), (44, 197, 34), (46, 260, 50), (100, 56, 33), (155, 51, 41), (215, 51, 40),
    (276, 52, 35), (44, 54, 37),
)  # fmt: skip

SHIPPED = {
    "camera.png": Photo(_file("camera.png"), "a man with a camera on a tripod; no quadrilateral"),
    "page.png": Photo(_file("page.png"), "text; nothing"),
    "text.png": Photo(_file("text.png"), "handwriting; nothing"),
    "horse.png": Photo(_file("horse.png"), "a horse; nothing"),
    "moon.png": Photo(_file("moon.png"), "craters; nothing"),
    "grass.png": Photo(_file("grass.png"), "grass; nothing"),
    "gravel.png": Photo(_file("gravel.png"), "pebbles; nothing"),
    "chelsea.png": Photo(_file("chelsea.png"), "a cat; nothing"),
    "rocket.jpg": Photo(_file("rocket.jpg"), "a rocket; nothing"),
    "brick.png": Photo(_file("brick.png"), "a wall; single bricks at most, never two", (), 3),
    "astronaut.png": Photo(
        _file("astronaut.png"), "a window's image on the helmet, a round badge",
        (Seen((QUADRILATERAL,), 359, 442, 26), Seen(ROUND, 171, 386, 68)),
    ),
    "coins.png": Photo(
        _file("coins.png"), "24 coins, one of them worn", tuple(Seen(ROUND, x, y, size) for x, y, size in _COINS), 1
    ),
    "coffee.png": Photo(
        _file("coffee.png"), "the rim of a cup, outside and inside",
        (Seen(ROUND, 290, 113, 187), Seen(ROUND, 291, 112, 158)),
    ),
    "phantom.png": Photo(
        _file("phantom.png"), "a skull, outside and inside, and two chambers",
        (Seen(ROUND, 199, 199, 282), Seen(ROUND, 200, 203, 269), Seen(ROUND, 156, 199, 90), Seen(ROUND, 243, 199, 65)),
        3,
    ),
    "retina.jpg": Photo(_file("retina.jpg"), "a round field of view", (Seen(ROUND, 704, 703, 1231),)),
    "cell.png": Photo(_file("cell.png"), "a round cell", (Seen(ROUND, 428, 374, 112),)),
    "logo.png": Photo(_file("logo.png"), "a disc", (Seen(ROUND, 251, 250, 426),)),
    "chessboard_GRAY.png": Photo(
        _file("chessboard_GRAY.png"), "a chessboard of 7 x 7 inner corners", (Seen((CHESSBOARD,), 99.5, 99.5, 150),)
    ),
}  # fmt: skip
