"""Arcs of circles among the boundaries of plane faces: which there are, their names, and how they are sampled."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
import trimesh

import planner
import scenes
from imaging.features.circles import LEAST_SEEN, rim
from imaging.features.locator import reach
from imaging.features.rim_look import look
from imaging.features.rim_sides import within_ends
from imaging.geometry.projection import project_ideal
from imaging.pictures import Pictures
from measure.features.rim_fit import Curve
from measure.features.rims import find_circle
from scenes import Picture
from scenes.measurands.proposed import proposed
from scenes.parts import mesh
from scenes.parts.arcs import LEAST_TURN, arcs
from tests import parts
from tests.oracle import polygon_image
from tests.proofs.arcs import as_if_whole, scene_of

kernel = pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")


def upper(solid):
    return [arc for arc in solid.arcs if arc.axis[2] > 0.5]


@pytest.mark.parametrize(
    ("made", "turn", "radius", "centre", "hole"),
    [
        (lambda: parts.cornered(60), 60, 10, (10, 10), False),
        (lambda: parts.cornered(90), 90, 10, (10, 10), False),
        (parts.notched, 180, 8, (25, 0), True),
        (lambda: parts.notched(240), 240, 8, (25, 4), True),
    ],
    ids=["corner of 60 degrees", "corner of 90 degrees", "half bore", "two thirds of a bore"],
)
def test_an_arc_on_both_sides_of_a_plate(made, turn, radius, centre, hole):
    """As drawn to 1e-9; counter-clockwise around the normal of its face, whichever way the boundary runs."""
    solid = mesh.solid(made())
    assert [arc.name for arc in solid.arcs] == ["c1", "c2"]
    assert solid.circles == ()
    for arc, height in zip(solid.arcs, (0.0, 8.0), strict=True):
        np.testing.assert_allclose(arc.centre, [*centre, height], atol=1e-9)
        assert (arc.radius, arc.hole) == (pytest.approx(radius, abs=1e-9), hole)
        assert np.degrees(arc.turn) == pytest.approx(turn, abs=1e-7)
        pieces = solid.vertices[[solid.edge(name).ends for name in arc.edges]]
        spokes = (pieces.mean(1) - arc.centre) / arc.radius
        one = (arc.ends[0] - arc.centre) / arc.radius
        angle = np.arctan2(spokes @ np.cross(arc.axis, one), spokes @ one) % (2 * np.pi)
        step = np.radians(turn) / len(arc.edges)
        np.testing.assert_allclose(angle, step * (np.arange(len(arc.edges)) + 0.5), atol=1e-7)
        np.testing.assert_allclose(arc.around(2), arc.ends, atol=1e-9)
        assert solid.circle(arc.name) is solid.round(arc.name) is arc


def test_the_round_ends_of_a_slot_beside_whole_circles():
    """Numbered after the circles, whose names stay; its straight sides are straight edges still."""
    solid = mesh.solid(parts.newcomers_plate())
    assert [circle.name for circle in solid.circles] == [f"c{i}" for i in range(1, 7)]
    assert [arc.name for arc in solid.arcs] == [f"c{i}" for i in range(7, 11)]
    assert sorted(arc.centre.round(9).tolist() for arc in upper(solid)) == [[18, 15, 8], [28, 15, 8]]
    assert all(np.degrees(arc.turn) == pytest.approx(180) and arc.hole for arc in solid.arcs)
    assert sum(solid.length(edge) == pytest.approx(10) for edge in solid.sharp) == 4
    used = [name for circle in solid.rims for name in circle.edges]
    assert len(used) == len(set(used))


def test_arcs_of_other_radii_in_a_row_are_told_apart():
    """An outline of four tangent arcs of 90 degrees, of 6 or 18 mm, without a straight piece; an ellipse has none."""
    outline = np.concatenate([
        parts.arc(centre, radius, begin, begin + 90)[:-1] for centre, radius, begin in (
            ((0, -12), 18, 45), ((-8.485281374239, -3.514718625761), 6, 135),
            ((0, 4.970562748477), 18, 225), ((8.485281374239, -3.514718625761), 6, -45),
        )
    ])  # fmt: skip
    solid = mesh.solid(parts.plate(outline, 5.0))
    found = sorted((round(arc.radius, 6), round(np.degrees(arc.turn), 4)) for arc in upper(solid))
    assert found == [(6.0, 90.0)] * 2 + [(18.0, 90.0)] * 2
    t = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    assert mesh.solid(parts.plate(np.column_stack([20 * np.cos(t), 12 * np.sin(t)]), 5.0)).arcs == ()


@pytest.mark.parametrize(("turn", "step", "count"), [(32, 4, 2), (28, 4, 0), (60, 15, 2), (60, 20, 0)])
def test_what_is_too_short_is_none(turn, step, count):
    """At least 30 degrees in at least four pieces."""
    rounded = parts.arc((10.0, 10.0), 10.0, 225 - turn / 2, 225 + turn / 2, step)
    outline = np.concatenate([[[-8.0, 28.0]], rounded, [[28.0, -8.0], [38.0, 38.0]]])
    assert len(mesh.solid(parts.plate(outline, 8.0)).arcs) == count
    assert np.degrees(LEAST_TURN) == pytest.approx(30)


@pytest.mark.parametrize(("off", "count"), [(2e-4, 2), (4e-3, 0)])
def test_vertices_off_the_circle_count_beside_the_height_of_the_arc(off, count):
    """A quarter of a circle of 10 mm is 2.93 mm high; vertices stand out by less, or more, than 1e-3 of it."""
    rounded = parts.arc((10.0, 10.0), 10.0, 180, 270)
    away = (rounded - 10) / 10
    rounded = rounded + off * np.where(np.arange(len(rounded)) % 2, 1.0, 0.0)[:, None] * away
    outline = np.concatenate([rounded, [[40.0, 0.0], [40.0, 40.0], [0.0, 40.0]]])
    assert len(mesh.solid(parts.plate(outline, 8.0)).arcs) == count


def test_single_precision_and_another_place(tmp_path):
    """An STL far from the origin: the same arcs, centre and radius to 1e-4 mm."""
    part = parts.notched()
    part.apply_translation([200.0, -100.0, 50.0])
    part.export(tmp_path / "part.stl")
    there, here = mesh.read(tmp_path / "part.stl").arcs, mesh.solid(parts.notched()).arcs
    assert [arc.name for arc in there] == [arc.name for arc in here]
    for one, other in zip(there, here, strict=True):
        np.testing.assert_allclose(one.centre - [200, -100, 50], other.centre, atol=1e-4)
        assert (one.radius, one.turn) == (pytest.approx(other.radius, abs=1e-4), pytest.approx(other.turn, abs=1e-4))


def test_a_part_without_any():
    assert mesh.solid(parts.bracket()).arcs == ()
    assert arcs(scenes.load("task1").solid) == ()
    assert mesh.solid(trimesh.creation.icosphere(3)).arcs == ()


@kernel
def test_a_step_file_has_the_arcs_of_its_mesh(tmp_path):
    """A plate with bores over its edges: three quarters, half and a quarter, exact; the mesh of it says the same."""
    from scenes.parts import step
    from tests.step_parts import drilled, written

    holes = [(30.0, 0.0, 6.0), (10.0, 40.0 - 2.0, 5.0), (60.0, 40.0, 8.0), (45.0, 20.0, 4.0)]
    solid = step.read(written(drilled((60, 40, 10), holes), tmp_path / "part.step")).solid
    found = {(*arc.centre.tolist(), arc.radius): float(np.degrees(arc.turn)) for arc in upper(solid)}
    more = 180 + 2 * np.degrees(np.arcsin(2 / 5))
    assert found == {
        (30.0, 0.0, 10.0, 6.0): pytest.approx(180), (10.0, 38.0, 10.0, 5.0): pytest.approx(more),
        (60.0, 40.0, 10.0, 8.0): pytest.approx(90),
    }  # fmt: skip
    solid.mesh().export(tmp_path / "part.stl")
    plain = mesh.read(tmp_path / "part.stl")
    assert [arc.name for arc in solid.arcs] == [arc.name for arc in plain.arcs]
    for one, other in zip(solid.arcs, plain.arcs, strict=True):
        np.testing.assert_allclose([*one.centre, one.radius], [*other.centre, other.radius], atol=1e-4)
        np.testing.assert_allclose(one.ends, other.ends, atol=1e-4)


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    """A rounded corner of 90 degrees, its upper arc, and a picture of it."""
    scene = scene_of(parts.cornered(90), tmp_path_factory.mktemp("part"))
    return scene, upper(scene.solid)[0], Pictures.of(scene, (20, 230), (40, 20))


def test_places_lie_between_the_ends(corner):
    """In equal steps; of a whole circle all around as ever."""
    _, arc, _ = corner
    places = arc.at(arc.angles(8))
    np.testing.assert_allclose(places, arc.around(17)[1::2], atol=1e-9)
    np.testing.assert_allclose(replace(arc, ends=None).angles(8), 2 * np.pi * (np.arange(8) + 0.5) / 8)


def test_places_near_the_ends_are_none(corner):
    """By the reach of the locator, in the image."""
    scene, arc, pictures = corner
    angle = arc.angles(400)
    scale = scene.camera.focal_px / scene.camera.distance
    away = scale * arc.radius * np.minimum(angle - angle[0], angle[-1] - angle)
    kept = within_ends(pictures, arc, angle)
    far = reach(scene.locator.scale_px, scene.camera.blur_px)
    assert kept[away > 1.1 * far].all()  # margin: seen from 20 degrees, lengths are up to 6 % shorter
    assert not kept[away < 0.9 * far].any()
    assert within_ends(pictures, replace(arc, ends=None), angle).all()
    seen = rim(pictures, arc)
    assert (seen.squared[~within_ends(pictures, arc, arc.angles(seen.squared.size))] == 0).all()
    assert seen.left == pytest.approx(0.25 * kept.mean(), abs=0.01)


def test_lengths_add_up_to_the_arc(corner):
    """Seen from straight above: a quarter of the circle's perimeter."""
    scene, arc, _ = corner
    seen = rim(Pictures.of(scene, np.array([0.0, 0.0]), np.array([40.0, 20.0])), arc)
    depth = scene.camera.distance  # the camera looks at the arc
    assert seen.arc.sum() == pytest.approx(scene.camera.focal_px / depth * arc.radius * np.pi / 2, rel=1e-3)


def test_a_look_is_told_between_its_places_and_not_beyond(corner):
    """At the places themselves as it is; beyond the last one as there."""
    _, arc, pictures = corner
    seen = look(pictures, arc)
    again = seen.at(arc.angles(seen.shift.size))
    np.testing.assert_allclose(again.squared, seen.squared, atol=1e-6)
    np.testing.assert_allclose(again.share, seen.share, atol=1e-9)
    ends = seen.at(np.array([arc.begin, arc.begin + arc.turn]))
    np.testing.assert_allclose(ends.squared, seen.squared[[0, -1]])


@pytest.fixture(scope="module")
def smooth_corner(tmp_path_factory):
    """A plate whose corner at the origin is rounded by 10 mm, in steps of half a degree."""
    outline = np.concatenate([parts.arc((10.0, 10.0), 10.0, 180.0, 270.0, 0.5), [[35, 0], [35, 35], [0, 35]]])
    return scene_of(parts.plate(outline, 8.0), tmp_path_factory.mktemp("part"))


def _off(scene, phase=0.0, move=0.0):
    """Errors (3,), px, of its arc in an exact picture from straight above, where it ends along a row and a column, at a
    place between pixels, by which the camera is moved, and ``move`` px each way from where it is expected.
    """
    camera = scene.camera
    away = 10.0 + phase * camera.distance / camera.focal_px
    scene = scene.with_(camera=camera.model_copy(update={"look_at": (away, away, 8.0)}))
    (arc,) = upper(scene.solid)
    loop = scene.solid.vertices[list(scene.solid.faces[arc.face])]
    outline = project_ideal(loop, np.array([0.0, 0.0]), scene.camera) + move
    image = polygon_image(outline, (camera.height, camera.width), camera.blur_px)
    found = find_circle(image[None], Picture.of(scene, (0, 0)), arc.name)
    assert found.state == ["ok"]
    return found.errors[0] * camera.focal_px / camera.distance - [move, move, 0.0]


PHASES = (0.0, 0.2, 0.4, 0.6, 0.8)


def test_an_arc_is_found_wherever_in_its_pixels_it_lies(smooth_corner, monkeypatch):
    """Centre and radius to 0.001 px; without what sampling by pixels does they go up and down with the place."""
    off = np.array([_off(smooth_corner, phase) for phase in PHASES])
    assert np.abs(off).max() < 1e-3
    monkeypatch.setattr(Curve, "sampled", lambda self, moved, optics, amplitude: 0 * moved)
    assert np.ptp([_off(smooth_corner, phase)[2] for phase in PHASES]) > 0.01


def test_an_arc_that_is_shifted_along_itself_turns_away(smooth_corner, monkeypatch):
    """By 0.6 px each way, to 0.006 px, 0.004 px of which come from values half a px apart; without the second order,
    d^2 / (2 R) along a tangent, twice that.
    """
    assert np.abs(_off(smooth_corner, move=0.6)).max() < 0.006
    monkeypatch.setattr(Curve, "second_order", lambda self, found: np.zeros((len(found), self.bend.size)))
    assert _off(smooth_corner, move=0.6)[2] < -0.01


def test_a_short_arc_is_said_to_be(tmp_path):
    """Of 40 degrees on 10 mm less than 36 are left off its ends: not measured, with the number; nearer it is."""
    scene = scene_of(parts.cornered(40), tmp_path)
    expected = planner.predict(scene, (20, 230), (40, 20)).measurands[0]
    assert expected.status == "short"
    assert expected.reason.startswith("3")
    assert expected.reason.endswith("degrees of arc c2 lie well off its ends in this picture; at least 36 are needed")
    assert pytest.approx(0.1) == LEAST_SEEN
    near = scene.with_(camera=scene.camera.model_copy(update={"distance": 100.0}))
    assert planner.predict(near, (20, 230), (40, 20)).measurands[0].status == "ok"


@pytest.mark.parametrize("model", ["calibrated", "bound", "paper"])
def test_a_convex_part_of_which_no_straight_edge_is_asked_for(corner, model):
    """Every model has its variance, hundreds of times what a whole circle would have."""
    scene, arc, _ = corner
    expected = planner.predict(scene, (20, 230), (40, 20), model=model).measurands[0]
    assert expected.status == "ok"
    whole = as_if_whole(Picture.of(scene, (20, 230), (40, 20)), arc)[2, 2]
    assert expected.variance_object > 20**2 / 2 * 4 * whole


def test_slots_and_half_bores_are_proposed():
    """A slot by the distance of its ends and one width; rounded corners are not."""
    found = {each.name for each in proposed(mesh.solid(parts.slotted()), "mm")}
    assert {"distance c1 c3", "distance c2 c4", "diameter c1", "diameter c2"} <= found
    assert not {"diameter c3", "diameter c4", "distance c1 c2"} & found
    assert "diameter c1" in {each.name for each in proposed(mesh.solid(parts.notched()), "mm")}
    assert not any("c1" in each.name for each in proposed(mesh.solid(parts.cornered(90)), "mm"))
