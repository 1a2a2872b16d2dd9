"""The Cramer-Rao bound: the smallest variance that any unbiased estimator can have, given the whole picture.

Free are the image positions of all visible vertices near the required edges (faces stay polygons), a linear level on
each face, the background and, on request, the blur; each pixel near the required edges counts with its own noise.
Besides the image something is `known`: a lit face's level is that of the light within its own size, and other vertices
move with the required ones within a pixel. That decides in slivers, whose levels and ends an image hardly tells;
elsewhere it changes nothing (`information(..., with_knowledge=False)` is the bound of the image alone).
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from imaging.blurred.arrangement import arrangement_of, near_pixels, near_vertices
from imaging.blurred.model import BlurredModel, State
from imaging.features.measurand import Measurands, measurands, normals
from imaging.features.projected_edges import lines_alone
from imaging.light.appearance import is_plain
from imaging.models.edge_bound import edge_bound
from imaging.models.errors import Errors
from imaging.pictures import Pictures
from imaging.sensor import Levels, recorded, sensitivity
from scenes import Noise, Scene

REACH = 32.0  # px from a required edge up to which pixels count; levels are hardly better known from more
KNOWN_LEVELS = 1.0  # of a lit face's level, and of what its slopes make of it: how well they are known from the light
KNOWN_BLUR = 0.3  # of the blur: how well it is known
FOLLOWS = 1.0  # px: how well other vertices are known beside the required edges; the pose is known to 2 degrees
_STILL = 0.01  # px: the same of vertices about which an image says nothing, so that they simply follow
_UNTOLD = (
    1e-10  # of a parameter's conditional information, added to it: keeps the matrix regular where nothing else informs
)
_LEAST = 1e-12  # information that is none
_FURTHEST = 100.0  # px^2; what is known no better is not known, for the model is linear


class Known(NamedTuple):
    """What is known of a model's parameters before its image is seen: precision (q, q) and mean (q,)."""

    precision: np.ndarray
    mean: np.ndarray


class Information(NamedTuple):
    """What an image tells of the parameters of a model, and what is known of them without it.

    Attributes
    ----------
    model : BlurredModel
    fisher : ndarray, shape (q, q)
        Fisher information of the image; a row and column of zeros where a parameter is held.
    known : ndarray, shape (q, q)
        Precision of what is known before.
    """

    model: BlurredModel
    fisher: np.ndarray
    known: np.ndarray

    def covariance(self) -> np.ndarray:
        """Smallest covariance of all parameters (q, q) over repeated images; large where nothing tells them.

        That of the most likely parameters given image and knowledge, to first order: knowledge does not scatter.
        """
        whole, some = self._whole()
        scale = 1 / np.sqrt(np.where(some, np.diag(whole), 1.0))
        weak = np.where(some, _UNTOLD, 1.0)
        inverse = np.linalg.inv(whole * scale[:, None] * scale + np.diag(weak))
        inverse = inverse * scale[:, None] * scale * (some[:, None] & some)
        return inverse - inverse @ (whole - self.fisher) @ inverse

    def _whole(self) -> tuple[np.ndarray, np.ndarray]:
        """Information of image and knowledge together, (q, q), and of which parameters there is some, bool (q,)."""
        held = np.diag(self.fisher) == 0
        whole = self.fisher + np.where(held[:, None] | held, 0.0, self.known)
        told = np.diag(whole)
        return whole, told > self._least(told)

    def _least(self, told: np.ndarray) -> np.ndarray:
        """Information of each parameter that is none; of levels in proportion, for their unit is any."""
        least, first = np.full(told.size, _LEAST), 2 * self.model.free.size
        for part in self.model.arrangement.level_slices:
            levels = slice(first + part.start, first + part.stop)
            least[levels] = _LEAST * told[levels].max(initial=0.0)
        return least

    def vertices(self) -> np.ndarray:
        """Smallest covariance of all vertices' (x, y), px^2, shape (2 V, 2 V); 0 for those that are not free.

        What nothing tells may be anywhere: 1e12 px^2.
        """
        free, count = self.model.free, len(self.model.arrangement.vertices)
        index = (2 * free[:, None] + [0, 1]).ravel()
        untold = ~self._whole()[1][: index.size]
        whole = np.zeros((2 * count, 2 * count))
        whole[np.ix_(index, index)] = self.covariance()[: index.size, : index.size] + np.diag(untold / _LEAST)
        return whole


def information(
    pictures: Pictures, *, free_blur: bool = False, reach: float = REACH, with_knowledge: bool = True
) -> Information:
    """What one picture tells of its arrangement.

    Parameters
    ----------
    free_blur : bool
        Whether the blur is unknown.
    reach : float
        How far from a required edge pixels count, px.
    with_knowledge : bool
        Whether `known` counts; the Cramer-Rao bound of the image alone if not.
    """
    scene, arrangement = pictures.scene, arrangement_of(pictures)
    y, x = near_pixels(arrangement, (scene.camera.height, scene.camera.width), reach)
    model = BlurredModel(arrangement, x, y, near_vertices(arrangement, reach + 6 * arrangement.blur_px))
    nothing = np.zeros((model.count, model.count))
    told = fisher(model, scene.noise, free_blur) if x.size else nothing
    return Information(model, told, known(model).precision if with_knowledge else nothing)


def known(model: BlurredModel, still: Collection[int] = (), follows: float = FOLLOWS) -> Known:
    """What light and pose tell of the parameters without the image.

    Levels of lit faces, and their slopes, to `KNOWN_LEVELS` of the level; vertices that end no required edge to
    ``follows`` px beside the required ones, which may be anywhere, and the ``still`` ones of them beyond doubt; the
    blur to `KNOWN_BLUR` of it.
    """
    arrangement, start = model.arrangement, model.start()
    levels = [np.full(region.count, region.known / KNOWN_LEVELS**2) for region in arrangement.regions]
    mean = [np.eye(region.count)[0] * region.known for region in arrangement.regions]
    places = _following(model, still, follows)
    precision = np.diag(np.concatenate([np.zeros(len(places)), *levels, [(KNOWN_BLUR * start.blur) ** -2]]))
    precision[: len(places), : len(places)] = places
    return Known(precision, np.concatenate([arrangement.vertices[model.free].ravel(), *mean, [start.blur]]))


def _following(model: BlurredModel, still: Collection[int], follows: float) -> np.ndarray:
    """Precision of the free vertices' places before, (2 F, 2 F), px^-2.

    The ends of required edges may be anywhere; the others follow them as one shift, turn and scale would have it.
    """
    free, places = model.free, model.arrangement.vertices[model.free]
    required = np.isin(free, model.arrangement.required)
    x, y = (places - places.mean(0)).T if free.size else places.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    motion = np.stack([np.stack([one, zero, x, -y], -1), np.stack([zero, one, y, x], -1)], 1)  # (F, 2, 4)
    follow = motion[~required].reshape(-1, 4) @ np.linalg.pinv(motion[required].reshape(-1, 4))
    apart = np.zeros((follow.shape[0], 2 * free.size))
    apart[:, np.repeat(~required, 2)] = np.eye(follow.shape[0])
    apart[:, np.repeat(required, 2)] = -follow
    sigma = np.where(np.isin(free[~required], list(still)), _STILL, follows)
    apart = apart / np.repeat(sigma, 2)[:, None]
    return apart.T @ apart


def fisher(model: BlurredModel, noise: Noise, free_blur: bool, state: State | None = None) -> np.ndarray:
    """Fisher matrix (q, q) at a state, the expected one when not given.

    What the change of the noise's variance tells of the levels is left out.
    """
    image, jacobian = model.evaluate(state or model.start())
    levels, gain = response(noise, image)
    weighted = jacobian * (gain / np.sqrt(levels.noise_variance))[:, None]
    if not free_blur:
        weighted[:, -1] = 0
    return weighted.T @ weighted


def response(noise: Noise, image: np.ndarray) -> tuple[Levels, np.ndarray]:
    """What is recorded at signals above darkness, with a least variance, and the level's derivative by the signal."""
    level = image + noise.dark_level
    found = recorded(noise, level)
    variance = np.maximum(np.broadcast_to(found.noise_variance, level.shape), 1e-6 * noise.variance + 1e-300)
    return Levels(found.level, variance), sensitivity(noise, level)


def bound(pictures: Pictures) -> Errors:
    """The bound for arrays of pictures, one after the other.

    Where things hide or shade each other, of circles and of the largest of some numbers, it is that of each edge by
    itself. Of a form, a maximum less a minimum, there is no bound: its variance is that of the calibrated model.
    """
    pictures = pictures if pictures.scene.noise.colour is None else pictures.with_scene(_of_raw(pictures.scene))
    alone = edge_bound(pictures)
    known = alone.measurands
    if not (is_plain(pictures.scene) and lines_alone(pictures.scene)):
        return alone
    lead, count, edges = alone.variance.shape, len(known.quantities), len(known.view.names)
    lines = np.full((*lead, edges, 2, 2), np.inf)
    variances, variances_object = np.full((*lead, count), np.inf), np.full((*lead, count), np.inf)
    for index in map(tuple, np.argwhere(np.isfinite(alone.variances).any(-1))):
        lines[index], variances[index], variances_object[index] = _one(pictures, index, lead)
    told = (variances < _FURTHEST * np.maximum(_unit(known), 1e-300)) & np.isfinite(alone.variances)
    variances = np.where(told, variances, np.inf)
    variances_object = np.where(told & np.isfinite(variances_object), variances_object, np.inf)

    def line_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return a * a * lines[..., 0, 0] + 2 * a * b * lines[..., 0, 1] + b * b * lines[..., 1, 1]

    joint = variances, variances_object
    return Errors(known, line_variance, alone.contrast, alone.noise_variance, alone.cut_off, (), (), joint=joint)


def _of_raw(scene: Scene) -> Scene:
    """A scene whose picture tells at least as much as its colour sensor's raw mosaic: all pixels are the strongest."""
    colour, noise, camera = scene.noise.colour, scene.noise, scene.camera
    most = max(colour.response)
    sharp = math.sqrt(max(camera.blur_px**2 - colour.blur_px**2, 0.0))
    bits = noise.bits if most == 1 else None  # rounding and the end of the scale only take away
    grey = noise.tried(colour=None, sigma=noise.sigma / most, gain=noise.gain / most, bits=bits)
    return scene.tried(noise=grey, camera=camera.tried(blur_px=sharp))


def _unit(known: Measurands) -> np.ndarray:
    """Largest squared derivative of each quantity by an edge's displacement at its ends: px^2 make units of it."""
    lengths = np.where(known.view.lengths > 0, known.view.lengths, np.inf)[..., None, :]
    offset, tilt = known.of_lines(known.gradient)
    return np.maximum(offset**2, (tilt / lengths) ** 2).max(-1, initial=0.0)


def _one(
    pictures: Pictures, index: tuple[int, ...], lead: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Covariance of (displacement, rotation) of each line, (E, 2, 2), and variances (M,) of the quantities in image and
    object, in one picture."""
    pick = [np.broadcast_to(poses, (*lead, 2))[index] for poses in (pictures.sensors, *pictures.lights)]
    one = Pictures(pictures.scene, pick[0], tuple(pick[1:]))
    known = measurands(one)
    joint, seen = joint_lines(known, information(one))
    lines = np.einsum("ekel->ekl", joint.reshape(len(seen), 2, len(seen), 2))
    hidden = np.logical_or(*(part[:, ~seen].any(-1) for part in known.of_lines(known.gradient)))
    plane = known.gradient_object
    if known.placing is not None:
        joint = _with_board(joint, known)
        found = np.where(np.repeat(seen, 2), 0.0, np.inf)
        plane = known.placing.adjusted(joint + np.diag(_padded(found, known))).gradient(plane)
    variances = (np.einsum("mi,ij,mj->m", each, joint, each) for each in (known.gradient, plane))
    image, plane = (np.where(hidden, np.inf, each) for each in variances)
    return np.where(seen[:, None, None], lines, np.inf), image, plane


def joint_lines(known: Measurands, told: Information) -> tuple[np.ndarray, np.ndarray]:
    """Covariance (2 E, 2 E) of all lines' displacements at their first ends and rotations in one picture, px and rad,
    and which of them are seen, bool (E,)."""
    required = told.model.arrangement.required
    rows = line_rows(known, required, len(told.model.arrangement.vertices)).reshape(2 * len(required), -1)
    return rows @ told.vertices() @ rows.T, known.view.visible & (required >= 0).all(-1)


def _with_board(joint: np.ndarray, known: Measurands) -> np.ndarray:
    """Covariance of lines with that of a board's parameters, whose points count as they are fitted."""
    board = known.board
    return joint if board is None else block_diag(joint, board.spread(board.noise))


def _padded(of_lines: np.ndarray, known: Measurands) -> np.ndarray:
    return np.concatenate([of_lines, np.zeros(known.seen.board)])


def line_rows(known: Measurands, required: np.ndarray, count: int) -> np.ndarray:
    """Derivative of each line's displacement at its first end and of its rotation by all vertices, (E, 2, 2 count)."""
    rows = np.zeros((len(required), 2, count, 2))
    for e, (normal, length, (start, stop)) in enumerate(
        zip(normals(known.view), known.view.lengths, required, strict=True)
    ):
        rows[e, 0, start] = normal
        rows[e, 1, stop], rows[e, 1, start] = normal / length, -normal / length
    return rows.reshape(len(required), 2, 2 * count)
