"""Which effects a scene calls for: each with the reason, its estimated influence on the distance, and its cost."""

from render.phenomena.base import Effect, EffectTolerance, Influence
from render.phenomena.register import EFFECTS, ChosenEffects, Decision, choose, effects, named

__all__ = [
    "EFFECTS",
    "ChosenEffects",
    "Decision",
    "Effect",
    "EffectTolerance",
    "Influence",
    "choose",
    "effects",
    "named",
]
