"""Curved surfaces: derivatives against differences, lines against 50 digits, areas, and what is refused."""

import math

import mpmath
import numpy as np
import pytest

from scenes import InvalidInput
from scenes.parts.surfaces import Cone, Cylinder, Plane, Quadric, Sphere, Torus
from scenes.parts.surfaces.roots import quadratic_roots, real_roots
from tests.curved import SURFACES, area_points, changed, on, tangents

EVERY = pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
STEP = 1e-5


@EVERY
def test_lines_meet_it_where_it_is(surface):
    """Points at the roots lie on the surface; between two roots the sign of the value changes, beyond it does not."""
    rng = np.random.default_rng(1)
    starts, ways = rng.normal(0, 2, (500, 3)), rng.normal(size=(500, 3))
    t = surface.intersections(starts, ways)
    assert t.shape == (500, {"plane": 1, "torus": 4}.get(surface.kind, 2))
    met = np.isfinite(t)
    known = np.where(met, t, 1e300)
    apart = np.diff(known, axis=1)
    assert (apart >= 0).all()
    assert met.any(1).mean() > 0.1  # margin: some lines meet it
    lines, which = np.nonzero(met)
    points = starts[lines] + t[lines, which][:, None] * ways[lines]
    assert np.abs(surface.values(points)).max() < 1e-9
    for i, k in zip(*np.nonzero(met[:, 1:] & (apart > 1e-6)), strict=True):
        slope = (surface.normals(starts[i] + t[i, k] * ways[i]) * ways[i]).sum()
        middle = starts[i] + (t[i, k] + t[i, k + 1]) / 2 * ways[i]
        assert surface.values(middle) * slope > 0 or surface.kind == "cone"  # the line may run on the other sheet


@EVERY
def test_normals_and_bends_against_differences(surface):
    rng = np.random.default_rng(2)
    points = on(surface, rng, 40)
    normals = surface.normals(points)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-13)
    found = np.stack(
        [(surface.values(points + STEP * e) - surface.values(points - STEP * e)) / (2 * STEP) for e in np.eye(3)], -1
    )
    np.testing.assert_allclose(found, normals, atol=1e-7)
    way, operator = tangents(normals, rng), surface.shape_operator(points)
    np.testing.assert_allclose(operator, np.swapaxes(operator, 1, 2), atol=1e-12)
    turned = (surface.normals(points + STEP * way) - surface.normals(points - STEP * way)) / (2 * STEP)
    flat = turned - (turned * normals).sum(-1, keepdims=True) * normals
    np.testing.assert_allclose(np.einsum("nij,nj->ni", operator, way), flat, atol=1e-7)


@EVERY
def test_height_over_the_tangent_plane(surface):
    """h(s) = -k s^2 / 2 along a tangent, by lines along the normal."""
    rng = np.random.default_rng(3)
    points = on(surface, rng, 40)
    normals = surface.normals(points)
    way, step = tangents(normals, rng), 1e-3
    heights = []
    for s in (-step, step):
        t = surface.intersections(points + s * way, normals)
        heights.append(t[np.arange(len(t)), np.abs(np.where(np.isinf(t), 1e9, t)).argmin(1)])
    bend = np.einsum("ni,nij,nj->n", way, surface.shape_operator(points), way)
    scale = 1 + np.abs(bend) ** 3
    assert (np.abs((heights[0] + heights[1]) / step**2 + bend) < 2e-4 * scale).all()


@EVERY
def test_shifts_against_differences(surface):
    points = on(surface, np.random.default_rng(4), 40)
    shifts = surface.shifts(points)
    assert shifts.shape == (len(points), len(surface.parameters))
    for k, name in enumerate(surface.parameters):
        less, more = (changed(surface, name, by).values(points) for by in (-STEP, STEP))
        np.testing.assert_allclose(shifts[:, k], (less - more) / (2 * STEP), rtol=1e-6, atol=1e-7, err_msg=name)


@pytest.mark.parametrize("name", ["cylinder", "cone", "narrowing cone", "sphere", "torus"])
def test_area_points_are_even(name):
    """Equal parts of the unit square are equal areas: by the size of the surface's own derivative."""
    surface = SURFACES[name]
    rng = np.random.default_rng(5)
    u, v = rng.uniform(0.02, 0.98, (2, 50))
    assert np.abs(surface.values(area_points(surface, u, v))).max() < 1e-12
    by_u = (area_points(surface, u + STEP, v) - area_points(surface, u - STEP, v)) / (2 * STEP)
    by_v = (area_points(surface, u, v + STEP) - area_points(surface, u, v - STEP)) / (2 * STEP)
    areas = np.linalg.norm(np.cross(by_u, by_v), axis=1)
    np.testing.assert_allclose(areas, areas.mean(), rtol=1e-6)
    known = {"cylinder": 2 * np.pi * 1.5 * 5, "sphere": 4 * np.pi * 1.5**2, "torus": 4 * np.pi**2 * 2.5 * 0.7}
    if name in known:
        assert areas.mean() == pytest.approx(known[name], rel=1e-6)


@pytest.mark.parametrize("name", ["plane", "cylinder", "cone", "narrowing cone", "sphere"])
def test_as_an_equation_of_second_degree(name):
    surface = SURFACES[name]
    points = on(surface, np.random.default_rng(6), 40)
    assert np.abs(surface.quadric.values(points)).max() < 1e-12
    np.testing.assert_allclose(surface.quadric.normals(points), surface.normals(points), atol=1e-9)
    np.testing.assert_allclose(surface.quadric.shape_operator(points), surface.shape_operator(points), atol=1e-9)


def test_one_sheet_of_a_cone_alone():
    """A line that meets the sheet beyond the apex has no root there."""
    cone = Cone((0, 0, 0), (0, 0, 1), 1.0, half_angle_deg=45.0)
    assert cone.ends == (pytest.approx(-1), math.inf)
    t = cone.intersections(np.array([-10.0, 0.1, -3.0]), np.array([1.0, 0, 0]))
    assert np.isinf(t).all()
    up = cone.intersections(np.array([0.5, 0, -10.0]), np.array([0, 0, 1.0]))
    assert up[0] == pytest.approx(9.5)
    assert np.isinf(up[1])


@pytest.mark.parametrize("miss", [1e-15, 1e-12, 1e-8, 1e-4])
@pytest.mark.parametrize("far", [1.0, 1e3, 1e6])
def test_grazing_rays(miss, far):
    """A line that passes inside a sphere or a cylinder by a little meets it, outside it does not; the chord has its
    length of 50 digits."""
    with mpmath.workdps(50):
        chord = float(2 * mpmath.sqrt(1 - (1 - mpmath.mpf(miss)) ** 2))
    bodies = [Sphere((0, 0, 0), 1.0), Cylinder((0, 0, 0), (0, 0, 1), 1.0)]
    for body in bodies:
        for side, meets in ((1 - miss, True), (1 + miss, False)):
            if abs(side - 1) < 2e-16:
                continue
            t = body.intersections(np.array([-far, side, 0]), np.array([1.0, 0, 0]))
            assert np.isfinite(t).all() == meets
            if meets:
                rounding = 1e-15 / miss + 1e-15 * far / chord
                assert t[1] - t[0] == pytest.approx(chord, rel=1e-9 + rounding)


@pytest.mark.parametrize("inside", [1e-9, 1e-6, 1e-3])
def test_torus_touched(inside):
    """Lines along the axis that graze the tube from outside: two roots just inside, none just outside, four never."""
    torus = Torus((0, 0, 0), (0, 0, 1), 2.0, 0.5)
    for edge, sign in ((2.5, 1), (1.5, -1)):
        start = np.array([[edge - sign * inside, 0, -5.0], [edge + sign * inside, 0, -5.0]])
        t = torus.intersections(start, np.array([0, 0, 1.0]))
        assert np.isfinite(t).sum(1).tolist() == [2, 0]
        half = math.sqrt(0.5**2 - (0.5 - inside) ** 2)
        np.testing.assert_allclose(np.sort(t[0])[:2], [5 - half, 5 + half], atol=1e-6 * half + 1e-12 / half)


def test_torus_lines_against_50_digits():
    """Every root moves by less than 1e-12 in a step of Newton's method at 50 digits, and there are as many as the signs
    of the distance along the line tell."""
    torus, rng = Torus((0.2, -0.1, 0.3), (0.1, 0.2, 0.9), 2.0, 0.6), np.random.default_rng(7)
    starts = rng.normal(0, 6, (30, 3))
    ways = area_points(torus, *rng.uniform(size=(2, 30))) - starts
    found = torus.intersections(starts, ways)
    along = np.linspace(-3, 5, 20_001)
    for start, way, t in zip(starts, ways, found, strict=True):
        inside = torus.values(start + along[:, None] * way) < 0
        assert np.isfinite(t).sum() == (inside[1:] != inside[:-1]).sum()
        assert max(abs(_newton_step(torus, start, way, root)) for root in t[np.isfinite(t)]) < 1e-12


def _newton_step(torus: Torus, start: np.ndarray, way: np.ndarray, t: float) -> float:
    """By which the root of a line's distance from the tube's middle, less the tube, is wrong."""
    with mpmath.workdps(50):
        axis = mpmath.matrix(torus.axis.tolist())
        axis /= mpmath.norm(axis)

        def distance(t):
            place = [
                mpmath.mpf(o) + t * mpmath.mpf(d) - mpmath.mpf(c)
                for o, d, c in zip(start, way, torus.centre, strict=True)
            ]
            height = mpmath.fsum(p * a for p, a in zip(place, axis, strict=True))
            beside = mpmath.sqrt(mpmath.fsum(p * p for p in place) - height**2)
            return mpmath.hypot(beside - mpmath.mpf(torus.radius), height) - mpmath.mpf(torus.tube)

        return float(distance(mpmath.mpf(t)) / mpmath.diff(distance, mpmath.mpf(t)))


@pytest.mark.parametrize("roots", [(1, 2, 3, 4), (1, 1 + 1e-6, 3, 4), (-5, 1e-8, 1, 1e3), (2, 2, 2, 2), (0, 0, 1, 1)])
def test_roots_of_quartics(roots):
    found = real_roots(np.poly(np.array(roots, float)))
    apart = min(np.diff(sorted(set(roots))), default=1)
    np.testing.assert_allclose(found, roots, atol=1e-3 if len(set(roots)) < 4 else 1e-8 / min(apart, 1), rtol=1e-9)


@pytest.mark.parametrize("b", [3.0, 1e4, 1e8])
def test_roots_of_quadratics_keep_their_digits(b):
    with mpmath.workdps(50):
        large = -mpmath.mpf(b) / 2 - mpmath.sqrt(mpmath.mpf(b) ** 2 / 4 - 1)
        exact = [float(large), float(1 / large)]
    np.testing.assert_allclose(quadratic_roots(1.0, b / 2, 1.0), exact, rtol=1e-15)
    assert np.isinf(quadratic_roots(0.0, 0.0, 1.0)).all()


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: Sphere((0, 0, 0), -1.0), "sphere.radius must be more than 0"),
        (lambda: Sphere((0, 0, math.nan), 1.0), "sphere.centre must be three numbers"),
        (lambda: Cylinder((0, 0, 0), (0, 0, 0), 1.0), "cylinder.axis must be a direction"),
        (lambda: Cylinder((0, 0, 0), (0, 0, 1), 1.0, (2, 1)), "cylinder.ends must be two rising numbers"),
        (
            lambda: Cone((0, 0, 0), (0, 0, 1), 1.0, (-2, 1), half_angle_deg=45.0),
            "cone.ends must be on one side of the apex at -1",
        ),
        (lambda: Cone((0, 0, 0), (0, 0, 1), 1.0, half_angle_deg=90.0), "cone.half_angle_deg must be from"),
        (lambda: Torus((0, 0, 0), (0, 0, 1), 1.0, 2.0), "torus.radius - torus.tube must be more than 0"),
        (lambda: Plane((0, 0), (0, 0, 1)), "plane.point must be three numbers"),
        (lambda: Quadric(np.eye(3), (0, 0, math.inf), 1.0), "quadric must have finite coefficients"),
        (lambda: Quadric(np.zeros((3, 3)), (0, 0, 0), 1.0), "quadric must have a coefficient of some power"),
    ],
)
def test_refused(make, match):
    with pytest.raises(InvalidInput, match=match):
        make()


@pytest.mark.parametrize("size", [1e3, 1e-3, -1.0, -1e3])
def test_a_line_meets_a_quadric_at_the_same_places_however_its_direction_is_given(size):
    """Nearly along a rod of radius 2: at 1e-6 it meets both walls far away, at 1e-7 it counts as met once."""
    start, ways = np.array([0.5, 0.3, 0.7]), np.array([[1e-6, 0.0, 1.0], [1e-7, 0.0, 1.0], [0.0, 0.0, 1.0]])
    rod = Quadric(np.diag([3.0, 3.0, 0.0]), (0, 0, 0), -12.0)
    found = rod.intersections(start, ways)
    assert np.isfinite(found).sum(1).tolist() == [2, 1, 0]
    wall = np.sqrt(4 - 0.3**2)
    assert found[0] == pytest.approx(1e6 * (np.array([-wall, wall]) - 0.5), rel=1e-9)
    assert np.sort(size * rod.intersections(start, size * ways), axis=1)[0] == pytest.approx(found[0], rel=1e-9)
    assert np.isfinite(rod.intersections(start, size * ways)).sum(1).tolist() == [2, 1, 0]
