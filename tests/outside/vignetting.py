"""An effect of a user's own: natural vignetting, the fourth power of the cosine of the angle from the axis."""

import numpy as np

from imaging.features.projected_edges import projected_edges
from imaging.pictures import Pictures
from render.phenomena.base import EFFECTS, Effect, Influence
from scenes import Picture


class Vignetting(Effect):
    """Pixels aside of the axis get less light."""

    name = "vignetting"
    switch = "a factor on the rendered image"
    has_formula = False

    def absent(self, pictures: Pictures) -> str | None:
        return None

    def influence(self, pictures: Pictures) -> Influence:
        """Contrast and noise of an edge fall together; the variance rises at most as the least squared factor."""
        camera = pictures.scene.camera
        ends = projected_edges(pictures).recorded - (np.array([camera.width, camera.height]) - 1) / 2
        away2 = np.nanmax((ends**2).sum(-1), initial=0.0) / camera.focal_px**2
        return Influence(0.0, float((1 + away2) ** 4 - 1))

    def seen(self, levels: np.ndarray, picture: Picture) -> np.ndarray:
        camera, dark = picture.scene.camera, picture.scene.noise.dark_level
        y, x = (np.arange(n) - (n - 1) / 2 for n in levels.shape)
        return dark + (levels - dark) / (1 + (x**2 + y[:, None] ** 2) / camera.focal_px**2) ** 2


EFFECTS.add("vignetting")(Vignetting())
