"""What a ray meets first, named by Embree, against every triangle tried in double precision."""

import numpy as np
import pytest
import trimesh

import scenes
from imaging.geometry import rays
from imaging.geometry.rays import by_embree, by_trial, first_face
from scenes.parts import mesh
from scenes.parts.solid import block

pytestmark = pytest.mark.skipif(rays.rtcore_scene is None, reason="Embree has no wheel here")
BODIES = "bracket", "bracket_mm", "plate", "flange", "shaft", "ball", "grey_floor"


def directed(body, rng, count):
    """Rays from near and far at about the body, of any length."""
    size, middle = np.ptp(body.vertices, 0).max(), body.vertices.mean(0)
    away = rng.standard_normal((count, 3))
    origins = middle + away * (rng.uniform(0.2, 50, count) * size / np.linalg.norm(away, axis=1))[:, None]
    vectors = middle + 0.3 * size * rng.standard_normal((count, 3)) - origins
    return origins, vectors * 10.0 ** rng.uniform(-3, 3, (count, 1))


@pytest.mark.parametrize("name", BODIES)
def test_embree_names_what_trial_finds(name):
    """With faces left out, too, behind which rays run on within the body and meet what turns to them."""
    body, rng = scenes.load(name).bodies, np.random.default_rng(7)
    origins, vectors = directed(body, rng, 3000)
    for own in ((), tuple(rng.choice(len(body.faces), 3, replace=False).tolist())):
        asked = rays._plates(body), origins, vectors, own
        (face, t), (expected, at) = by_embree(*asked), by_trial(*asked)
        assert (face != expected).sum() <= 1  # margin: none is measured; a ray may pass an edge within 1e-7 of the size
        same = (face == expected) & (face >= 0)
        # margin: some of both, by how the rays are drawn
        assert 0.05 < same.mean() < 0.95
        assert t[same] == pytest.approx(at[same], rel=1e-9)
        assert np.isinf(t[face < 0]).all()


def test_each_ray_may_have_faces_of_its_own_that_it_does_not_meet(monkeypatch):
    """As when all rays of those faces are asked together; with a margin too, and without Embree."""
    body, rng = scenes.load("bracket").bodies, np.random.default_rng(17)
    origins, vectors = directed(body, rng, 600)
    own = rng.choice(len(body.faces), (600, 2))
    some = np.unique(own[:40], axis=0)
    own[40:] = some[rng.integers(len(some), size=560)]
    for margin in (0.0, 1e-6):
        face, t = first_face(body, origins, vectors, own, margin=margin)
        for faces in some:
            rows = (own == faces).all(1)
            expected, at = first_face(body, origins[rows], vectors[rows], tuple(faces.tolist()), margin=margin)
            assert face[rows].tolist() == expected.tolist()
            assert t[rows].tolist() == at.tolist()
    assert (face != first_face(body, origins, vectors, (), margin=1e-6)[0]).any()  # negative control
    monkeypatch.setattr(rays, "rtcore_scene", None)
    expected, at = first_face(body, origins, vectors, own)
    assert (face != expected).sum() <= 1  # margin: a ray may pass an edge within 1e-7 of the size
    same = face == expected
    assert t[same] == pytest.approx(at[same], rel=1e-9)


def test_a_bundle_tries_what_is_near_and_misses_nothing():
    """Narrow cones of rays at random places of a ball of 20,480 triangles: as when all are tried, of a tenth."""
    ball, rng = trimesh.creation.icosphere(5), np.random.default_rng(3)
    plates = rays._plates(mesh.solid(ball))
    tried = 0
    for _ in range(12):
        origin = rng.normal(size=3)
        origin *= rng.uniform(1.5, 20) / np.linalg.norm(origin)
        aim = rng.normal(size=3)
        vectors = 0.9 * aim / np.linalg.norm(aim) + 0.1 * rng.normal(size=(30, 3)) - origin
        origins = np.broadcast_to(origin, vectors.shape).copy()
        near = rays._may_meet(plates, origins, vectors)
        tried += near.mean() / 12
        (face, t), (expected, at) = (rays._first(each, origins, vectors) for each in (plates.some(near), plates))
        assert face.tolist() == expected.tolist()
        assert t.tolist() == at.tolist()
    assert tried < 0.1


def test_what_a_ray_begins_on_or_within_is_not_met():
    """From a face outward and inward, along it, from inside the body; and rays that lead nowhere."""
    body = block((1.0, 2.0, 3.0))
    top = body.face_names.index("top")
    origins = np.array([[0.5, 1, 3], [0.5, 1, 3], [0.5, 1, 3], [0.5, 1, 1.5], [0.5, 1, 9], [0.5, 1, 9], [np.nan, 1, 9]])
    vectors = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 0, 1], [0, 0, -1], [0, 0, 0], [0, 0, -1.0]])
    face, t = first_face(body, origins, vectors, ())
    assert face.tolist() == [-1, -1, -1, -1, top, -1, -1]
    assert t[4] == pytest.approx(6.0, rel=1e-12)
    without, _ = first_face(body, origins, vectors, (top,))
    assert without.tolist() == [-1] * 7


def test_nothing_is_met_of_no_triangles_and_by_no_rays():
    body = block((1.0, 2.0, 3.0))
    face, t = first_face(body, np.array([[0.5, 1, 9.0]]), np.array([[0, 0, -1.0]]), tuple(range(6)))
    assert (face.tolist(), t.tolist()) == ([-1], [np.inf])
    face, t = first_face(body, np.empty((2, 0, 3)), np.empty((2, 0, 3)), ())
    assert face.shape == t.shape == (2, 0)


def test_a_far_and_a_small_body_are_met_as_near_and_large_ones():
    """Single precision is that of the body: a millionth of its size, a thousand sizes off, is still told."""
    body = block((1.0, 2.0, 3.0))
    below, above = (np.array([1 + off, 1.0, -1.0]) for off in (-3e-6, 3e-6))  # beside the right face
    way = np.array([0.0, 0.0, 1.0])
    for far in (1.0, 1000.0):
        face, t = first_face(body, np.array([below, above]) - far * way, np.tile(way, (2, 1)), ())
        assert face.tolist() == [body.face_names.index("bottom"), -1]
        assert t[0] == pytest.approx(1 + far, rel=1e-12)


def test_without_embree_every_triangle_is_tried(monkeypatch):
    body, rng = scenes.load("bracket").bodies, np.random.default_rng(1)
    origins, vectors = directed(body, rng, 200)
    expected = first_face(body, origins, vectors, ())
    monkeypatch.setattr(rays, "rtcore_scene", None)
    assert np.array_equal(first_face(body, origins, vectors, ())[0], expected[0])


def random_plates(margin):
    """Triangles of no symmetry, 7 of them."""
    rng = np.random.default_rng(5)
    corners = rng.uniform(-3, 4, (3, 7, 3))
    normals = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    duals = np.stack([np.cross(corners[2] - corners[0], normals), np.cross(normals, corners[1] - corners[0])])
    duals /= np.einsum("kti,kti->kt", duals, corners[1:] - corners[0])[..., None]
    heights, shifts = (np.einsum("...ti,ti->...t", each, corners[0]) for each in (normals, duals))
    return rays.Plates(np.arange(7), corners, normals, heights, duals, shifts, margin)


def test_heights_of_triangles():
    """Twice the area over the side across from each corner."""
    plates = random_plates(0.0)
    one, two, three = plates.corners
    area = np.linalg.norm(np.cross(two - one, three - one), axis=1)
    sides = np.linalg.norm([three - two, three - one, two - one], axis=-1)
    assert plates._heights == pytest.approx(area / sides, rel=1e-9)


def test_well_within_is_twice_the_margin_from_every_side():
    """By the distances from three lines; places are spread over each triangle and around it."""
    plates, rng = random_plates(0.03), np.random.default_rng(6)
    which = np.repeat(np.arange(7), 400)
    shares = rng.uniform(-0.2, 0.9, (len(which), 2))
    one, two, three = plates.corners[:, which]
    places = one + shares[:, :1] * (two - one) + shares[:, 1:] * (three - one)
    away = []
    for start, stop in ((one, two), (two, three), (three, one)):
        along = (stop - start) / np.linalg.norm(stop - start, axis=1, keepdims=True)
        away.append(np.einsum("ni,ni->n", np.cross(plates.normals[which], along), places - start))
    expected = np.min(away, axis=0) > 2 * 0.03 * plates.radius
    assert np.array_equal(plates.well_within(which, places), expected)
    assert 0.1 < expected.mean() < 0.6  # margin: a share: places of both kinds


@pytest.mark.parametrize("margin", [0.01, 0.03])
def test_triangles_are_wider_by_the_margin(margin):
    """A ray beside a side's middle by less than the margin of the sphere's radius meets it, by more it does not."""
    plates = random_plates(margin)
    for k in range(7):
        alone = plates.some(np.arange(7) == k)
        alone = rays.Plates(*(getattr(alone, name) for name in ("faces", "corners", "normals", "heights", "duals",
                                                                 "shifts")), margin)  # fmt: skip
        corners = (alone.corners[:, 0] - alone.centre) / alone.radius
        for start, stop in zip(corners, np.roll(corners, -1, 0), strict=True):
            outward = np.cross(stop - start, alone.normals[0])
            outward /= np.linalg.norm(outward)
            for share, met in ((0.9, True), (1.1, False)):
                origin = (start + stop) / 2 + share * margin * outward + 0.5 * alone.normals[0]
                ray = np.float32([origin]), np.float32([-alone.normals[0]])
                assert (alone.tree.run(*ray, query="INTERSECT", output=1)["primID"][0] >= 0) == met


@pytest.mark.parametrize("sections", [5, 300])
def test_no_ray_passes_between_triangles(sections):
    """Of a closed convex part: rays at sides and corners of triangles, and close by, meet it there or before."""
    rod = trimesh.creation.cylinder(1.0, 3.0, sections=sections)
    rod.apply_transform(trimesh.transformations.rotation_matrix(0.7, [0.3, 0.6, 0.8]))
    body, rng, count = mesh.solid(rod), np.random.default_rng(5), 3000
    shares = rng.dirichlet([1, 1, 1], count)
    shares[: count // 2, 0] = 0.0
    shares[: count // 4, 1] = 0.0
    ends = np.einsum("nk,nki->ni", shares / shares.sum(1, keepdims=True), body.triangles[rng.integers(
        len(body.triangles), size=count)])  # fmt: skip
    ways = body.vertices.mean(0) + 0.3 * rng.permutation(ends - ends.mean(0)) - ends  # to inside, so from outside
    starts = ends - rng.choice([0.1, 1.0, 30.0], count)[:, None] * ways
    beside = 3e-7 * body.extent * rng.standard_normal((count, 3)) * (np.arange(count) % 2)[:, None]
    _, t = by_embree(rays._plates(body, 1e-6), starts, ends + beside - starts, ())
    past = (t - 1) * np.linalg.norm(ends - starts, axis=1) / body.extent
    assert past.max() < 1e-4  # of those beside an edge, that run along a face: 4e-6 measured
    assert np.abs(past[::2]).max() < 1e-9


@pytest.mark.parametrize("name", ["bracket_mm", "flange", "plate"])
def test_what_passes_a_side_closely_is_met_as_by_trial(name):
    """Rays at places of which most are near a side of their triangle."""
    body, rng, count = scenes.load(name).bodies, np.random.default_rng(8), 3000
    origins, _ = directed(body, rng, count)
    corners = body.triangles[rng.integers(len(body.triangles), size=count)]
    places = np.einsum("nk,nki->ni", rng.dirichlet([0.08, 0.5, 0.5], count), corners)
    asked = rays._plates(body, 1e-6), origins, places - origins, ()
    (face, t), (expected, at) = by_embree(*asked), by_trial(*asked)
    clear = (np.abs(at - 1) > 1e-9) & (np.abs(t - 1) > 1e-9)  # what is aimed at may count for either of two faces
    # margin: some of both, by how the rays are drawn
    assert 0.1 < clear.mean() < 0.9
    assert (face != expected)[clear].sum() <= 1  # margin: none is measured
    assert t[face == expected] == pytest.approx(at[face == expected], rel=1e-9)


def test_what_is_met_beside_a_triangle():
    """Of the triangles around it the nearest of other faces, no farther than asked; against each by itself."""
    body, rng = scenes.load("bracket_mm").bodies, np.random.default_rng(3)
    plates, count = rays._plates(body, 1e-6), 400
    which = rng.integers(len(plates.faces), size=count)
    places = plates.corners[:, which].mean(0) + 0.02 * body.extent * rng.standard_normal((count, 3))
    origins = places + 0.5 * body.extent * plates.normals[which]
    vectors = places - origins
    own, most = tuple(range(0, int(plates.faces.max()), 5)), rng.choice([0.9, 1.0, 3.0], count)
    passed = np.isin(plates.faces, own)
    triangle, t = plates.met_beside(which, origins, vectors, most, own)
    # margin: some of both, by how the rays are drawn
    assert 0.2 < np.isfinite(t).mean() < 0.8
    for i in range(count):
        same = (plates.corners[:, :, None] == plates.corners[:, which[i]]).all(-1).any((0, 2))
        around = np.flatnonzero(same & ~passed)
        assert len(around) > 1
        _, ts = rays._meet(plates.some(around), origins[i : i + 1], vectors[i : i + 1])
        ts = ts[ts <= most[i]]
        assert t[i] == pytest.approx(ts.min(initial=np.inf), rel=1e-9)
        assert triangle[i] in around or not np.isfinite(t[i])
