"""Which faces a record means, and how a profile may run."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import scenes
from scenes import Turned
from scenes.parts.mesh import solid
from scenes.parts.surfaces import Cylinder, Plane
from scenes.parts.walls import exact_walls
from scenes.selection import OnFaces, Where

BLOCK = scenes.block((12.0, 8.0, 2.5))  # a corner at the origin


def names(part, record: OnFaces) -> list[str]:
    return [part.face_names[face] for face in record.chosen(part, "textures[2]")]


def outward(part, record: OnFaces) -> list[list[float]]:
    return part.normals[record.chosen(part, "textures[2]")].round(9).tolist()


@pytest.mark.parametrize(
    ("side", "normal"),
    [
        ("top", [0, 0, 1]), ("bottom", [0, 0, -1]), ("front", [0, -1, 0]), ("back", [0, 1, 0]), ("left", [-1, 0, 0]),
        ("right", [1, 0, 0]),
    ],
)  # fmt: skip
def test_sides_are_where_they_look(side, normal):
    assert outward(BLOCK, OnFaces(where=side)) == [normal]


@pytest.mark.parametrize(("within", "count"), [(3.0, 0), (7.4, 1), (7.6, 2), (172.5, 23), (180.0, 24)])
def test_faces_within_an_angle(within, count):
    """Of a prism of 24 sides and its two ends, 7.5 degrees and a tenth beside the first side."""
    rod = trimesh.creation.cylinder(2.0, 5.0, sections=24)
    part = solid(rod)
    sides = part.normals[np.abs(part.normals[:, 2]) < 0.5]
    angle = np.radians(0.1) + np.arctan2(sides[0, 1], sides[0, 0]) - np.radians(7.5)
    record = OnFaces(where=Where(normal=(9 * np.cos(angle), 9 * np.sin(angle), 0.0), within_deg=within))
    if not count:
        with pytest.raises(ValueError, match=r"textures\[2\]\.where must hold a face of the object, got none"):
            record.chosen(part, "textures[2]")
        return
    found = part.normals[record.chosen(part, "textures[2]")]
    ends = 2 if within >= 90 else 0
    assert len(found) == count + ends
    cosine = found @ [np.cos(angle), np.sin(angle), 0]
    # margin: the angle that is asked for is the limit
    assert cosine.min() >= np.cos(np.radians(within)) - 1e-9


@pytest.mark.parametrize(
    ("box", "found"),
    [
        (((-1, -1, -1), (0.5, 9, 3)), [[-1, 0, 0]]),
        (((0, 0, 0), (12, 8, 2.5)), None),
        (((0, 0, 2.5 - 1e-9), (12, 8, 2.6)), [[0, 0, 1]]),
        (((0, 0, 2.5 + 1e-4), (12, 8, 2.6)), []),
        (((0, 0, 0), (12, 8 - 1e-4, 2.5)), [[0, -1, 0]]),
        (((0, 0, 2), (12, 8, 2.5 - 1e-5)), [[0, 0, 1]]),
        (((0, 0, 2), (12, 8, 2.5 - 2e-5)), []),
        (((1e-5, 0, 0), (1, 8, 2.5)), [[-1, 0, 0]]),
        (((2e-5, 0, 0), (1, 8, 2.5)), []),
    ],
)
def test_faces_within_a_box(box, found):
    """All of a face, within a millionth of the part's size."""
    where = OnFaces(where=Where(box=box))
    if found == []:
        with pytest.raises(ValueError, match="must hold a face of the object, got none"):
            where.chosen(BLOCK, "k")
        return
    assert len(outward(BLOCK, where)) == 6 if found is None else outward(BLOCK, where) == found


def test_a_box_and_a_direction_are_both_asked():
    box = ((-1, -1, -1), (13, 9, 0.5))
    assert outward(BLOCK, OnFaces(where=Where(box=box, normal=(0, 0, -2.0)))) == [[0, 0, -1]]
    with pytest.raises(ValueError, match="must hold a face"):
        OnFaces(where=Where(box=box, normal=(0, 0, 2.0))).chosen(BLOCK, "k")


def test_names_are_taken_in_their_order():
    wanted = (BLOCK.face_names[4], BLOCK.face_names[1])
    assert names(BLOCK, OnFaces(faces=wanted)) == list(wanted)


@pytest.mark.parametrize(
    ("record", "match"),
    [
        ({}, r"k\.faces or k\.where must be given, not both, got none"),
        ({"faces": (BLOCK.face_names[0],), "where": "top"}, "not both, got both"),
        ({"faces": (BLOCK.face_names[0], "no")}, rf"k\.faces\[1\] must be one of {BLOCK.face_names[0]}, .*, got 'no'"),
        ({"faces": (BLOCK.face_names[2],) * 2}, rf"must be different faces, got '{BLOCK.face_names[2]}' twice"),
        ({"where": "above"}, r"k\.where must be one of top, bottom, .*, or a table, got 'above'"),
        ({"where": Where()}, "must be a side, or have a normal or a box, got neither"),
        ({"where": Where(normal=(0, 0, 0))}, r"k\.where\.normal must be a direction, got \[0\.0, 0\.0, 0\.0\]"),
        ({"where": Where(box=((0, 0, 0), (1, 1, 0)))}, r"k\.where\.box must be of rising corners"),
    ],
)
def test_what_means_no_faces(record, match):
    with pytest.raises(ValueError, match=match):
        OnFaces(**record).chosen(BLOCK, "k")


@pytest.mark.parametrize("count", [24, 25])
def test_many_names_are_not_all_listed(count):
    prism = solid(trimesh.creation.cylinder(2.0, 5.0, sections=count - 2))
    with pytest.raises(ValueError, match="must be one of") as said:
        OnFaces(faces=("no",)).chosen(prism, "k")
    assert str(said.value).count(", ") == (24 if count == 24 else 25)
    assert (", ..., got" in str(said.value)) == (count == 25)


@pytest.mark.parametrize(
    ("profile", "match"),
    [
        ([(0, 1), (1, 1), (1, 1), (2, 1)], "must be different points along the axis, never falling"),
        ([(0, 1), (1, 1), (0.5, 2), (2, 1)], r"never falling, got \[0\.0, 1\.0, 0\.5, 2\.0\]"),
        ([(0, 1), (0, 2), (2, 1)], "must begin and end with a wall, got a shoulder"),
        ([(0, 1), (2, 2), (2, 1)], "must begin and end with a wall, got a shoulder"),
        ([(0, 1), (1, 1), (1, 2), (1, 3), (2, 3)], "must have one shoulder at a place, got two"),
    ],
)
def test_profiles_that_none_can_turn(profile, match):
    with pytest.raises(ValueError, match=match):
        Turned(kind="turned", profile=profile)


def test_profiles_that_fall_in_radius_alone():
    assert len(Turned(kind="turned", profile=[(-1, 3), (1, 3), (1, 2), (2, 1), (4, 1)]).solid.curved) == 3


@pytest.mark.parametrize(("taken", "name"), [("other", "land"), ("land", "k1")])
def test_a_wall_of_several_faces_has_the_name_of_its_first(taken, name):
    """A cylinder cut along its axis, as kernels do; a name that something else has is not given again."""
    part = solid(trimesh.creation.cylinder(2.0, 5.0, sections=24))
    side = np.abs(part.normals[:, 2]) < 0.5
    owners = np.where(side, np.where(np.arange(len(side)) < np.flatnonzero(side)[9], 1, 2), 0)
    axis = (0, 0, 1)
    surfaces = Plane((0, 0, 2.5), axis), Cylinder((0, 0, 0), axis, 2.0), Cylinder((0, 0, 1), (0, 0, -1), 2.0)
    vertices = (taken, *part.vertex_names[1:])
    (wall,) = exact_walls(replace(part, vertex_names=vertices), owners, surfaces, ("flat", "land", "sea"))
    assert wall.name == name
    assert len(wall.faces) == 24
    assert wall.surface.ends == pytest.approx((-2.5, 2.5))
