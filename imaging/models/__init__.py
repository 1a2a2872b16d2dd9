"""Variance models: how precisely the measurand can be known in pictures, without an image of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, get_args

from imaging.models.bound import bound
from imaging.models.calibrated import calibrated
from imaging.models.errors import Errors
from imaging.models.paper import paper
from imaging.pictures import Pictures
from scenes import InvalidInput
from scenes.errors import given

ModelName = Literal["paper", "calibrated", "bound"]
DEFAULT_MODEL: ModelName = "calibrated"
_MODELS: dict[str, Callable[[Pictures], Errors]] = {"paper": paper, "calibrated": calibrated, "bound": bound}


def variance_model(name: str) -> Callable[[Pictures], Errors]:
    """The variance model of a name: a function of `Pictures`.

    Raises
    ------
    InvalidInput
        If there is no such model.
    """
    if not isinstance(name, str) or name not in _MODELS:
        raise InvalidInput(f"model must be one of {', '.join(get_args(ModelName))}, got {given(name)}")
    return _MODELS[name]
