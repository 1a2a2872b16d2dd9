"""The camera: its kinds, its sensor and noise, its lens, its data sheet."""

from typing import Annotated

from scenes.cameras.kinds import CAMERAS
from scenes.cameras.lens import Lens
from scenes.cameras.lens_model import LENSES, AnyLens, LensModel
from scenes.cameras.pinhole import Camera
from scenes.cameras.splined import Splined
from scenes.cameras.telecentric import Telecentric
from scenes.registry import OneOf

AnyCamera = Annotated[Camera, OneOf(CAMERAS, "pinhole")]

__all__ = ["CAMERAS", "LENSES", "AnyCamera", "AnyLens", "Camera", "Lens", "LensModel", "Splined", "Telecentric"]
