"""Effects that a scene's render leaves out: what each would change, and what it would cost."""

from __future__ import annotations

from importlib import import_module, util

from scenes import InvalidInput
from validate.campaign import Case
from validate.cost.knob import Knob

_CHECK = "validate.effects_check"


def effects_knob(case: Case, variant: str) -> Knob:
    """Influence on the noise-free distance and on its variance, against time, of each effect switched on alone.

    Raises
    ------
    InvalidInput
        If the renderer has no effects to choose, or is so slow that they would take longer than all other knobs.
    """
    if util.find_spec(_CHECK) is None:
        raise InvalidInput("effects must be known to the renderer, got a renderer that has none")
    if variant.startswith("scalar"):
        raise InvalidInput(f"effects must be timed in a compiled variant of Mitsuba, got {variant}")
    check = import_module(_CHECK)
    found = check.check(case.scene, settings=(case.setting,), only=check.RENDERED)
    rows = tuple(
        (s.name, s.seconds, s.seconds / s.seconds_auto, abs(s.bias_px), s.resolution_px, abs(s.variance),
         s.resolution_variance)
        for s in found
    )  # fmt: skip
    return Knob(
        name="effects",
        title="Effects that are left out: influence if switched on alone, against time",
        columns=("effect", "seconds", "x time", "change px", "+- px", "change of variance", "+- variance"),
        rows=rows,
        x="x time",
        y="change px",
        series="effect",
        note="+- : what the renderer's own scatter may contribute; a smaller change is none. "
        "`ice effects SCENE --check` shows all settings.",
    )
