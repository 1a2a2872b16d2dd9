"""The noise-free image of a scene from one sensor pose under one light pose, by Mitsuba."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from imaging.geometry.lens import recorded
from imaging.geometry.projection import project_ideal
from imaging.light.backlight import backlights
from render import variant as variants
from render.board import board_window, is_board
from render.fine import defocus, fine_image
from render.optics import blur_and_bin, lens_alone
from render.parts import parts, within_cone
from render.phenomena import EFFECTS, EffectTolerance, choose
from render.phenomena.register import DIMMED
from render.precision import check_precision
from render.quality import Quality
from scenes import InvalidInput, Picture, Scene


def image(
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    quality: Quality = Quality(),
    variant: str | None = None,
    effects: str | Iterable[str] = "auto",
    tolerance: EffectTolerance = EffectTolerance(),
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
    tolerance : EffectTolerance
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
    picture, camera = picture.with_scene(chosen.scene), chosen.scene.camera
    levels = np.full((camera.height, camera.width), chosen.scene.noise.dark_level)
    which, beside = variant or variants.choose(), board_window(picture)
    where = window(picture)
    if levels[where].size:
        levels[where] += _seen(picture, chosen.active, where, quality, which)
    if beside is not None:
        there = is_board(picture, beside)
        dark = chosen.scene.noise.dark_level
        levels[beside][there] = dark + _seen(picture, chosen.active, beside, quality, which, evenly=True)[there]
    for name in sorted(chosen.active):
        levels = EFFECTS[name].seen(levels, picture)
    return levels


def _seen(
    picture: Picture,
    active: frozenset[str],
    where: tuple[slice, slice],
    quality: Quality,
    which: str,
    *,
    evenly: bool = False,
) -> np.ndarray:
    """Signal in rows and columns of the image, before what effects add to recorded levels."""
    check_precision(picture.scene.camera)
    k = quality.supersample
    crop = tuple(slice(part.start * k, part.stop * k) for part in where)
    start, found = (crop[1].start, crop[0].start), np.zeros(1)
    for part in parts(picture.with_scene(DIMMED.without(picture.scene)), active):  # rays know of no lens
        fine = fine_image(part, crop, quality, which, evenly=evenly)
        if part.silhouette:
            fine = np.where(within_cone(part.picture, crop, k), fine, 0.0)
        found = found + blur_and_bin(fine, lens_alone(picture.scene), k, start)
    return found


def window(picture: Picture) -> tuple[slice, slice]:
    """Rows and columns of the image that have to be rendered: what object and blur can reach, all with a background."""
    scene, camera = picture.scene, picture.scene.camera
    corners = project_ideal(scene.bodies.vertices, np.array(list(picture.sensor)), camera)
    corners = np.concatenate([corners, recorded(corners, camera)])
    if np.isnan(corners).any() or scene.floor is not None or backlights(scene):
        return slice(0, camera.height), slice(0, camera.width)
    margin = 2 + 6 * camera.most_blur_px + defocus(picture)
    low, high = np.floor(corners.min(0) - margin), np.ceil(corners.max(0) + margin + 1)
    (left, top), (right, bottom) = (
        np.clip(edge, 0, [camera.width, camera.height]).astype(int).tolist() for edge in (low, high)
    )
    return slice(top, bottom), slice(left, right)
