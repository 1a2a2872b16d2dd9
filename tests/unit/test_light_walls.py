"""Light on curved surfaces that is told for all facets around an axis together, and light that walls of bores send."""

import numpy as np
import pytest
import trimesh

import scenes
from imaging.light import exchange
from imaging.light.bore import bores
from imaging.light.emitters import emitters, plain
from imaging.light.exchanged import exchanged
from imaging.light.walls import wall
from imaging.pictures import Pictures
from scenes.lights import GLANCE
from scenes.parts.mesh import solid as mesh_solid
from tests import parts
from tests.light_paths import traced


def revolved(profile, sections):
    return mesh_solid(trimesh.creation.revolve(profile, sections=sections))


# a bore of 2 mm radius, 5 mm deep, in the ground of a cone that narrows from 5 to 3 mm
_STEPPED = [(10.0, 0.0), (10.0, 8.0), (5.0, 8.0), (3.0, 5.0), (2.0, 5.0), (2.0, 0.0), (10.0, 0.0)]


def walls_of(solid, cell=4.0):
    """Those of all curved surfaces, by their largest radius."""
    found = [wall(solid, region, cell) for region in np.unique(solid.regions[solid.regions >= 0]).tolist()]
    return sorted(found, key=lambda each: np.linalg.norm(each.triangles[..., :2], axis=-1).max())


@pytest.mark.parametrize("sections", [36, 96])
def test_walls_are_the_same_whatever_their_facets_are(sections):
    """A cylinder, a cone, a cylinder around z: whole turns, as long as they are, as many nodes."""
    found = walls_of(revolved(_STEPPED, sections))
    assert [each.closed for each in found] == [True, True, True]
    assert [each.length for each in found] == pytest.approx([5.0, np.hypot(2, 3), 8.0], rel=2e-3)
    assert [abs(each.axis[2]) for each in found] == pytest.approx([1, 1, 1], abs=1e-9)
    assert [(each.count, each.rows.size) for each in found] == [(32, 8), (32, 8), (63, 8)]


@pytest.mark.parametrize("sections", [36, 96])
def test_nodes_of_a_wall_stand_on_its_facets_where_their_coordinates_are(sections):
    for each in walls_of(revolved(_STEPPED, sections)):
        nodes, faces = each.nodes()
        steps, along = each.coordinates(nodes).T.reshape(2, each.count, -1)
        apart = (steps - np.arange(each.count)[:, None] + each.count / 2) % each.count - each.count / 2
        assert np.abs(apart).max() < 0.09 * 96 / sections  # margin: chords run within the circle; 0.034
        inner = along[:, 1:-1] - each.rows[1:-1]
        assert np.abs(inner).max() < 0.01 * each.length  # margin: the same
        some = each.triangles[[np.flatnonzero(each.faces == face)[0] for face in faces]]
        normals = np.cross(some[:, 1] - some[:, 0], some[:, 2] - some[:, 0])
        off = np.einsum("ni,ni->n", nodes - some[:, 0], normals) / np.linalg.norm(normals, axis=1)
        assert np.abs(off).max() < 1e-9


def test_a_part_of_a_turn_is_an_open_wall():
    """The round end of a slot: half a turn of 6 mm radius, beyond whose ends the last node tells the light."""
    solid = mesh_solid(parts.slotted())
    ends = [wall(solid, region, 4.0) for region in np.unique(solid.regions[solid.regions >= 0]).tolist()]
    assert len(ends) == 2
    for each in ends:
        assert not each.closed
        assert each.turn == pytest.approx(np.pi, rel=1e-6)
        middle = each.triangles.reshape(-1, 3).mean(0) - each.point
        one = np.cross(each.axis, middle) / np.linalg.norm(np.cross(each.axis, middle))
        back = -middle / np.linalg.norm(middle)
        beyond = each.point + 6.0 * np.array([np.cos(a) * one + np.sin(a) * back for a in (0.1, np.pi - 0.1)])
        assert sorted(each.coordinates(beyond)[:, 0].tolist()) == pytest.approx([0, each.count - 1])


def test_surfaces_around_no_axis_or_back_over_themselves_are_no_walls():
    """An elliptic column; a ring of a round section, which comes back beneath itself."""
    oval = trimesh.creation.cylinder(1.0, 4.0, sections=48)
    oval.apply_scale([3.0, 1.0, 1.0])
    for solid in (mesh_solid(oval), mesh_solid(trimesh.creation.torus(5.0, 1.0, major_sections=48, minor_sections=24))):
        (region,) = np.unique(solid.regions[solid.regions >= 0]).tolist()
        assert wall(solid, region, 4.0) is None


def seen(solid, folder, polar):
    """A scene of a part, one light from a polar angle, as a point that shines."""
    file = folder / f"part{len(solid.faces)}.ply"
    solid.export(file)
    data = scenes.load("plate").model_dump(exclude={"measurands", "settings"})
    scene = scenes.Scene.model_validate(data | {"object": {"kind": "mesh", "file": str(file), "units": "cm"}})
    (shining,) = tuple(map(plain, emitters(scene, Pictures.of(scene, (0.0, 0.0), (polar, 20.0)).lights, GLANCE)))
    return scene, shining


def test_a_cone_has_the_same_light_whatever_its_facets_are(tmp_path, monkeypatch):
    """By 36 and by 96 facets, at places all around and along it, by so many rays that their noise is small; facets that
    are told alone differ by 2.5 %."""
    monkeypatch.setattr(exchange, "_FROM_WALL", 1 << 12)
    angle, part = (np.arange(32) + 0.5) * 2 * np.pi / 32, np.array([0.1, 0.5, 0.9])
    found = []
    for sections in (36, 96):
        scene, shining = seen(trimesh.creation.revolve(_STEPPED, sections=sections), tmp_path, 50.0)
        solid = scene.solid
        cone = next(each for each in walls_of(solid) if 0.1 < abs(each.slant[1]) < 0.9)
        faces = np.unique(cone.faces)
        middles = np.array([solid.triangles[solid.triangle_faces == face].mean((0, 1)) for face in faces])
        away = np.cos(np.arctan2(middles[:, 1], middles[:, 0])[None] - angle[:, None])
        faces = np.repeat(faces[away.argmax(1)][:, None], part.size, 1)
        radius = np.broadcast_to(3 + 2 * part, faces.shape)
        points = np.stack([radius * np.cos(angle)[:, None], radius * np.sin(angle)[:, None], radius * 1.5 + 0.5], -1)
        found.append(exchanged(scene, (shining,)).at(points, faces))
    off = np.sqrt(np.mean((found[0] / found[1] - 1) ** 2))
    assert off < 0.015  # margin: twice what is measured; 0.7 %


def test_walls_of_bores_send_light_to_others(tmp_path):
    """The top of a pin half a millimetre beneath a bore, which sees the wall and darkness, as paths tell it."""
    ring = trimesh.creation.revolve([(10.0, 0.0), (10.0, 5.0), (3.0, 5.0), (3.0, 0.0), (10.0, 0.0)], sections=96)
    pin = trimesh.creation.cylinder(1.0, 3.0, sections=48)
    pin.apply_translation([0.0, 0.0, -2.0])
    scene, shining = seen(trimesh.util.concatenate([ring, pin]), tmp_path, 25.0)
    solid = scene.solid
    assert len(bores(solid)) == 1
    up = solid.plane & (solid.normals[:, 2] > 0.5)
    top = int(np.flatnonzero(up & (np.abs(solid.offsets + 0.5) < 1e-6))[0])
    points = np.array([[x, y, -0.5] for x, y in ((0, 0), (0.6, 0), (-0.6, 0), (0, 0.6), (0, -0.6))], float)
    white, rng = scene.material.diffuse(), np.random.default_rng(1)
    paths = traced(solid, white, np.array(shining.at), points, solid.normals[top], 1 << 14, rng) * shining.power
    told = exchanged(scene, (shining,)).at(points, np.full(5, top))
    assert (paths > 0).all()
    assert told / paths == pytest.approx(np.ones(5), abs=0.04)  # margin: twice what is measured; 1.8 %
