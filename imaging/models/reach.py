"""How far from the required edges the pixels are that tell where these are."""

from __future__ import annotations

import numpy as np

from imaging.blurred.arrangement import Arrangement, near_pixels, near_vertices
from imaging.blurred.model import BlurredModel
from imaging.models.bound import REACH as FARTHEST
from imaging.models.bound import Information, fisher, known
from scenes import Noise

NEAR = 16.0  # px up to which pixels are used; beyond it they only add to known grey levels, as a rule
_MANY = 60_000  # pixels that are used of long edges, unless their blur needs more
_NEAREST, _BLURS = 5.0, 6.0  # px, and the blur's standard deviations, that are used at the least
_MORE = 1.02  # ratio of variances from which pixels farther away are worth their time


def model_within(arrangement: Arrangement, shape: tuple[int, int], reach: float) -> BlurredModel:
    """The image at the pixels within ``reach`` px of the required edges, in images (height, width)."""
    y, x = near_pixels(arrangement, shape, reach)
    return BlurredModel(arrangement, x, y, near_vertices(arrangement, reach + 6 * arrangement.blur_px))


def reach_of(arrangement: Arrangement, shape: tuple[int, int], noise: Noise) -> float:
    """Distance from the required edges up to which an estimator uses pixels, px.

    `NEAR`; less where edges are long; `FARTHEST`, the bound's own, where other edges between the two tell of the
    required ones: the planner's light and pose say what the picture tells.
    """
    ends = arrangement.vertices[arrangement.required[arrangement.required[:, 0] >= 0]]
    length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
    most = float(np.clip(_MANY / (2 * max(length, 1.0)), max(_NEAREST, _BLURS * arrangement.blur_px), FARTHEST))
    if most <= NEAR or not _others(arrangement) or not all(region.known for region in arrangement.regions[1:]):
        return min(most, NEAR)
    near, far = (_variances(arrangement, shape, noise, reach) for reach in (NEAR, most))
    return most if (near > _MORE * far).any() else NEAR


def is_long(length: float, blur: float) -> bool:
    """Whether edges of so many px in all, and of such a blur, px, need more pixels than are used of long ones."""
    return 2 * length * max(_NEAREST, _BLURS * blur) > _MANY


def asked_of(corners: np.ndarray) -> np.ndarray:
    """What is asked of C corners (C, 2): their distance if there are two, else all coordinates; (k, 2 C)."""
    if len(corners) != 2:
        return np.eye(2 * len(corners))
    across = corners[1] - corners[0]
    unit = across / max(float(np.linalg.norm(across)), 1e-12)
    return np.concatenate([-unit, unit])[None]


def _others(arrangement: Arrangement) -> bool:
    """Whether there are pieces of other edges than the required ones."""
    return bool((arrangement.edges < 0).any())


def _variances(arrangement: Arrangement, shape: tuple[int, int], noise: Noise, reach: float) -> np.ndarray:
    """Smallest variances of what is asked of the corners, px^2, (k,)."""
    model = model_within(arrangement, shape, reach)
    if not model.x.size:
        return np.full(1, np.inf)
    told = Information(model, fisher(model, noise, True), known(model).precision).vertices()
    index = (2 * arrangement.corners[:, None] + [0, 1]).ravel()
    rows = asked_of(arrangement.vertices[arrangement.corners])
    return np.einsum("ki,ij,kj->k", rows, told[np.ix_(index, index)], rows)
