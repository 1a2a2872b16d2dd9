"""Whether values are linear in the errors of lines: of covariances that are put in by hand."""

import numpy as np
import pytest

import measure
import planner
import scenes
from measure import propagation
from measure.features.layout import layout_of
from measure.nonlinear import are_nonlinear
from measure.quantities import find
from scenes import Measurand, Picture

POSES = (20, 70), (15, 200)
ASKED = {"across": ("width", "e4", "e7"), "square": ("angle", "e4", "e9"), "parallel": ("angle", "e4", "e7")}


@pytest.fixture(scope="module")
def picture():
    """Of a block, of which a distance is asked for, a width, and the angles of two edges that cross and of two that are
    parallel."""
    asked = (Measurand(name=name, kind=kind, features=[{"edge": one}, {"edge": other}])
             for name, (kind, one, other) in ASKED.items())  # fmt: skip
    return Picture.of(scenes.load("task1").tried(measurands=tuple(asked)), *POSES)


@pytest.fixture(scope="module")
def image(picture):
    return planner.image(picture)


@pytest.fixture(scope="module")
def found(picture, image):
    return find(image[None], picture, "gradient", noiseless=True)


def told(picture, found, level, slope):
    """Of the values where noise moves the line of e4 at its start by so many px and turns it by so much."""
    layout, errors = layout_of(picture), np.zeros((found.seen.count,) * 2)
    row = 2 * layout.names.index("e4")
    errors[row, row], errors[row + 1, row + 1] = level**2, slope**2
    return dict(zip(("distance", *ASKED), are_nonlinear(found, layout, errors).tolist(), strict=True))


@pytest.mark.parametrize(
    ("level", "slope", "bent"),
    [
        (0.2, 0.002, {"parallel"}),
        (5.0, 0.001, {"parallel"}),
        (0.01, 0.1, {"parallel"}),
        (0.01, 0.5, {"parallel", "across", "square"}),
        (0.01, 1e-4, set()),
    ],
)
def test_what_bends_where_noise_turns_a_line(picture, found, level, slope, bent):
    """How far two parallel lines are turned has no sign: its errors lean to one side. Widths and other angles bend
    where it is turned by half a radian. What is moved by 0.01 px is not asked."""
    assert {name for name, is_bent in told(picture, found, level, slope).items() if is_bent} == bent


def test_what_bends_has_no_value(picture, image, monkeypatch):
    here = measure.propagate(image, picture).measurands
    monkeypatch.setattr(propagation, "are_nonlinear", lambda *_: np.array([False, True, False, False]))
    there = measure.propagate(image, picture).measurands
    assert here.status[:3] == ("ok",) * 3
    assert there.status == ("ok", "ill_conditioned", *here.status[2:])
    assert np.isinf(there.covariance[1, 1])
    assert np.isnan(there.value[1])
