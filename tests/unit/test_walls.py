"""Curved surfaces of parts from files by their limbs: whole outer ones, predicted as a turned part of the same size."""

import json
import math
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import trimesh

import planner
import scenes
from imaging.features.circles import RimImage, calibrated_circle
from planner.search.local import refine
from planner.search.objective import SearchProblem
from render.curved import stands_for
from scenes import InvalidInput
from scenes.load import from_document
from scenes.parts import step, walls
from scenes.parts.mesh import solid
from scenes.parts.recognised import cylinders
from scenes.parts.surfaces import Cone
from scenes.parts.walls import recognised_walls
from validation.report import scene_table

SENSOR = (10, 80)
kernel = pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")


def document(part: dict, names: tuple[str, ...]) -> dict:
    """The bundled shaft's scene about another part."""
    found = scenes.load("shaft").model_dump(mode="json", exclude_defaults=True)
    found.pop("name", None)
    measurands = [
        {"name": name, "kind": "diameter", "features": [{"surface": name}], "tolerance": 0.02} for name in names
    ]
    return found | {"object": part, "measurands": measurands, "settings": []}


def lathed(profile, sections: int, outside: bool = False) -> trimesh.Trimesh:
    """A turned part's facets about x; with their middles on it, and so the corners ``outside``."""
    line = np.array([(0.0, profile[0][0]), *((r, z) for z, r in profile), (0.0, profile[-1][0])])
    made = trimesh.creation.revolve(line, sections=sections)
    made.vertices = made.vertices @ np.eye(3)[[1, 2, 0]]
    made.vertices[:, 1:] /= math.cos(math.pi / sections) if outside else 1.0
    return made


def sigmas(scene) -> list[float]:
    return [m.variance_object**0.5 for m in planner.predict(scene, SENSOR).measurands]


def test_a_shaft_of_facets_is_the_turned_one(tmp_path):
    """Radii, ends and standard deviations within what single precision leaves."""
    whole = scenes.load("shaft")
    lathed(whole.object.profile, 96).export(tmp_path / "shaft.stl")
    part = {"kind": "mesh", "file": "shaft.stl"}
    scene = from_document(tmp_path / "a.toml", document(part, ("k1", "k2", "k3")))
    for own, other in zip(scene.solid.curved, whole.solid.curved, strict=True):
        assert own.radius == pytest.approx(other.radius, abs=3e-7)
        assert own.centre == pytest.approx(other.centre, abs=2e-6)
        assert np.abs(own.surface.axis @ other.surface.axis) == pytest.approx(1, abs=1e-12)
        assert len(own.faces) == 96
    assert sigmas(scene) == pytest.approx(sigmas(whole), rel=1e-6)


@pytest.mark.parametrize("sections", [24, 96])
def test_the_radius_is_that_of_the_corners(sections):
    """Facets that touch the surface in their middles have it too large by 1 / cos(pi / n): no residual tells."""
    made = recognised_walls(solid(lathed([(0, 5), (8, 5)], sections, outside=True)))
    assert made[0].radius == pytest.approx(5 / math.cos(math.pi / sections), rel=1e-9)


def test_what_nothing_is_measured_by_stays_its_facets(tmp_path):
    """Another wall, or none: no curved surface, and a lens that bends is as welcome as before."""
    lathed([(-30, 6), (-10, 6), (-10, 10), (30, 10)], 48).export(tmp_path / "shaft.stl")
    said = document({"kind": "mesh", "file": "shaft.stl"}, ("k2",))
    one = from_document(tmp_path / "a.toml", said)
    assert [wall.name for wall in one.solid.curved] == ["k2"]
    assert [wall.name for wall in one.all_walls.curved] == ["k1", "k2"]
    assert stands_for(one.solid).sum() == 48 + 2  # its facets, and the discs at its ends
    circle = {"name": "end", "kind": "diameter", "features": [{"circle": "c1"}]}
    said["camera"]["lens"] = {"distortion": [0.01, 0, 0, 0, 0]}
    assert not from_document(tmp_path / "a.toml", said | {"measurands": [circle]}).solid.curved
    with pytest.raises(InvalidInput, match="must be without distortion for a curved object"):
        from_document(tmp_path / "a.toml", said)
    wrong = {"name": "d", "kind": "diameter", "features": [{"surface": "k7"}]}
    with pytest.raises(InvalidInput, match="surface must be one of k1, k2, got 'k7'"):
        from_document(tmp_path / "a.toml", said | {"measurands": [wrong]})


def test_part_of_a_turn_and_a_bore_are_none():
    """A rod cut along its axis, and one cut at a slant; a tube has its outside alone."""
    rod = trimesh.creation.cylinder(2.0, 8.0, sections=48)
    half = trimesh.convex.convex_hull(rod.vertices[rod.vertices[:, 0] > -0.3])
    slant = rod.copy()
    slant.vertices[:, 2] += np.where(slant.vertices[:, 2] > 0, 0.2 * slant.vertices[:, 0], 0.0)
    assert len(cylinders(solid(half))) == len(cylinders(solid(slant))) == 1
    assert recognised_walls(solid(half)) == recognised_walls(solid(slant)) == ()
    tube = recognised_walls(solid(trimesh.creation.annulus(1.0, 2.0, 5.0, sections=48)))
    assert [round(wall.radius, 9) for wall in tube] == [2.0]


def test_listed_with_kind_and_residual():
    """A turned part's are exact; of a mesh what is left of their recognition is told."""
    exact = scene_table.facts(scenes.load("shaft"))["surfaces"]
    assert [(s["name"], s["kind"], s["radius"], s["residual"]) for s in exact] == [
        ("d1", "cylinder", 6.0, None), ("d2", "cylinder", 10.0, None), ("d3", "cylinder", 7.0, None),
    ]  # fmt: skip
    outside = scene_table.facts(scenes.load("flange"))["surfaces"]
    assert [(s["name"], round(s["radius"], 4), round(s["length"], 4)) for s in outside] == [("k1", 40.0, 10.0)]
    assert 0 < outside[0]["residual"] < 5e-6


def test_exact_walls_of_a_record():
    """The recorded flange: its outside alone, exact, by its number; every other cylinder of it is hollow."""
    record = json.loads((Path(__file__).parent / "flange.step.json").read_text())
    found = step.part(record).curved
    assert [(wall.name, wall.surface.kind, wall.radius) for wall in found] == [("k1", "cylinder", 40.0)]
    assert found[0].centre == pytest.approx([0, 0, 5], abs=1e-12)
    assert len(found[0].faces) == 24


@kernel
def test_a_step_shaft_is_the_turned_one(tmp_path):
    """Cylinders and a cone, the file's names, exact: predicted as the turned part of the same profile."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    from tests.step_parts import written

    def at(x):
        return gp_Ax2(gp_Pnt(x, 0, 0), gp_Dir(1, 0, 0))

    body = BRepPrimAPI_MakeCylinder(at(-30), 6.0, 20.0).Shape()
    for part in (BRepPrimAPI_MakeCylinder(at(-10), 10.0, 20.0), BRepPrimAPI_MakeCone(at(10), 9.0, 7.0, 20.0)):
        body = BRepAlgoAPI_Fuse(body, part.Shape()).Shape()
    names = {number: f"land {number}" for number in range(10)}
    written(body, tmp_path / "shaft.step", names)
    profile = [[-30, 6], [-10, 6], [-10, 10], [10, 10], [10, 9], [30, 7]]
    turned = {"kind": "turned", "axis": "x", "profile": profile}
    part = step.read(tmp_path / "shaft.step")
    walls = sorted(part.curved, key=lambda wall: wall.centre[0])
    assert [wall.surface.kind for wall in walls] == ["cylinder", "cylinder", "cone"]
    assert [wall.radius for wall in walls] == pytest.approx([6, 10, 8], rel=1e-9)
    assert all(wall.name.startswith("land ") for wall in walls)
    own = document({"kind": "step", "file": "shaft.step"}, tuple(wall.name for wall in walls))
    other = document(turned, ("d1", "d2", "d3"))
    both = [sigmas(from_document(tmp_path / "a.toml", each)) for each in (own, other)]
    assert both[0] == pytest.approx(both[1], rel=1e-6)


def test_short_pieces_of_a_rim_have_no_negative_variance(rng):
    """Where the pieces of a rim that can be used are shorter than errors are correlated, nothing is told of it."""
    angle = 2 * np.pi * (np.arange(64) + 0.5) / 64
    design = np.stack([np.cos(angle), np.sin(angle), np.ones(64)], -1)
    lengths = np.geomspace(1e-3, 10, 40)
    clear = rng.random((40, 64)) < 0.6
    rims = RimImage(design, np.broadcast_to(lengths[:, None], (40, 64)), np.ones((40, 64)), 1.0, clear)
    found = np.diagonal(calibrated_circle(rims, 0.1, 1.2, 0.0), axis1=-2, axis2=-1)
    assert (found > 0).all()
    assert np.isinf(found[0]).all()
    assert np.isfinite(found[-1]).all()


def test_refinement_begins_where_the_search_ended(task1):
    """Even where rounding says the other way whether a plane seen edge-on is seen."""
    start = np.array([40.0, 50.0]), np.array([30.0, 200.0])

    def value(sensor, light):
        return np.inf if (sensor == begun).all() else 1.0 + float(((sensor - [40, 52]) ** 2).sum())

    begun, problem = start[0], SearchProblem.of(task1, "calibrated", "object")
    told = [refine(problem, start, 5.0, value=value, known=known) for known in (5.0, 0.5)]
    assert 1 <= told[0].value < 1.1  # margin: a ratio of a minimum to where it began
    assert told[0][0] == pytest.approx([40, 52], abs=0.3)
    assert told[1].value == 0.5
    assert told[1][0] == pytest.approx(start[0])
    with pytest.raises(InvalidInput, match="must begin at a pose that is allowed"):
        refine(problem, start, 5.0, value=value)


@pytest.mark.parametrize(("slope", "radius", "found"), [(45.0, 1.01, True), (45.0, 0.99, False), (-45.0, 1.01, True),
                                                        (-45.0, 0.99, False)])  # fmt: skip
def test_a_cone_whose_apex_lies_between_its_ends_is_none(slope, radius, found):
    """Its wall is 2 long: either way its radius falls by 1 from the middle to an end."""
    rod = solid(trimesh.creation.cylinder(3.0, 2.0, sections=24))
    (whole,) = cylinders(rod)
    cone = Cone((0, 0, 0), (0, 0, 1), radius, (-0.1, 0.1), half_angle_deg=slope)
    wall = walls._whole(rod, "a", cone, whole.faces, 1e-9)
    assert (wall is not None) is found
    if wall is not None:
        assert (wall.radius, wall.surface.ends) == (pytest.approx(radius), pytest.approx((-1, 1)))


def test_walls_of_one_name_are_told_apart():
    """Two pins that a file calls alike, and one called as a corner is: the first keeps the name."""
    pins = [trimesh.creation.cylinder(r, 4.0, sections=24).apply_translation((9.0 * r, 0, 0)) for r in (1.0, 2.0, 3.0)]
    made = solid(trimesh.util.concatenate(pins))
    found = {round(each.surface.radius): each for each in cylinders(made)}
    owners = np.full(len(made.faces), 3)
    for r, each in found.items():
        owners[list(each.faces)] = r - 1
    surfaces = (*(found[r].surface for r in (1, 2, 3)), None)
    named = walls.exact_walls(made, owners, surfaces, ("pin", "pin", made.vertex_names[0], ""))
    assert {wall.name: round(wall.radius) for wall in named} == {"pin": 1, "k2": 2, "k3": 3}
    apart = walls.exact_walls(made, owners, surfaces, ("a", "b", "c", ""))
    assert {wall.name: round(wall.radius) for wall in apart} == {"a": 1, "b": 2, "c": 3}
