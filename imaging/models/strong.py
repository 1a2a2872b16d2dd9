"""The piece of each edge that stands out of the noise, where its contrast changes much or turns along it.

Light from other faces, a shadow on what is seen past an edge, or gloss make one part of an edge stand out and leave
another without contrast, or with the other side brighter. Where there is too little contrast, the errors of edge points
are no longer linear in the noise: a few such points scatter more than all others of their edge, and no variance that is
propagated tells it. The planner's variance and the measurement's calipers leave the same points out, by this one rule.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from imaging.features.locator import MIN_CONTRAST, MIN_USABLE, reach
from imaging.features.projected_edges import ProjectedEdges, end_divisors
from imaging.geometry.projection import edge_points, in_space
from imaging.light.appearance import is_separable
from imaging.light.edge_sides import side_signals
from imaging.light.sheets import printed
from imaging.pictures import Pictures
from imaging.sensor import recorded

ROUGH = 4.0  # ratio of squared contrasts along an edge beyond which points are dropped
_LEAST = 1.25 * MIN_CONTRAST  # of such a piece: the model is up to a fifth off where light comes from other faces
_JUMP = 0.5  # of the contrast, from one place to the next: a shadow ends there
_PLACES = 128  # along the image of an edge


def strong_pieces(pictures: Pictures, view: ProjectedEdges) -> np.ndarray:
    """The longest piece of each edge with enough contrast of one sign, found once for each picture.

    Where the contrast changes by no more than a factor 2, where no such piece is long enough, of edges beside prints,
    whose contrast changes in places, and of pictures that are glanced at, the whole edge. Beside a place where the
    contrast jumps to less than half, a shadow's edge, the locator's reach is left out, too.

    Returns
    -------
    ndarray, shape (..., E, 2)
        Fractions (from, to) of the image's length.
    """
    if not view.names or not pictures.closely or is_separable(pictures.scene) or printed(pictures.scene):
        return np.broadcast_to([0.0, 1.0], (*view.lengths.shape, 2))
    return pictures.once(("strong", view.names), lambda: _strong_pieces(pictures, view))


def _strong_pieces(pictures: Pictures, view: ProjectedEdges) -> np.ndarray:
    scene, fractions = pictures.scene, (np.arange(_PLACES) + 0.5) / _PLACES
    near, far = end_divisors(scene, view.names, pictures.sensors)
    spatial = in_space(fractions, near, far)
    contrast = _over_noise(pictures, view.names, edge_points(scene.solid, view.names, spatial))
    clear = reach(scene.locator.scale_px, scene.camera.most_blur_px)
    lead = np.broadcast_shapes(contrast.shape[:-1], view.lengths.shape)
    found = np.empty((*lead, 2))
    contrast, lengths = np.broadcast_to(contrast, (*lead, _PLACES)), np.broadcast_to(view.lengths, lead)
    trims = np.broadcast_to(view.framed, (*lead, 2))
    for place in np.ndindex(lead):
        found[place] = strong_piece(contrast[place], float(lengths[place]), trims[place], clear)
    return found


def _over_noise(pictures: Pictures, names: tuple[str, ...], points: np.ndarray) -> np.ndarray:
    """Contrast over the standard deviation of the noise, with its sign, at points (..., E, n, 3), (..., E, n)."""
    noise = pictures.scene.noise
    found = recorded(noise, noise.dark_level + side_signals(pictures, names, points))
    rise = found.level[..., 0, :] - found.level[..., 1, :]
    sigma = np.sqrt(np.broadcast_to(found.noise_variance, found.level.shape).mean(-2))
    return np.where(rise == 0, 0.0, rise / np.where(sigma > 0, sigma, np.finfo(float).tiny))


def strong_piece(contrast: np.ndarray, length: float, trims: np.ndarray, clear: float) -> tuple[float, float]:
    """Fractions (from, to) of one edge that stand out of the noise.

    Parameters
    ----------
    contrast : ndarray, shape (n,)
        Over the noise, with its sign, in the middles of n even parts of the edge's image.
    length : float
        Of the image, px.
    trims : ndarray, shape (2,)
        What is left out at the ends anyway, px: what is there decides nothing.
    clear : float
        What is left out beside a jump, px.

    Examples
    --------
    >>> strong_piece(12.5 - 10 * (np.arange(16) + 0.5) / 16, 100.0, np.zeros(2), 5.0)
    (0.0, 0.625)
    >>> strong_piece(np.array([20.0] * 6 + [-7.5] * 4), 80.0, np.zeros(2), 8.0)
    (0.0, 0.5)
    >>> strong_piece(np.array([6.0] * 6 + [4.0] * 4), 100.0, np.zeros(2), 5.0)
    (0.0, 1.0)
    """
    count = len(contrast)
    place = (np.arange(count) + 0.5) / count * length
    used = np.flatnonzero((place >= trims[0]) & (place <= length - trims[1]))
    if not used.size or not _is_rough(contrast[used]):
        return 0.0, 1.0
    sign = np.where(np.abs(contrast) >= _LEAST, np.sign(contrast), 0.0)[used]
    first, last = _longest(sign)
    if first == last:
        return 0.0, 1.0
    height, start, stop = contrast[used] * sign[first], 0.0, 1.0
    if first > 0:
        start = float(used[first] + 0.5 - _beyond(height[first], height[first - 1])) / count
        start += clear / length if height[first - 1] < _JUMP * height[first] else 0.0
    if last < len(used):
        stop = float(used[last - 1] + 0.5 + _beyond(height[last - 1], height[last])) / count
        stop -= clear / length if height[last] < _JUMP * height[last - 1] else 0.0
    shown = min(stop * length, length - trims[1]) - max(start * length, trims[0])
    return (start, stop) if shown >= MIN_USABLE else (0.0, 1.0)


def _beyond(inner: float, outer: float) -> float:
    """How far a piece goes on past its last part to the next one, which is not of it: a share, as if evenly between."""
    return (inner - _LEAST) / (inner - outer)


def _is_rough(contrast: np.ndarray) -> bool:
    """Whether contrasts (n,) change by more than a factor 2, or their sign."""
    squared = contrast**2
    return bool(squared.max() > ROUGH * squared.min() or contrast.min() < 0 < contrast.max())


def _longest(sign: np.ndarray) -> tuple[int, int]:
    """Bounds (from, to) of the longest run of one value that is not 0, the first of equally long ones; equal if there
    is none."""
    ends = np.flatnonzero(np.diff(sign, prepend=np.nan, append=np.nan) != 0)
    runs = [(start, stop) for start, stop in pairwise(ends) if sign[start]]
    return max(runs, key=lambda run: run[1] - run[0], default=(0, 0))
