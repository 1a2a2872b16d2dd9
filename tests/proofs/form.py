"""``python -m tests.proofs form``: is the zone that a feature's points seem to need larger by as much as predicted?

A part's picture is rendered without noise; other parts' pictures are made of it, its edge or rim shifted across itself
by a known form - a sine along the edge, lobes around the circle, of random phase - or not at all. Each gets noise of
its own and is measured by who believes the part to be perfect. The zones that points need must follow the law that the
noise-free picture of the perfect part tells: their mean and how many exceed its 95 % quantile lie within chance (Sidak,
1 % over all rows). The law that is predicted without any image (`form_law`) has the same mean within 2.5 %. Parts
without form are called out of form, of a zone of size 0, no more often than the 2.3 % that are stated; parts whose zone
is just the limit are wrongly accepted or refused no more often, whatever their form.
As controls are refused zones from which nothing is taken off, and, of a circle, the law of independent points.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy import stats
from scipy.ndimage import map_coordinates

import measure
import render
import scenes
from imaging.features.seen import unit_normals
from imaging.geometry.projection import project
from imaging.models.extremes import Law
from imaging.models.form_law import FormLaw, form_law, residues
from imaging.pictures import Pictures
from planner.uncertainty.forms import FormSize
from scenes import Picture, Quantity
from tests import toleranced
from validation.statistics import sidak

STATED = float(stats.norm.sf(2))  # of wrong decisions, at k = 2
_LEVEL = 0.01
_WIDE = 12.0  # px beside the feature that move with it
_PLACES = 2000  # along a feature: what is true is told by these
_BATCH = 100  # pictures at a time
_MODEL = 0.025  # by which the law without an image may differ in its mean, as sigma by the closed form does


@dataclass(frozen=True)
class Case:
    """A feature in a picture, and a form: its amplitude, of the noise's standard deviation at a point, and how many
    waves or lobes it has."""

    name: str
    picture: Picture
    amplitude: float
    waves: float

    @property
    def quantity(self) -> Quantity:
        return self.picture.scene.quantities[0]

    @property
    def is_edge(self) -> bool:
        """Whether it is a straight edge; else a circle."""
        return self.quantity.edges[0] not in (circle.name for circle in self.picture.scene.solid.rims)

    @cached_property
    def passed(self) -> float:
        """Part of a wave's height that the locator's Gaussian leaves as it smooths along the feature."""
        places, _, _ = _outline(self)
        length = np.linalg.norm(np.diff(places, axis=0), axis=-1).sum()
        return float(np.exp(-((2 * np.pi * self.waves / length * self.picture.scene.locator.scale_px) ** 2) / 2))

    @property
    def predicted(self) -> FormLaw:
        """The law without an image."""
        found = form_law(Pictures.of(self.picture), self.quantity)
        assert found is not None
        return found


@dataclass(frozen=True)
class Row:
    """Of many parts: mean of the zones that their points need over that of their law, and that of the law without an
    image; its deviation from the former in standard errors, and the same of independent points; how many exceed the
    law's 95 % quantile; mean error of the values and of the zones as found, over the standard deviation, and measured
    over predicted variance; and how many are called out of form, or accepted, at a limit that is their true size."""

    case: Case
    count: int
    mean: float
    model: float
    z: float
    z_independent: float
    above: int
    off: float
    untouched: float
    variance: float
    refused: int
    accepted: int

    def follows(self, tests: int) -> bool:
        """Whether mean and quantile are as predicted, with 99 % over so many rows of two tests."""
        level = sidak(_LEVEL, 2 * tests)
        near = abs(self.z) < stats.norm.isf(level / 2) and abs(self.model - 1) < _MODEL
        return near and stats.binomtest(self.above, self.count, 0.05).pvalue > level

    def is_decided(self, tests: int) -> bool:
        """Whether wrong decisions are no more than stated."""
        most = stats.binom.isf(sidak(_LEVEL, 2 * tests), self.count, STATED)
        return max(self.refused, self.accepted if self.case.amplitude else 0) <= most

    def __str__(self) -> str:
        above, refused, accepted = (n / self.count for n in (self.above, self.refused, self.accepted))
        return (
            f"{self.case.name:<28} mean {self.mean:6.4f} of its law ({self.z:+.1f}; independent points "
            f"{self.z_independent:+.0f}), law {self.model:6.4f} without image, {above:5.1%} above q95, "
            f"value off {self.off:+.2f} sigma (as found {self.untouched:+.1f}), variance {self.variance:.3f}, "
            f"called out {refused:.1%}, accepted {accepted:.1%} at its limit"
        )


def cases(folder: Path, amplitude: float = 4.0) -> list[Case]:
    """An edge and a bore, each without form error and with one."""
    block = scenes.load("task1").with_(task=None, settings=[], measurands=[
        {"name": "front", "kind": "straightness", "features": [{"edge": "e7"}], "tolerance": 0.05}])  # fmt: skip
    plate = toleranced.scene(folder, ("back",), 720, width=480, height=384, focal_px=1800.0).with_(measurands=[
        {"name": "bore", "kind": "roundness", "features": [{"circle": "c4"}], "tolerance": 0.1}])  # fmt: skip
    edge, bore = (
        scene.with_(
            measurands=[{**scene.measurands[0].model_dump(mode="json", exclude_defaults=True), "kind": "profile"}]
        )
        for scene in (block, plate)
    )
    of = {
        "straightness": (Picture.of(block, (30, 135), (15, 315)), 1.7),
        "roundness": (Picture.of(plate, (10, 300), (5, 40)), 3.0),
        "profile of an edge": (Picture.of(edge, (30, 135), (15, 315)), 1.7),
        "profile of a bore": (Picture.of(bore, (10, 300), (5, 40)), 2.0),
    }
    return [
        Case(f"{name}, {f'{waves:g} waves' if high else 'no form'}", picture, high, waves)
        for name, (picture, waves) in of.items()
        for high in (0.0, amplitude)
    ]


def row(case: Case, count: int, rng: np.random.Generator) -> Row:
    """Of so many parts."""
    clean = render.image(case.picture, quality=render.Quality(everywhere=True))
    law, name = _law(case, clean), case.quantity.name
    high = case.amplitude * float(np.sqrt(np.diag(law.covariance).mean()))
    phases, parts = rng.uniform(0, 2 * np.pi, count), []
    for first in range(0, count, _BATCH):
        images = np.stack([_made(case, clean, high, phase, rng) for phase in phases[first : first + _BATCH]])
        found = measure.measure(images, case.picture, estimator="gradient")
        assert all(found.forms[name]), "all parts are measured"
        parts += zip(found.value[:, 0], found.sigma[:, 0], found.forms[name], strict=True)
    value, sigma, told = (np.array(column) for column in zip(*parts, strict=True))
    seen, true = np.array([each.size for each in told]), np.array([_zone(case, law, high, phase) for phase in phases])
    apart = replace(law, covariance=np.diag(np.diag(law.covariance)))
    laws, alone = zip(*(_both(case, high, phase, (law, apart)) for phase in phases), strict=True)
    mean, u = np.array([[each.mean, each.u] for each in laws]).T
    sizes = [FormSize(float(v), 0.0, s, each.law) for v, s, each in zip(value, seen, told, strict=True)]
    decided = [size.decide(limit) for size, limit in zip(sizes, true, strict=True)]
    return Row(
        case, count, float(seen.mean() / mean.mean()), case.predicted.noise.mean / law.noise.mean,
        _deviation(seen, laws), _deviation(seen, alone), int((seen > [each.quantile(0.95) for each in laws]).sum()),
        float((value - true).mean() / sigma.mean()), float((seen - true).mean() / sigma.mean()),
        float((value - true).var(ddof=1) / (u**2).mean()), decided.count("fail"), decided.count("pass"),
    )  # fmt: skip


def _law(case: Case, clean: np.ndarray) -> FormLaw:
    """As the noise-free picture of a perfect part tells it."""
    (found,) = measure.measure(clean[None], case.picture, estimator="gradient").forms[case.quantity.name]
    assert found is not None
    return found.law


def _both(case: Case, high: float, phase: float, laws: tuple[FormLaw, FormLaw]) -> tuple[Law, ...]:
    """Of the zone of a part with a form, by two laws of its points."""
    return tuple(law.of(case.passed * _form(case, law.at, high, phase)) for law in laws)


def _deviation(seen: np.ndarray, laws: Sequence[Law]) -> float:
    """Of a mean from that of laws, in standard errors."""
    return float((seen - [law.mean for law in laws]).sum() / np.sqrt(sum(law.u**2 for law in laws)))


def _form(case: Case, at: np.ndarray, high: float, phase: float) -> np.ndarray:
    """Distances at places, less the reference by least squares."""
    if case.quantity.kind == "profile":
        return _wave(case, at, high, phase)
    design = [np.ones(at.size), at] if case.is_edge else [np.ones(at.size), np.cos(at), np.sin(at)]
    return residues(np.stack(design, -1)) @ _wave(case, at, high, phase)


def _wave(case: Case, at: np.ndarray, high: float, phase: float) -> np.ndarray:
    turn = at * (2 * np.pi if case.is_edge else 1.0)
    return high * np.sin(case.waves * turn + phase)


def _zone(case: Case, law: FormLaw, high: float, phase: float) -> float:
    """What the true form needs over the part that is measured: from many places, by a fit of its own."""
    dense = np.linspace(law.at.min(), law.at.max(), _PLACES)
    wave = _wave(case, dense, high, phase)
    if case.quantity.kind == "profile":
        return 2 * float(np.abs(wave).max())
    if case.is_edge:
        return float(np.ptp(wave - np.polyval(np.polyfit(dense, wave, 1), dense)))
    waves = np.stack([np.ones(dense.size), np.cos(dense), np.sin(dense)], -1)
    return float(np.ptp(wave - waves @ np.linalg.lstsq(waves, wave, rcond=None)[0]))


def _made(case: Case, clean: np.ndarray, high: float, phase: float, rng: np.random.Generator) -> np.ndarray:
    """A part's noisy picture."""
    noise = case.picture.scene.noise
    return render.expose(_moved(case, clean, high, phase) if high else clean, noise, rng, 1)[0]


def _moved(case: Case, clean: np.ndarray, high: float, phase: float) -> np.ndarray:
    """A picture whose feature is shifted across itself by a form."""
    places, steps, share = _outline(case)
    y, x = np.mgrid[: clean.shape[0], : clean.shape[1]].astype(float)
    pixels = np.stack([x.ravel(), y.ravel()], -1)
    (left, top), (right, bottom) = places.min(0) - _WIDE, places.max(0) + _WIDE
    near = np.flatnonzero((x.ravel() > left) & (x.ravel() < right) & (y.ravel() > top) & (y.ravel() < bottom))
    distance, nearest = _tree(places).query(pixels[near], distance_upper_bound=_WIDE)
    inside = np.isfinite(distance)
    near, nearest = near[inside], nearest[inside]
    shift = steps[nearest] * _wave(case, share[nearest], high, phase)[:, None]
    moved = clean.astype(float).copy().ravel()
    moved[near] = map_coordinates(clean, (pixels[near] - shift).T[::-1], order=5, mode="nearest")
    return moved.reshape(clean.shape)


def _tree(places: np.ndarray):
    from scipy.spatial import cKDTree

    return cKDTree(places)


def _outline(case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (n, 2) of the feature's image, the shift there for a unit across it (n, 2), px, and where that is (n,)."""
    scene, pose = case.picture.scene, np.array(list(case.picture.sensor))
    if case.is_edge:
        at = np.linspace(0, 1, _PLACES)
        edge = scene.solid.edge(case.quantity.edges[0])
        start, stop = scene.solid.vertices[list(edge.ends)]
        faces = scene.solid.normals[list(edge.faces)]
        upward = faces[np.argmax(scene.solid.areas[list(edge.faces)])]
        across = np.broadcast_to(np.cross(upward, (stop - start) / np.linalg.norm(stop - start)), (_PLACES, 3))
        points = start + at[:, None] * (stop - start)
    else:
        at = np.linspace(0, 2 * np.pi, _PLACES, endpoint=False)
        circle = scene.solid.circle(case.quantity.edges[0])
        points, across = circle.at(at), circle.spokes(at)
    small = 1e-4
    places, moved = project(points, pose, scene.camera), project(points + small * across, pose, scene.camera)
    normals = unit_normals(np.gradient(places, axis=0))
    return places, normals * np.einsum("ni,ni->n", (moved - places) / small, normals)[:, None], at


def form(
    parts: Annotated[int, typer.Option(help="Simulated parts of each kind and form.")] = 1000,
    amplitude: Annotated[float, typer.Option(help="Of forms, of the standard deviation of a point.")] = 4.0,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Zones of forms: mean, 95 % quantile and decisions of simulated parts; six minutes of processor time."""
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for case in cases(Path(folder), amplitude):
            rows.append(row(case, parts, rng))
            print(rows[-1], flush=True)
    least = stats.norm.isf(sidak(_LEVEL, len(rows)) / 2)
    follow, decided = sum(each.follows(len(rows)) for each in rows), sum(each.is_decided(len(rows)) for each in rows)
    untouched = sum(each.untouched * np.sqrt(each.count) > least for each in rows)
    apart = sum(abs(each.z_independent) > least for each in rows)
    print(f"of {len(rows)} rows {follow} follow their law, {decided} keep the stated rate of {STATED:.1%}")
    print(f"refused as controls: zones as found in {untouched} rows, independent points in {apart}")
    controls = untouched == len(rows) and apart > 0
    raise typer.Exit(0 if follow == decided == len(rows) and controls else 1)
