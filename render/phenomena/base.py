"""What an effect is: when it can matter, how much, what it costs, and the scene without it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from imaging.pictures import Pictures
from scenes import Brdf, InvalidInput, Luminaire, Picture, Scene
from scenes.registry import Registry

SAFETY = 2.0  # estimates are of first order; twice them is taken as the bound


class Influence(NamedTuple):
    """Estimated bounds of what an effect does to the measured distance; the largest over the settings asked for.

    ``bias_px`` is the change of its mean, px, and ``variance`` the relative change of its variance. Infinite where a
    required edge would be wrong altogether.
    """

    bias_px: float
    variance: float


NOTHING = Influence(0.0, 0.0)
EVERYTHING = Influence(float("inf"), float("inf"))


@dataclass(frozen=True)
class EffectTolerance:
    """What may be left out: at most this change of the mean (px) and this relative change of the variance."""

    bias_px: float = 0.005
    variance: float = 0.02

    def __post_init__(self) -> None:
        for name in ("bias_px", "variance"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InvalidInput(f"tolerance {name} must be at least 0, got {value!r}")

    def exceeded_by(self, influence: Influence) -> bool:
        """Whether an influence is too large to be left out."""
        return influence.bias_px > self.bias_px or influence.variance > self.variance


class Effect(ABC):
    """One effect.

    Attributes
    ----------
    name : str
    cost : float
        Time of a render with this effect alone over that without, compiled variant, about (measured by ``ice effects
        --check``). 1 is free: it is then never left out where it can matter.
    random : bool
        Whether single rays become random, so that all pixels need more of them; several such effects share the rays,
        and what the costliest costs is paid once.
    has_formula : bool
        Whether the planner predicts it, or could. What has none is known from a rendered picture only.
    switch : str
        How it is simulated.
    """

    name: ClassVar[str]
    cost: ClassVar[float] = 1.0
    random: ClassVar[bool] = False
    has_formula: ClassVar[bool] = True
    switch: ClassVar[str]

    def absent(self, pictures: Pictures) -> str | None:
        """Why the effect is exactly zero; None where it can matter, as everywhere where nothing else is said."""
        return None

    @abstractmethod
    def influence(self, pictures: Pictures) -> Influence:
        """Bound of the influence; only asked for where the effect can matter."""

    def without(self, scene: Scene) -> Scene:
        """The scene with the effect's parts neutral."""
        return scene

    def seen(self, levels: np.ndarray, picture: Picture) -> np.ndarray:
        """What it makes of a rendered image (height, width), grey levels, ``noise.dark_level`` in darkness.

        For an effect that no part of the scene and no ray simulates.
        """
        return levels


EFFECTS: Registry[Effect] = Registry("effect")


def changed(scene: Scene, part: str, **values) -> Scene:
    """The scene with values of one part (``camera``, ``light``, ...) replaced."""
    return scene.model_copy(update={part: getattr(scene, part).model_copy(update=values)})


def relit(scene: Scene, change: Callable[[Luminaire], Luminaire]) -> Scene:
    """The scene with each of its lights replaced by what ``change`` makes of it."""
    return scene.lit_by(*map(change, scene.lights))


def with_materials(scene: Scene, change: Callable[[Brdf], Brdf]) -> Scene:
    """The scene with all its materials changed."""
    others = tuple(map(change, scene.materials))
    return scene.model_copy(update={"material": change(scene.material), "materials": others})


def largest(bias: np.ndarray, variance: np.ndarray) -> Influence:
    """Bound over settings, with the safety factor; what is not a number counts as infinite."""
    finite = (np.nan_to_num(part, nan=np.inf, posinf=np.inf) for part in (bias, variance))
    return Influence(*(SAFETY * float(part.max()) for part in finite))
