"""A number with its standard uncertainty: how a table ``{ value = 25, sd = 0.05 }`` stands beside a plain number."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from scenes.errors import describe
from scenes.model import Model
from scenes.numbers import ROOTS, number_at
from scenes.ranges import Coordinate, Spread

Distribution = Literal["normal", "rectangular", "triangular", "arcsine", "t"]
PER_HALF_WIDTH = {"rectangular": 3**-0.5, "triangular": 6**-0.5, "arcsine": 2**-0.5}
"""Standard uncertainty of a distribution over its half width (JCGM 100, 4.3)."""
_DISTORTION = "camera.lens.distortion"  # a number alone stands for the first of a row


class Uncertain(Model):
    """How well a number is known: ``sd``, its standard uncertainty, or ``half_width``, the limits on both sides.

    Examples
    --------
    >>> round(Uncertain(half_width=0.3).u, 4), Uncertain(sd=0.05).distribution_name
    (0.1732, 'normal')
    """

    value: Coordinate | None = None
    """The number itself; 0 for a deviation."""
    sd: Spread | None = None
    """Standard uncertainty, of the number's unit."""
    half_width: Spread | None = None
    """Largest deviation to either side, of the number's unit."""
    distribution: Distribution | None = None
    """normal with ``sd``, rectangular with ``half_width`` if left out."""
    dof: Annotated[float, Field(ge=0.01, le=1e12)] | None = None
    """Degrees of freedom of ``sd``; infinite if left out."""
    type: Literal["A", "B"] = "B"
    """A: evaluated from repeated observations; B: otherwise."""

    @model_validator(mode="after")
    def _one_size(self) -> Uncertain:
        if (self.sd is None) == (self.half_width is None):
            raise ValueError(f"sd or half_width must be given, got {'none' if self.sd is None else 'both'}")
        if self.half_width is not None and self.distribution_name not in PER_HALF_WIDTH:
            raise ValueError(
                f"distribution must be one of {', '.join(PER_HALF_WIDTH)} with half_width, got {self.distribution!r}"
            )
        if self.distribution_name == "t" and not (self.dof or 0) > 2:
            raise ValueError(f"dof must be above 2 with distribution 't', got {self.dof}")
        return self

    @property
    def distribution_name(self) -> Distribution:
        """The distribution, also where the default is meant."""
        return self.distribution or ("rectangular" if self.sd is None else "normal")

    @property
    def u(self) -> float:
        """Standard uncertainty (not variance), of the number's unit."""
        return self.sd if self.half_width is None else self.half_width * PER_HALF_WIDTH[self.distribution_name]


class UncertainNumber(Uncertain):
    """A number of the scene's camera, lights, material, noise or floor, and how well it is known."""

    key: Annotated[str, Field(max_length=200)]
    """Which, as error messages name it: ``camera.focal_px``, ``lights[1].distance``."""


def taken_out(data: dict[str, Any]) -> dict[str, Any]:
    """A scene's document with plain numbers, the tables that stood for some of them in its list ``uncertain``.

    Raises
    ------
    ValueError
        If such a table is none, or two are about the same number.

    Examples
    --------
    >>> plain = taken_out({"camera": {"focal_px": {"value": 800.0, "sd": 2.0}}})
    >>> plain["camera"], [each.key for each in plain["uncertain"]]
    ({'focal_px': 800.0}, ['camera.focal_px'])
    """
    found: list[UncertainNumber] = []
    plain = {key: _plain(value, key, found) if key in ROOTS else value for key, value in data.items()}
    if not found:
        return data
    given = data.get("uncertain", ())
    return {**plain, "uncertain": [*(given if isinstance(given, list | tuple) else [given]), *found]}


def _plain(value: Any, key: str, found: list[UncertainNumber]) -> Any:
    if isinstance(value, dict) and "value" in value:
        key = f"{key}[0]" if key == _DISTORTION else key
        try:
            told = UncertainNumber.model_validate({**value, "key": key})
        except ValidationError as error:
            raise ValueError(f"{key}.{describe(error)}") from None
        found.append(told.model_copy(update={"value": None}))  # the scene has it
        return value["value"]
    if isinstance(value, dict):
        return {name: _plain(inner, f"{key}.{name}", found) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner, f"{key}[{i}]", found) for i, inner in enumerate(value)]
    return value


def check_uncertain(scene: Any, numbers: tuple[UncertainNumber, ...]) -> None:
    """See that each is about a real number that the scene has, and no number twice.

    Raises
    ------
    ValueError
        If not.
    """
    keys = [each.key for each in numbers]
    for each in numbers:
        number_at(scene, each.key)
        if keys.count(each.key) > 1:
            raise ValueError(f"uncertain must have each key once, got {each.key!r} twice")
        if each.value is not None:
            raise ValueError(f"uncertain.value must be left out, for {each.key} says it, got {each.value:g}")
