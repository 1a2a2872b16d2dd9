"""Curved surfaces: lines of any length, which walls are one, limits, and errors of their places."""

import math

import numpy as np
import pytest

from scenes import InvalidInput
from scenes.parts.curved import Curved
from scenes.parts.surfaces import Cone, Cylinder, Plane, Sphere, Torus
from scenes.parts.surfaces.surface import axes_beside, stretch, unit
from scenes.parts.walls import _alike, _kinds
from tests.curved import AXIS, SURFACES, area_points

EVERY = pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)


@EVERY
@pytest.mark.parametrize("size", [1e-5, 3e4])
def test_a_line_meets_a_surface_in_the_same_places_however_long_its_vector(surface, size):
    rng = np.random.default_rng(3)
    starts, ways = rng.normal(0, 2, (60, 3)), rng.normal(size=(60, 3))
    one, other = surface.intersections(starts, ways), size * surface.intersections(starts, size * ways)
    met = np.isfinite(one)
    assert (met == np.isfinite(other)).all()
    assert met.sum() > 10
    np.testing.assert_allclose(other[met], one[met], rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("size", [1e-5, 1.0, 3e4])
def test_a_line_along_a_generator_meets_a_wall_once_or_never(size):
    """Beside a cone's generator once, inside a cylinder never; or where rounding has them meet, 1e10 away."""
    cone, cylinder = SURFACES["cone"], SURFACES["cylinder"]
    one, _ = axes_beside(cone.axis)
    generator = cone.axis + cone.slope * one
    start = cone.point - 0.3 * one
    near, far = size * cone.intersections(start, size * generator)
    assert abs(cone.values(start + near * generator)) < 1e-9
    assert far > 1e10
    assert (np.abs(size * cylinder.intersections(start, size * cylinder.axis)) > 1e10).all()


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (Sphere((1, 2, 3), 2.0), Sphere((1, 2, 3 + 9e-4), 2.0), True),
        (Sphere((1, 2, 3), 2.0), Sphere((1, 2, 3 - 1.1e-3), 2.0), False),
        (Sphere((1, 2, 3), 2.0), Sphere((1, 2, 3), 2.0 + 9e-4), True),
        (Sphere((1, 2, 3), 2.0), Sphere((1, 2, 3), 2.0 - 1.1e-3), False),
        (Sphere((1, 2, 3), 2.0), Cylinder((1, 2, 3), AXIS, 2.0), False),
        (Cylinder((1, 2, 3), AXIS, 2.0), Sphere((1, 2, 3), 2.0), False),
    ],
)
def test_balls_are_one_by_centre_and_radius(one, other, same):
    assert _alike(one, other, 1e-3) == same


def _wall(along=0.0, aside=0.0, radius=0.0, angle=0.0, sign=1.0, tilt=0.0):
    """A cone of 2 radius growing by 10 degrees, as it is said from another point of its axis, or changed."""
    axis = np.array(AXIS) / np.linalg.norm(AXIS)
    one, two = axes_beside(axis)
    turned = math.cos(tilt) * axis + math.sin(tilt) * two
    wide = 2.0 + math.tan(math.radians(10)) * along + radius
    point = np.array([1.0, -2.0, 3.0]) + along * axis + aside * one
    return Cone(point, sign * turned, wide, (-0.5, 0.5), half_angle_deg=sign * (10 + angle))


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({}, True),
        ({"along": 4.0}, True),
        ({"along": -3.0, "sign": -1.0}, True),
        ({"aside": 9e-4}, True),
        ({"aside": -1.1e-3}, False),
        ({"radius": 9e-4, "sign": -1.0}, True),
        ({"radius": -1.1e-3}, False),
        ({"angle": 1e-3}, False),
        ({"angle": 1e-3, "sign": -1.0}, False),
        ({"tilt": 0.02}, True),  # (1 - cos) r = 4e-4
        ({"tilt": 0.04}, False),
    ],
)
def test_walls_are_one_wherever_they_end(change, same):
    assert _alike(_wall(), _wall(**change), 1e-3) == same


def test_a_wall_s_two_halves_are_of_one_kind_and_a_bore_is_of_none():
    surfaces = (
        _wall(), None, Sphere((0, 0, 0), 1.0), Torus((0, 0, 0), AXIS, 2.0, 0.5), _wall(along=2.0, sign=-1.0),
        Cylinder((0, 0, 0), AXIS, 1.0, hollow=True), _wall(aside=1.0), Plane((0, 0, 0), AXIS), Sphere((0, 0, 0), 1.0),
    )  # fmt: skip
    assert _kinds(surfaces, 1e-3).tolist() == [0, -1, 1, -1, 0, -1, 2, -1, 1]


def test_surfaces_have_limits():
    """Numbers up to 1e9, as they are said."""
    assert Sphere((1e9, 0, 0), 1e9).radius == 1e9
    for made in (
        lambda: Sphere((1.01e9, 0, 0), 1.0),
        lambda: Sphere((0, -1.01e9, 0), 1.0),
        lambda: Sphere((0, 0, 0), 1.01e9),
        lambda: Sphere((0, 0, 0), True),
        lambda: Sphere((0, 0), 1.0),
    ):
        with pytest.raises(InvalidInput, match=r"sphere\.(centre|radius) must be .* 1e\+09, got"):
            made()
    assert unit("axis", (0, -3e-250, 4e-250)) == pytest.approx([0, -0.6, 0.8])
    assert stretch("ends", ("-1", math.inf)) == (-1, math.inf)
    for ends in ((1, 1), (2, 1), (math.nan, 1), (1,), None):
        with pytest.raises(InvalidInput, match="ends must be two rising numbers, got"):
            stretch("ends", ends)


EYE = np.array([9.0, -4.0, 7.0])
MEASURED = ["sphere", "cylinder", "cone", "narrowing cone"]


@pytest.mark.parametrize("name", MEASURED)
def test_a_surface_moves_by_the_parameters_that_it_is_found_by(name):
    """To first order its wall moves by its shifts times `parameters`, whichever of them is wrong."""
    surface, step = SURFACES[name], 1e-6
    curved = Curved("c", surface, ())
    points = area_points(surface, *np.random.default_rng(5).uniform(0.1, 0.9, (2, 20)))
    design = surface.shifts(points) @ curved.parameters(EYE)
    assert design.shape == (20, curved.count)
    for k in range(curved.count):
        less, more = (
            curved.moved(EYE, tuple(by * np.eye(curved.count)[k])).surface.values(points) for by in (-step, step)
        )
        np.testing.assert_allclose(design[:, k], (less - more) / (2 * step), rtol=1e-6, atol=1e-7)
    one, two = curved.sideways(EYE)
    assert abs(one @ (curved.centre - EYE)) < 1e-12
    if name == "sphere":
        assert abs(one @ two) + abs(two @ (curved.centre - EYE)) < 1e-12
        assert np.linalg.norm(two) == pytest.approx(1)
    else:
        assert abs(one @ surface.axis) < 1e-12
        assert not two.any()


@pytest.mark.parametrize("sign", [1, -1])
def test_a_smaller_cone_ends_at_its_apex(sign):
    """Of slope 0.5, its end 1.99 from the middle, where its radius of 1 is all but gone; the other end stays."""
    cone = Cone((0, 0, 0), (0, 0, sign), 1.0, (-1.99, 3.0), half_angle_deg=math.degrees(math.atan(0.5)))
    other = Cone((0, 0, 0), (0, 0, sign), 1.0, (-3.0, 1.99), half_angle_deg=-math.degrees(math.atan(0.5)))
    for surface, ends in ((cone, (-1.98, 3.0)), (other, (-3.0, 1.98))):
        made = Curved("c", surface, ()).moved(EYE, (0.0, 0.0, -0.01, 0.0)).surface
        assert made.ends == pytest.approx(ends, abs=1e-12)
        assert made.radius == pytest.approx(0.99)
        wider = Curved("c", surface, ()).moved(EYE, (0.0, 0.0, 0.01, 0.0)).surface
        assert wider.ends == surface.ends
