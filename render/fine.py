"""The image of one part's light in fine pixels, before lens and pixel aperture: which rays go where.

One ray a fine pixel shows where brightness steps; the fine pixels that an edge crosses get many. Where single rays are
random (interreflection, an aperture, a light of some size), all that something is measured from get many.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from imaging.geometry.blur import confusion
from imaging.geometry.projection import depth
from imaging.light.appearance import is_plain
from render import gathered
from render import variant as variants
from render.adaptive import bent, crossed, dilated, refine
from render.between import edges_of, lent_to
from render.build import CUSTOM, MANY_WAYS, description, textured, view
from render.even import Even, fine_of, some_of
from render.gathered import Gathering
from render.large import Counts, Renders, bounced, fine_pixels, is_large, whole_pixels
from render.modelled import Modelled
from render.mosaic import Tiles
from render.parts import Part
from render.quality import Quality
from render.rays import AT_ONCE, LARGE_AT_ONCE, SURFACES, Rays
from render.sight import Sight
from render.texture import Face
from scenes import Picture

_STEEP = 3  # pixels about an edge in which light that one of its faces sends to the other is not even over a pixel
_NEAR = 16  # rays of a fine pixel beside an edge, where what is random is faint


def fine_image(
    part: Part, crop: tuple[slice, slice], quality: Quality, variant: str, *, evenly: bool = False
) -> np.ndarray:
    """Image of a part's fine pixels.

    Parameters
    ----------
    part : Part
    crop : tuple of slice
        Rows and columns of fine pixels.
    quality : Quality
    variant : str
        Mitsuba variant.
    evenly : bool
        Whether all edges get the same rays, also in large images, whatever is measured.

    Returns
    -------
    ndarray of float, shape of the crop
        Grey levels above the black level.
    """
    tracer = _Tracer(part, crop, quality, variants.use(variant), variant.startswith("scalar"))
    return tracer.large() if tracer.is_large and not evenly else tracer.small()


def defocus(picture: Picture) -> float:
    """Radius of the largest circle of confusion, px."""
    camera = picture.scene.camera
    away = depth(picture.scene.bodies.vertices, np.array(list(picture.sensor)), camera)
    return float(confusion(camera, np.maximum(away, 1e-3 * camera.distance)).max())


def _even(part: Part) -> bool:
    """Whether no place sees less of a light of some size than its horizon leaves: one convex body before darkness."""
    return part.active & MANY_WAYS == {"light_size"} and is_plain(part.picture.scene) and not part.silhouette


def _quiet(part: Part, sharp: frozenset[str]) -> bool:
    """Whether what is random about the rays is but a small part of the light: on curved parts, what faces send to each
    other, and what a backlight sends round them."""
    picture = part.picture
    round_the_part = picture.scene.lights[0].faces_sensor
    return (
        bool(picture.scene.solid.curved)
        and not part.silhouette
        and (round_the_part or part.active - sharp == {"interreflection"})
    )


@dataclass(frozen=True, eq=False)
class _Tracer:
    """Rays of one part's fine pixels.

    Attributes
    ----------
    part : Part
    crop : tuple of slice
        Rows and columns of fine pixels.
    quality : Quality
    mitsuba : module
        With the variant set.
    scalar : bool
        Whether that traces rays one by one.
    """

    part: Part
    crop: tuple[slice, slice]
    quality: Quality
    mitsuba: Any
    scalar: bool

    @property
    def picture(self) -> Picture:
        return self.part.picture

    @property
    def start(self) -> tuple[int, int]:
        """First row and column of the crop."""
        return self.crop[0].start, self.crop[1].start

    @property
    def sharp(self) -> frozenset[str]:
        """Effects whose single rays are not random."""
        return self.part.active - MANY_WAYS

    @cached_property
    def textures(self) -> tuple[tuple[Face, ...], ...] | None:
        custom = self.scalar and self.part.active & CUSTOM and not self.part.silhouette
        return textured(self.picture, self.sharp) if custom or _even(self.part) else None

    @cached_property
    def active(self) -> frozenset[str]:
        """Effects that are traced: a light of some size that all see alike is in the textures."""
        return self.sharp if self.textures is not None and _even(self.part) else self.part.active

    @property
    def random(self) -> bool:
        """Whether single rays are random."""
        return self.sharp != self.active

    @cached_property
    def quiet(self) -> bool:
        return self.scalar and _quiet(self.part, self.sharp)

    @property
    def many(self) -> int:
        """Rays of a fine pixel that an edge crosses."""
        interpreted = self.scalar and self.active & CUSTOM and (self.textures is None or self.random)
        plain = self.scalar and (self.textures is None or not self.active & CUSTOM)
        rays = self.quality.edge_samples or (16 if interpreted else 64 if plain else 256)
        return rays * self.quality.denser**2 if self.random else rays

    @property
    def ordinary(self) -> int:
        """Rays of a fine pixel where they are not random."""
        scene = self.picture.scene
        even_faces = not scene.textures and not (scene.solid.curved and not self.random)
        return self.quality.samples or (1 if self.scalar and even_faces else 4)

    @property
    def few(self) -> int:
        """Rays of a fine pixel where they are random and no edge crosses it."""
        return (self.quality.random_samples or (4 if self.quiet else 16)) * self.quality.denser**2

    @property
    def near(self) -> int:
        """The same of one that something is measured from."""
        if not self.quality.everywhere or is_large(self.crop, self.quality.supersample, random=True):
            return self.few
        return min(_NEAR * self.quality.denser**2, self.many) if self.quiet else self.many

    @cached_property
    def gathering(self) -> Gathering | None:
        """What adds light that met more surfaces than rays follow."""
        between = self.active - self.sharp == {"interreflection"} and not self.part.silhouette
        asked = self.quality.gathered and self.scalar and between and not self.quality.everywhere
        return Gathering.of(self.mitsuba, self.part.reduced(self.active).picture) if asked else None

    @property
    def is_large(self) -> bool:
        """Whether not all fine pixels are rendered: there are many, or each needs many rays."""
        return self.random or self.modelled is not None or is_large(self.crop, self.quality.supersample)

    @cached_property
    def modelled(self) -> Modelled | None:
        """What tells direct light where pictures are compared by what is measured in them; None where rays do."""
        compared = self.scalar and self.quality.alike and not self.quality.everywhere
        if not compared or self.part.silhouette or self.active - self.sharp - {"interreflection"}:
            return None
        start, width = self.start, self.crop[1].stop - self.crop[1].start
        return Modelled.of(self.picture, self.quality.supersample, start, width)

    def rays(self, active: frozenset[str]) -> Rays:
        """Of a compiled variant, with some effects."""
        bounces = SURFACES - 1 if "interreflection" in active else 0
        at_once = LARGE_AT_ONCE if self.is_large else AT_ONCE
        most, quality = max(self.few, self.many), self.quality
        return Rays(
            self.mitsuba, quality.supersample, most, bounces, quality.seed, at_once, self.part.silhouette, self._sighted
        )

    @cached_property
    def _sighted(self) -> Callable[[tuple[int, int], Any, Any], Any] | None:
        """Rays of a telecentric camera."""
        sight = Sight.of(self.picture, self.active, self.quality.supersample)
        return None if sight is None else lambda shape, place, pair: sight.rays(self.mitsuba, place, self.crop, pair)

    def film(self, divided: int = 1) -> tuple[tuple[int, int], tuple[slice, slice]]:
        """Width and height of the whole frame, and the crop, in pixels of so many fine ones each way."""
        camera, k = self.picture.scene.camera, self.quality.supersample // divided
        return (camera.width * k, camera.height * k), whole_pixels(self.crop, divided)

    def load(self, active, samples: int, textures=None, divided: int = 1, shown: Picture | None = None) -> Any:
        """Scene of Mitsuba with some effects."""
        part = Part(shown or self.picture, self.part.active, self.part.silhouette).reduced(active)
        met = SURFACES if self.gathering is None else gathered.SURFACES
        made = description(self.mitsuba, part, *self.film(divided), samples, textures, met)
        return self.mitsuba.load_dict(made, parallel=False)

    def rendered(self, loaded: Any, active, rays: int, divided: int = 1) -> np.ndarray:
        """Image of all its pixels."""
        sight = Sight.of(self.picture, active, self.quality.supersample // divided)
        if sight is None or sight.is_parallel:
            return np.array(self.mitsuba.render(loaded, seed=self.quality.seed), dtype=float)[:, :, 0]
        pixels = np.zeros(tuple(part.stop - part.start for part in self.film(divided)[1]))
        everywhere = np.ones(pixels.shape, bool)
        if not self.scalar:
            return refine(loaded, self.rays(active), pixels, everywhere, rays)
        tiles = replace(self._tiles(loaded, active, rays, divided), roughly=True)
        return tiles.rendered(pixels, everywhere, rays, (self.quality.seed, 3))

    def again(self, loaded: Any, active, fine: np.ndarray, marked: np.ndarray, rays: int) -> np.ndarray:
        """The image with marked fine pixels rendered again; in scalar variants also what turns out to be crossed."""
        if not self.scalar:
            return refine(loaded, self.rays(active), fine, marked, rays)
        return self._tiles(loaded, active, rays).refined(fine, marked, rays, self.quality.seed)

    def again_alone(self, loaded: Any, active, fine: np.ndarray, marked: np.ndarray, rays: int) -> np.ndarray:
        """The image with marked fine pixels rendered again, and no others."""
        if not self.scalar:
            return refine(loaded, self.rays(active), fine, marked, rays)
        return self._tiles(loaded, active, rays).rendered(fine, marked, rays, (self.quality.seed, 0))

    def _tiles(self, loaded: Any, active, rays: int, divided: int = 1, sampler: str | None = None) -> Tiles:
        """Of fine pixels, in scalar variants."""
        size, crop = self.film(divided)
        seen = view(self.mitsuba, self.picture, active, size, crop, rays)
        seen |= {"sampler": {"type": sampler or "multijitter"}}
        if self.quality.alike and sampler is None and divided == 1 and "light_size" not in active:
            # a grid: of the faces of a light, or ways from face to face, it would find a few alone
            seen["sampler"] = {"type": "stratified", "jitter": False}
        sight = Sight.of(self.picture, active, self.quality.supersample // divided)
        gathering = self.gathering if "interreflection" in active else None
        if gathering is not None:
            seen["film"] |= {"pixel_format": "rgb"}
        return Tiles(self.mitsuba, loaded, seen, (crop[0].start, crop[1].start), sight, gathering=gathering)

    def whole(self, random: bool, count: int, where: np.ndarray | None = None) -> np.ndarray:
        """Image of whole pixels, with or without random rays; of a mask of them, 0 beside it."""
        active, textures = (self.active, None) if random else (self.sharp, self.textures)
        loaded, k = self.load(active, count, textures, self.quality.supersample), self.quality.supersample
        if self.scalar and where is None:
            return self.rendered(loaded, active, count, k)
        pixels = np.zeros(tuple(part.stop - part.start for part in self.film(k)[1]))
        where = np.ones(pixels.shape, bool) if where is None else where
        if self.scalar:
            return self._tiles(loaded, active, count, k).rendered(pixels, where, count, (self.quality.seed, 4))
        return refine(loaded, self.rays(active), pixels, where, count)

    def _bounced(self) -> Callable[[np.ndarray, np.ndarray, int], np.ndarray]:
        """What makes light between surfaces where pictures are compared: patches without noise, or random rays."""
        k = self.quality.supersample
        if self.modelled is not None and self.modelled.tells_between:
            return lambda near, *_: self.modelled.between(fine_of(near, k), 1)
        return lambda *asked: fine_of(bounced(self.with_less_without, *asked), k)

    def with_less_without(self, near: np.ndarray, count: int) -> np.ndarray:
        """What surfaces send to each other: with it less without it, of the same rays; whole pixels."""
        pixels, count = np.zeros(near.shape), 1 << math.ceil(math.log2(count))

        def with_effects(active) -> np.ndarray:
            loaded = self.load(active, count, None, self.quality.supersample)
            tiles = self._tiles(loaded, active, count, self.quality.supersample, "ldsampler")
            return tiles.rendered(pixels.copy(), near, count, (self.quality.seed, 2))

        return with_effects(self.active) - with_effects(self.sharp)

    def large(self) -> np.ndarray:
        """Image of which fine pixels are rendered only near edges."""
        picture, k = self.picture, self.quality.supersample
        between = self.active - self.sharp == {"interreflection"}
        apart, plane = self.scalar and self.quality.alike, not (picture.scene.solid.curved or self.part.silhouette)
        again = {random: self._again(random) for random in {False, self.random}}
        renders = Renders(
            self.whole,
            lambda random, *what: again[random](*what),
            k,
            self.random,
            self.quality.everywhere,
            self._bounced() if apart and between else None,
            self._even() if between and plane else None,
            self.quality.alike,
        )
        counts = Counts(self.ordinary, self.few, self.near, self.many)
        return fine_pixels(picture, self.crop, renders, math.ceil(k * defocus(picture)), counts)

    def _again(self, random: bool) -> Callable[[np.ndarray, np.ndarray, int], np.ndarray]:
        """What renders marked fine pixels again, with or without the effects of random rays."""
        if random:
            return partial(self.again_alone, self.load(self.active, self.few), self.active)
        if self.modelled is not None:
            return self.modelled.rendered
        return partial(self.again_alone, self.load(self.sharp, self.ordinary, self.textures), self.sharp)

    def _even(self) -> Even:
        """Where light that plane faces send to each other may be seen, in whole pixels, and where it is even."""
        k, shape = self.quality.supersample, tuple(part.stop - part.start for part in self.crop)
        first = tuple(part.start for part in self.film(k)[1])
        every = np.ones(len(self.picture.scene.bodies.normals), bool)

        def uneven() -> np.ndarray:
            if self.picture.scene.textures:
                return np.ones([size // k for size in shape], bool)
            edges = dilated(edges_of(self.picture, every, shape, self.start, k, creases=True), 3)
            return dilated(some_of(edges, k), 2 * _STEEP + 1)

        return Even(lambda marked: lent_to(self.picture, marked, first, 1), uneven)

    def small(self) -> np.ndarray:
        """Image of which all fine pixels are rendered, and those that an edge crosses again."""
        loaded = self.load(self.sharp, self.ordinary, self.textures)
        fine = self.rendered(loaded, self.sharp, self.ordinary)
        marked = self._crossed(fine)
        if self.random:
            loaded = self.load(self.active, self.few)
            fine = self.again_alone(loaded, self.active, fine, np.ones_like(marked), self.few)
        return self.again(loaded, self.active, fine, marked, self.many)

    def _crossed(self, fine: np.ndarray) -> np.ndarray:
        """Fine pixels that an edge crosses, as a mask; textures, bilinear, need no more rays and do not count."""
        scene, away = self.picture.scene, math.ceil(self.quality.supersample * defocus(self.picture))
        even = fine
        if scene.textures:
            bare = self.picture.with_scene(scene.model_copy(update={"textures": ()}))
            plain = textured(bare, self.sharp) if self.textures is not None else None
            even = self.rendered(self.load(self.sharp, 1, plain, shown=bare), self.sharp, 1)
        marked = crossed(even, away)
        if scene.solid.curved and not away:
            marked &= bent(even)  # their shading slopes more than a plane face's
        return marked
