"""The whole picture without the renderer: one convex body before darkness, and a board beside it, exactly blurred."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from imaging.blurred.arrangement import arrangement_of
from imaging.blurred.board import add_board
from imaging.blurred.model import BlurredModel
from imaging.light.appearance import is_plain
from imaging.pictures import Pictures
from scenes import InvalidInput, Picture, Scene

_NONE = np.empty(0, int)
_AT_ONCE = 1 << 18  # pixels, which bounds the memory


def image(scene: Scene | Picture, sensor: Any = None, light: Any = None, where: np.ndarray | None = None) -> np.ndarray:
    """Noise-free grey levels, as `render.image` has them, from the image model alone.

    Parameters
    ----------
    scene : Scene or Picture
        One convex body before darkness, without textures.
    sensor, light : Pose or pair of float
        Degrees; left out for a picture.
    where : ndarray of bool, shape (height, width), optional
        Pixels that are drawn, a board beside the part apart; the others are dark. All when not given.

    Returns
    -------
    ndarray of float64, shape (height, width)
        Darkness included, not cut off at the end of the scale.

    Raises
    ------
    InvalidInput
        If the scene is another one, or it is not known where its lights stand.

    Examples
    --------
    >>> import scenes
    >>> image(scenes.load("task1"), (30, 135), (15, 315)).shape
    (240, 256)
    """
    picture = Picture.of(scene, sensor, light)
    check_drawable(picture.scene)
    if not picture.lights:
        raise InvalidInput("light must be given, got none")
    camera = picture.scene.camera
    found = np.zeros((camera.height, camera.width))
    drawn = np.ones(found.shape, bool) if where is None else where
    rows = max(_AT_ONCE // camera.width, 1)
    for top in range(0, camera.height, rows):
        y, x = np.nonzero(drawn[top : top + rows])
        if x.size:
            found[y + top, x] = signal_at(Pictures.of(picture), x, y + top)
    add_board(found, Pictures.of(picture))
    return found + picture.scene.noise.dark_level


def signal_at(pictures: Pictures, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Signal above darkness at pixels (P,) of one picture, grey levels."""
    arrangement = arrangement_of(pictures)
    if not len(arrangement.pieces):  # no light falls on what is seen
        return np.zeros(x.size)
    known = tuple(replace(region, order=0) for region in arrangement.regions)  # as the light gives it, and no other
    model = BlurredModel(replace(arrangement, regions=known), x, y, _NONE)
    return model.image(model.start())


def is_drawable(scene: Scene) -> bool:
    """Whether `image` knows such scenes."""
    return is_plain(scene) and not scene.textures


def check_drawable(scene: Scene) -> None:
    """See that `image` knows such scenes.

    Raises
    ------
    InvalidInput
        If not.
    """
    if is_drawable(scene):
        return
    if is_plain(scene):
        raise InvalidInput("scene must be without textures, got some")
    raise InvalidInput("scene must be one convex body before darkness, got one in which things hide or shade others")
