"""The camera: its sensor and noise, its lens, its data sheet."""

from scenes.cameras.lens import Lens
from scenes.cameras.lens_model import LENSES, AnyLens, LensModel

__all__ = ["LENSES", "AnyLens", "Lens", "LensModel"]
