"""What all pairs of sensors and lenses of a catalogue can do at best: which cannot show the part, and least noise.

No place of camera and light is looked at; arrays of all pairs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imaging.features.locator import kappa2
from planner.designing.aspects import Aspect
from planner.designing.evaluation import Problem
from planner.designing.optics import BLUR, CIRCLE, DISTANCE, FIELD, MOUNT, defocus_um, is_covered, noise_to_signal
from scenes.cameras.diffraction import airy_um
from scenes.catalogue import ListedLens, ListedSensor
from scenes.parts.solid import Solid
from scenes.units import in_unit

NOISE = "least noise"
REASONS = (MOUNT, CIRCLE, FIELD, DISTANCE, BLUR, NOISE)
_SHORTEST_NM = 400.0  # of light that a catalogue offers: diffraction is at least this light's
_SAFE = 0.5  # of sigma: a quantity's may be smaller than that of its best feature, as that of a mean of two
_ROWS = 64  # sensors at a time


@dataclass(frozen=True, eq=False)
class Pairs:
    """All pairs of S sensors and L lenses.

    Attributes
    ----------
    reason : ndarray of int, shape (S, L)
        0: possible; else 1 + the index in `REASONS` of the last thing that keeps every view from measuring.
    least : ndarray, shape (S, L)
        Lower bound of U over what is allowed, by noise alone; infinite where not possible.
    """

    reason: np.ndarray
    least: np.ndarray


def pairs(problem: Problem, sensors: Sequence[ListedSensor], lenses: Sequence[ListedLens]) -> Pairs:
    """Of all pairs; some rows at a time."""
    parts = [_some(problem, sensors[at : at + _ROWS], lenses) for at in range(0, len(sensors), _ROWS)]
    empty = Pairs(np.zeros((0, len(lenses)), int), np.zeros((0, len(lenses))))
    return Pairs(*(np.concatenate([getattr(part, name) for part in [empty, *parts]]) for name in ("reason", "least")))


def _some(problem: Problem, sensors: Sequence[ListedSensor], lenses: Sequence[ListedLens]) -> Pairs:
    shape = len(sensors), len(lenses)
    reason, least = np.ones(shape, int), np.full(shape, np.inf)
    for aspect in problem.aspects:
        stage, bound = _seen(problem, aspect, sensors, lenses)
        better = bound < least
        least = np.where(better, bound, least)
        reason = np.where((reason == 0) | (stage == 0), 0, np.maximum(reason, stage))
    return Pairs(reason, least)


def _seen(
    problem: Problem, aspect: Aspect, sensors: Sequence[ListedSensor], lenses: Sequence[ListedLens]
) -> tuple[np.ndarray, np.ndarray]:
    """Stage at which a view fails, 0 where it does not, and its bound."""
    wishes = problem.wishes
    half = np.array([each.size_mm for each in sensors])[:, None] / 2
    pitch = np.array([each.pixel_pitch_um for each in sensors])[:, None]
    tele = np.array([each.is_telecentric for each in lenses])
    focal = np.array([each.focal_length_mm or 1.0 for each in lenses])
    magnification = np.array([each.magnification or 1.0 for each in lenses])
    fixed = np.array([each.working_distance_mm or 0.0 for each in lenses])
    nearest = np.array([each.minimum_object_distance_mm or 0.0 for each in lenses])
    farthest = np.array([math.inf if each.is_telecentric else each.maximum_object_distance_mm or math.inf
                         for each in lenses])  # fmt: skip
    free = np.maximum(aspect.distance(half, focal), np.maximum(nearest, wishes.nearest_mm))
    far = np.where(tele, fixed, free)
    scale = np.where(tele, magnification, focal / np.maximum(free - focal, 1e-9))
    blur = _least_blur(problem, aspect, lenses, scale) / pitch
    mounts = np.array([[each.takes(lens.mount) for lens in lenses] for each in sensors])
    circles = np.array([lens.circle_mm for lens in lenses])
    diagonals = np.array([each.diagonal for each in sensors])[:, None]
    most = np.minimum(wishes.farthest_mm, farthest)
    fails = [
        ~mounts, ~is_covered(diagonals, circles),
        tele & ~aspect.fits(half, np.broadcast_to(magnification, mounts.shape)),
        (far < max(wishes.nearest_mm, aspect.nearest_mm)) | (far > most), blur > wishes.blur_px,
    ]  # fmt: skip
    bound = _least_ratio(problem, aspect, sensors, far, scale, blur, tele)
    fails.append(bound > 1)
    stage = np.zeros(mounts.shape, int)
    for k in range(len(fails), 0, -1):
        stage = np.where(fails[k - 1], k, stage)
    return stage, np.where((stage == 0) | (stage == len(fails)), bound, np.inf)


def _least_blur(problem: Problem, aspect: Aspect, lenses: Sequence[ListedLens], scale: np.ndarray) -> np.ndarray:
    """Least blur of the apertures of each lens, um, (S, L); an MTF counts as no more than diffraction."""
    found, apertures = np.full(scale.shape, np.inf), [each.stops for each in lenses]
    tele = np.array([each.is_telecentric for each in lenses])
    own = np.array([0.0 if each.mtf else problem.otherwise_um for each in lenses])
    for k in range(max(map(len, apertures))):
        stops = np.array([each[min(k, len(each) - 1)] for each in apertures])
        number = np.where(tele, stops, stops * (1 + scale))
        defocus = defocus_um(scale, aspect.half_depth_mm, number)
        found = np.minimum(found, np.sqrt(airy_um(_SHORTEST_NM, 1.0) ** 2 * number**2 + own**2 + defocus**2))
    return found


def _least_ratio(
    problem: Problem, aspect: Aspect, sensors: Sequence[ListedSensor], far: np.ndarray, scale: np.ndarray,
    blur: np.ndarray, tele: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Least U over what is allowed: each quantity's best feature, whole, in full light, as near as any of it is."""
    noise = np.array([noise_to_signal(each, 1.0) for each in sensors])[:, None]
    pitch = np.array([each.pixel_pitch_um for each in sensors])[:, None] / 1000
    nearer = np.where(tele, 1.0, np.maximum(far - aspect.nearest_mm, 0.0) / far)
    pixel = pitch / scale * nearer
    per_point = 2 * math.sqrt(math.pi) * problem.scene.locator.scale_px * noise
    per_point = per_point * kappa2(problem.scene.locator.scale_px, blur)
    worst = np.zeros(far.shape if far.ndim == 2 else blur.shape)
    mm = in_unit(1.0, problem.scene.units, "mm")
    for quantity, allowed in zip(problem.scene.quantities, problem.allowed, strict=True):
        lengths = [_length(problem.scene.solid, name) for f in quantity.basic for name in f.edges]
        longest = max(lengths) * mm
        if quantity.is_angle:
            sigma = np.degrees(np.sqrt(12 * per_point * pixel**3 / longest**3))
        else:
            sigma = np.sqrt(per_point * pixel**3 / longest) / mm
        worst = np.maximum(worst, problem.wishes.coverage * _SAFE * sigma / allowed if allowed > 0 else np.inf)
    return worst


def _length(solid: Solid, name: str) -> float:
    """Of an edge, or around a circle or a curved surface of the part; scene units."""
    for edge in solid.edges:
        if edge.name == name:
            return float(np.linalg.norm(np.subtract(*solid.vertices[list(edge.ends)])))
    radius = getattr(solid.round(name), "radius", None)
    return 2 * math.pi * float(radius) if isinstance(radius, float) else 2 * math.pi * solid.extent
