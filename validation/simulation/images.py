"""Images, beside renders of a picture, of what its scene is not sure of.

Reflectances change what light does between faces, and contrasts: each is rendered reflecting less and, up to a
megapixel, more, with few rays, and half of one subtracted from the other, for between faces that light each other a
step more does more than one less. By how much both lie off the straight line counts as an input of its own: an error's
square is one on the mean, in standard uncertainties. In images above a megapixel, where that takes long, what one
material does is told by the render itself, less its direct light (`dimmed`). Lights that stand elsewhere are rendered
so, too, both ways and as far as they may stand, for a shadow may reach an edge from there alone; in large images their
direct light. Of plain scenes the closed form of the bias tells what lights do, or images of the image model do, where
that draws the render itself.
Renders that are compared have the same rays, one by one, or their difference would be noise; and what makes a picture
brighter or darker as a whole, which moves nothing, is not told by few rays but by the render itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np
from scipy import sparse

import measure
from imaging.blurred.whole import image as drawn
from imaging.blurred.whole import is_drawable
from imaging.colour import seen
from imaging.models.inputs import Moved, both_ways, u_of
from measure import Images
from render import modelled
from render.build import MANY_WAYS
from render.large import LARGE
from render.surroundings import near_required
from scenes import Picture
from validation.simulation.dimmed import of_one_surface
from validation.simulation.how import BETWEEN, How, is_below
from validation.simulation.inputs import LIGHT, REFLECTANCE, light_in_closed_form, lines_by_lights, of_unknown_kinds

_SETS = 4  # of rays that tell what changes a bias that is not known well enough
_OVERALL = {"supersample": 1, "samples": 1, "edge_samples": 4, "random_samples": 16}
_DRAWN = 0.1  # of a pixel's noise: nearer to a render, the image model tells what a light elsewhere does
_LEVELS = 64  # random samples of the image that a picture is compared with


def completed(
    picture: Picture,
    renders: tuple[np.ndarray, ...],
    beside: tuple[np.ndarray, ...],
    how: How,
) -> Images:
    """With the images, or numbers, of what the scene is not sure of."""
    first, known, alike, active = renders[0], of_unknown_kinds(picture), how.compared(picture), how.active(picture)
    lines: dict[str, np.ndarray] = {}
    every = tuple(both_ways(picture))
    surfaces, lights = ([each for each in every if each.of_surfaces is which] for which in (True, False))
    direct, whole, dimmed = cache(partial(alike.direct, active=active)), cache(alike.image), None
    if active & MANY_WAYS == {BETWEEN} and not is_below(picture, LARGE):
        dimmed = of_one_surface(picture, renders, partial(direct, picture), u_of(picture.scene.uncertainty.reflectance))
    if dimmed is not None:
        changed = {REFLECTANCE: dimmed}
    elif is_below(picture, LARGE):
        changed = {REFLECTANCE: _both_ways(first, whole, surfaces, picture)}
    else:
        changed = {REFLECTANCE: _steps(first, whole, [each.one for each in surfaces], picture)}
    in_closed_form = light_in_closed_form(picture, how)
    if in_closed_form is not None:
        known |= {LIGHT: in_closed_form}
        lines = {LIGHT: lines_by_lights(picture)}
    else:
        # bounced light takes four times as long in a large image, and changes u(light_place) by less than 0.1 sigma
        drawing = cache(partial(drawn, where=_read(picture, how)))
        rendered = whole if is_below(picture, LARGE) else direct
        made = drawing if _is_drawn(picture, first, drawing) else rendered
        changed[LIGHT] = _both_ways(first, made, lights, picture)
    modelled.forget()
    changed = {name: some for name, some in changed.items() if some.shape[0]}
    return Images(renders, changed, beside, known, lines, how.by_pixel)


def _read(picture: Picture, how: How) -> np.ndarray | None:
    """The pixels that are read of a drawn image, as a mask; None where it is not known by what, or none is drawn."""
    known = how.readers and is_drawable(picture.scene)
    return measure.region_of_interest(picture, estimators=how.readers) if known else None


def _is_drawn(picture: Picture, render: np.ndarray, drawing: Callable[[Picture], np.ndarray]) -> bool:
    """Whether the image model draws a render, near what is measured, far below the noise of a pixel, rms."""
    if not is_drawable(picture.scene):
        return False
    near = near_required(picture, (slice(0, render.shape[0]), slice(0, render.shape[1])), 1)
    squares = np.square(drawing(picture) - render) / seen(picture.scene.noise, render).noise_variance
    return bool(near.any()) and float(squares[near].mean()) < _DRAWN**2


def of_all(picture: Picture, images: Images, how: How) -> np.ndarray:
    """Images of all of a picture, as `measure.Images` has them, with what others of it have changed."""
    how, sets = replace(how, quality=replace(how.quality, **_OVERALL), everywhere=True), []
    moved = [each for each in both_ways(picture) if each.of_surfaces or LIGHT in images.changed]
    for seed in range(2):
        alike = replace(how, quality=replace(how.quality, alike=True, seed=how.quality.seed + seed))
        levels = replace(how, quality=replace(how.quality, random_samples=_LEVELS))
        here = alike.image(picture)
        steps = (here + (alike.image(one) - alike.image(other)) / (2 * times) for one, other, times, _ in moved)
        told = (image for step in steps for image in (step, here))  # of what is bent no block is asked
        sets.append([levels.image(picture, seed), here, *told])
    return np.array(sets)


def is_random(picture: Picture, how: How) -> bool:
    """Whether rays that are compared have noise: they have none where the image model tells all light."""
    return how.everywhere or not (how.by_pixel and modelled.is_told(picture, how.active(picture)))


def settled(picture: Picture, images: Images, how: How) -> Images:
    """With what is changed as the mean of several sets of rays.

    Rays that are the same in two pictures go the same ways only up to what is changed: where a light stands decides
    what of bounced light a ray finds, and so much noise is left in their difference, which counts as uncertainty.
    """
    seeded = (replace(how, quality=replace(how.quality, seed=how.quality.seed + k)) for k in range(1, _SETS))
    sets = [images.changed, *(completed(picture, images.renders, images.beside, each).changed for each in seeded)]
    return replace(images, changed={name: sum(each[name] for each in sets) / len(sets) for name in images.changed})


def _both_ways(
    first: np.ndarray, made: Callable[[Picture], np.ndarray], moved: Sequence[Moved], picture: Picture
) -> sparse.csr_array:
    """For each input what it does to the first render on the straight line, and what both ways lie off it, (2 k, N)."""
    steps = _steps(first, made, [way for each in moved for way in (each.one, each.other)], picture)
    one, other = steps[::2], steps[1::2]
    order = np.arange(steps.shape[0]).reshape(2, -1).T.ravel()
    times = np.repeat([each.times for each in moved], 2)[:, None]
    return sparse.csr_array(sparse.vstack([one - other, one + other], format="csr")[order] / (2 * times))


def _steps(
    first: np.ndarray, made: Callable[[Picture], np.ndarray], others: Iterable[Picture], picture: Picture
) -> sparse.csr_array:
    """By how much other pictures differ from this one, all of the same random numbers, (k, N), in the first render.

    Most of a large image is dark where nothing is measured, and only the rest of it is read.
    """
    dark, here = picture.scene.noise.dark_level, cache(partial(made, picture))
    rows = [_moved(first, here, made(other), dark) for other in others]
    return sparse.vstack([*rows, sparse.csr_array((0, first.size))], format="csr")


def _moved(first: np.ndarray, here: Callable[[], np.ndarray], other: np.ndarray, dark: float) -> sparse.csr_array:
    """By how much an image differs from that of the picture itself, ``here``, both of few rays, (1, N); grey levels.

    In the render of many rays, ``first``. Edges lie a little elsewhere in an image of few rays: what it says of all
    levels together is taken of the other image itself, or a light that is farther away would move them.
    """
    lit = np.flatnonzero((first != dark) | (here() != dark) | (other != dark))
    levels, before, after = (image.ravel()[lit] - dark for image in (first, here(), other))
    part = float(after @ before) / max(float(before @ before), np.finfo(float).tiny)
    change = (part - 1) * levels + (after - part * before)
    return sparse.csr_array((change, lit, [0, lit.size]), (1, first.size))
