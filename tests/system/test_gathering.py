"""Light between faces gathered from patches: as bright as that of whole paths, with less noise."""

from dataclasses import replace

import numpy as np
import pytest

import render
import scenes
from render import Quality, fine, variant
from render.build import view
from render.gathered import Gathering, is_gathered
from scenes import Picture

pytestmark = [
    pytest.mark.render,
    pytest.mark.skipif(not variant.choose().startswith("scalar"), reason="compiled variants follow whole paths"),
]
_COUNT = 6
_FEW = Quality(supersample=1, samples=1, edge_samples=16, random_samples=16, everywhere=False)


@pytest.fixture(scope="module")
def picture():
    """A foot before its upright, on a grey floor."""
    return Picture.of(scenes.load("grey_floor"), (40, 0), (30, 300))


def rendered(picture, quality):
    return np.array([render.image(picture, quality=replace(quality, seed=seed)) for seed in range(_COUNT)])


def apart(first, second):
    """By how many of its standard errors the mean level of one differs from that of the other, where both are lit."""
    lit = (first.mean(0) > 25) & (second.mean(0) > 25)
    error = np.sqrt(sum(each[:, lit].var(0, ddof=1).sum() / _COUNT for each in (first, second)))
    return (second.mean(0) - first.mean(0))[lit].sum() / error


def test_gathered_light_is_that_of_paths(picture, monkeypatch):
    """Levels within chance; without what is gathered they are far from it."""
    whole, gathered = rendered(picture, _FEW), rendered(picture, replace(_FEW, gathered=True))
    assert abs(apart(whole, gathered)) < 4
    monkeypatch.setattr(fine.Gathering, "image", lambda *given: 0.0)
    assert apart(whole, rendered(picture, replace(_FEW, gathered=True))) < -20  # margin: five times; 98


def test_what_shines_itself_is_taken_off_ray_by_ray(picture):
    """Gathered light is nowhere negative, nor where an edge of a face that shines is seen: other rays would see other
    parts of it."""
    mitsuba, camera = variant.use(variant.choose()), picture.scene.camera
    crop = slice(0, camera.height), slice(0, camera.width)
    seen = view(mitsuba, picture, frozenset({"interreflection"}), (camera.width, camera.height), crop, 16)
    seen["film"] |= {"pixel_format": "rgb"}
    found = Gathering.of(mitsuba, picture).image(mitsuba.load_dict(seen), 0)
    assert found.min() >= 0
    assert found.max() > 1


@pytest.mark.parametrize(("name", "does"), [("grey_floor", True), ("copper", False), ("shaft", False)])
def test_where_light_cannot_be_gathered_it_is_traced(name, does):
    """Glossy and turned parts are rendered as without it."""
    assert is_gathered(scenes.load(name)) == does
