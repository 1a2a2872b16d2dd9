"""Pictures of simulated stations, whose inputs are drawn."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from imaging.blurred.arrangement import arrangement_of
from imaging.blurred.board import add_board
from imaging.blurred.model import BlurredModel
from imaging.geometry.lens import undistorted
from imaging.light.appearance import is_plain
from planner.budgeting.station import Station
from scenes import InvalidInput


def clean_image(station: Station) -> np.ndarray:
    """The noise-free picture of a station, shape (height, width), grey levels, by the closed form of plain scenes.

    Vertices lie exactly where the station records them; along bent edges the middle of a lens that is off counts as
    centred. What a tilt of the part does to its brightness is left out.

    Raises
    ------
    InvalidInput
        If things hide or shade each other in the scene, or it is not alone before darkness.
    """
    scene = station.scene
    if not is_plain(scene):
        raise InvalidInput(f"scene must be one convex body before darkness for simulated pictures, got {scene.name}")
    camera = scene.camera
    there = arrangement_of(station.pictures)
    there = replace(there, vertices=undistorted(station.record(scene.bodies.vertices), camera))
    y, x = (part.ravel() for part in np.mgrid[: camera.height, : camera.width])
    model = BlurredModel(there, x, y, np.arange(0))
    image = model.image(model.start()).reshape(camera.height, camera.width) + scene.noise.dark_level
    add_board(image, station.pictures, lambda points: undistorted(station.record(station.board_at(points)), camera))
    return image


def exposed(stations: Iterable[Station], rng: np.random.Generator) -> np.ndarray:
    """One noisy picture of each station, whose sensor has a fixed pattern of its own, shape (n, height, width)."""
    from render.sensor import expose

    images = []
    for station in stations:
        noise = station.scene.noise.model_copy(update={"pattern_seed": int(rng.integers(2**31))})
        images.append(expose(clean_image(station), noise, rng, 1)[0])
    return np.stack(images)
