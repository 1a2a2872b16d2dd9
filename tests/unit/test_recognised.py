"""Cylinders recognised among a mesh's facets."""

import numpy as np
import pytest
import trimesh

import scenes
from scenes.parts import recognised
from scenes.parts.mesh import solid
from scenes.parts.recognised import _turn, cylinders
from tests.parts import bracket, prism, unevenly
from validation.report import scene_table


def turned(mesh: trimesh.Trimesh, seed: int) -> tuple[trimesh.Trimesh, np.ndarray]:
    """Somewhere else in space, and the rotation."""
    frame = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    frame *= np.sign(np.linalg.det(frame))
    move = np.eye(4)
    move[:3, :3], move[:3, 3] = frame, (3.0, -2.0, 7.0)
    return mesh.copy().apply_transform(move), frame


@pytest.mark.parametrize("sections", [12, 48, 200])
def test_a_rod(sections):
    """Radius, axis and ends to rounding, however many facets."""
    mesh, frame = turned(trimesh.creation.cylinder(2.0, 5.0, sections=sections), sections)
    found = cylinders(solid(mesh))
    assert [each.name for each in found] == ["k1"]
    surface = found[0].surface
    assert surface.radius == pytest.approx(2.0, rel=1e-9)
    assert abs(surface.axis @ frame[:, 2]) == pytest.approx(1, abs=1e-12)
    assert np.diff(surface.ends)[0] == pytest.approx(5.0, rel=1e-9)
    assert found[0].residual < 1e-9
    assert found[0].turn_deg == pytest.approx(360)
    assert not surface.hollow


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_a_rod_of_any_size_is_none_s_wall(size):
    mesh = trimesh.creation.cylinder(2.0 * size, 5.0 * size, sections=24)
    tube = trimesh.creation.annulus(1.0 * size, 2.0 * size, 5.0 * size, sections=24)
    assert [each.surface.hollow for each in cylinders(solid(mesh))] == [False]
    assert {round(each.surface.radius / size): each.surface.hollow for each in cylinders(solid(tube))} == {
        1: True, 2: False,
    }  # fmt: skip


def test_single_precision_leaves_its_residual():
    mesh, _ = turned(trimesh.creation.cylinder(2.0, 5.0, sections=64), 1)
    mesh = trimesh.load_mesh(trimesh.util.wrap_as_stream(mesh.export(file_type="stl")), file_type="stl")
    found = cylinders(solid(mesh))[0]
    assert 1e-9 < found.residual <= found.largest < 2e-6  # margin: single precision: 2^-24 of 2 units and their fit
    assert found.surface.radius == pytest.approx(2.0, abs=2e-6)


def test_noise_of_vertices_is_the_residual():
    """Both rims off by the same noise of sigma, so that facets stay plane: the root mean square is sigma."""
    rng, sections, sigma = np.random.default_rng(5), 400, 2e-5
    mesh = trimesh.creation.cylinder(2.0, 5.0, sections=sections)
    x, y, _ = mesh.vertices.T
    number = np.round(np.arctan2(y, x) * sections / (2 * np.pi)).astype(int) % sections
    noise = rng.normal(size=sections)
    mesh.vertices[:, :2] *= 1 + sigma / 2.0 * noise[number][:, None]
    found = cylinders(solid(mesh))[0]
    expected = sigma * np.std(noise) * np.sqrt(1 - 2 / sections)  # less the mean, and two shifts
    assert found.residual == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("quarter", [False, True])
def test_the_axis_is_that_of_the_residual(quarter, rng):
    """Distances of noisy vertices from the axis that is told, less the radius, have the residual that is told."""
    sections = 48
    angle = np.linspace(0, 2 * np.pi / (4 if quarter else 1), sections, endpoint=quarter)
    radii = 2.0 + 1e-5 * rng.normal(size=sections)
    ring = np.stack([radii * np.cos(angle), radii * np.sin(angle)], 1)
    wall = np.concatenate([np.column_stack([ring, np.full(sections, z)]) for z in (0.0, 5.0)])
    corners = [[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]] if quarter else np.empty((0, 3))
    mesh, frame = turned(trimesh.convex.convex_hull(np.concatenate([wall, corners])), 11)
    found = cylinders(solid(mesh))[0]
    away = wall @ frame.T + [3.0, -2.0, 7.0] - found.surface.point
    off = np.linalg.norm(np.cross(away, found.surface.axis), axis=1) - found.surface.radius
    assert np.sqrt(np.mean(off**2)) == pytest.approx(found.residual, rel=1e-6)
    assert found.residual < 1.2e-5


def test_the_cylinder_that_is_told_is_the_nearest_to_its_vertices(rng):
    """A quarter whose radii fall by a thousandth from side to side: no other axis or radius leaves less."""
    angle = np.linspace(0, np.pi / 2, 30)
    radii = 2.0 + 1e-3 * np.cos(3 * angle) + 2e-4 * rng.normal(size=30)
    outline = [(0.0, 0.0), *np.column_stack([radii * np.cos(angle), radii * np.sin(angle)]).tolist()]
    mesh, _ = turned(prism(outline, 5.0), 3)
    made = solid(mesh)
    (found,) = cylinders(made)
    points = made.vertices[np.unique([v for f in found.faces for v in made.faces[f]])]
    surface = found.surface
    beside = np.linalg.svd(surface.axis[None])[2][1:]

    def off(shift=(0.0, 0.0), larger=0.0):
        away = points - surface.point - np.array(shift) @ beside
        return np.linalg.norm(np.cross(away, surface.axis), axis=1) - surface.radius - larger

    assert np.sqrt(np.mean(off() ** 2)) == pytest.approx(found.residual, rel=1e-9)
    assert np.abs(off()).max() == pytest.approx(found.largest, rel=1e-9)
    for step in np.concatenate([np.eye(3), -np.eye(3)]) * 1e-5:
        # margin: an inequality: the least is told
        assert np.mean(off(step[:2], step[2]) ** 2) > found.residual**2


def test_walls_of_holes_are_hollow():
    """A bracket's two bores of unequal facets, turned in space: radii 4 and 5 mm, 12 and 6 mm deep."""
    mesh, frame = turned(bracket(angles=unevenly(np.random.default_rng(2), 60)), 4)
    found = cylinders(solid(mesh))
    assert len(found) == 2
    for each, (radius, deep) in zip(
        sorted(found, key=lambda f: f.surface.radius), ((4.0, 12.0), (5.0, 6.0)), strict=True
    ):
        assert each.surface.hollow
        assert each.surface.radius == pytest.approx(radius, rel=1e-8)
        assert np.diff(each.surface.ends)[0] == pytest.approx(deep, rel=1e-8)
        assert abs(each.surface.axis @ frame[:, 2]) == pytest.approx(1, abs=1e-10)
        assert each.residual < 1e-8


@pytest.mark.parametrize("far", [(900.0, 0.0, 0.0), (0.0, -900.0, 0.0), (-900.0, 900.0, 0.0)])
@pytest.mark.parametrize("hollow", [False, True])
def test_what_is_hollow_is_so_anywhere(hollow, far):
    """A tube's two walls, far off the origin and off its axis."""
    found = cylinders(solid(trimesh.creation.annulus(2.0, 3.0, 5.0).apply_translation(far)))
    assert [each.surface.hollow for each in found if (each.surface.radius < 2.5) == hollow] == [hollow]


@pytest.mark.parametrize("far", [(0.0, 0.0), (900.0, 0.0), (0.0, -900.0), (-900.0, 300.0), (300.0, 900.0)])
@pytest.mark.parametrize("hollow", [False, True])
def test_what_is_hollow_is_so_where_facets_go_a_quarter_round(hollow, far):
    """A fillet and its opposite, wherever they are: the normals of a whole wall add up to nothing, theirs do not."""
    angle = np.radians(np.linspace(0, 90, 13))
    middle = (9.0, 7.0) if hollow else (5.0, 3.0)
    arc = np.column_stack([np.cos(angle), np.sin(angle)]) * (-4.0 if hollow else 4.0) + middle
    outline = [*((0.0, 0.0), (9.0, 0.0)), *(arc[::-1] if hollow else arc).tolist(), (0.0, 7.0)]
    made = prism(outline, 6.0).apply_translation((far[0], 0.0, far[1]))
    (found,) = cylinders(solid(made))
    assert found.surface.hollow is hollow
    assert (found.surface.radius, found.turn_deg) == (pytest.approx(4.0), pytest.approx(90.0))


def test_a_cone_a_box_and_a_ball_are_none():
    for mesh in (
        trimesh.creation.cone(2.0, 3.0, sections=48),
        trimesh.creation.box((1, 2, 3)),
        trimesh.creation.icosphere(subdivisions=3),
    ):
        assert cylinders(solid(mesh)) == ()


def test_listed_with_their_residuals():
    """What ``ice show`` lists of the bundled bracket: both bores, their diameters within single precision."""
    walls = scene_table.facts(scenes.load("bracket_mm"))["cylinders"]
    assert [(w["name"], round(w["diameter"], 4), w["hole"]) for w in walls] == [("k1", 8.0, True), ("k2", 10.0, True)]
    assert all(0 < w["residual"] <= w["largest"] < 1e-5 for w in walls)  # margin: the order is said


def test_ends_are_where_the_rod_ends():
    """Counted along the axis from its point, wherever in space the rod stands."""
    mesh, _ = turned(trimesh.creation.cylinder(2.0, 5.0, sections=36), 8)
    (found,) = cylinders(solid(mesh))
    surface, middle = found.surface, np.array([3.0, -2.0, 7.0])
    ends = surface.point + np.array(surface.ends)[:, None] * surface.axis

    assert ends == pytest.approx(middle + np.array([[-2.5], [2.5]]) * surface.axis, abs=1e-9)


def test_how_far_round_facets_go(rng):
    """From the first facet's middle to the last one's and a mean step more; all round where no gap is wide."""
    axis, one, two = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])

    def turn(degrees):
        angles = np.radians(rng.permutation(degrees))
        return np.degrees(_turn(np.cos(angles)[:, None] * one + np.sin(angles)[:, None] * two, axis))

    assert turn([160.0, 170.0, 185.0, 190.0, 210.0]) == pytest.approx(50 + 12.5)  # across the half turn
    assert turn([10.0, 100.0, 190.0, 250.0]) == pytest.approx(360)  # steps of 90, 90, 60 and 120
    assert turn([10.0, 100.0, 180.0, 230.0]) == pytest.approx(360 - 140 + 220 / 3)


@pytest.mark.parametrize(("radius", "is_one"), [(2.0, True), (0.0, False), (1e8, False)])
def test_a_cylinder_has_a_radius(monkeypatch, radius, is_one):
    """Where the fit ends at none, or at a plane's, its facets are no cylinder's."""
    fitted = recognised._least_squares
    monkeypatch.setattr(recognised, "_least_squares", lambda *how: (*fitted(*how)[:2], radius, np.zeros(48)))
    assert bool(cylinders(solid(trimesh.creation.cylinder(2.0, 5.0, sections=24)))) is is_one
