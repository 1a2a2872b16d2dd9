"""What simulates a bias is shown: noise-free images of a picture, each made once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np

from measure import Images
from scenes import Picture
from validation.simulation.how import How
from validation.simulation.images import completed, is_random, of_all, settled


class Shown:
    """Noise-free images of a picture, each made when it is first asked for: estimators that read them share them.

    ``first``: those that are there, with what the scene is not sure of.
    """

    def __init__(self, picture: Picture, how: How, first: Images | None = None) -> None:
        self.picture, self.how, self._first = picture, how, first
        self.image = cache(partial(how.image, picture))
        self.rough = cache(partial(how.rough.image, picture))
        self._overall = cache(lambda: of_all(picture, self._first, how))
        self._settled = cache(lambda: settled(picture, self._first, how).changed)

    def images(self, renders: tuple[np.ndarray, ...]) -> Images:
        """Renders, with images of what the scene is not sure of: made beside the first that are asked for."""
        if self._first is None:
            self._first = completed(self.picture, renders, (), self.how)
        return replace(self._first, renders=renders)

    def more_telling(self, images: Images) -> list[Callable[[], Images]]:
        """What tells of inputs that images do not know well enough, the quickest first."""
        more = [lambda: replace(images, overall=self._overall())]
        if is_random(self.picture, self.how):
            more.append(lambda: replace(images, changed=self._settled(), overall=self._overall()))
        return more
