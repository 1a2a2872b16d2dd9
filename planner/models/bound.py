"""The Cramer-Rao bound: the smallest variance that any unbiased estimator can have, given the whole picture.

Free are the image positions of all visible vertices near the required edges (faces stay polygons), a linear level on
each face, the background and, on request, the blur. What is known of them is what the pixels near the required edges
tell, each with its own noise; of the level and the slopes of a lit face besides that the light gives them, within their
own size. This holds the levels of slivers, which else could be negative; elsewhere it changes nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.features.measurand import Measurand, measurand, normals
from planner.imaging.appearance import is_plain
from planner.imaging.arrangement import arrangement_of, near_pixels, near_vertices
from planner.imaging.blurred import BlurredModel, State
from planner.imaging.pictures import Pictures
from planner.imaging.sensor import recorded
from planner.models.edge_bound import edge_bound
from planner.models.errors import Errors
from scenes import Centre, Noise

REACH = 32.0  # px from a required edge up to which pixels count; levels are hardly better known from more
KNOWN_LEVELS = 1.0  # of a lit face's level, and of what its slopes make of it: how well they are known from the light
_UNTOLD = 1e3  # px, or the size of a level: a standard deviation at which nothing is known
_FURTHEST = 100.0  # px^2; what is known no better is not known, for the model is linear


class Information(NamedTuple):
    """Fisher information on the parameters of a model at one state.

    Attributes
    ----------
    model : BlurredModel
    fisher : ndarray, shape (q, q)
        Of all parameters; a row and column of zeros where one is held.
    """

    model: BlurredModel
    fisher: np.ndarray

    def covariance(self) -> np.ndarray:
        """Smallest covariance of all parameters (q, q); large where the data cannot tell."""
        told = np.diag(self.fisher)
        some = told > 1e-12
        scale = 1 / np.sqrt(np.where(some, told, 1.0))
        weak = np.where(some, (scale / _UNTOLD) ** 2, 1.0)
        matrix = self.fisher * scale[:, None] * scale + np.diag(weak)
        return np.linalg.inv(matrix) * scale[:, None] * scale * (some[:, None] & some)

    def vertices(self) -> np.ndarray:
        """Smallest covariance of all vertices' (x, y), px^2, shape (2 V, 2 V); 0 for those that are not free."""
        free, count = self.model.free, len(self.model.arrangement.vertices)
        index = (2 * free[:, None] + [0, 1]).ravel()
        whole = np.zeros((2 * count, 2 * count))
        whole[np.ix_(index, index)] = self.covariance()[: index.size, : index.size]
        return whole


def information(
    pictures: Pictures, *, free_blur: bool = False, reach: float = REACH, known_levels: float = KNOWN_LEVELS
) -> Information:
    """What one picture tells of its arrangement.

    Parameters
    ----------
    free_blur : bool
        Whether the blur is unknown.
    reach : float
        How far from a required edge pixels count, px.
    known_levels : float
        Standard deviation of lit faces' levels before, in units of them; infinite where nothing is known.
    """
    scene, arrangement = pictures.scene, arrangement_of(pictures)
    y, x = near_pixels(arrangement, (scene.camera.height, scene.camera.width), reach)
    model = BlurredModel(arrangement, x, y, near_vertices(arrangement, reach + 6 * arrangement.blur_px))
    if not x.size:
        return Information(model, np.zeros((model.count, model.count)))
    return Information(model, fisher(model, scene.noise, free_blur) + np.diag(known(model, known_levels)))


def known(model: BlurredModel, levels: float = KNOWN_LEVELS) -> np.ndarray:
    """Precision of each parameter before, (q,), of lit faces' levels only."""
    regions = [np.full(region.count, levels**-2 if region.known else 0.0) for region in model.arrangement.regions]
    return np.concatenate([np.zeros(2 * model.free.size), *regions, [0.0]])


def fisher(model: BlurredModel, noise: Noise, free_blur: bool, state: State | None = None) -> np.ndarray:
    """Fisher matrix (q, q) at a state, the expected one when not given.

    What the change of the noise's variance tells of the levels is left out.
    """
    image, jacobian = model.evaluate(state or model.start())
    gain, variance = response(noise, image)
    weighted = jacobian * (gain / np.sqrt(variance))[:, None]
    if not free_blur:
        weighted[:, -1] = 0
    return weighted.T @ weighted


def response(noise: Noise, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of the recorded level by the signal, and variance of the noise, at signals above darkness."""
    level = image + noise.dark_level
    step = 1e-3 * np.sqrt(noise.variance + noise.gain * np.maximum(image, 0) + 1e-12)
    high, low = (recorded(noise, level + sign * step).level for sign in (1, -1))
    variance = np.broadcast_to(recorded(noise, level).noise_variance, level.shape)
    return (high - low) / (2 * step), np.maximum(variance, 1e-6 * noise.variance + 1e-300)


def bound(pictures: Pictures) -> Errors:
    """The bound for arrays of pictures, one after the other.

    Where things hide or shade each other, and of circles, it is that of each edge by itself.
    """
    alone = edge_bound(pictures)
    features = pictures.scene.task.corners
    if not is_plain(pictures.scene) or any(isinstance(feature, Centre) for feature in features):
        return alone
    known = alone.measurand
    lead = alone.variance.shape
    each = [_one(pictures, index, lead) for index in np.ndindex(lead)]
    lines = np.array([lines for lines, _ in each]).reshape(*lead, *each[0][0].shape)
    variance = np.array([variance for _, variance in each]).reshape(lead)
    usable = np.isfinite(alone.variance) & (variance < _FURTHEST * np.maximum(_unit(known), 1e-300))
    variance = np.where(usable, variance, np.inf)

    def line_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return a * a * lines[..., 0, 0] + 2 * a * b * lines[..., 0, 1] + b * b * lines[..., 1, 1]

    with np.errstate(divide="ignore", invalid="ignore"):
        in_object = variance / known.scale**2
    in_object = np.where(np.isfinite(in_object), in_object, np.inf)
    return Errors(known, variance, in_object, line_variance, alone.contrast, alone.noise_variance, ())


def _unit(known: Measurand) -> np.ndarray:
    """Largest squared derivative of the measurand by an edge's displacement at its ends: px^2 make units of it."""
    lengths = np.where(known.view.lengths > 0, known.view.lengths, np.inf)
    return np.maximum(known.offset**2, (known.tilt / lengths) ** 2).max(-1, initial=0.0)


def _one(pictures: Pictures, index: tuple[int, ...], lead: tuple[int, ...]) -> tuple[np.ndarray, float]:
    """Covariance of (displacement, rotation) of each line, (E, 2, 2), and variance of the measurand in one picture."""
    pick = [np.broadcast_to(poses, (*lead, 2))[index] for poses in (pictures.sensors, *pictures.lights)]
    one = Pictures(pictures.scene, pick[0], tuple(pick[1:]))
    known = measurand(one)
    edges = len(known.view.names)
    if not known.view.visible.all():
        return np.full((edges, 2, 2), np.inf), np.inf
    told = information(one)
    required = told.model.arrangement.required
    if (required < 0).any():
        return np.full((edges, 2, 2), np.inf), np.inf
    rows = line_rows(known, required, len(told.model.arrangement.vertices))
    covariance = told.vertices()
    gradient = known.offset @ rows[:, 0] + known.tilt @ rows[:, 1]
    lines = np.einsum("eki,ij,elj->ekl", rows, covariance, rows)
    return lines, float(gradient @ covariance @ gradient)


def line_rows(known: Measurand, required: np.ndarray, count: int) -> np.ndarray:
    """Derivative of each line's displacement at its first end and of its rotation by all vertices, (E, 2, 2 count)."""
    rows = np.zeros((len(required), 2, count, 2))
    for e, (normal, length, (start, stop)) in enumerate(
        zip(normals(known.view), known.view.lengths, required, strict=True)
    ):
        rows[e, 0, start] = normal
        rows[e, 1, stop], rows[e, 1, start] = normal / length, -normal / length
    return rows.reshape(len(required), 2, 2 * count)
