"""Curved surfaces as the renderer has them: discs at their ends, and what lies between a circle and its polygon."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from render import curved
from scenes import Circle, Turned

STEP = Turned(kind="turned", axis="y", profile=[(0.0, 6.0), (20.0, 6.0), (20.0, 10.0), (30.0, 9.0)]).solid


def circle_of(radius: float, height: float):
    """The circle of the part about y that is there, of several the one whose face looks up."""
    return max(
        (c for c in STEP.circles if abs(c.radius - radius) < 1e-6 and abs(c.centre[1] - height) < 1e-6),
        key=lambda c: c.axis[1],
    )


@pytest.mark.parametrize(("radius", "height", "sign"), [(6.0, 0.0, -1), (9.0, 30.0, 1), (10.0, 20.0, -1)])
def test_what_lies_between_a_circle_and_its_polygon(radius, height, sign):
    """Its area is the circle's less the polygon's, its normal that of the face; no place is farther out or in."""
    circle = circle_of(radius, height)
    assert circle.axis[1] == pytest.approx(sign)
    found = curved._lunes(STEP, circle)
    cross = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]) / 2
    polygon = len(circle.edges) / 2 * math.sin(2 * math.pi / len(circle.edges))
    pieces = -(-1024 // len(circle.edges)) * len(circle.edges)
    area = radius**2 * (pieces / 2 * math.sin(2 * math.pi / pieces) - polygon)
    assert cross.sum(0) == pytest.approx([0, sign * area, 0], abs=1e-9 * radius**2)
    assert (cross[:, 1] * sign > 0).all()
    np.testing.assert_allclose(found[..., 1], height, atol=1e-9)
    far = np.linalg.norm(found[..., [0, 2]], axis=-1)
    np.testing.assert_allclose(far, radius, rtol=1e-6)


def test_both_ends_and_a_shoulder_are_discs():
    """Three plane faces, each with a disc as wide as its widest circle; nothing else of them is left to be a mesh."""
    ends = sorted((round(c.radius, 6), round(float(c.centre[1]), 6)) for c in curved._ends(STEP))
    assert ends == [(6.0, 0.0), (9.0, 30.0), (10.0, 20.0)]
    assert curved._rims(STEP) == []
    standing = curved.stands_for(STEP)
    flat = np.abs(STEP.normals[:, 1]) > 1 - 1e-9
    assert standing[~flat].all()
    assert standing[flat].sum() == 3


def test_a_disc_is_where_its_circle_is():
    """Its middle, its axes across the normal by the radius, its outside along the normal."""
    scaled = []

    def transform(rows):
        return SimpleNamespace(scale=lambda by: scaled.append((np.array(rows), by)) or "world")

    circle = circle_of(9.0, 30.0)
    made = curved._disc(SimpleNamespace(ScalarTransform4f=transform), circle, {"type": "b"})
    assert made == {"type": "disk", "to_world": "world", "bsdf": {"type": "b"}}
    ((matrix, by),) = scaled
    assert by == pytest.approx(9.0)
    assert matrix[:3, 3] == pytest.approx([0, 30, 0])
    assert matrix[:3, 2] == pytest.approx([0, 1, 0])
    assert np.linalg.det(matrix) == pytest.approx(1)
    assert matrix[3].tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize("count", [12, 30])
def test_pieces_of_any_length_and_direction_are_filled_from_end_to_end(count):
    """Unequal steps around a slanted axis, every other edge the other way round: each arc runs between its ends."""
    rng = np.random.default_rng(count)
    turn = np.cumsum(rng.uniform(0.5, 1.5, count))
    turn *= 2 * math.pi / turn[-1]
    axis, one, two = np.array([0.0, 0.6, 0.8]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.8, -0.6])
    at = np.array([3.0, -1.0, 2.0])
    vertices = at + 2.5 * (np.cos(turn)[:, None] * one + np.sin(turn)[:, None] * two)
    ends = {f"e{i}": (i, (i + 1) % count)[:: 1 if i % 2 else -1] for i in range(count)}
    solid = SimpleNamespace(vertices=vertices, edge=lambda name: SimpleNamespace(ends=ends[name]))
    found = curved._lunes(solid, Circle("c1", at, axis, 2.5, 0, tuple(ends), False))
    arcs = found.reshape(count, -1, 3, 3)
    for (a, b), arc in zip(ends.values(), arcs, strict=True):
        both = {tuple(vertices[i].round(9)) for i in (a, b)}
        assert {tuple(arc[0, 0].round(9)), tuple(arc[-1, 2].round(9))} == both
        normal = np.cross(arc[:, 1] - arc[:, 0], arc[:, 2] - arc[:, 0])
        assert (normal @ axis > 0).all()
        chord = vertices[b] - vertices[a]
        beyond = np.abs(np.cross(arc[:, 1:] - vertices[a], chord) @ axis) / np.linalg.norm(chord)
        bulge = 2.5 * (1 - math.cos(math.asin(np.linalg.norm(chord) / 5)))
        # margin: the arc's middle is no corner of its pieces: a part of 1 / pieces^2
        assert beyond.max() == pytest.approx(bulge, rel=1e-3)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_facets_of_a_wall_are_those_around_its_axis_between_its_ends(axis):
    """Cylinder, shoulder, cone, cylinder: 48 facets of each wall, none of a shoulder or an end, and its own numbers."""
    profile = [(0.0, 6.0), (20.0, 6.0), (20.0, 10.0), (30.0, 8.0), (34.0, 8.0)]
    solid, k = Turned(kind="turned", axis=axis, profile=profile).solid, "xyz".index(axis)
    radii, slopes = {"d1": 6, "d2": 9, "d3": 8}, {"d1": 0, "d2": -0.2, "d3": 0}
    ends = {"d1": (0, 20), "d2": (20, 30), "d3": (30, 34)}
    assert [wall.name for wall in solid.curved] == list(radii)
    for wall in solid.curved:
        corners = solid.vertices[np.unique([v for f in wall.faces for v in solid.faces[f]])]
        low, high = ends[wall.name]
        assert len(wall.faces) == 48
        assert np.ptp(corners[:, k]) == pytest.approx(high - low)
        assert wall.centre[k] == pytest.approx((low + high) / 2)
        assert wall.radius == pytest.approx(radii[wall.name])
        assert math.tan(wall.half_angle) == pytest.approx(slopes[wall.name])
        assert np.abs(solid.normals[list(wall.faces)][:, k]).max() < 0.3  # margin: a cone's normals: 0.2
    used = sorted(f for wall in solid.curved for f in wall.faces)
    assert used == sorted(np.flatnonzero(np.abs(solid.normals[:, k]) < 0.9))


@pytest.mark.parametrize("unit", [1e-4, 1e-3, 1 / 25.4, 1e4])
def test_a_pin_is_one_in_any_unit(unit):
    """Of a radius of 0.2 mm, with a chamfer and a shoulder of 5 micrometres; what is said in metres was refused."""
    profile = [(0.0, 0.2), (3.0, 0.2), (3.0, 0.205), (3.1, 0.205), (3.105, 0.2)]
    one, other = (Turned(kind="turned", profile=[(u * z, u * r) for z, r in profile]).solid for u in (1, unit))
    assert other.vertices == pytest.approx(unit * one.vertices, abs=1e-9 * unit)
    assert other.faces == one.faces
    assert [(e.name, e.kind, e.convex) for e in other.edges] == [(e.name, e.kind, e.convex) for e in one.edges]
    assert [wall.faces for wall in other.curved] == [wall.faces for wall in one.curved]
    assert [len(wall.faces) for wall in one.curved] == [48, 48, 48]


def test_faces_without_a_record_of_holes_have_one_loop():
    """Then both ends are discs, the shoulder, with two circles, is not."""
    ends = sorted((round(c.radius, 6), round(float(c.centre[1]), 6)) for c in curved._ends(replace(STEP, holes=())))
    assert ends == [(6.0, 0.0), (9.0, 30.0)]
