"""JSON that every reader takes, of whatever the commands have to say."""

import enum
import fractions
import json
import math
from dataclasses import dataclass
from pathlib import Path

import mpmath
import numpy as np
import pytest

from validation.strict_json import dumps


class _Colour(enum.Enum):
    RED = 1


@dataclass(frozen=True)
class _Row:
    name: str
    value: float


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (mpmath.mpf("1.5"), 1.5),
        (mpmath.inf, None),
        (mpmath.nan, None),
        (fractions.Fraction(1, 4), 0.25),
        (fractions.Fraction(10**400), None),
        (np.float32(0.5), 0.5),
        (np.int64(3), 3),
        (np.bool_(True), True),
        (np.array([[1.0, np.nan], [-np.inf, 2.0]]), [[1.0, None], [None, 2.0]]),
        (math.inf, None),
        (Path("a/b"), "a/b"),
        (_Colour.RED, 1),
        (_Row("x", math.nan), {"name": "x", "value": None}),
        ({1: (True, None, 10**20)}, {"1": [True, None, 10**20]}),
        ("\udcff [mm] \u2603", "\udcff [mm] \u2603"),
    ],
)
def test_what_is_told_is_read_back(value, told):
    read = json.loads(dumps({"value": value}), parse_constant=pytest.fail)["value"]
    assert read == told
    assert type(read) is type(told)


@pytest.mark.parametrize("value", [object(), {1, 2}, 1j, np.array([1j]), _Row])
def test_what_json_cannot_say_is_no_text(value):
    with pytest.raises(TypeError, match="value must be of a kind that JSON can say, got"):
        dumps([value])
