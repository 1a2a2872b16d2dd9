"""The noise-free images that tell the bias of a picture: renders of other rays, and of what the scene is not sure of.

Reflectances change what light does between faces, and contrasts: each is rendered reflecting less, with few rays, and
subtracted from the same render of the scene as it is. In images above a megapixel, where that takes long, what one
material does is told by the render itself, less its direct light (`validation.dimmed`). Lights that stand elsewhere are
rendered so, too, in large images their direct light alone; of plain scenes the closed form of the bias tells what
lights do. Two renders that are compared have the same rays, one by one, or their difference would be noise; and what
makes a picture brighter or darker as a whole, which moves nothing, is not told by few rays but by the render itself.
All of them are made where something is measured (everywhere for estimators that look farther), and with few rays first:
where the noise of these is far below sigma or the tolerance, more rays would tell nothing. Where a bias is not known
well enough for its value to be `ok`, up to a megapixel, all of the picture is rendered with few rays, for it tells of
reflectances and lights itself (`measure.adjustment`); and where that does not do, more sets of rays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial

import numpy as np
from scipy.ndimage import binary_erosion

import measure
import render
from imaging.features.measurand import measurands
from imaging.light.appearance import is_plain
from imaging.models.bias import bias
from imaging.pictures import Pictures
from measure import Correction, Images
from measure.known_bias import RENDERING, TEXTURE
from measure.propagation import PropagatedValues
from measure.unevenness import Unevenness
from render import EffectTolerance, Quality
from render import variant as variants
from render.build import MANY_WAYS
from render.large import LARGE, LARGE_RANDOM, near_required
from scenes import Picture, Pose, Scene
from scenes.materials import Brdf
from scenes.status import CLUTTER, ILL_CONDITIONED, MISFIT, OK, is_trusted
from validation.dimmed import of_one_surface
from validation.remeasured import Method

REFLECTANCE, LIGHT = "reflectance", "light_place"
_BETWEEN = "interreflection"
_PAIR, _MOST = 2, 6  # renders of other rays; of an image whose pixels tell how noisy they are, a pair does
_ROUGH, _LEAST = 4, 3  # with few rays, with all: of others, for two often agree by chance
_OTHERS = 1000  # where the seeds of renders begin that are measured, beside those that tell their biases
_OTHERWISE = "isophote"  # where the default estimator does not tell which of two edges it is on
_SETS = 4  # of rays that tell what changes a bias that is not known well enough
_NOISY = 8  # pictures in which a texture is looked for
_QUIET, _OF_TOLERANCE = 0.1, 0.01  # parts of sigma, and of the tolerance, that the renderer's noise stays below
_FEW = {"supersample": 2, "samples": 1, "edge_samples": 64, "random_samples": 16}  # rays
_ALIKE = {"samples": 1, "edge_samples": 16, "random_samples": 64, "alike": True}
_OVERALL = {"supersample": 1, "samples": 1, "edge_samples": 4, "random_samples": 16}
_LEVELS = 64  # random samples of the image that a picture is compared with
_FINE, _COARSE = 4, 2  # fine pixels a pixel, each way, of images that are compared, up to a megapixel and above


@dataclass(frozen=True)
class How:
    """How noise-free images are made: as `render.image` takes it, and whether where nothing is measured, too.

    ``predicted``: whether the closed form of the bias is that of whatever measures in them.
    """

    quality: Quality = Quality()
    variant: str | None = None
    effects: str = "auto"
    tolerance: EffectTolerance = EffectTolerance()
    everywhere: bool = False
    predicted: bool = False

    def by(self, *methods: Method) -> How:
        """Everywhere, if one of the methods looks at more than the surroundings of what is measured."""
        kinds = [measure.ESTIMATORS[each.locator] for each in methods]
        return replace(
            self,
            everywhere=not all(each.local for each in kinds),
            predicted=all(each.bias_predicted for each in kinds),
        )

    @property
    def rough(self) -> How:
        """With few rays."""
        return replace(self, quality=replace(self.quality, **_FEW))

    def compared(self, picture: Picture) -> How:
        """With few rays, the same ones of all pictures from one place: their differences are told, not they.

        Beside an edge they have to tell where a shadow ends, which in a coarse grid moves in steps.
        """
        fine = _FINE if _is_below(picture, LARGE) else _COARSE
        return replace(self, quality=replace(self.quality, supersample=fine, **_ALIKE))

    @property
    def by_pixel(self) -> bool:
        """Whether rays are random pixel by pixel: in compiled variants all fine pixels share one table."""
        return (self.variant or variants.choose()).startswith("scalar")

    def image(self, picture: Picture, seed: int = 0) -> np.ndarray:
        """With rays of another seed, counted from the quality's."""
        return self._rendered(picture, self.effects, seed)

    def active(self, picture: Picture) -> frozenset[str]:
        """The effects that are simulated."""
        return render.choose(picture.scene, self.effects, self.tolerance, picture).active

    def direct(self, picture: Picture, active: frozenset[str]) -> np.ndarray:
        """Without light between faces."""
        return self._rendered(picture, active - {_BETWEEN}, 0)

    def _rendered(self, picture: Picture, effects: str | frozenset[str], seed: int) -> np.ndarray:
        quality = replace(self.quality, seed=self.quality.seed + seed, everywhere=self.everywhere)
        return render.image(picture, None, None, quality, self.variant, effects, self.tolerance)


def steadied(picture: Picture, image: np.ndarray, method: Method, how: How = How()) -> tuple[np.ndarray, ...]:
    """A noise-free image and renders of other rays, as many as make the noise of their mean a tenth of sigma; six at
    most.

    A camera's picture has no such noise, but what is measured in noisy copies of one render has an error of its own,
    which no number of copies averages out.
    """
    if not how.active(picture) & MANY_WAYS:
        return (image,)
    pair = image, how.image(picture, _OTHERS)
    found = measure.correction(Images(pair, by_pixel=how.by_pixel), picture, method.locator, method.threshold)
    known = np.isfinite(found.sigma) & (found.sigma > 0)  # what can be measured
    noise = np.sqrt(2) * found.sources[RENDERING][known] / (_QUIET * found.sigma[known])
    most = max(noise[np.isfinite(noise)], default=0.0)
    if most <= 1:
        return (image,)
    return (*pair, *(how.image(picture, _OTHERS + i) for i in range(1, min(math.ceil(most**2), _MOST) - 1)))


def mean_of(picture: Picture, renders: tuple[np.ndarray, ...]) -> np.ndarray:
    """The first of some renders, where something is measured their mean."""
    if len(renders) == 1:
        return renders[0]
    camera = picture.scene.camera
    near = near_required(picture, (slice(0, camera.height), slice(0, camera.width)), 1)
    inner = binary_erosion(near, iterations=math.ceil(4 * camera.most_blur_px) + 1, border_value=1)
    return np.where(inner, np.mean(renders, 0), renders[0])


def independent(
    picture: Picture,
    methods: tuple[Method, ...],
    measured: tuple[np.ndarray, ...],
    propagated: tuple[PropagatedValues, ...],
    how: How = How(),
) -> tuple[Correction, ...]:
    """Corrections by each method from as many renders of other rays as those whose mean's noisy copies are corrected.

    Parameters
    ----------
    measured : tuple of ndarray, shape (height, width)
        Those (`steadied`).
    propagated : tuple of PropagatedValues
        What `measure.propagate` says of their mean, by method.
    """
    how = how.by(*methods)
    others = tuple(how.image(picture, 1 + i) for i in range(len(measured)))
    images = _completed(picture, others, measured, how)
    more, found = [cache(each) for each in _more(picture, images, how)], []
    for each, told in zip(methods, propagated, strict=True):
        of = partial(_told_by, picture, each, told)
        found.append(_sure(picture, of(images), of, more))
    return tuple(found)


def _told_by(picture: Picture, method: Method, told: PropagatedValues, images: Images) -> Correction:
    return measure.correction(images, picture, method.locator, method.threshold, told)


def _sure(
    picture: Picture, found: Correction, of: Callable[[Images], Correction], more: Iterable[Callable[[], Images]]
) -> Correction:
    """A correction; where it does not know a bias well enough, up to a megapixel, that of more images."""
    for images in more if _is_below(picture, LARGE) else ():
        states = zip(found.status, np.isfinite(found.bias), strict=True)
        if not any(state == CLUTTER and known for state, known in states):
            break
        found = of(images())
    return found


def _more(picture: Picture, images: Images, how: How) -> list[Callable[[], Images]]:
    """What tells of inputs that these images do not know well enough, the quickest first."""
    overall = cache(partial(_overall, picture, images, how))
    return [
        lambda: replace(images, overall=overall()),
        lambda: replace(_settled(picture, images, how), overall=overall()),
    ]


def _overall(picture: Picture, images: Images, how: How) -> np.ndarray:
    """Images of all of a picture, as `measure.Images` has them, with what others of it have changed."""
    how, sets = replace(how, quality=replace(how.quality, **_OVERALL), everywhere=True), []
    changed = *_of_other_surfaces(picture), *(_with_lights_moved(picture) if LIGHT in images.changed else ())
    for seed in range(2):
        alike = replace(how, quality=replace(how.quality, alike=True, seed=how.quality.seed + seed))
        levels = replace(how, quality=replace(how.quality, random_samples=_LEVELS))
        sets.append([levels.image(picture, seed), *map(alike.image, (picture, *changed))])
    return np.array(sets)


def of_render(
    picture: Picture, method: Method, image: np.ndarray, propagated: PropagatedValues, how: How = How()
) -> Correction:
    """The correction that one render tells, where settings are compared: how noisy the render is, is left out."""
    how = how.by(method)
    images, none = _completed(picture, (image,), (), how), np.zeros(len(picture.scene.quantities))
    images = replace(images, known={**images.known, RENDERING: (none, none)})
    return measure.correction(images, picture, method.locator, method.threshold, propagated)


def simulated(picture: Picture, method: Method, how: How = How()) -> Correction:
    """The correction of a picture of a part whose statistical textures nobody knows, kept in this process.

    Where light takes random ways, four renders of few rays do, or two of a large image, if their noise is below a tenth
    of sigma or a hundredth of the tolerance; else of all rays, and renders of other rays are added until it is, six at
    most.
    """
    return _simulated(picture, method, how.by(method))


def best(picture: Picture, made: Callable[[Picture, Method], Correction] = simulated) -> Correction:
    """The correction of a picture by its default estimator; by isophotes where these tell values that it does not.

    Where two edges run together noise may decide which of them an edge point is on by one rule, and not by another:
    that a simulated picture tells, without an image. What ``made`` makes is a correction by one method.
    """
    found = made(picture, Method(measure.best_estimator(picture)))
    if ILL_CONDITIONED not in found.simulated:
        return found
    other = made(picture, Method(_OTHERWISE))
    return other if _trusted(other) > _trusted(found) else found


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
        clean = np.mean(renders, axis=0)
        return measure.propagate(clean, picture, estimator=method.locator, threshold=method.threshold).measurands

    images = None
    pair = how.by_pixel and not _is_below(picture, LARGE_RANDOM)  # a small one has few pixels, and is cheap
    if how.active(picture) & MANY_WAYS:
        few = tuple(how.rough.image(picture, seed) for seed in range(_PAIR if pair else _ROUGH))
        images, told = _completed(picture, few, (), how), propagated(few)
        of = partial(_told_by, picture, method, told)
        found = of(images)
        if _is_quiet(found):
            return _sure(picture, found, of, _more(picture, images, how)), told
    renders = tuple(how.image(picture, seed) for seed in range(_PAIR if pair else _LEAST))
    images = _rebased(images, renders) if images else _completed(picture, renders, (), how)
    told = propagated(renders)
    of = partial(_told_by, picture, method, told)
    found = of(images)
    while len(images.renders) < _MOST and not _is_quiet(found):
        images = replace(images, renders=(*images.renders, how.image(picture, len(images.renders))))
        found = of(images)
    return _sure(picture, found, of, _more(picture, images, how)), told


def _settled(picture: Picture, images: Images, how: How) -> Images:
    """With what is changed as the mean of several sets of rays.

    Rays that are the same in two pictures go the same ways only up to what is changed: where a light stands decides
    what of bounced light a ray finds, and so much noise is left in their difference, which counts as uncertainty.
    """
    seeded = (replace(how, quality=replace(how.quality, seed=how.quality.seed + k)) for k in range(1, _SETS))
    sets = [images.changed, *(_completed(picture, images.renders, images.beside, each).changed for each in seeded)]
    changed = {
        name: tuple(np.mean(same, axis=0) for same in zip(*(each[name] for each in sets), strict=True))
        for name in images.changed
    }
    return replace(images, changed=changed)


def _rebased(images: Images, renders: tuple[np.ndarray, ...]) -> Images:
    """With other renders; what is changed differs from the first of them by as much as before."""
    moved = {
        name: tuple(renders[0] + (each - images.renders[0]) for each in some) for name, some in images.changed.items()
    }
    return replace(images, renders=renders, changed=moved)


def _is_quiet(found: Correction) -> bool:
    tolerances = np.array([0.0 if q.tolerance is None else q.tolerance.half for q in found.quantities])
    limit = np.maximum(_QUIET * found.sigma, _OF_TOLERANCE * tolerances)
    noise = found.sources[RENDERING]
    return bool((noise <= limit)[np.isfinite(noise) & np.isfinite(found.sigma)].all())


def _without_textures(scene: Scene) -> Scene:
    kept = tuple(each for each in scene.textures if each.kind != "statistical")
    return scene if kept == scene.textures else scene.tried(textures=kept)


def _completed(
    picture: Picture,
    renders: tuple[np.ndarray, ...],
    beside: tuple[np.ndarray, ...],
    how: How,
) -> Images:
    """With the images, or numbers, of what the scene is not sure of."""
    first, known, alike, active = renders[0], _of_unknown_kinds(picture), how.compared(picture), how.active(picture)
    lines: dict[str, np.ndarray] = {}
    direct, whole, dimmed = cache(partial(alike.direct, active=active)), cache(alike.image), None
    if active & MANY_WAYS == {_BETWEEN} and not _is_below(picture, LARGE):
        dimmed = of_one_surface(picture, renders, partial(direct, picture), _u(picture.scene.uncertainty.reflectance))
    if dimmed is None:
        others = _steps(first, whole, _of_other_surfaces(picture), picture)
    changed = {REFLECTANCE: others if dimmed is None else (dimmed,)}
    in_closed_form = _light_in_closed_form(picture, how)
    if in_closed_form is not None:
        known |= {LIGHT: in_closed_form}
        lines = {LIGHT: _lines_by_lights(picture)}
    else:
        # bounced light takes four times as long in a large image, and changes u(light_place) by less than 0.1 sigma
        made = whole if _is_below(picture, LARGE) else direct
        changed[LIGHT] = _steps(first, made, _with_lights_moved(picture), picture)
    changed = {name: some for name, some in changed.items() if some}
    return Images(renders, changed, beside, known, lines, how.by_pixel)


def _is_below(picture: Picture, pixels: int) -> bool:
    return picture.scene.camera.width * picture.scene.camera.height <= pixels


def _steps(
    first: np.ndarray,
    made: Callable[[Picture], np.ndarray],
    others: Iterable[Picture],
    picture: Picture,
) -> tuple[np.ndarray, ...]:
    """The first render with what other pictures differ by from this one, both of the same random numbers."""
    changed, dark = [made(other) for other in others], picture.scene.noise.dark_level
    here = made(picture) if changed else first
    return tuple(_changed(first - dark, here - dark, other - dark) + dark for other in changed)


def _changed(first: np.ndarray, here: np.ndarray, other: np.ndarray) -> np.ndarray:
    """An image as another one differs from this one, ``here``, both of few rays; grey levels above darkness.

    Of the same picture with many rays, ``first``. Edges lie a little elsewhere in an image of few rays: what it says
    of all levels together is taken of the other image itself, or a light that is farther away would move them.
    """
    part = float((other * here).sum()) / max(float((here * here).sum()), np.finfo(float).tiny)
    return part * first + (other - part * here)


def _of_other_surfaces(picture: Picture) -> Iterator[Picture]:
    """The picture with each material, and the floor, reflecting less by its standard uncertainty.

    One material of one convex body is not among them: it changes nothing but the scale of brightness.
    """
    scene, part = picture.scene, _u(picture.scene.uncertainty.reflectance)
    if part == 0 or (is_plain(scene) and not scene.materials):
        return
    dimmed = scene.material.dimmed(part)
    if dimmed is not None:
        yield picture.with_scene(scene.tried(material=dimmed))
    if scene.bright_floor is not None:
        floor = scene.bright_floor.tried(reflectance=(1 - part) * scene.bright_floor.reflectance)
        yield picture.with_scene(scene.tried(floor=floor))
    for i, each in enumerate(scene.materials):
        dimmed = each.dimmed(part) if isinstance(each, Brdf) else None
        if dimmed is not None:
            yield picture.with_scene(scene.tried(materials=(*scene.materials[:i], dimmed, *scene.materials[i + 1 :])))


def _of_unknown_kinds(picture: Picture) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Infinite where a material that matters is of a kind that does not say how it reflects less."""
    scene = picture.scene
    used = (*scene.materials, *((scene.material,) if scene.materials or not is_plain(scene) else ()))
    if all(isinstance(each, Brdf) and each.dimmed(0.5) is not None for each in used):
        return {}
    unknown = np.full(len(picture.scene.quantities), np.inf)
    return {REFLECTANCE: (unknown, unknown)}


def _with_lights_moved(picture: Picture) -> Iterator[Picture]:
    """The picture with each light moved by its standard uncertainty: away, along the meridian, and across it."""
    u = _u(picture.scene.uncertainty.light_place)
    for i, light in enumerate(picture.scene.lights):
        if light.faces_sensor or u == 0:
            continue
        yield picture.with_scene(_with_light(picture.scene, i, light.tried(distance=(1 + u) * light.distance)))
        for pose in _beside(picture.lights[i], math.degrees(u)):
            yield replace(picture, lights=(*picture.lights[:i], pose, *picture.lights[i + 1 :]))


def _with_light(scene: Scene, which: int, light) -> Scene:
    if scene.light is not None:
        return scene.tried(light=light)
    several = scene.several_lights
    return scene.tried(several_lights=(*several[:which], light, *several[which + 1 :]))


def _beside(pose: Pose, step: float) -> Iterator[Pose]:
    """Poses a step away, degrees, along the meridian and across it."""
    yield Pose(pose.polar_deg + step if pose.polar_deg + step <= 180 else pose.polar_deg - step, pose.azimuth_deg)
    (p, a), s = np.radians(list(pose)), math.radians(step)
    here = np.array([math.sin(p) * math.cos(a), math.sin(p) * math.sin(a), math.cos(p)])
    x, y, z = math.cos(s) * here + math.sin(s) * np.array([-math.sin(a), math.cos(a), 0.0])
    yield Pose(math.degrees(math.atan2(math.hypot(x, y), z)), math.degrees(math.atan2(y, x)))


def _light_in_closed_form(picture: Picture, how: How) -> tuple[np.ndarray, np.ndarray] | None:
    """Standard uncertainties (M,) of the bias by lights' places, in the object and in the image.

    None where the closed form of the bias is another one's than that of what measures, or has no value.
    """
    if not (how.predicted and is_plain(picture.scene)):
        return None
    here, found = bias(Pictures.of(picture)), []
    for other in _with_lights_moved(picture):
        moved = bias(Pictures.of(other))
        found.append((moved.values_object - here.values_object, moved.values - here.values))
    squares = np.square(found).sum(0) if found else np.zeros((2, len(picture.scene.quantities)))
    return tuple(np.sqrt(squares.reshape(2, -1))) if np.isfinite(squares).all() else None


def _lines_by_lights(picture: Picture) -> np.ndarray:
    """What each light's place moves lines by, (k, q), in closed form; circles by nothing."""
    here, known, rows = bias(Pictures.of(picture)), measurands(Pictures.of(picture)), []
    lengths = np.linalg.norm(known.seen.along, axis=-1)
    for other in _with_lights_moved(picture):
        start, stop = np.moveaxis(bias(Pictures.of(other)).lines - here.lines, -1, 0)
        rows.append(np.zeros(known.seen.count))
        rows[-1][: 2 * len(lengths)] = np.stack([start, (stop - start) / lengths], -1).ravel()
    return np.array(rows).reshape(-1, known.seen.count)


def _u(told) -> float:
    return 0.0 if told is None else told.u
