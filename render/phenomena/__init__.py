"""Which effects a scene calls for: each with the reason, its estimated influence on the distance, and its cost."""

from render.phenomena.base import Effect, Influence, Tolerance
from render.phenomena.register import EFFECTS, Choice, Decision, choose, effects, named

__all__ = ["EFFECTS", "Choice", "Decision", "Effect", "Influence", "Tolerance", "choose", "effects", "named"]
