"""A grid of dots in an image: the centre of each, with its covariance and a status, as a `Board`."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from scipy import sparse
from scipy.special import chdtrc

from imaging.boards.dot_fitting import dot_reach, dot_rows, fit_dots
from imaging.boards.windows import steps
from measure.boards.chessboard import Board, check_shape
from measure.boards.noise import check_noise, of_board
from scenes import status
from scenes.arrays import picture
from scenes.errors import InvalidInput

_LEAST_AREA, _FEWEST = 12.0, 9  # px^2 of a dot, and how many make a grid
_ALIKE = 0.5, 2.0  # area of a dot over the median of its grid's
_FILLED = 0.85  # part of its ellipse that a blot fills at least, and the other way round
_NEAR = 0.3  # of the way to the next dot: where it is expected
_LEAST_GAP = 1.5  # px beside a dot that have to be seen
_FAINTEST = 3.0  # times the noise: the contrast of a dot
_FALSE_ALARM = 0.01  # of all dots of a grid together


def dot_grid(image: Any, shape: tuple[int, int] | None = None, noise: float | None = None) -> Board:
    """Measure the dots of the grid in an image.

    Blots about as large as most, ordered from neighbour to neighbour; then each is the likeliest blurred ellipse. Dots
    that are cut off, covered or blotted have no centre and no part in anything; a grid may be seen in part. What is
    measured are centres of ellipses: `calibrate_camera` takes off how far these are from the dots' own centres.

    Parameters
    ----------
    image : array_like, shape (height, width)
        Grey levels; the dots all darker, or all brighter than what is between them.
    shape : (columns, rows), optional
        Dots that the grid must have; counted when not given.
    noise : float, optional
        Standard deviation of white noise, grey levels; from the image when not given.

    Raises
    ------
    InvalidInput
        If there is no such grid in the image, or an argument is bad.
    """
    image, shape = picture(image), check_shape(shape)
    check_noise(noise)
    found = [_ordered(_blots(image, bright)) for bright in (False, True)]
    grid = max(found, key=lambda each: np.isfinite(each[..., 0]).sum())
    if np.isfinite(grid[..., 0]).sum() < _FEWEST or min(grid.shape[:2]) < 3:
        raise InvalidInput("image must show a grid of at least 3 x 3 dots, got none")
    if shape is not None and grid.shape[:2] != shape[::-1]:
        grid = grid.swapaxes(0, 1) if grid.shape[:2] == shape else grid
        if grid.shape[:2] != shape[::-1]:
            raise InvalidInput(
                f"image must show a whole grid of {shape[0]} x {shape[1]} dots, got {grid.shape[1]} x {grid.shape[0]}"
            )
    return measured(image, grid, noise)


def _blots(image: np.ndarray, bright: bool) -> np.ndarray:
    """Ellipses x, y, a, b, angle of dark or bright blots that may be dots, (n, 5)."""
    smooth = cv2.GaussianBlur(np.asarray(image, np.float32), (0, 0), 1.0)
    around = cv2.blur(smooth, (_window(image.shape),) * 2)
    away = smooth - around if bright else around - smooth
    mask = (away > np.percentile(away, 99) / 2).astype(np.uint8)
    outlines = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    height, width = image.shape
    found = []
    for outline in outlines:
        area = cv2.contourArea(outline)
        x, y, wide, high = cv2.boundingRect(outline)
        inside = x > 1 and y > 1 and x + wide < width - 1 and y + high < height - 1
        if area < _LEAST_AREA or len(outline) < 6 or not inside:
            continue
        (cx, cy), axes, angle = cv2.fitEllipseDirect(outline)
        b, a = sorted(each / 2 for each in axes)
        if b > 1 and np.isfinite(a) and _FILLED < area / (np.pi * a * b) < 1 / _FILLED:
            found.append((cx, cy, a, b, angle if axes[0] >= axes[1] else angle + 90))
    return np.array(found).reshape(-1, 5)


def _window(shape: tuple[int, int]) -> int:
    """px along which a mean stands for what is between dots: odd."""
    return 2 * (min(shape) // 16) + 1


def _ordered(blots: np.ndarray) -> np.ndarray:
    """Blots (rows, columns, 5) of the largest grid that goes from one blot to its neighbours; NaN where none is."""
    if len(blots) < _FEWEST:
        return np.full((0, 0, 5), np.nan)
    area = blots[:, 2] * blots[:, 3]
    blots = blots[(area > _ALIKE[0] * np.median(area)) & (area < _ALIKE[1] * np.median(area))]
    if len(blots) < _FEWEST:
        return np.full((0, 0, 5), np.nan)
    from scipy.spatial import KDTree  # slow to load, and rarely needed

    places, tree = blots[:, :2], KDTree(blots[:, :2])
    first = int(tree.query(np.median(places, 0))[1])
    there = _grown(places, tree, first)
    indices = np.array(list(there))
    low = indices.min(0)
    found = np.full((*(np.ptp(indices, axis=0) + 1), 5), np.nan)
    for index, blot in there.items():
        found[tuple(np.array(index) - low)] = blots[blot]
    return found


def _grown(places: np.ndarray, tree, first: int) -> dict[tuple[int, int], int]:
    """Row and column of each blot that is reached from the first, each expected where its neighbours' steps say."""
    near = places[tree.query(places[first], 5)[1][1:]] - places[first]
    right = near[np.argmax(near @ [1, 0.01])]
    down = near[np.argmax(np.abs(near @ [-right[1], right[0]]))]
    down = down if down @ [-right[1], right[0]] > 0 else -down
    there, steps, waiting = {(0, 0): first}, {(0, 0): (down, right)}, [(0, 0)]
    while waiting:
        at = waiting.pop(0)
        for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
            to = (at[0] + sign * (axis == 0), at[1] + sign * (axis == 1))
            if to in there:
                continue
            step = sign * steps[at][axis]
            distance, blot = tree.query(places[there[at]] + step)
            if distance > _NEAR * np.linalg.norm(step) or blot in there.values():
                continue
            moved = list(steps[at])
            moved[axis] = sign * (places[blot] - places[there[at]])
            there[to], steps[to] = int(blot), tuple(moved)
            waiting.append(to)
    return there


def respond(image: np.ndarray, board: Board, grid: np.ndarray) -> sparse.csr_array:
    """Derivatives of all coordinates x, y, x, ... of a board's dots by the image's pixels, (2 n, height * width).

    ``grid`` is that from which they were measured; rows of dots that are not are empty.
    """
    n, which = len(board.corners), np.flatnonzero(board.measured)
    if not which.size:
        return sparse.csr_array((2 * n, image.size))
    blots = grid.reshape(-1, 5)
    rows, places, there = dot_rows(image, blots[which], dot_reach(blots[:, 2], _ways(grid))[which])
    x, y = np.where(there[..., None], places, 0).astype(int).transpose(2, 0, 1)
    column = np.broadcast_to((y * image.shape[1] + x)[:, None], rows.shape)
    row = np.broadcast_to((2 * which[:, None] + [0, 1])[..., None], rows.shape)
    return sparse.csr_array((rows.ravel(), (row.ravel(), column.ravel())), (2 * n, image.size))


def measured(image: np.ndarray, grid: np.ndarray, noise: float | None) -> Board:
    """The likeliest centre of each dot about which there is room; ``grid`` (rows, columns, 5) has x, y, a, b, px, and
    angle, degrees, of each. White noise is of a standard deviation, which the image tells where it is None."""
    blots, way = grid.reshape(-1, 5), _ways(grid)
    state = np.where(np.isfinite(way) & np.isfinite(blots[:, 0]), status.OK, status.NOT_VISIBLE).astype(object)
    reach = dot_reach(blots[:, 2], way)
    low, high = (blots[:, :2] + sign * (reach + 1)[:, None] for sign in (-1, 1))
    with np.errstate(invalid="ignore"):
        room = (low >= 0).all(1) & (high <= np.array(image.shape[::-1]) - 1).all(1) & (reach > blots[:, 2] + _LEAST_GAP)
    state[(state == status.OK) & ~room] = status.SHORT
    which = np.flatnonzero(state == status.OK)
    if not which.size:
        return Board(grid.shape[1::-1], np.full((len(blots), 2), np.nan), np.full((len(blots), 2, 2), np.nan),
                     tuple(state), np.full(len(blots), np.nan), of_board(image, noise), np.nan)  # fmt: skip
    found = fit_dots(image, blots[which], reach[which])
    noise = of_board(image, noise, found)
    fit = chdtrc(found.freedom, found.square / noise**2)
    limit = 1 - (1 - _FALSE_ALARM) ** (1 / len(which))
    state[which] = np.select(
        [found.contrast < _FAINTEST * noise, ~found.converged, fit < limit],
        [status.LOW_CONTRAST, status.ILL_CONDITIONED, status.MISFIT], status.OK,
    )  # fmt: skip
    good = np.isin(state[which], status.MEASURED)
    used, values = which[good], np.full((len(blots), 8), np.nan)
    excess = np.where(fit < limit, found.square / noise**2 / found.freedom, 1.0)[:, None, None]
    values[used] = np.column_stack([
        found.centre, (noise**2 * excess * found.unit_covariance).reshape(-1, 4), fit, found.radius / way[which],
    ])[good]  # fmt: skip
    share = float(np.nanmedian(values[:, 7])) if good.any() else 0.0
    return Board(
        grid.shape[1::-1], values[:, :2], values[:, 2:6].reshape(-1, 2, 2), tuple(map(str, state)), values[:, 6], noise,
        float(np.median(found.blur[good])) if good.any() else np.nan, share,
    )  # fmt: skip


def _ways(grid: np.ndarray) -> np.ndarray:
    """Mean way (n,) from each dot to the next, px: the root of the area that it has; of one alone that of the grid."""
    right, down = np.moveaxis(steps(grid[..., :2]), 2, 0)
    way = np.sqrt(np.abs(down[..., 0] * right[..., 1] - down[..., 1] * right[..., 0]))
    return np.where(np.isfinite(way), way, np.nanmedian(way)).ravel()
