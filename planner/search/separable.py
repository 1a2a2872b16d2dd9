"""A lower bound of the variance of all sensor x light pairs that is one matrix product.

On a convex diffuse solid an edge's contrast is K / r (or K / r^3 with fall-off): K depends on the light and on which
faces the sensor sees, r on the light and the place along the edge. For the paper's model the line's variance is a
convex function of the weights K^2 / r^2, so it lies above its tangent at equal weights, which is linear in 1 / r^2.
The calibrated model is linear in r^6 itself. Both are then, edge by edge, a sum of products (sensor) x (light).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.features.measurand import Measurand, measurand
from planner.features.projected_edges import end_depths, image_fractions
from planner.imaging.contrast import squared_distance, step_on_unit_sphere
from planner.imaging.projection import direction, facing
from planner.models.locator import MIN_USABLE, correlation, kappa2
from planner.models.models import NODE_WEIGHTS, NODES, PAPER_KAPPA2, PAPER_POINTS
from scenes import Scene

_DEGREE = 7  # of the interpolation along an edge: exact for r^6, and about 1e-9 for the smooth functions here
_MARGIN = 3e-6  # relative; single precision in sums of about 30 terms of like size


@dataclass(frozen=True)
class Separable:
    """Lower bound of the variance: sum over k of sensor_part[s, k] light_part[l, k] / K^2[class of s, l, edge of k].

    Attributes
    ----------
    sensors : ndarray of int, shape (S,)
        Indices of the sensors that can measure at all.
    classes : ndarray of int, shape (S,)
        Which set of faces each of them sees.
    sensor_part : ndarray, shape (S, E, k)
    light_part : ndarray, shape (L, E, k)
    strength : ndarray, shape (classes, L, E)
        K^2.
    """

    sensors: np.ndarray
    classes: np.ndarray
    sensor_part: np.ndarray
    light_part: np.ndarray
    strength: np.ndarray

    def of_class(self, which: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Indices of sensors (into `sensors`) and lights that see contrast on all edges, and the lights' matrix."""
        strength = self.strength[which]
        lights = np.flatnonzero((strength > 0).all(-1))
        part = (self.light_part[lights] / strength[lights][..., None]).reshape(len(lights), -1)
        return np.flatnonzero(self.classes == which), lights, np.ascontiguousarray(part.T, np.float32)

    def rows(self, which: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """Bound for some sensors (indices into `sensors`) and the matrix of `of_class`, single precision."""
        part = self.sensor_part[which]
        return part.reshape(len(part), -1).astype(np.float32) @ lights


def separable(scene: Scene, sensors: np.ndarray, lights: np.ndarray, model: str, objective: str) -> Separable:
    """Set up the bound for a convex diffuse solid and a task of straight edges.

    Parameters
    ----------
    sensors, lights : ndarray, shape (n, 2), (m, 2)
        Poses, degrees.
    model : {"paper", "calibrated"}
    objective : {"image", "object"}
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        known = measurand(scene, sensors)
        make = _paper if model == "paper" else _calibrated
        sensor_part, good = make(scene, sensors, known)
        if objective == "object":
            sensor_part = sensor_part / known.scale[:, None, None] ** 2
    good &= known.view.visible.all(-1) & np.isfinite(sensor_part).all((-1, -2))
    light_part = _light_part(scene, known.view.names, lights, model)
    slack = 1 - _MARGIN * np.sign(sensor_part * light_part.mean(0))  # less where it adds, more where it takes away
    seen = facing(scene.solid, scene.camera.distance * direction(sensors[good]))
    kinds, classes = np.unique(seen, axis=0, return_inverse=True)
    first = [int(np.flatnonzero(good)[np.argmax(classes == k)]) for k in range(len(kinds))]
    strength = [step_on_unit_sphere(scene, known.view.names, sensors[k], lights) ** 2 for k in first]
    return Separable(
        np.flatnonzero(good), classes.ravel(), (sensor_part * slack)[good], light_part, np.array(strength)
    )  # fmt: skip


def _nodes() -> np.ndarray:
    """Chebyshev points on 0 to 1."""
    return (1 - np.cos(np.pi * (np.arange(_DEGREE) + 0.5) / _DEGREE)) / 2


def _lagrange(at: np.ndarray) -> np.ndarray:
    """Lagrange's polynomials of the nodes at fractions (...), shape (..., _DEGREE)."""
    nodes = _nodes()
    parts = [np.prod([(at - m) / (n - m) for m in nodes if m != n], axis=0) for n in nodes]
    return np.stack(parts, -1)


def _light_part(scene: Scene, names: tuple[str, ...], lights: np.ndarray, model: str) -> np.ndarray:
    """What an edge's bound takes from the light, shape (L, E, k)."""
    if model == "paper":
        points = np.linspace(0, 1, PAPER_POINTS)
        inverse = 1 / squared_distance(scene, names, points, lights)
        mean = inverse.mean(-1, keepdims=True)
        smooth = (inverse / mean**2) @ _lagrange(points)
        return np.concatenate([1 / mean, smooth], -1)
    sixth = squared_distance(scene, names, _nodes(), lights) ** 3 / scene.light.distance**4
    cubes = squared_distance(scene, names, np.linspace(0, 1, 33), lights) ** 1.5 / scene.light.distance**2
    return np.concatenate([np.ptp(cubes, axis=-1)[..., None] ** 2, sixth], -1)


def _paper(scene: Scene, sensors: np.ndarray, known: Measurand) -> tuple[np.ndarray, np.ndarray]:
    """Tangent at equal weights: 2 sum h^2 - sum h^2 w, h the weight of each point's error in A d + B theta."""
    names, lengths = known.view.names, known.view.lengths[..., None]
    fractions = np.linspace(0, 1, PAPER_POINTS)
    part = np.empty((len(sensors), len(names), _DEGREE + 1))
    for at in range(0, len(sensors), 1024):
        s = slice(at, at + 1024)
        influence = _influence(lengths[s] * image_fractions(scene, names, sensors[s], fractions), known, s)
        nodes = _influence(lengths[s] * image_fractions(scene, names, sensors[s], _nodes()), known, s,
                           lengths[s] * image_fractions(scene, names, sensors[s], fractions))  # fmt: skip
        missed = np.abs(influence - nodes @ _lagrange(fractions).T).max(-1)
        part[s, :, 0] = 2 * influence.sum(-1) - 1.5 * PAPER_POINTS * missed
        part[s, :, 1:] = -nodes
    return part * PAPER_KAPPA2 * scene.noise.sigma**2, (lengths > 0).all((-1, -2))


def _influence(u: np.ndarray, known: Measurand, s: slice, points: np.ndarray | None = None) -> np.ndarray:
    """h^2 at places u (px) for the unweighted line through ``points`` (px; u itself when not given)."""
    points = u if points is None else points
    mean = points.mean(-1, keepdims=True)
    a, b = known.offset[s][..., None], known.tilt[s][..., None]
    return (a / points.shape[-1] + (b - a * mean) * (u - mean) / ((points - mean) ** 2).sum(-1, keepdims=True)) ** 2


def _calibrated(scene: Scene, sensors: np.ndarray, known: Measurand) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of r^6 at the interpolation's nodes; the first takes the square of the range of r^3."""
    scale = scene.locator.scale_px
    per_point = kappa2(scale, scene.camera.blur_px) * scene.noise.variance
    whole, trims = known.view.lengths[..., None], known.view.framed
    length = whole - trims.sum(-1, keepdims=True)
    good = (length[..., 0] >= MIN_USABLE).all(-1)
    length = np.where(length > 0, length, np.nan)
    middle = trims[..., :1] + length / 2
    t = length / 2 * np.concatenate([[-1], NODES, [1]])
    near, far = end_depths(scene, known.view.names, sensors)
    fractions = (middle + t) / whole
    spatial = fractions * near / (far + fractions * (near - far))
    a = known.offset[..., None]
    lever = known.tilt[..., None] - a * middle
    weight = (a + 12 * lever * t / length**2) / length
    inside = np.concatenate([[0], NODE_WEIGHTS, [0]]) * length / 2
    ends = np.array([1.0] + [0.0] * len(NODES) + [1.0])
    slope = 12 * lever / length**3
    factor = 2 * np.sqrt(np.pi) * scale * inside * (weight**2 - (scale * slope) ** 2) - 2 * scale**2 * ends * weight**2
    extra = np.zeros_like(length)
    short = good & np.isfinite(length[..., 0]).all(-1) & (length[..., 0] < 10 * scale).any(-1)
    crowd, spare = _short(weight[short] * inside[short], t[short], scale)
    is_short = length[short] < 10 * scale
    factor[short] = np.where(is_short, crowd, factor[short])
    extra[short] = np.where(is_short, -spare, 0.0)
    values = np.einsum("...j,...jk->...k", factor, _lagrange(spatial))
    return np.concatenate([extra, values], -1) * per_point, good


def _short(weighted: np.ndarray, t: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Short edges: r^3 r'^3 = (r^6 + r'^6) / 2 - (r^3 - r'^3)^2 / 2; coefficients of r^6, and the most of the rest."""
    kernel = weighted[..., :, None] * weighted[..., None, :] * correlation(t[..., :, None] - t[..., None, :], scale)
    return kernel.sum(-1), np.abs(kernel).sum((-1, -2))[..., None] / 2
