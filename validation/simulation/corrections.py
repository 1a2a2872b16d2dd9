"""The bias of a picture by noise-free images of it, and how surely they tell it.

All images are made where something is measured (everywhere for estimators that look farther), and with few rays first:
where the noise of these is far below sigma or the tolerance, more rays would tell nothing. Where a bias is not known
well enough for its value to be `ok`, up to a megapixel, all of the picture is rendered with few rays, for it tells of
reflectances and lights itself (`measure.adjustment`); and where that does not do, more sets of rays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache, lru_cache, partial

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
from scenes.status import CLUTTER, ILL_CONDITIONED, MISFIT, OK, is_trusted
from validation.remeasured import Method
from validation.simulation.how import How, is_below
from validation.simulation.images import completed, of_all, settled

_PAIR, _MOST = 2, 6  # renders of other rays; of an image whose pixels tell how noisy they are, a pair does
_ROUGH, _LEAST = 4, 3  # with few rays, with all: of others, for two often agree by chance
_NOISY = 8  # pictures in which a texture is looked for
_QUIET, _OF_TOLERANCE = 0.1, 0.01  # parts of sigma, and of the tolerance, that the renderer's noise stays below


def of_render(
    picture: Picture, method: Method, image: np.ndarray, propagated: PropagatedValues, how: How = How()
) -> Correction:
    """The correction that one render tells, where settings are compared: how noisy the render is, is left out."""
    how = how.by(method)
    images, none = completed(picture, (image,), (), how), np.zeros(len(picture.scene.quantities))
    images = replace(images, known={**images.known, RENDERING: (none, none)})
    return measure.correction(images, picture, method.locator, method.threshold, propagated)


def simulated(picture: Picture, method: Method, how: How = How()) -> Correction:
    """The correction of a picture of a part whose statistical textures nobody knows, kept in this process.

    Where light takes random ways, four renders of few rays do, or two of a large image, if their noise is below a tenth
    of sigma or a hundredth of the tolerance, or as many as six if these make it so; else of all rays, and renders of
    other rays are added until it is, six at most.
    """
    return _simulated(picture, method, how.by(method).gathering)


def best(picture: Picture, made: Callable[[Picture, Method], Correction] = simulated) -> Correction:
    """The correction of a picture by its default estimator; by another one that tells more of its values.

    Where two edges run together noise may decide which of them an edge point is on by one rule, and not by another:
    that a simulated picture tells, without an image. And a bias that is not known well enough for one may be for
    another (`measure.other_estimators`): asked in images up to a megapixel alone, for each simulates all anew. What
    ``made`` makes is a correction by one method.
    """
    found = made(picture, Method(measure.best_estimator(picture)))
    for name in measure.other_estimators(picture.scene):
        if not _may_be_told(picture, found, measure.ESTIMATORS[name].local):
            break
        other = made(picture, Method(name))
        found = other if _trusted(other) > _trusted(found) else found
    return found


def _may_be_told(picture: Picture, found: Correction, local: bool) -> bool:
    """Whether another estimator may tell more: one that looks where nothing is measured, too, takes long."""
    unknown = CLUTTER in found.status and is_below(picture, LARGE)
    return unknown or (local and ILL_CONDITIONED in found.simulated)


def _trusted(found: Correction) -> int:
    return sum(map(is_trusted, found.status))


@lru_cache(maxsize=64)
def _simulated(picture: Picture, method: Method, how: How) -> Correction:
    alike = picture.with_scene(_without_textures(picture.scene))
    found, told = _until_quiet(alike, method, how)
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


def _until_quiet(picture: Picture, method: Method, how: How) -> tuple[Correction, PropagatedValues]:
    """With few rays if these do; else with all, and with renders of other rays until they do, `_MOST` at most.

    Beside it what propagation says of the mean of the first of these renders.
    """

    def propagated(renders: tuple[np.ndarray, ...]) -> PropagatedValues:
        clean = mean_of(renders)
        return measure.propagate(clean, picture, estimator=method.locator, threshold=method.threshold).measurands

    images = None
    pair = how.by_pixel and not is_below(picture, LARGE_RANDOM)  # a small one has few pixels, and is cheap
    if how.active(picture) & MANY_WAYS:
        few = tuple(how.rough.image(picture, seed) for seed in range(_PAIR if pair else _ROUGH))
        images, told = completed(picture, few, (), how), propagated(few)
        of = partial(told_by, picture, method, told)
        found = of(images)
        if len(few) * _noise(found) ** 2 <= _MOST:
            found, images = _quieter(picture, of, found, images, how.rough)
        if _noise(found) <= 1:
            return sure(picture, found, of, more_telling(picture, images, how)), told
    renders = tuple(how.image(picture, seed) for seed in range(_PAIR if pair else _LEAST))
    images = replace(images, renders=renders) if images else completed(picture, renders, (), how)
    told = propagated(renders)
    of = partial(told_by, picture, method, told)
    found, images = _quieter(picture, of, of(images), images, how)
    return sure(picture, found, of, more_telling(picture, images, how)), told


def _quieter(
    picture: Picture, of: Callable[[Images], Correction], found: Correction, images: Images, how: How
) -> tuple[Correction, Images]:
    """With renders of other rays until they are quiet, `_MOST` at most."""
    while _noise(found) > 1 and len(images.renders) < _MOST:
        images = replace(images, renders=(*images.renders, how.image(picture, len(images.renders))))
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


def more_telling(picture: Picture, images: Images, how: How) -> list[Callable[[], Images]]:
    """What tells of inputs that these images do not know well enough, the quickest first."""
    overall = cache(partial(of_all, picture, images, how))
    return [
        lambda: replace(images, overall=overall()),
        lambda: replace(settled(picture, images, how), overall=overall()),
    ]


def _noise(found: Correction) -> float:
    """Of the renderer, in parts of what it is to stay below, of the noisiest value."""
    tolerances = np.array([0.0 if q.tolerance is None else q.tolerance.half for q in found.quantities])
    noise, limit = found.sources[RENDERING], np.maximum(_QUIET * found.sigma, _OF_TOLERANCE * tolerances)
    known = np.isfinite(noise) & np.isfinite(found.sigma)
    return float((noise[known] / np.maximum(limit[known], np.finfo(float).tiny)).max(initial=0.0))


def _without_textures(scene: Scene) -> Scene:
    kept = tuple(each for each in scene.textures if each.kind != "statistical")
    return scene if kept == scene.textures else scene.tried(textures=kept)
