"""``python -m tests.proofs known-levels``: would an estimator that knows the rendered picture measure better?

Beside each edge the noise-free render is taken for what the picture shows, but for what is not known: where the edge
is (offset and tilt), how bright each of its sides is, the blur, and the inputs that the scene is not sure of, with
their standard uncertainties (`validation.simulation` renders the picture with each of them changed). That is linear
least squares with observations of the unknowns (Mikhail and Ackermann, Observations and Least Squares, 1976); pixels
near other edges are left out. Printed beside ``gradient``, whose inputs the picture adjusts, too: sigma, u(bias) and u,
and what is left of the bias in pictures of which reflectances and lights are drawn as in `tests.proofs.bias`. No part
of the program: what it would gain is told in docs/estimators.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import typer

import measure
import scenes
from imaging.colour import seen
from imaging.features.locator import CLEARANCE, edge_blur
from imaging.features.measurand import measurands
from imaging.geometry.segments import distance_to_segment
from imaging.pictures import Pictures
from measure import Images
from measure.estimators.coverage import NODE_WEIGHTS, NODES, density, half_plane
from measure.estimators.estimate import Estimate, noisy
from measure.estimators.kinds import ESTIMATORS, EstimatorKind
from measure.estimators.strip import HALF_WIDTH, LEAST_BLUR, pixels_beside
from measure.features.calipers import Caliper, edge_calipers
from measure.features.layout import Layout
from measure.features.optics import Optics
from scenes import Picture, status
from tests.proofs.bias import deviating, moved, rms
from validation.remeasured import Method
from validation.simulation import How
from validation.simulation.images import completed, of_all

NAME = "known levels"
_OWN = 3.0  # px beside an edge that are its own, whatever else is near
_SCALE = 0.1  # standard uncertainty of how bright a side is, relative
_AROUND, _BESIDE = 5.0, 7.0  # px along and across an edge over which its contrast is found
_CAPTURE = 1.5  # px


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of a picture: recorded levels without noise (height, width), and their change by one standard
    uncertainty of each input (k, height, width)."""

    levels: np.ndarray
    changed: np.ndarray


@dataclass(frozen=True, eq=False)
class KnownLines:
    """Lines of E edges, linear in the pixels: ``rows`` (2 E, P) times what an image differs by from the ``expected``
    levels (P,)."""

    calipers: tuple[Caliper, ...]
    pixels: np.ndarray
    rows: np.ndarray
    expected: np.ndarray
    contrast: np.ndarray
    optics: Optics

    def estimate(self, images: np.ndarray) -> Estimate:
        away = images.reshape(len(images), -1)[:, self.pixels] - self.expected
        level, slope = np.moveaxis((away @ self.rows.T).reshape(len(images), -1, 2), -1, 0)
        contrast = np.zeros((*level.shape, 2)) + np.stack([self.contrast, 0 * self.contrast], -1)
        count = np.full(level.shape, self.pixels.size)
        return Estimate(level, slope, contrast, count, np.zeros_like(count), np.full(level.shape, status.OK))

    def covariance(self, estimate: Estimate, images: np.ndarray) -> np.ndarray:
        found = noisy(self.rows, self.optics, images, self.pixels)
        return np.broadcast_to(found, (len(images), *found.shape[-2:]))

    def respond_within(self, clean: np.ndarray) -> np.ndarray:
        return self.rows


def _strip(layout: Layout, caliper: Caliper, index: int, clear: float) -> tuple[np.ndarray, ...]:
    """Pixels beside an edge, their ideal coordinates and places in its caliper; none near other edges."""
    flat, points, along, across = pixels_beside(caliper, HALF_WIDTH)
    keep = np.ones(flat.size, bool)
    others = [ends for ends in layout.ends[layout.visible] if not np.array_equal(ends, layout.ends[index])]
    for segment in (*others, *layout.others):
        keep &= (distance_to_segment(points, *segment) > clear) | (np.abs(across) < _OWN)
    return flat[keep], points[keep], along[keep], across[keep]


def _contrast(levels: np.ndarray, inside: np.ndarray, along: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Contrast of an edge at its pixels (P,), of planes fitted to either side near each place."""
    places, found = np.arange(along.min(), along.max() + 1, 2.0), []
    for place in places:
        near = (np.abs(along - place) < _AROUND) & (np.abs(across) < _BESIDE)
        plane = np.stack([np.ones(near.sum()), across[near], along[near] - place], 1)
        sides = np.concatenate([plane * inside[near, None], plane * (1 - inside[near, None])], 1)
        fit = np.linalg.lstsq(sides, levels[near], rcond=None)[0]
        found.append(fit[0] - fit[3])
    return np.interp(along, places, found)


def _side(levels: np.ndarray, away: np.ndarray, along: np.ndarray, blur: float) -> np.ndarray:
    """Level of a side at all pixels (P,), from those ``away`` from the edge by three blurs, px; beyond it as on it."""

    def terms(place: np.ndarray, depth: np.ndarray) -> np.ndarray:
        u, v = (place - along.mean()) / max(np.ptp(along), 1.0), depth / HALF_WIDTH
        return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], -1)

    own = away > 3 * edge_blur(blur)
    fit = np.linalg.lstsq(terms(along[own], away[own]), levels[own], rcond=None)[0]
    return terms(along, np.maximum(away, 0.0)) @ fit


def _line(known: Known, caliper: Caliper, strip: tuple[np.ndarray, ...], dark: float) -> tuple[np.ndarray, float]:
    """Derivative of (level, slope) by an edge's pixels (2, P), and its contrast."""
    pixels, ideal, along, across = strip
    optics, middle = caliper.optics, caliper.length / 2
    slopes = [optics.gradient(ideal, axis) for axis in (caliper.normal, caliper.direction)]
    blur = np.maximum(caliper.blur(along), LEAST_BLUR) * np.linalg.norm(slopes[0], axis=-1)
    nodes = across[:, None] + slopes[0] @ NODES.T
    inside = (half_plane(nodes / blur[:, None]) * NODE_WEIGHTS).sum(1)
    thin = density(nodes / blur[:, None]) * NODE_WEIGHTS / blur[:, None]
    lever = along[:, None] + slopes[1] @ NODES.T - middle
    levels = known.levels.ravel()[pixels] - dark
    contrast = _contrast(levels, inside, along, across)
    plus, minus = (_side(levels, sign * across, along, float(blur.mean())) for sign in (1, -1))
    columns = [
        -contrast * thin.sum(1), -contrast * (thin * lever).sum(1), plus * inside, minus * (1 - inside),
        -contrast * (thin * nodes / blur[:, None]).sum(1), *known.changed.reshape(len(known.changed), -1)[:, pixels],
    ]  # fmt: skip
    weight = 1 / np.sqrt(np.broadcast_to(_noise(optics, known.levels.ravel()[pixels]), pixels.shape))
    design = np.stack(columns, 1) * weight[:, None]
    told = np.diag([0.0, 0.0, 1 / _SCALE, 1 / _SCALE, 0.0, *np.ones(len(known.changed))])
    offset, tilt = (np.linalg.pinv(np.concatenate([design, told]))[:2, : pixels.size]) * weight
    return np.stack([offset - middle * tilt, tilt]), float(contrast.mean())


def _noise(optics: Optics, levels: np.ndarray) -> np.ndarray | float:
    variance = optics.noise_at(levels)
    return optics.noise_variance if variance is None else variance


def prepared(known: Known, layout: Layout) -> KnownLines:
    """The estimator of a layout whose picture is known."""
    clear, parts, calipers = CLEARANCE * edge_blur(layout.optics.most_blur_px), [], []
    for index, caliper in enumerate(edge_calipers(layout, clear, 0.0, 2 * clear)):
        if caliper.status in status.MEASURED:
            strip = _strip(layout, caliper, index, clear)
            parts.append((strip[0], *_line(known, caliper, strip, layout.optics.sensor.dark_level)))
        else:
            parts.append((np.zeros(0, int), np.zeros((2, 0)), 0.0))
        calipers.append(caliper)
    pixels = np.unique(np.concatenate([part[0] for part in parts]))
    rows = np.zeros((2 * len(parts), pixels.size))
    for e, (own, told, _) in enumerate(parts):
        rows[2 * e : 2 * e + 2, np.searchsorted(pixels, own)] = told
    contrast = np.array([part[2] for part in parts])
    return KnownLines(tuple(calipers), pixels, rows, known.levels.ravel()[pixels], contrast, layout.optics)


def images_of(picture: Picture) -> Images:
    """Two renders of few rays, and with each input changed by a standard uncertainty."""
    how = How().by(Method("strip"))
    renders = tuple(how.rough.image(picture, seed) for seed in range(2))
    images = completed(picture, renders, (), how)
    return replace(images, overall=of_all(picture, images, how))


def corrections(picture: Picture, images: Images) -> dict[str, measure.Correction]:
    """By ``gradient``, inputs adjusted to the picture, and by known levels."""
    noise = picture.scene.noise
    changed = [each - images.renders[0] for some in images.changed.values() for each in some]
    clean = seen(noise, np.mean(images.renders, axis=0)).level
    known = Known(clean, np.reshape(changed, (-1, *clean.shape)))
    kind = EstimatorKind(lambda layout, threshold: prepared(known, layout), _CAPTURE, exact_px=0.01)
    name, alone = f"known levels {len(ESTIMATORS)}", replace(images, overall=None)  # of this picture alone
    ESTIMATORS.add(name)(kind)
    return {"gradient": measure.correction(images, picture, "gradient"), NAME: measure.correction(alone, picture, name)}


def left(picture: Picture, offs: dict[str, measure.Correction], trials: int, seed: int) -> dict[str, np.ndarray]:
    """What is left of the biases in pictures whose inputs deviate, over u(bias) as told, (trials, M)."""
    true, rng = measurands(Pictures.of(picture)).value_object, np.random.default_rng(seed)
    rows: dict[str, list[np.ndarray]] = {name: [] for name in offs}
    for trial in range(trials):
        actual = Picture(
            deviating(picture.scene, rng), picture.sensor, tuple(moved(pose, rng) for pose in picture.lights)
        )
        how = How(everywhere=True).rough
        image = seen(picture.scene.noise, how.image(actual, 1000 + trial)).level
        for name, off in offs.items():
            found = measure.measure(image, picture, correction=off)
            rows[name].append((found.value - true) / np.hypot(found.u_bias, off.beside))
    return {name: np.array(some) for name, some in rows.items()}


def known_levels(
    scene: Annotated[list[str], typer.Option(help="Bundled names; may be repeated.")] = ["grey_floor"],  # noqa: B006
    settings: Annotated[int, typer.Option(help="Of each.")] = 3,
    trials: Annotated[int, typer.Option(help="Pictures with drawn inputs, of each setting.")] = 8,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Sigma, u(bias) and u by known levels beside those of the default; some minutes a setting."""
    for name in scene:
        whole = scenes.load(name)
        for setting in whole.settings[:settings]:
            picture = Picture.of(whole, setting.sensor, setting.lights)
            offs = corrections(picture, images_of(picture))
            rest = left(picture, offs, trials, seed)
            for m, quantity in enumerate(whole.quantities):
                for method, off in offs.items():
                    print(
                        f"{name} {picture.sensor} {quantity.name} {method}: {off.status[m]}, sigma {off.sigma[m]:.3g}, "
                        f"u(bias) {off.u_bias[m]:.3g}, u {np.hypot(off.sigma[m], off.u_bias[m]):.3g}, bias "
                        f"{off.bias[m]:+.3g}; left over u(bias) {rms(rest[method][:, m]):.2f} rms",
                        flush=True,
                    )
