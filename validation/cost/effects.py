"""Effects that a scene's render leaves out: what each would change, and what it would cost."""

from __future__ import annotations

from scenes import InvalidInput
from validation.batch.campaign import Case
from validation.cost.parameter import Parameter
from validation.cost.watch import Watch
from validation.effects_check import RENDERED, check


def effects_parameter(case: Case, variant: str, watch: Watch = Watch()) -> Parameter:
    """Influence on the noise-free distance and on its variance, against time, of each effect switched on alone.

    Raises
    ------
    InvalidInput
        If the renderer is so slow that they would take longer than all other parameters.
    """
    if variant.startswith("scalar"):
        raise InvalidInput(f"effects must be timed in a compiled variant of Mitsuba, got {variant}")
    found = []
    for number in watch.samples(len(RENDERED), least=1):
        found += check(case.scene, settings=(case.setting,), only=RENDERED[number : number + 1])
    rows = tuple(
        (s.name, s.seconds, s.seconds / s.seconds_auto, abs(s.bias_px), s.resolution_px, abs(s.variance),
         s.resolution_variance)
        for s in found
    )  # fmt: skip
    return Parameter(
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
