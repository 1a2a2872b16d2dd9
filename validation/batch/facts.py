"""What a run file says of its run, checked: nobody knows who wrote the file."""

from __future__ import annotations

import json
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, TypeAdapter, ValidationError

from scenes.errors import describe
from scenes.files.door import check_bounded

_Strict = ConfigDict(strict=True)
_NotNegative = Annotated[FiniteFloat, Field(ge=0)]
_Images = Annotated[int, Field(ge=0, le=10_000_000)]


_Variance = Annotated[float, Field(ge=0)]  # 0 without noise
_FARTHEST = 1e12  # px


def _length(value: float) -> float:
    if abs(value) > _FARTHEST:  # NaN is none: nothing to be measured lies before the camera
        raise ValueError(f"a distance must be at most {_FARTHEST:g} px, got {value:g}")
    return value


_Length = Annotated[float, AfterValidator(_length)]


class _Correction(BaseModel):
    """A bias that is taken off, its standard uncertainty and that by the renderer's noise, which may be infinite."""

    model_config = _Strict

    bias: _Length
    u: _Variance
    noise: _Variance


class _Photos(BaseModel):
    """Which photographs, and whether the mean error is judged."""

    model_config = ConfigDict(strict=True, extra="forbid")

    files: str
    exact_poses: bool


class _Identity(BaseModel):
    """What the numbers depend on."""

    model_config = ConfigDict(strict=True, extra="forbid")

    campaign: dict[str, Any]
    files: dict[str, str] = {}
    seed: Annotated[int, Field(ge=0)]
    renders: Annotated[int, Field(ge=2, le=10_000_000)]
    chunk: int
    variant: str
    quality: dict[str, float | int | bool | None]
    effects: str
    tolerance: dict[str, float]
    versions: dict[str, str]
    code: str
    photos: _Photos | None = None


class _PredictedMeasurand(BaseModel):
    """The same of one measurand in the object."""

    model_config = _Strict

    name: Annotated[str, Field(max_length=1000)]
    kind: Annotated[str, Field(max_length=20)]
    unit: Annotated[str, Field(max_length=20)]
    value: _Length
    paper: _Variance
    calibrated: _Variance
    bound: _Variance
    predicted_bias: _Length
    texture: _Variance | None = None
    correction: _Correction | None = None


class _Predicted(BaseModel):
    """Predictions that need no image; variances may be infinite."""

    model_config = _Strict

    paper: _Variance
    calibrated: _Variance
    bound: _Variance
    value_px: _Length
    predicted_bias: _Length
    texture: _Variance | None = None
    corrections: dict[str, _Correction] = {}
    measurands: Annotated[list[_PredictedMeasurand], Field(min_length=1, max_length=1000)]


_Scalar = str | int | float | bool | None
_KINDS: dict[str, TypeAdapter] = {
    "identity": TypeAdapter(_Identity),
    "directory": TypeAdapter(Annotated[str, Field(max_length=10_000)], config=_Strict),
    "predicted": TypeAdapter(_Predicted),
    "seconds": TypeAdapter(dict[str, _NotNegative], config=_Strict),
    "wall": TypeAdapter(_NotNegative, config=_Strict),
    "workers": TypeAdapter(_Images, config=_Strict),
    "stages": TypeAdapter(list[list[_Images]], config=_Strict),
    "machines": TypeAdapter(Annotated[list[dict[str, _Scalar]], Field(max_length=1000)], config=_Strict),
    "effects": TypeAdapter(dict[str, list[dict[str, _Scalar]]], config=_Strict),
}


def read(kind: str, text: Any) -> Any:
    """A stored document of one kind.

    Raises
    ------
    ValueError
        If it is not what is stored there.
    """
    try:
        found = json.loads(text)
        check_bounded(found)
        _KINDS[kind].validate_python(found)
        return found
    except ValidationError as error:
        raise ValueError(f"{kind}: {describe(error)}") from None
    except (TypeError, RecursionError):
        raise ValueError(f"{kind} must be a document, got something else") from None
