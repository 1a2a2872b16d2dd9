"""Two runs of the same settings: which of them differ by more than chance?"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator
from scipy import stats

from scenes import InvalidInput
from scenes.errors import describe
from scenes.files.door import read_json

_MOST = 1_000_000_000  # images of a setting


class _Judged(BaseModel):
    """What is compared of one estimator in one setting."""

    model_config = ConfigDict(strict=True)

    method: str
    n: Annotated[int, Field(ge=0, le=_MOST)]
    failed: Annotated[int, Field(ge=0, le=_MOST)]
    empirical: Annotated[float, Field(ge=0, le=1e24)] | None
    bias: Annotated[float, Field(ge=-1e12, le=1e12)] | None

    @model_validator(mode="after")
    def _consistent(self) -> _Judged:
        if self.failed > self.n:
            raise ValueError(f"failed must be at most n, {self.n}, got {self.failed}")
        if self.empirical is not None and (self.bias is None or 0 < self.empirical < 1e-30):
            raise ValueError(f"empirical must be 0 or at least 1e-30, beside a bias, got {self.empirical:g}")
        return self


_Angles = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]


class _Setting(_Judged):
    scene: str = ""
    parameters: dict[str, Any] = {}
    sensor: _Angles
    light: _Angles
    classic: list[_Judged]


class _Document(BaseModel):
    model_config = ConfigDict(strict=True)

    scene: str
    settings: Annotated[list[_Setting], Field(min_length=1)]


@dataclass(frozen=True)
class Change:
    """One test on one estimator in one setting.

    ``what`` is "variance" (F test), "mean" (Welch's t test) or "failed" (Fisher's exact test); ``before`` and ``after``
    are variance in px^2, mean error in px, or number of failed images.
    """

    setting: str
    method: str
    what: str
    before: float | None
    after: float | None
    p_value: float


@dataclass(frozen=True)
class Comparison:
    """The outcome: ``changed`` are the tests below ``limit``, the most significant first.

    Two runs of the same code, with different seeds, differ with probability ``level``. With the same seed they share
    their random numbers and the tests are conservative.
    """

    changed: tuple[Change, ...]
    tests: int
    settings: int
    level: float
    limit: float
    only_before: tuple[str, ...]
    only_after: tuple[str, ...]
    text: str

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def read(path: Path) -> dict[str, Any]:
    """The document of ``ice validate --json`` from a run directory or a file.

    Raises
    ------
    InvalidInput
        If there is none, or what is compared of it is missing or of another type.
    """
    file = path / "result.json" if path.is_dir() else path
    try:
        document = read_json(file)
        _Document.model_validate(document)
        return document
    except ValidationError as error:
        reason = describe(error)
    except InvalidInput as error:
        reason = str(error)
    raise InvalidInput(f"{path} must be a run directory or its result.json, got: {reason}")


def compare(before: dict[str, Any], after: dict[str, Any], level: float = 0.01) -> Comparison:
    """Compare two documents of ``ice validate --json``, setting by setting and estimator by estimator.

    Raises
    ------
    InvalidInput
        If they have no setting with a common estimator.
    """
    first, second = _judged(before), _judged(after)
    tests = [c for key in first if key in second for c in _tests(key, first[key], second[key])]
    if not tests:
        raise InvalidInput("the runs must have at least one setting and estimator in common, got none")
    limit = -math.expm1(math.log1p(-level) / len(tests))
    changed = tuple(sorted((c for c in tests if c.p_value < limit), key=lambda change: change.p_value))
    settings = len({key[0] for key in first} & {key[0] for key in second})
    text = (
        f"{len(changed) or 'None'} of {len(tests)} tests on {settings} settings differ beyond chance "
        f"(smallest p-value {min(c.p_value for c in tests):.2g} against {limit:.2g}, Sidak, {level:.0%} for all)."
    )
    only = [tuple(" ".join(key) for key in a if key not in b) for a, b in ((first, second), (second, first))]
    return Comparison(changed, len(tests), settings, level, limit, *only, text)


def _judged(document: dict[str, Any]) -> dict[tuple[str, str], dict[str, Any]]:
    """Results by setting (scene, parameters and poses) and estimator."""
    found = {}
    for row in document["settings"]:
        parameters = "".join(f" {key}={value}" for key, value in row.get("parameters", {}).items())
        poses = " ".join(f"{role} ({row[role][0]:g}, {row[role][1]:g})" for role in ("sensor", "light"))
        setting = f"{row.get('scene', document['scene'])}{parameters} {poses}"
        for judged in (row, *row["classic"]):
            found[setting, judged["method"]] = judged
    return found


def _tests(key: tuple[str, str], a: dict[str, Any], b: dict[str, Any]) -> list[Change]:
    good = [judged["n"] - judged["failed"] for judged in (a, b)]
    table = [[a["failed"], good[0]], [b["failed"], good[1]]]
    tests = [Change(*key, "failed", a["failed"], b["failed"], float(stats.fisher_exact(table).pvalue))]
    if min(good) > 1 and a["empirical"] and b["empirical"]:
        p = float(f_test(a["empirical"], good[0], b["empirical"], good[1]))
        tests.append(Change(*key, "variance", a["empirical"], b["empirical"], p))
        sigmas = [math.sqrt(judged["empirical"]) for judged in (a, b)]
        t = stats.ttest_ind_from_stats(a["bias"], sigmas[0], good[0], b["bias"], sigmas[1], good[1], equal_var=False)
        tests.append(Change(*key, "mean", a["bias"], b["bias"], float(t.pvalue)))
    return tests


def f_test(first: float, n: int, second: float, m: int) -> float:
    """Two-sided p-value of two sample variances, of n and m normal values, being of one variance.

    >>> round(f_test(1.0, 1000, 1.25, 1000), 5)
    0.00043
    """
    ratio = first / second
    return float(2 * min(stats.f.cdf(ratio, n - 1, m - 1), stats.f.sf(ratio, n - 1, m - 1)))
