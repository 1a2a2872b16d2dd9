"""How noise-free images are made that tell the bias of a picture."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import measure
import render
from imaging.light.appearance import is_plain
from render import EffectTolerance, Quality
from render import variant as variants
from render.build import MANY_WAYS
from render.gathered import is_gathered
from render.large import LARGE
from scenes import Picture, Scene
from validation.remeasured import Method

BETWEEN = "interreflection"
_DENSER = 2  # times more rays, each way, where single ones are random
_FEW = {"supersample": 2, "samples": 1, "edge_samples": 64, "random_samples": 16}  # rays
_ALIKE = {"samples": 1, "edge_samples": 16, "random_samples": 64, "alike": True, "gathered": False}
_FINE, _COARSE = 4, 2  # fine pixels a pixel, each way, of images that are compared, up to a megapixel and above


@dataclass(frozen=True)
class How:
    """How noise-free images are made: as `render.image` takes it, and whether where nothing is measured, too.

    ``predicted``: whether the closed form of the bias is that of whatever measures in them; ``readers``: the estimators
    that do, where they are known.
    """

    quality: Quality = Quality()
    variant: str | None = None
    effects: str = "auto"
    tolerance: EffectTolerance = EffectTolerance()
    everywhere: bool = False
    predicted: bool = False
    readers: tuple[str, ...] = ()

    def by(self, *methods: Method, of: Scene | None = None) -> How:
        """Everywhere, if one of the methods looks at more than the surroundings of what is measured in a scene."""
        kinds = [measure.ESTIMATORS[each.locator] for each in methods]
        kinds = kinds if of is None else [each.within(of) for each in kinds]
        return replace(
            self,
            everywhere=not all(each.local for each in kinds),
            predicted=all(each.bias_predicted for each in kinds),
            readers=tuple(sorted({each.locator for each in methods})),
        )

    def shared(self, picture: Picture) -> How:
        """That of all estimators whose images are the same ones: where the image model draws none."""
        return self if is_plain(picture.scene) else replace(self, predicted=False, readers=())

    @property
    def rough(self) -> How:
        """With few rays."""
        return replace(self, quality=replace(self.quality, **_FEW))

    def compared(self, picture: Picture) -> How:
        """With few rays, the same ones of all pictures from one place: their differences are told, not they.

        Beside an edge they have to tell where a shadow ends, which in a coarse grid moves in steps.
        """
        fine = _FINE if is_below(picture, LARGE) else _COARSE
        return replace(self, quality=replace(self.quality, supersample=fine, **_ALIKE))

    @property
    def finer(self) -> How:
        """With four times the rays where single ones are random."""
        return replace(self, quality=replace(self.quality, denser=_DENSER * self.quality.denser))

    @property
    def gathering(self) -> How:
        """With light between faces gathered, where that can be."""
        return replace(self, quality=replace(self.quality, gathered=True))

    def quieter(self, picture: Picture) -> How:
        """With light between faces gathered, or with four times the rays where it is not."""
        alone = self.active(picture) & MANY_WAYS == {BETWEEN}
        gathers = alone and self.by_pixel and not self.everywhere and is_gathered(picture.scene)
        return self.gathering if gathers else self.finer

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
        return self._rendered(picture, active - {BETWEEN}, 0)

    def _rendered(self, picture: Picture, effects: str | frozenset[str], seed: int) -> np.ndarray:
        quality = replace(self.quality, seed=self.quality.seed + seed, everywhere=self.everywhere)
        return render.image(picture, None, None, quality, self.variant, effects, self.tolerance)


def is_below(picture: Picture, pixels: int) -> bool:
    return picture.scene.camera.width * picture.scene.camera.height <= pixels
