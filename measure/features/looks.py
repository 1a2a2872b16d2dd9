"""Levels that the scene shows beside edges, where more than the part's own lit faces may be seen there.

Faces that get light from other faces alone, prints, a floor, shadows upon it, obstacles: what an estimator takes for
even may be none of it. Rays of the camera tell, as a pinhole sees it: levels, with shadows and with light between
surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from imaging.geometry.lens import image_centre
from imaging.light.behind import seen_at
from imaging.pictures import Pictures
from imaging.sensor import recorded


@dataclass(frozen=True, eq=False)
class Looks:
    """What one picture of known lights shows, moved as its layout is.

    Attributes
    ----------
    pictures : Pictures
        The one.
    turn : ndarray, shape (2, 2)
        Rotation from places where they are expected to where they are taken to be.
    shift : ndarray, shape (2,)
        Added then, ideal px.
    """

    pictures: Pictures
    turn: np.ndarray
    shift: np.ndarray

    @classmethod
    def of(cls, pictures: Pictures) -> Looks:
        """Where everything is where it is expected."""
        return cls(pictures, np.eye(2), np.zeros(2))

    def moved(self, turn: np.ndarray, shift: np.ndarray) -> Looks:
        """With all places turned and then shifted."""
        return replace(self, turn=turn @ self.turn, shift=turn @ self.shift + shift)

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """Recorded grey levels at places (n, 2), ideal px."""
        scene, seen = self.pictures.scene, (places - self.shift) @ self.turn
        found = seen_at(self.pictures, seen - image_centre(scene.camera))
        return recorded(scene.noise, scene.noise.dark_level + found).level
