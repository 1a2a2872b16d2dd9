"""Geometric tolerances of a file as measurands, on parts whose faces are known by where they are."""

from importlib.util import find_spec

import numpy as np
import pytest

from scenes.measurands.drawn import drawn
from scenes.measurands.drawn_material import asks_for_material, with_material
from scenes.parts import step
from scenes.parts.pmi import Characteristic, Pmi
from scenes.parts.surfaces import Cylinder, Plane
from tests import step_parts
from validation import new_scene

pytestmark = pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")

BORES = ((8.0, 8.0, 3.0), (52.0, 8.0, 3.5), (30.0, 32.0, 4.0))


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """60 x 40 x 6 mm with three bores and a square boss of 10 mm in its middle."""
    shape = step_parts.drilled((60.0, 40.0, 6.0), list(BORES), [(25.0, 15.0, 10.0, 5.0)])
    return step.read(step_parts.written(shape, tmp_path_factory.mktemp("block") / "block.step"))


def numbers(part, wanted):
    """Of a part's faces in its file: planes by normal and distance from the origin, bores by their radius."""
    found = []
    for face, surface in enumerate(part.surfaces):
        if isinstance(wanted, tuple):
            normal, height = wanted
            level = isinstance(surface, Plane) and np.allclose(surface.normal, normal)
            if level and np.isclose(np.dot(surface.point, normal), height):
                found.append(part.places[face])
        elif isinstance(surface, Cylinder) and np.isclose(surface.radius, wanted):
            found.append(part.places[face])
    assert found
    return tuple(found)


def asked(part, kind, of, datums=(), zone=0.2, unit="mm", **facts):
    """What becomes of a tolerance of faces, each letter's datum given by its face."""
    faces = sum((numbers(part, each) for each in of), ())
    letters = {letter: numbers(part, each) if each else () for letter, each in zip("ABC", datums, strict=False)}
    each = Characteristic(1, kind, zone=zone, faces=faces, datums=tuple(letters), **facts)
    order = {place: place for place in part.places}
    (found,) = drawn(part, Pmi((each,), letters, order), unit)
    return found


def told(found):
    """Kind, edges and limit of the first candidate of the first feature."""
    first = found.candidates[0][0]
    return first.kind, first.tolerance.plus


TOP, LEFT, FRONT, RIGHT = ((0, 0, 1), 6.0), ((-1, 0, 0), 0.0), ((0, -1, 0), 0.0), ((1, 0, 0), 60.0)


@pytest.mark.parametrize(
    ("datums", "kind", "limit"),
    [
        ((TOP, FRONT, LEFT), "true_position", 0.2),
        ((TOP, 3.0, 3.5), "true_position", 0.2),
        ((TOP, 3.0, FRONT), "true_position", 0.2),
        ((TOP, 3.0), "distance", 0.1),
        ((TOP, FRONT), "offset", 0.1),
    ],
)
def test_positions_of_a_bore(block, datums, kind, limit):
    """In two datums about a true place; of one datum half of the diameter to either side of a true distance."""
    found = asked(block, "position", [4.0], datums, is_round=True)
    assert told(found) == (kind, limit)
    circles = {circle.name: circle for circle in block.solid.circles}
    measurand = found.candidates[0][0]
    assert circles[measurand.features[0].circle].radius == pytest.approx(4.0)
    heights = {
        round(float(circles[each.circle].centre[2]), 6) for each in measurand.features if hasattr(each, "circle")
    }
    assert len(heights) == 1
    assert "position #1" in measurand.name


def test_the_scenes_unit(block):
    found = asked(block, "position", [4.0], (TOP, FRONT, LEFT), zone=0.254, unit="inch", is_round=True)
    assert told(found) == ("true_position", pytest.approx(0.01))


def test_a_boss_in_the_middle_of_the_plate(block):
    """Its two sides about those of the plate, in the plane of the plate's top."""
    sides = [((-1, 0, 0), -25.0), ((1, 0, 0), 35.0)]
    letters = {"A": (*numbers(block, LEFT), *numbers(block, RIGHT))}
    faces = sum((numbers(block, each) for each in sides), ())
    each = Characteristic(1, "symmetry", zone=0.2, faces=faces, datums=("A",))
    (found,) = drawn(block, Pmi((each,), letters, {place: place for place in block.places}), "mm")
    assert told(found) == ("symmetry", 0.2)
    for line in found.candidates[0][0].features:
        ends = block.solid.vertices[list(block.solid.edge(line.centre_line[0]).ends)]
        assert ends[:, 2] == pytest.approx([6.0, 6.0])


def test_the_middle_of_two_planes_from_a_datum_plane_and_from_bores(block):
    """By its distance: half of the zone's width to either side."""
    sides = [((-1, 0, 0), -25.0), ((1, 0, 0), 35.0)]
    for datums, feature in (((TOP, LEFT), "edge"), ((TOP, 3.0, 3.5), "square_at")):
        found = asked(block, "position", sides, datums)
        assert told(found) == ("width", 0.1)
        assert hasattr(found.candidates[0][0].features[1], feature)
    front = [((0, -1, 0), -15.0), ((0, 1, 0), 25.0)]
    assert hasattr(asked(block, "position", front, (TOP, 3.0, 3.5)).candidates[0][0].features[1], "through")


@pytest.mark.parametrize(
    ("kind", "of", "datum"),
    [("parallelism", RIGHT, LEFT), ("perpendicularity", FRONT, LEFT), ("parallelism", TOP, ((0, 0, -1), 0.0))],
)
def test_turns_of_a_plane(block, kind, of, datum):
    """By an edge of each in one face; the first is the tolerance's, the second the datum's."""
    found = asked(block, kind, [of], (datum,))
    assert told(found) == (kind, 0.2)
    for measurand in found.candidates[0]:
        for feature, (normal, height) in zip(measurand.features, (of, datum), strict=True):
            ends = block.solid.vertices[list(block.solid.edge(feature.edge).ends)]
            assert ends @ np.array(normal) == pytest.approx([height, height])


def test_rims_about_one_axis(tmp_path):
    part = step.read(step_parts.written(step_parts.flange(), tmp_path / "flange.step"))
    found = asked(part, "coaxiality", [40.0], (12.0,), is_round=True)
    assert told(found) == ("concentricity", 0.2)
    radii = {circle.name: circle.radius for circle in part.solid.circles}
    assert [radii[each.circle] for each in found.candidates[0][0].features] == pytest.approx([40.0, 12.0])


def test_straightness_of_a_plane(block):
    """By edges of the plane whose other face is the larger one, so that they are seen to bend as the plane does."""
    found = asked(block, "straightness", [FRONT], ())
    assert told(found) == ("straightness", 0.2)
    solid = block.solid
    for measurand in found.candidates[0]:
        (edge,) = (solid.edge(feature.edge) for feature in measurand.features)
        assert solid.vertices[list(edge.ends)][:, 1] == pytest.approx([0.0, 0.0])
        other = [face for face in edge.faces if not np.allclose(solid.normals[face], (0, -1, 0))]
        assert solid.areas[other[0]] > min(solid.areas[list(edge.faces)])
    lengths = [solid.length(solid.edge(each.features[0].edge)) for each in found.candidates[0]]
    assert lengths == sorted(lengths, reverse=True)


def test_roundness_of_a_bore(block):
    """By either of its rims."""
    found = asked(block, "roundness", [4.0], ())
    assert told(found) == ("roundness", 0.2)
    radii = {circle.name: circle.radius for circle in block.solid.circles}
    assert [radii[each.features[0].circle] for each in found.candidates[0]] == pytest.approx([4.0, 4.0])


@pytest.mark.parametrize(
    ("kind", "of", "datums", "facts", "reason"),
    [
        ("position", [4.0], (TOP, FRONT, LEFT), {}, "its zone is between two planes"),
        ("position", [4.0], (TOP,), {"is_round": True}, "its datums fix no place in the plane"),
        ("position", [4.0], (TOP, FRONT, None), {"is_round": True}, "of no face what datum C is"),
        ("position", [4.0], (TOP, FRONT, LEFT), {"zone": None}, "gives no size of the zone"),
        ("position", [4.0], (TOP, FRONT, LEFT), {"zone": 0.0, "modifiers": ("M",)}, "is 0 at maximum material"),
        ("perpendicularity", [4.0], (TOP,), {"is_round": True}, "the direction of an axis"),
        ("perpendicularity", [FRONT], (), {}, "no edge or circle of it lies in one plane"),
        ("flatness", [TOP], (), {}, "form of a whole surface"),
        ("total runout", [4.0], (), {}, "form of a whole surface"),
        ("profile of a line", [TOP], (FRONT,), {}, "about a place in its datums"),
        ("straightness", [4.0], (), {}, "are no edges of the part"),
        ("roundness", [TOP], (), {}, "no rim of it is an edge"),
    ],
)
def test_reasons(block, kind, of, datums, facts, reason):
    found = asked(block, kind, of, datums, **facts)
    assert found.candidates == ()
    assert reason in found.reason


def test_a_radius_of_a_bore(block):
    each = Characteristic(1, "radius", value=3.0, plus=0.1, minus=0.1, faces=numbers(block, 3.0))
    (found,) = drawn(block, Pmi((each,), {}, {place: place for place in block.places}), "mm")
    assert told(found) == ("radius", 0.1)


def sized(block, **facts):
    """A bore's position with M and the diameters of two bores, the second with limits if any; what becomes of them."""
    letters = {"A": numbers(block, TOP), "B": numbers(block, 3.0), "C": numbers(block, 3.5)}
    each = (
        Characteristic(1, "diameter", value=6.0, plus=0.1, minus=0.1, faces=numbers(block, 3.0)),
        Characteristic(2, "diameter", value=8.0, faces=numbers(block, 4.0), **facts),
        Characteristic(3, "position", zone=0.2, is_round=True, faces=numbers(block, 4.0), datums=tuple("ABC"),
                       modifiers=("M",)),
    )  # fmt: skip
    asked_for = drawn(block, Pmi(each, letters, {place: place for place in block.places}), "mm")
    return asked_for, [row[0] for found in asked_for for row in found.candidates]


def test_a_zone_with_the_modifier_m_grows_with_the_bores_diameter(block):
    """Of the same bore, at whichever rim; where the file gives that no limits it stays as at maximum material."""
    asked_for, measurands = sized(block, plus=0.2, minus=0.05)
    assert asks_for_material(asked_for) == {m.name for row in asked_for[2].candidates for m in row}
    one, own, place = with_material(block.solid, measurands, asked_for)
    assert (one, own) == tuple(measurands[:2])
    assert place.maximum_material == own.name
    text = new_scene._measurand(place, is_growing=True)
    assert f'maximum_material = "{own.name}" #' in text
    asked_for, measurands = sized(block)
    assert with_material(block.solid, measurands, asked_for) == tuple(measurands)
    assert "# at maximum material: its diameter" in new_scene._measurand(measurands[-1], is_growing=True)
    assert "material" not in new_scene._measurand(measurands[-1])
