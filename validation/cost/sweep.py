"""All knobs of a scene, one after another."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import render
from render import variant as variants
from scenes import InvalidInput
from validation.batch.campaign import Campaign
from validation.cost.effects import effects_knob
from validation.cost.grid import grid_knob
from validation.cost.locators import estimators_knob
from validation.cost.model import CostModel
from validation.cost.parameter import Knob
from validation.cost.pareto import pareto_knob
from validation.cost.points import points_knob
from validation.cost.rays import rays_knob
from validation.cost.sampling import images_knob
from validation.cost.scaling import scaling_knob
from validation.cost.size import size_knob
from validation.cost.trial import spread_cases, trial

_STEPS = 10  # the trial and nine knobs
_SETTINGS = 2  # of the knobs that render


@dataclass(frozen=True)
class Survey:
    """What `survey` has measured; ``omitted`` tells which knobs could not be, and why."""

    scene: str
    model: CostModel
    knobs: tuple[Knob, ...]
    omitted: dict[str, str]
    seconds: float

    def to_json(self) -> dict[str, Any]:
        return {
            "scene": self.scene,
            "model": asdict(self.model),
            "knobs": {knob.name: knob.to_json() for knob in self.knobs},
            "omitted": self.omitted,
            "seconds": self.seconds,
        }


def survey(campaign: Campaign, seed: int = 1, report: Callable[[str, int, int], None] | None = None) -> Survey:
    """Measure each knob of a scene on this machine.

    Raises
    ------
    InvalidInput
        If no setting of the scene can be measured.
    """
    began, tell = time.perf_counter(), report or (lambda *_: None)
    tell("trial", 0, _STEPS)
    model = trial(campaign, seed)
    variant, cases = variants.choose(), spread_cases(campaign, 2 * _SETTINGS)[1::2]
    images = [render.image(c.scene, c.setting.sensor, c.setting.light, variant=variant) for c in cases]
    makers: dict[str, Callable[[], Knob]] = {
        "rays": lambda: rays_knob(cases, variant),
        "images": lambda: images_knob(cases[0], images[0], seed),
        "estimators": lambda: estimators_knob(cases, images, seed),
        "points": lambda: points_knob(cases[0]),
        "grid": lambda: grid_knob(campaign.scenes[0]),
        "size": lambda: size_knob(cases[0], variant, seed),
        "effects": lambda: effects_knob(cases[0], variant),
        "scaling": lambda: scaling_knob(model),
        "pareto": lambda: pareto_knob(model),
    }
    knobs, omitted = [], {}
    for done, (name, make) in enumerate(makers.items(), 1):
        tell(name, done, _STEPS)
        try:
            knobs.append(make())
        except InvalidInput as error:
            omitted[name] = str(error)
    tell("done", _STEPS, _STEPS)
    return Survey(campaign.name, model, tuple(knobs), omitted, time.perf_counter() - began)
