"""Which effects would be simulated at a state, and why."""

from __future__ import annotations

from typing import Any

import render
from scenes import Scene
from validation.explore.state import State


def effects(scene: Scene, state: State) -> list[dict[str, Any]]:
    """One row an effect: name, whether it is on, and the reason in words."""
    here = scene.model_copy(update={"settings": (state.setting,)})
    return [{"name": each.effect.name, "on": each.on, "reason": each.reason} for each in render.effects(here)]
