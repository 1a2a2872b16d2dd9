"""All parameters of a scene, one after another."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import render
from render import variant as variants
from scenes import InvalidInput
from validation.batch.campaign import Campaign
from validation.cost.effects import effects_parameter
from validation.cost.grid import grid_parameter
from validation.cost.locators import estimators_parameter
from validation.cost.model import CostModel
from validation.cost.parameter import Parameter
from validation.cost.pareto import pareto_parameter
from validation.cost.points import points_parameter
from validation.cost.rays import rays_parameter
from validation.cost.sampling import images_parameter
from validation.cost.scaling import scaling_parameter
from validation.cost.size import size_parameter
from validation.cost.trial import spread_cases, trial
from validation.defaults import DEFAULT_SEED

_STEPS = 10  # the trial and nine parameters
_SETTINGS = 2  # of the parameters that render


@dataclass(frozen=True)
class Sweep:
    """What `sweep` has measured; ``omitted`` tells which parameters could not be, and why."""

    scene: str
    model: CostModel
    parameters: tuple[Parameter, ...]
    omitted: dict[str, str]
    seconds: float

    def to_json(self) -> dict[str, Any]:
        return {
            "scene": self.scene,
            "model": asdict(self.model),
            "parameters": {parameter.name: parameter.to_json() for parameter in self.parameters},
            "omitted": self.omitted,
            "seconds": self.seconds,
        }


def sweep(campaign: Campaign, seed: int = DEFAULT_SEED, report: Callable[[str, int, int], None] | None = None) -> Sweep:
    """Measure each parameter of a scene on this machine.

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
    makers: dict[str, Callable[[], Parameter]] = {
        "rays": lambda: rays_parameter(cases, variant),
        "images": lambda: images_parameter(cases[0], images[0], seed),
        "estimators": lambda: estimators_parameter(cases, images, seed),
        "points": lambda: points_parameter(cases[0]),
        "grid": lambda: grid_parameter(campaign.scenes[0]),
        "size": lambda: size_parameter(cases[0], variant, seed),
        "effects": lambda: effects_parameter(cases[0], variant),
        "scaling": lambda: scaling_parameter(model),
        "pareto": lambda: pareto_parameter(model),
    }
    parameters, omitted = [], {}
    for done, (name, make) in enumerate(makers.items(), 1):
        tell(name, done, _STEPS)
        try:
            parameters.append(make())
        except InvalidInput as error:
            omitted[name] = str(error)
    tell("done", _STEPS, _STEPS)
    return Sweep(campaign.name, model, tuple(parameters), omitted, time.perf_counter() - began)
