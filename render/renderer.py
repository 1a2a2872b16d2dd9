"""The noise-free image of a scene from one sensor pose under one light pose, by Mitsuba."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.geometry.lens import confusion, recorded
from imaging.geometry.projection import depth, project_ideal
from imaging.light.appearance import is_plain
from imaging.light.backlight import backlights
from render import variant as variants
from render.adaptive import bent, crossed, near_edges, refine
from render.between import lent_to
from render.build import CUSTOM, MANY_WAYS, description, textured, view
from render.large import Renders, fine_pixels, is_large, whole_pixels
from render.mosaic import mosaic, refine_tiles
from render.optics import blur_and_bin
from render.parts import Part, parts, within_cone
from render.phenomena import EFFECTS, Tolerance, choose
from render.precision import check_precision
from render.rays import AT_ONCE, LARGE_AT_ONCE, SURFACES, Rays
from scenes import InvalidInput, Picture, Scene

_NEAR = 16  # rays of a fine pixel beside an edge, where what is random is faint


@dataclass(frozen=True)
class Quality:
    """What the clean image's accuracy costs.

    Attributes
    ----------
    supersample : int
        Fine pixels that divide a pixel, each way.
    samples : int, optional
        Rays a fine pixel, a square number; 4 in compiled variants and 1 in scalar ones when not given.
    edge_samples : int, optional
        Rays of a fine pixel that an edge crosses, a square number; 256 when not given, but in scalar variants 64 for a
        diffuse surface, and 16 for the paper's reflectance where it has no texture (`render.texture`) and runs as
        interpreted Python, some 40 times slower. Where single rays are random all pixels that the task's edges are
        located from get as many; of curved parts whose random light is faint, in scalar variants, 16.
    random_samples : int, optional
        Rays of every other fine pixel where a single ray is random wherever it hits (interreflection, an aperture, a
        light of finite size), a square number; 16 when not given, 4 in scalar variants where that light is faint.
    seed : int
    everywhere : bool
        Whether pixels that nothing is measured by are seen as well as the others. If not, they are dark or, where light
        takes random ways, have the direct light alone: for images that are measured and not looked at.
    alike : bool
        Whether whatever is rendered from one place has the same rays, in scalar variants: of fine pixels that an edge
        crosses they stand in a grid, and what surfaces send to each other is rendered apart, in whole pixels, and added
        to the direct light. For the difference of two images, which few rays tell; an image itself is off by some
        tenths of a standard deviation.

    On Task1's 16 settings, eight seeds, a scalar variant's lines lie within 0.00024 px (rms; 0.0007 at most) of the
    exact image's and its distances within 0.0008 px (0.0025), for 0.15 s of one core a setting; with 256 rays its
    distances lie within 0.0003 px (0.0006).
    """

    supersample: int = 4
    samples: int | None = None
    edge_samples: int | None = None
    random_samples: int | None = None
    seed: int = 0
    everywhere: bool = True
    alike: bool = False

    def __post_init__(self) -> None:
        if self.supersample < 1:
            raise InvalidInput(f"supersample must be at least 1, got {self.supersample}")
        for name in ("samples", "edge_samples", "random_samples"):
            value = getattr(self, name)
            if value is not None and (value < 1 or math.isqrt(value) ** 2 != value):
                raise InvalidInput(f"{name} must be a square number, got {value}")


def image(
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    quality: Quality = Quality(),
    variant: str | None = None,
    effects: str | Iterable[str] = "auto",
    tolerance: Tolerance = Tolerance(),
) -> np.ndarray:
    """Noise-free image.

    Parameters
    ----------
    scene : Scene or Picture
    sensor, light : Pose or pair of float
        Polar angle and azimuth, degrees; not with a picture, which has its own.
    quality : Quality
        Rays a pixel.
    variant : str, optional
        Mitsuba variant; `render.variant.choose()` when not given.
    effects : {"auto", "all"} or iterable of str
        Which effects to simulate: those whose estimated influence exceeds the tolerance, every one, or the named ones
        (see `render.effects`).
    tolerance : Tolerance
        What ``auto`` may leave out.

    Returns
    -------
    ndarray of float64, shape (height, width)
        Grey levels, darkness at the black level. Without a floor only the part that the object covers is rendered; the
        rest is dark. The same seed gives the same image, bit by bit, for the same variant.

    Raises
    ------
    InvalidInput
        If a pose stands in or on the object, an effect is unknown, or the focal length is too long.
    """
    picture = Picture.of(scene, sensor, light)
    if not picture.lights:
        raise InvalidInput("light must be a pose, got nothing")
    chosen = choose(picture.scene, effects, tolerance, picture)
    picture, camera, k = picture.with_scene(chosen.scene), chosen.scene.camera, quality.supersample
    levels = np.full((camera.height, camera.width), chosen.scene.noise.dark_level)
    rows, columns = window(picture)
    if levels[rows, columns].size:
        check_precision(camera)
        crop = tuple(slice(part.start * k, part.stop * k) for part in (rows, columns))
        which, start = variant or variants.choose(), (crop[1].start, crop[0].start)
        for part in parts(picture, chosen.active):
            fine = _fine(part, crop, quality, which)
            if part.silhouette:
                fine = np.where(within_cone(part.picture, crop, k), fine, 0.0)
            levels[rows, columns] += blur_and_bin(fine, camera, k, start)
    for name in sorted(chosen.active):
        levels = EFFECTS[name].seen(levels, picture)
    return levels


def window(picture: Picture) -> tuple[slice, slice]:
    """Rows and columns of the image that have to be rendered: what object and blur can reach, all with a background."""
    scene, camera = picture.scene, picture.scene.camera
    corners = project_ideal(scene.bodies.vertices, np.array(list(picture.sensor)), camera)
    corners = np.concatenate([corners, recorded(corners, camera)])
    if np.isnan(corners).any() or scene.floor is not None or backlights(scene):
        return slice(0, camera.height), slice(0, camera.width)
    margin = 2 + 6 * camera.blur_px + _defocus(picture)
    low, high = np.floor(corners.min(0) - margin), np.ceil(corners.max(0) + margin + 1)
    (left, top), (right, bottom) = (
        np.clip(edge, 0, [camera.width, camera.height]).astype(int).tolist() for edge in (low, high)
    )
    return slice(top, bottom), slice(left, right)


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


def _defocus(picture: Picture) -> float:
    """Radius of the largest circle of confusion, px."""
    camera = picture.scene.camera
    away = depth(picture.scene.bodies.vertices, np.array(list(picture.sensor)), camera)
    return float(confusion(camera, np.maximum(away, 1e-3 * camera.distance)).max())


def _fine(part: Part, crop, quality: Quality, variant: str) -> np.ndarray:
    """Image of fine pixels, before lens and pixel aperture."""
    picture, active = part.picture, part.active
    camera = picture.scene.camera
    mitsuba, scalar, k = variants.use(variant), variant.startswith("scalar"), quality.supersample
    size, sharp = (camera.width * k, camera.height * k), active - MANY_WAYS
    smooth = _even(part)
    textures = textured(picture, sharp) if smooth or (scalar and active & CUSTOM and not part.silhouette) else None
    if textures is not None and smooth:
        active = sharp
    interpreted = scalar and bool(active & CUSTOM) and (textures is None or sharp != active)
    plain, quiet = scalar and (textures is None or not active & CUSTOM), scalar and _quiet(part, sharp)
    many = quality.edge_samples or (16 if interpreted else 64 if plain else 256)
    even_faces = not picture.scene.textures and not (picture.scene.solid.curved and sharp == active)
    samples = quality.samples or (1 if scalar and even_faces else 4)

    few = quality.random_samples or (4 if quiet else 16)
    bounces = SURFACES - 1 if "interreflection" in active else 0
    large = is_large(crop, k, sharp != active) or (sharp != active and not quality.everywhere)
    at_once = LARGE_AT_ONCE if large else AT_ONCE
    rays = Rays(mitsuba, k, max(few, many), bounces, quality.seed, at_once, part.silhouette)

    def load(active, samples, textures=None, divided=1, shown=picture):
        film = tuple(n // divided for n in size), whole_pixels(crop, divided)
        made = description(mitsuba, Part(shown, part.active, part.silhouette).reduced(active), *film, samples, textures)
        return mitsuba.load_dict(made, parallel=False)

    def rendered(loaded) -> np.ndarray:
        return np.array(mitsuba.render(loaded, seed=quality.seed), dtype=float)[:, :, 0]

    def again(loaded, active, fine, marked, rays_each, tiles=refine_tiles, seed=quality.seed) -> np.ndarray:
        if not scalar:
            return refine(loaded, rays, fine, marked, rays_each)
        seen, start = view(mitsuba, picture, active, size, crop, rays_each), (crop[0].start, crop[1].start)
        seen["sampler"] = {"type": "stratified", "jitter": False} if quality.alike else {"type": "multijitter"}
        return tiles(mitsuba, loaded, seen, start, fine, marked, rays_each, seed)

    def whole(active, count, textures) -> np.ndarray:
        loaded = load(active, count, textures, k)
        if scalar:
            return rendered(loaded)
        pixels = np.zeros(tuple((part.stop - part.start) // k for part in crop))
        return refine(loaded, rays, pixels, np.ones(pixels.shape, bool), count)

    def bounced(near, count) -> np.ndarray:
        """What surfaces send to each other: with it less without it, of the same rays; whole pixels."""
        pixels, count, found = np.zeros(near.shape), 1 << math.ceil(math.log2(count)), []
        film = tuple(n // k for n in size), whole_pixels(crop, k)
        for each in (active, sharp):
            loaded = load(each, count, None, k)
            seen = view(mitsuba, picture, each, *film, count) | {"sampler": {"type": "ldsampler"}}
            start = tuple(part.start for part in film[1])
            found.append(mosaic(mitsuba, loaded, seen, start, pixels.copy(), near, count, (quality.seed, 2)))
        return found[0] - found[1]

    if large:
        between = active - sharp == {"interreflection"}
        apart, plane = scalar and quality.alike and between, not (picture.scene.solid.curved or part.silhouette)
        start = crop[0].start, crop[1].start
        scenes_ = {False: (load(sharp, samples, textures), sharp), True: (load(active, few), active)}
        renders = Renders(
            lambda random, count: whole(scenes_[random][1], count, None if random else textures),
            lambda random, *what: again(*scenes_[random], *what, mosaic, (quality.seed, 0)),
            k, sharp != active, quality.everywhere, bounced if apart else None,
            (lambda marked: lent_to(picture, marked, start, k)) if between and plane else None,
        )  # fmt: skip
        return fine_pixels(picture, crop, renders, math.ceil(k * _defocus(picture)), (samples, few, many))
    loaded = load(sharp, samples, textures)
    fine = rendered(loaded)
    even = fine
    if picture.scene.textures:  # bilinear, so they need no more rays: edges are sought without them
        bare = picture.with_scene(picture.scene.model_copy(update={"textures": ()}))
        plain = textured(bare, sharp) if textures is not None else None
        even = rendered(load(sharp, 1, plain, shown=bare))
    away = math.ceil(k * _defocus(picture))
    marked = crossed(even, away)
    if picture.scene.solid.curved and not away:
        marked &= bent(even)  # their shading slopes more than a plane face's
    if sharp != active:
        loaded = load(active, few)
        near = near_edges(picture, crop, k)
        fine = rendered(loaded) if scalar else refine(loaded, rays, fine, np.ones_like(marked), few)
        if quiet:
            fine = again(loaded, active, fine, near & ~marked, min(_NEAR, many))
        else:
            marked |= near
    return again(loaded, active, fine, marked, many)
