"""Pieces of faces that send light on: they cover the faces, and send what random paths of light say."""

import numpy as np
import pytest
import trimesh

import scenes
from imaging.light import exchanged as exchanged_module
from imaging.light import senders as senders_module
from imaging.light.emitters import emitters, plain
from imaging.light.exchange import exchange_of, room
from imaging.light.exchanged import Exchanged
from imaging.light.senders import senders
from imaging.pictures import Pictures
from scenes import Picture
from scenes.lights import GLANCE
from tests.light_paths import traced


@pytest.fixture(scope="module")
def picture():
    """An upright 1 cm behind a foot, both on a grey floor: light goes to and fro in the gap."""
    return Picture.of(scenes.load("grey_floor"), (40, 0), (30, 300))


def areas(triangles):
    return np.linalg.norm(np.cross(*np.moveaxis(triangles[:, 1:] - triangles[:, :1], 1, 0)), axis=1) / 2


def test_pieces_cover_all_faces(picture):
    """Each face's pieces are its area, and lie in it; those of faces that see others are no larger than cells."""
    found = senders(picture)
    exchange = exchange_of(picture.scene.bodies, picture.scene.bright_floor)
    solid, sides = exchange.solid, np.linalg.norm(found.triangles - np.roll(found.triangles, 1, 1), axis=-1).max(1)
    whole = np.bincount(solid.triangle_faces, areas(solid.triangles))
    assert np.bincount(found.faces, areas(found.triangles)) == pytest.approx(whole, rel=1e-9)
    corners = np.array([solid.vertices[face[0]] for face in solid.faces])
    away = np.einsum("nki,ni->nk", found.triangles - corners[found.faces][:, None], solid.normals[found.faces])
    assert away == pytest.approx(0, abs=1e-9)
    turned = np.cross(*np.moveaxis(found.triangles[:, 1:] - found.triangles[:, :1], 1, 0))
    assert (np.einsum("ni,ni->n", turned, solid.normals[found.faces]) > 0).all()
    assert sides[exchange.has[found.faces]].max() <= exchange.cell
    assert (found.sent[~exchange.has[found.faces]] == 0).all()


def in_the_gap(picture, count, rng):
    """Pieces of the foot's wall and the upright's, and the floor between them, at random by area; and a place in each
    by its corners' shares."""
    found = senders(picture)
    middle = found.triangles.mean(1)
    inside = (middle[:, 0] > -1) & (middle[:, 0] < 0) | (np.abs(middle[:, 0] + 0.5) < 0.5001)
    inside &= (middle[:, 1] > 0) & (middle[:, 1] < 7.5) & (middle[:, 2] < 2.5)
    inside &= exchange_of(picture.scene.bodies, picture.scene.bright_floor).has[found.faces]
    some = np.flatnonzero(inside)
    size = areas(found.triangles[some])
    return found, rng.choice(some, count, p=size / size.sum()), rng.dirichlet(np.ones(3), count)


def paths_tell(picture, asked, rng):
    """Grey levels that places send on of light that had met a face before."""
    found, which, shares = asked
    scene, (shining,) = picture.scene, map(plain, emitters(picture.scene, Pictures.of(picture).lights, GLANCE))
    solid = room(scene.bodies, scene.bright_floor)
    white = [scene.surfaces.of(face).diffuse() for face in range(len(scene.bodies.faces))]
    white += [] if scene.bright_floor is None else [scene.floor.reflectance]
    faces, points = found.faces[which], (found.triangles[which] * shares[:, :, None]).sum(1)
    at = np.array(shining.at)
    arriving = traced(solid, np.array(white), at, points, solid.normals[faces], 1 << 12, rng) * shining.power
    return scene.camera.exposure * np.array(white)[faces] * arriving


def off(picture, rng):
    """Of what places in the gap send, root mean square over that of what paths say, and the means' ratio."""
    asked = in_the_gap(picture, 100, rng)
    expected, (found, which, shares) = paths_tell(picture, asked, rng), asked
    told = (found.sent[which] * shares).sum(1)
    return np.sqrt(np.mean((told - expected) ** 2) / np.mean(expected**2)), told.mean() / expected.mean()


def test_what_a_gap_sends_on_is_as_paths_tell(picture, monkeypatch):
    """All over it; by pieces of a cell, which is as wide as the gap, it is off by more."""
    told, mean = off(picture, np.random.default_rng(1))
    for name in ("_FINER", "_FINEST"):
        monkeypatch.setattr(senders_module, name, 1.0)
    senders.cache_clear()
    coarse, _ = off(picture, np.random.default_rng(1))
    senders.cache_clear()
    assert told < 0.065  # 4.3 %, of which 1.4 % are the paths' own
    assert coarse > 0.065  # 8.2 %
    assert mean == pytest.approx(1, abs=0.03)  # margin: twice what is measured


@pytest.fixture(scope="module")
def groove(tmp_path_factory):
    """A picture of a shaft of 12 mm with a bore of 6 mm and a groove 0.2 mm deep, the rim of whose lower flank is
    measured: that is a tenth as wide as the cells by which light between faces is told."""
    file = tmp_path_factory.mktemp("part") / "shaft.ply"
    profile = [(3, 0), (6, 0), (6, 24), (5.8, 24), (5.8, 26), (6, 26), (6, 40), (3, 40), (3, 0)]
    trimesh.creation.revolve(profile, sections=96).export(file)
    data = scenes.load("plate").model_dump(exclude={"measurands", "settings"})
    data["object"] = {"kind": "mesh", "file": str(file), "units": "mm"}
    solid = scenes.Mesh.model_validate(data["object"]).solid
    rim = next(c for c in solid.circles if c.radius > 5.9 and abs(c.centre[2] - 24) < 1e-3)
    asked = [{"name": "d", "kind": "diameter", "features": [{"circle": rim.name}]}]
    data |= {"units": "mm", "light": {"kind": "point", "distance": 150.0}, "measurands": asked}
    data["camera"] = {"width": 640, "height": 1024, "focal_px": 2500.0, "distance": 150.0, "look_at": [0.0, 0.0, 20.0]}
    return Picture.of(scenes.Scene.model_validate(data), (60, 170), (45, 170))


def test_the_ground_of_a_shallow_groove_sends_on_what_paths_tell(groove):
    """What it has of its flank falls within 0.2 mm. By pieces that looked from their middles alone, which rarely see
    the flank, it sent twice as much."""
    found, rng = senders(groove), np.random.default_rng(1)
    middle = found.triangles.mean(1)
    at_foot = (np.abs(np.hypot(*middle[:, :2].T) - 5.79) < 0.02) & (middle[:, 2] < 26) & (middle[:, 2] > 24)
    at_foot &= np.arctan2(middle[:, 1], -middle[:, 0]) ** 2 < 0.3**2
    some = np.flatnonzero(at_foot)
    size = areas(found.triangles[some])
    asked = found, rng.choice(some, 400, p=size / size.sum()), rng.dirichlet(np.ones(3), 400)
    told = (found.sent[asked[1]] * asked[2]).sum(1)
    expected = paths_tell(groove, asked, rng).mean()
    assert told.mean() / expected == pytest.approx(1, abs=0.2)  # margin: twice what is measured; 6 to 10 %


def test_places_are_asked_in_blocks(picture, monkeypatch):
    """Of so many rays at most, which bounds the memory; what they send is the same to the last digit."""
    whole, asked = senders(picture).sent, []
    monkeypatch.setattr(exchanged_module, "AT_ONCE", 100 * exchanged_module._FROM_PIECE)
    gathered = Exchanged.gathered
    counted = lambda self, met, count, rays: asked.append(count) or gathered(self, met, count, rays)  # noqa: E731
    monkeypatch.setattr(Exchanged, "gathered", counted)
    parts = senders.__wrapped__(picture).sent
    assert max(asked) == 100 < sum(asked)
    np.testing.assert_array_equal(parts, whole)


def test_distances_from_what_is_measured():
    """Beside an edge, beyond its end and of one without length; from none they are infinite."""
    edges = np.array([[(0, 0, 0), (1, 0, 0)], [(0, 0, 5), (0, 0, 5)]], float)
    away = senders_module._distance(edges, 0.1)
    assert away(np.array([[0.52, 0.3, 0], [2, 0, 0], [0, 1, 5]])) == pytest.approx([0.3, 1, 1], abs=0.01)
    assert np.isinf(senders_module._distance(edges[:0], 0.1)(np.zeros((2, 4, 3)))).all()
