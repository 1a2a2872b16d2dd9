"""All parameters of a scene, one after another."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import render
from render import variant as variants
from scenes import InvalidInput
from validation.batch.campaign import Campaign
from validation.batch.options import RunOptions
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
from validation.cost.watch import Watch
from validation.defaults import DEFAULT_SEED

BUDGET = 120.0  # seconds
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


def sweep(
    campaign: Campaign,
    seed: int = DEFAULT_SEED,
    report: Callable[[str, int, int], None] | None = None,
    budget: float = BUDGET,
) -> Sweep:
    """Measure each parameter of a scene on this machine.

    Parameters
    ----------
    campaign : Campaign
    seed : int
        Of the noise.
    report : callable, optional
        As report(what, done, total); called every few seconds.
    budget : float
        Seconds, about: fewer samples are taken of a slow scene, and parameters that need some are left out once it is
        over.

    Raises
    ------
    InvalidInput
        If no setting of the scene can be measured.
    """
    whole, tell = Watch(budget), report or (lambda *_: None)
    tell("trial", 0, _STEPS)
    model = trial(campaign, RunOptions(seed), report=lambda *_: tell("trial", 0, _STEPS), watch=Watch(budget / 3))
    variant, spread = variants.choose(), spread_cases(campaign, 2 * _SETTINGS)
    cases = spread[1::2] or spread
    images = [render.image(c.scene, c.setting.sensor, c.setting.light, variant=variant) for c in cases]
    wanted: dict[str, Callable[[], Parameter]] = {
        "scaling": lambda: scaling_parameter(model),
        "pareto": lambda: pareto_parameter(model),
        "points": lambda: points_parameter(cases[0]),
        "images": lambda: images_parameter(cases[0], images[0], seed, share()),
        "estimators": lambda: estimators_parameter(cases, images, seed, share()),
        "rays": lambda: rays_parameter(cases, variant, share()),
        "size": lambda: size_parameter(cases[0], variant, seed, share()),
        "effects": lambda: effects_parameter(cases[0], variant, share()),
        "grid": lambda: grid_parameter(campaign.scenes[0], share()),
    }
    parameters, omitted = [], {}
    for done, (name, make) in enumerate(wanted.items(), 1):
        share = partial(_share, whole, _STEPS - done, partial(tell, name, done, _STEPS))
        try:
            parameters.append(make())
        except InvalidInput as error:
            omitted[name] = str(error)
    tell("done", _STEPS, _STEPS)
    return Sweep(campaign.name, model, tuple(parameters), omitted, time.perf_counter() - whole.began)


def _share(whole: Watch, left: int, tell: Callable[[], None]) -> Watch:
    """The time of the next of so many parameters that are left.

    Raises
    ------
    InvalidInput
        If there is none.
    """
    tell()
    if whole.left <= 0:
        raise InvalidInput(f"--budget must be longer for it, got {whole.seconds:g} s")
    return Watch(whole.left / left, tell)
