"""Where zero crossings are sought, and how far: beside an edge in half steps of Newton's method, beside a limb."""

import numpy as np
import pytest
from scipy import sparse
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ndtr

from imaging.blurred.boundaries import Boundaries
from imaging.blurred.segment import Segments
from imaging.contours.shading import Profile
from imaging.features.limb_locator import limb_crossing
from imaging.features.locator import edge_blur
from imaging.models.bias import _zero
from measure.estimators.crossing import STEP, CrossingLocator
from measure.estimators.gradient import gradient_along
from measure.features.optics import Optics


def steps(*apart: float) -> Boundaries:
    """An endless unit step beside each place, px away along its own normal."""
    count = len(apart)
    one, none = np.ones(count), np.zeros(count)
    parts = Segments(-99 * one, 99 * one, np.array(apart), one, none, one, none, none)
    sides = np.tile([0.0, 1.0], (count, 1))
    return Boundaries(np.arange(count), np.ones(count, bool), parts, sides, np.zeros((count, 2)), np.zeros(count, bool))


def test_a_crossing_is_sought_five_half_px_away():
    """Of lone steps, each found where it is, a wide blur telling from afar; beyond 2.5 px nothing is reached."""
    near = steps(0.3, -0.7, 1.9, -3.2, 3.4)
    with np.errstate(invalid="ignore"):  # of places that are settled
        moved, slope = _zero(near, np.full(5, 6.0), None)
    assert moved == pytest.approx([0.3, -0.7, 1.9, -2.5, 2.5], abs=1e-6)
    assert slope[:3] == pytest.approx(-1 / (np.sqrt(2 * np.pi) * 6.0**3), rel=1e-3)  # at the last step but one


# coefficients of sqrt(d)^j inside the limb, grey levels, where steps of more than half a width lead astray
UNEVEN = [[71.9, -88.0, 13.9, 3.8], [28.8, -39.8, 9.3, 4.1], [-82.6, 104.9, -10.7, -13.1]]


@pytest.mark.parametrize("coefficients", UNEVEN)
def test_a_limb_s_crossing_beside_an_uneven_profile(coefficients):
    """The second derivative of the smoothed profile by quadrature over the distance's root, and its root next to 0."""
    blur, scale = 0.6, 1.0
    width = np.hypot(edge_blur(blur), scale)

    def second(place: float) -> float:
        """At a place outwards, in units of the smoothed edge's width; d = r^2 inside."""

        def part(r: float) -> float:
            x = place + r**2
            return float(np.polyval(coefficients[::-1], r * np.sqrt(width)) * (x**2 - 1) * np.exp(-(x**2) / 2) * 2 * r)

        return quad(part, 0, 3.5, epsabs=1e-11, epsrel=1e-11)[0]

    found = limb_crossing(Profile(np.array([coefficients]), np.zeros(1)), 0.0, blur, scale).shift[0] / width
    assert 0.3 < abs(found) < 1  # margin: more than a half step away
    places = np.linspace(0, found, 30)[:-1]
    signs = np.sign([second(place) for place in places])
    assert (signs == signs[0]).all()  # none is nearer that way
    assert brentq(second, found - 0.05, found + 0.05, xtol=1e-12) == pytest.approx(found, abs=1e-8)


def test_a_profile_that_crosses_nowhere_is_told_from_one_that_does():
    """Cubics along three positions, told by themselves: place, slope as contrast, and what is 0 where there is none."""
    offsets = -3.0 + STEP * np.arange(9)
    roots, slopes = [-1.3, 0.4, 0.0], [-2.0, -0.7, 0.0]
    profiles = [
        k * (offsets - r) * (1 + 0.1 * (offsets - r) + 0.03 * (offsets - r) ** 2)
        for r, k in zip(roots, slopes, strict=False)
    ]
    profiles[2] = 5.0 + offsets**2
    image = np.concatenate(profiles)[None, None]
    empty = np.zeros((3, 0)), np.zeros((0, 27))
    tool = CrossingLocator(
        np.array([0.0, 1.0, 3.0]), offsets, np.arange(27), sparse.eye_array(27).tocsr(), np.array([4.0, 5.0, 6.0]),
        np.array([1.0, 1.5, 2.0]), *empty,
    )  # fmt: skip
    each = tool.locate_each(image)
    assert each.valid.tolist() == [[True, True, False]]
    assert each.offset[0] == pytest.approx([-1.3, 0.4 * 1.5, 0.0], abs=1e-9)
    assert each.contrast[0] == pytest.approx([4 * 2.0, 5 * 0.7, 0.0], rel=1e-9)
    assert tool.locate(image).offset[0] == pytest.approx([-1.3, 0.4 * 1.5, 0.0], abs=1e-9)


def test_a_weak_edge_beside_a_strong_one_is_found_by_the_sign_that_is_known():
    """The strong one stands past the places across, 4.2 px away; without the sign the middle between both is found."""
    optics, rows, across = Optics((64, 64), blur_px=0.8), np.arange(20.0, 40.0, 2.0), np.arange(64) - 30.3
    image = 80 * ndtr((across + 4.2) / optics.blur_px) + 14 * ndtr(across / optics.blur_px)
    image = np.broadcast_to(image, optics.shape)
    places, normals = np.stack([np.full(10, 30.3), rows], -1), np.tile([1.0, 0.0], (10, 1))
    known, told = (gradient_along(optics, rows, places, normals, signs=signs) for signs in (np.ones(10), None))
    width = np.hypot(optics.scale_px, optics.blur_px)

    def second(x: float) -> float:
        return 80 * (x + 4.2) * np.exp(-(((x + 4.2) / width) ** 2) / 2) + 14 * x * np.exp(-((x / width) ** 2) / 2)

    assert known.locate_each(image[None]).offset == pytest.approx(brentq(second, -0.5, 0.5), abs=5e-3)
    assert np.abs(told.locate_each(image[None]).offset).min() > 0.6


def test_an_image_that_is_the_other_way_round_altogether_is_believed():
    """Light from elsewhere than the scene says: all of an edge is darker where it should be brighter."""
    optics, rows = Optics((64, 64), blur_px=0.8), np.arange(20.0, 40.0, 2.0)
    image = np.broadcast_to(14 * ndtr((np.arange(64) - 30.3) / optics.blur_px), optics.shape)
    places, normals = np.stack([np.full(10, 30.3), rows], -1), np.tile([1.0, 0.0], (10, 1))
    turned = gradient_along(optics, rows, places, normals, signs=-np.ones(10)).locate_each(image[None])
    assert turned.valid.all()
    assert turned.offset == pytest.approx(0.0, abs=5e-3)
    box = (optics.scale_px**2 + edge_blur(optics.blur_px) ** 2) / (optics.scale_px**2 + optics.blur_px**2)  # none here
    assert turned.contrast == pytest.approx(14.0 * box**1.5, rel=0.02)


@pytest.mark.parametrize(("window", "off"), [(1.0, 0.0), (1.0, 0.3), (1.5, 0.6), (3.0, 1.0)])
def test_a_lone_edge_counts_in_a_small_window(window, off):
    """Its points are sure of it, in the middle and off it: a window's ends are nearer, and count less from nearer."""
    optics, rows = Optics((64, 64), blur_px=0.8, window_px=window), np.arange(20.0, 40.0, 2.0)
    image = np.broadcast_to(90 * ndtr((np.arange(64) - 30.3 - off) / optics.blur_px), optics.shape)
    places, normals = np.stack([np.full(10, 30.3), rows], -1), np.tile([1.0, 0.0], (10, 1))
    found = gradient_along(optics, rows, places, normals, signs=-np.ones(10)).locate(image[None])
    assert found.certain.min() > 0.5
    turned = gradient_along(optics, rows, places, normals, signs=-np.ones(10)).locate_each(image[None])
    assert turned.offset == pytest.approx(off, abs=0.02)
