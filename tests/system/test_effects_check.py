"""What was left out, switched on: reduced to one setting and few rays. ``ice effects SCENE --check`` does all of it."""

import pytest

import render
import scenes
from render import variant
from render.phenomena import EffectTolerance
from scenes import Floor, Lens
from validation.effects_check import RENDERED, Switched, check

pytestmark = pytest.mark.render
SLOW = variant.choose().startswith("scalar")  # everything on runs as interpreted Python there
COARSE = render.Quality(supersample=2, samples=1, edge_samples=4 if SLOW else 16, random_samples=1)


@pytest.mark.parametrize(
    ("name", "only"),
    [
        ("task1", ("floor",)),
        ("macro", ("floor",)),
    ],
)
def test_left_out_effects_are_within_their_bounds(name, only):
    scene = scenes.load(name)
    cheap = check(scene, quality=COARSE, settings=scene.settings[:1], only=only)
    assert [row.name for row in cheap] == list(only)
    assert all(row.holds for row in cheap), cheap
    if SLOW:  # a compiled variant's rays are the same, with or without a floor that is not seen
        assert all(row.bias_px != 0 for row in cheap), cheap  # the pictures are not the same ones


def test_light_of_some_size_is_within_its_bound(task1):
    """Radius 4 cm at 100 cm, left out by a wide tolerance, and 15 cm, which a face's horizon cuts off."""
    quality, wide = (
        render.Quality(supersample=2, samples=1, edge_samples=4, random_samples=4),
        EffectTolerance(1e9, 1e9),
    )
    scene = task1.model_copy(update={"light": task1.light.model_copy(update={"radius": 4.0})})
    (row,) = check(scene, wide, quality, task1.settings[5:6], only=("light_size",))
    assert row.holds, row
    assert 0 < row.estimated.bias_px < row.estimated.variance < 0.05
    if SLOW:  # it is 1e-8 px, which rounding decides
        assert row.bias_px != 0  # the pictures are not the same ones
    large = task1.model_copy(update={"light": task1.light.model_copy(update={"radius": 15.0})})
    (row,) = check(large, wide, quality, task1.settings[5:6], only=("light_size",))
    assert row.holds, row
    assert row.variance != 0
    if SLOW:
        assert row.bias_px != 0


def test_bounds_hold_where_they_are_not_zero(task1):
    """Distortion and a dark floor, left out by a wide tolerance: each is measurable and within its bound."""
    wide, lens = EffectTolerance(1e9, 1e9), Lens(distortion=-0.05)
    cases = {
        "lens_distortion": task1.model_copy(update={"camera": task1.camera.model_copy(update={"lens": lens})}),
        "floor": task1.model_copy(update={"floor": Floor(reflectance=0.02, height=-3.0)}),
    }
    for name, scene in cases.items():
        (row,) = check(scene, wide, COARSE, task1.settings[4:5], only=(name,))
        assert row.holds, row
        # margin: what is asked is that they are not zero
        assert abs(row.bias_px) > 0.02 or abs(row.variance) > 0.01, row


def test_a_bound_that_is_too_small_is_found(task1):
    """Negative control: a floor whose influence is said to be nothing."""
    row = Switched(task1.settings[0], "floor", render.effects(task1)[1].influence, 0.01, 0.0, 2e-4, 1e-3, 1.0, 1.0)
    assert not row.holds
    assert "floor" in RENDERED
