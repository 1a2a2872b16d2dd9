"""A newcomer's plate, 50 x 30 x 8 mm, its step 2 mm wide and deep: at its foot light from the riser moves an edge."""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from planner.uncertainty.conformity import decide
from scenes import Picture, Tolerance
from tests.parts import prism
from validation import budgets, simulation
from validation.remeasured import Method

ZONE = 0.02
WIDTHS = (1.965, 1.98, 2.0, 2.02, 2.035)  # at the limits, around them, and between


def plate(folder, width=2.0):
    """Seen from above near the step, 10 px a mm."""
    profile = [(0, 0), (50, 0), (50, 6), (50 - width, 6), (50 - width, 8), (0, 8)]
    prism(profile, 30.0).export(folder / f"{width}.stl")
    told = {
        "name": "plate", "units": "mm", "object": {"kind": "mesh", "units": "mm", "file": str(folder / f"{width}.stl")},
        "material": {"diffuse_reflectance": 0.8}, "light": {"distance": 300.0},
        "camera": {"width": 64, "height": 48, "focal_px": 3000.0, "distance": 300.0, "look_at": [49.0, 15.0, 6.5],
                   "blur_px": 0.8, "exposure": 180.0},
        "noise": {"dark_level": 16.0, "sigma": 1.6, "bits": 8},
    }  # fmt: skip
    bare = scenes.Scene.model_validate(told)
    at = {edge.name: bare.solid.vertices[list(edge.ends)] for edge in bare.solid.sharp}
    ends = [next(n for n, v in at.items() if np.allclose(v[:, [0, 2]], (x, 6))) for x in (50 - width, 50)]
    one = {"name": "step", "kind": "width", "features": [{"edge": name} for name in ends], "tolerance": ZONE}
    whole = scenes.Scene.model_validate({**told, "measurands": [one]})
    return Picture.of(whole, (20, 0), (20, 45))


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    picture = plate(tmp_path_factory.mktemp("plate"))
    return picture, simulation.simulated(picture, Method("gradient"))


@pytest.mark.render
def test_decisions_at_and_around_the_limits(nominal, tmp_path):
    """100 parts, 20 pictures of each of 5 widths: no decision is wrong, and the two outside and the middle are decided.

    Without the correction the same pictures are decided wrong: a perfect step seems 0.03 mm too wide.
    """
    (picture, off), decisions, raw = nominal, {}, {}
    assert off.simulated == ("clutter",)
    assert off.bias[0] > 30 * off.sigma[0]  # margin: what a newcomer met
    assert off.status == ("ok",)
    for k, width in enumerate(WIDTHS):
        part = plate(tmp_path, width)
        clean = render.image(part, quality=render.Quality(seed=50 + k))
        pictures = render.expose(clean, part.scene.noise, np.random.default_rng(k), 20)
        found = measure.measure(pictures, picture, correction=off)
        assert set(found.status.ravel()) == {"ok"}
        # margin: U is what is claimed
        assert np.abs(found.value[:, 0] - width).max() < 2 * found.u[:, 0].max()
        zone, u = Tolerance(plus=ZONE, minus=ZONE), found.u[:, 0]
        decisions[width] = {decide(v, s, 2.0, zone) for v, s in zip(found.value[:, 0], u, strict=True)}
        values = found.value[:, 0] + off.bias[0]
        raw[width] = {decide(v, s, 2.0, zone) for v, s in zip(values, found.sigma[:, 0], strict=True)}
    assert decisions[2.0] == {"pass"}
    assert decisions[1.965] == decisions[2.035] == {"fail"}
    assert decisions[1.98] == decisions[2.02] == {"undecided"}
    assert raw[2.0] == {"fail"}


@pytest.mark.render
def test_the_budget_covers_what_pictures_have(nominal):
    """The closed form alone does not sign it; simulated, value +- U is signed and holds what another render has."""
    picture, off = nominal
    plain = planner.budget(picture)
    assert plain.statuses == ("clutter",)
    found = budgets.budget_of(picture)
    assert found.statuses == ("ok",)
    assert {row.source for row in found.measurands[0].contributions} >= {"bias by reflectance", "bias by light_place"}
    assert found.u_bias[0] == pytest.approx(off.u_bias[0], rel=1e-6)
    assert 1.9 * off.u_bias[0] < found.measurands[0].U
    other = render.image(picture, quality=render.Quality(seed=99))
    left = measure.measure(other, picture, correction=off).value[0] - 2.0
    assert abs(left) < found.measurands[0].U / 5  # the scene is exact: what is left is the renders' noise
