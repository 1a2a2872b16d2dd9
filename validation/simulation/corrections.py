"""The bias of a picture by noise-free images of it, and how surely they tell it.

All images are made where something is measured (everywhere for estimators that look farther), and with few rays first:
where the noise of these is far below sigma or the tolerance, more rays would tell nothing. Where a bias is not known
well enough for its value to be `ok`, up to a megapixel, all of the picture is rendered with few rays, for it tells of
reflectances and lights itself (`measure.adjustment`); and where that does not do, more sets of rays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

import measure
import render
from measure import Correction, Images
from measure.correction import mean_of
from measure.known_bias import RENDERING, TEXTURE
from measure.propagation import PropagatedValues
from measure.unevenness import Unevenness
from render.build import MANY_WAYS
from render.large import LARGE, LARGE_RANDOM
from scenes import Picture, Scene
from scenes.status import CLUTTER, ILL_CONDITIONED, LOW_CONTRAST, MISFIT, OK, SIGN_CHANGE, is_trusted
from validation.remeasured import Method
from validation.simulation.how import How, is_below
from validation.simulation.images import completed
from validation.simulation.shown import Shown

_PAIR, _MOST = 2, 6  # renders of other rays; of an image whose pixels tell how noisy they are, a pair does
_ROUGH, _LEAST = 4, 3  # with few rays, with all: of others, for two often agree by chance
_NOISY = 8  # pictures in which a texture is looked for
_QUIET, _OF_TOLERANCE = 0.1, 0.01  # parts of sigma, and of the tolerance, that the renderer's noise stays below


def of_render(
    picture: Picture, method: Method, image: np.ndarray, propagated: PropagatedValues, how: How = How()
) -> Correction:
    """The correction that one render tells, where settings are compared: how noisy the render is, is left out."""
    how = how.by(method, of=picture.scene)
    images, none = completed(picture, (image,), (), how), np.zeros(len(picture.scene.quantities))
    images = replace(images, known={**images.known, RENDERING: (none, none)})
    return measure.correction(images, picture, method.locator, method.threshold, propagated)


def simulated(picture: Picture, method: Method, how: How = How()) -> Correction:
    """The correction of a picture of a part whose statistical textures nobody knows, kept in this process.

    Where light takes random ways, four renders of few rays do, or two of a large image, if their noise is below a tenth
    of sigma or a hundredth of the tolerance, or as many as six if these make it so; else of all rays, and renders of
    other rays are added until it is, six at most.
    """
    return _simulated(picture, method, how.by(method, of=picture.scene).gathering)


def best(picture: Picture, made: Callable[[Picture, Method], Correction] = simulated) -> Correction:
    """The correction of a picture by its default estimator; by another one that tells more of its values.

    Where two edges run together noise may decide which of them an edge point is on by one rule, and not by another:
    that a simulated picture tells, without an image. And a bias that is not known well enough for one may be for
    another (`measure.other_estimators`), an edge be too faint for one alone: asked in images up to a megapixel. Where
    each tells values that the other does not, each edge is measured by the one that tells it. What ``made`` makes is a
    correction by one method.
    """
    found = made(picture, Method(measure.best_estimator(picture)))
    for name in measure.other_estimators(picture.scene):
        if not _may_be_told(picture, found, name):
            continue
        tried = [found, made(picture, Method(name))]
        mixed = _by_edges(*tried, picture.scene)
        if mixed is not None:
            tried.append(made(picture, Method(mixed)))
        found = max(tried, key=_trusted)  # the first of them
    return found


def _may_be_told(picture: Picture, found: Correction, name: str) -> bool:
    """Whether another estimator may tell more: in large images one that looks where nothing is measured, too, takes
    long."""
    small, unsure = is_below(picture, LARGE), {ILL_CONDITIONED} & set(found.simulated)
    if not small:
        return bool(unsure) and measure.ESTIMATORS[name].within(picture.scene).local
    return CLUTTER in found.status or bool(unsure) or not {LOW_CONTRAST, SIGN_CHANGE}.isdisjoint(found.simulated)


def _by_edges(found: Correction, other: Correction, scene: Scene) -> str | None:
    """The estimator that measures the edges of values that the other alone tells by that, the rest as before.

    None where one of both tells all that the other does, or their edges cannot be measured one by one.
    """
    one, two = (np.array([is_trusted(state) for state in each.status]) for each in (found, other))
    if not ((one & ~two).any() and (two & ~one).any()):
        return None
    names = {name for quantity, new in zip(found.quantities, two & ~one, strict=True) if new for name in quantity.edges}
    return measure.mixed_estimator(found.estimator, other.estimator, names, scene)


def _trusted(found: Correction) -> int:
    return sum(map(is_trusted, found.status))


@lru_cache(maxsize=64)
def _simulated(picture: Picture, method: Method, how: How) -> Correction:
    alike = picture.with_scene(_without_textures(picture.scene))
    shared = _shown(alike, how.shared(alike)) if is_below(alike, LARGE) else None  # large ones fill the memory
    found, told = _until_quiet(alike, method, how, shared)
    if alike is picture or alike.scene == picture.scene:
        return found
    uneven = Unevenness.about(picture, told.response)
    plane, image = (
        np.where(np.isfinite(found.bias), np.sqrt(uneven.variances(response)), np.inf)
        for response in (told.response, told.response_image)
    )
    return replace(
        found,
        sources={**found.sources, TEXTURE: plane},
        sources_image={**found.sources_image, TEXTURE: image},
        features=None,
        simulated=_with_textures(picture, method, how, found.simulated),
    )


def _with_textures(picture: Picture, method: Method, how: How, states: tuple[str, ...]) -> tuple[str, ...]:
    """Statuses (M,) of a simulated picture, ``misfit`` where textures like the part's make noisy pictures so."""
    rng, noise = np.random.default_rng(how.quality.seed), picture.scene.noise
    images = render.expose(how.rough.image(picture), noise, rng, _NOISY)
    found = measure.measure(images, picture, estimator=method.locator, threshold=method.threshold)
    misfit = (found.status == MISFIT).any(0)
    return tuple(MISFIT if new and old == OK else old for new, old in zip(misfit, states, strict=True))


def _until_quiet(
    picture: Picture, method: Method, how: How, shown: Shown | None = None
) -> tuple[Correction, PropagatedValues]:
    """With few rays if these do; else with all, and with renders of other rays until they do, `_MOST` at most.

    Beside it what propagation says of the mean of the first of these renders.
    """
    shown = shown or Shown(picture, how)

    def begun(render: Callable[[int], np.ndarray], least: int) -> tuple[PropagatedValues, Callable, Images]:
        renders = tuple(render(seed) for seed in range(least))
        clean = mean_of(renders)
        told = measure.propagate(clean, picture, estimator=method.locator, threshold=method.threshold).measurands
        return told, partial(told_by, picture, method, told), shown.images(renders)

    pair = how.by_pixel and not is_below(picture, LARGE_RANDOM)  # a small one has few pixels, and is cheap
    if how.active(picture) & MANY_WAYS:
        told, of, images = begun(shown.rough, _PAIR if pair else _ROUGH)
        found = of(images)
        if len(images.renders) * _noise(found) ** 2 <= _MOST:
            found, images = _quieter(of, found, images, shown.rough)
        if _noise(found) <= 1:
            return sure(picture, found, of, shown.more_telling(images)), told
    told, of, images = begun(shown.image, _PAIR if pair else _LEAST)
    found, images = _quieter(of, of(images), images, shown.image)
    return sure(picture, found, of, shown.more_telling(images)), told


def _quieter(
    of: Callable[[Images], Correction], found: Correction, images: Images, render: Callable[[int], np.ndarray]
) -> tuple[Correction, Images]:
    """With renders of other rays until they are quiet, `_MOST` at most."""
    while _noise(found) > 1 and len(images.renders) < _MOST:
        images = replace(images, renders=(*images.renders, render(len(images.renders))))
        found = of(images)
    return found, images


def told_by(picture: Picture, method: Method, told: PropagatedValues, images: Images) -> Correction:
    return measure.correction(images, picture, method.locator, method.threshold, told)


def sure(
    picture: Picture, found: Correction, of: Callable[[Images], Correction], more: Iterable[Callable[[], Images]]
) -> Correction:
    """A correction; where it does not know a bias well enough, up to a megapixel, that of more images."""
    for images in more if is_below(picture, LARGE) else ():
        states = zip(found.status, np.isfinite(found.bias), strict=True)
        if not any(state == CLUTTER and known for state, known in states):
            break
        found = of(images())
    return found


def _noise(found: Correction) -> float:
    """Of the renderer, in parts of what it is to stay below, of the noisiest value."""
    tolerances = np.array([0.0 if q.tolerance is None else q.tolerance.half for q in found.quantities])
    noise, limit = found.sources[RENDERING], np.maximum(_QUIET * found.sigma, _OF_TOLERANCE * tolerances)
    known = np.isfinite(noise) & np.isfinite(found.sigma)
    return float((noise[known] / np.maximum(limit[known], np.finfo(float).tiny)).max(initial=0.0))


@lru_cache(maxsize=1)
def _shown(picture: Picture, how: How) -> Shown:
    return Shown(picture, how)


def _without_textures(scene: Scene) -> Scene:
    kept = tuple(each for each in scene.textures if each.kind != "statistical")
    return scene if kept == scene.textures else scene.tried(textures=kept)
