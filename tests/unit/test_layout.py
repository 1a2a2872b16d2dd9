"""Layouts are moved as rigid bodies, and a polygon's neighbours are the ones beside it."""

import numpy as np
import pytest
from skimage.draw import polygon2mask

import scenes
from imaging.features.locator import MIN_USABLE, reach
from imaging.features.projected_edges import projected_edges
from imaging.pictures import Pictures
from measure.features.calipers import edge_calipers
from measure.features.layout import BACKGROUND, layout_of, polygon_layout
from measure.features.optics import Optics
from scenes import Picture, status
from tests.oracle import axes
from tests.parts import newcomers_plate

OPTICS = Optics((60, 80), 0.7, 4.0)
CORNERS = np.array([[20.0, 12.0], [62.0, 18.0], [55.0, 47.0], [17.0, 40.0]])


def turned(points, middle, shift, turn):
    """By complex numbers."""
    z = (points[..., 0] - middle[0]) + 1j * (points[..., 1] - middle[1])
    z = z * np.exp(1j * turn)
    return np.stack([z.real + middle[0] + shift[0], z.imag + middle[1] + shift[1]], -1)


@pytest.mark.parametrize("kind", ["polygon", "block"])
def test_moved(kind, task1):
    block = layout_of(scenes.Picture.of(task1, (40, 100), (15, 315)))
    layout = polygon_layout(CORNERS, OPTICS) if kind == "polygon" else block
    shift, turn = (1.5, -2.5), 0.3
    middle = np.mean([end for pair in layout.ends for end in pair], axis=0)
    found = layout.moved(shift, turn)

    def expected(points):
        return turned(points, middle, shift, turn)

    assert found.ends == pytest.approx(expected(layout.ends), abs=1e-9)
    assert found.others.shape == layout.others.shape == (len(layout.others), 2, 2)
    assert found.others == pytest.approx(expected(layout.others), abs=1e-9)
    for before, after in ((layout.faces, found.faces), (layout.apart, found.apart)):
        assert [a.shape for a in after] == [b.shape for b in before]
        assert all(np.allclose(a, expected(b), atol=1e-9) for b, a in zip(before, after, strict=True))
    for before, after in zip(layout.beside, found.beside, strict=True):
        for b, a in zip(before, after, strict=True):
            assert a == pytest.approx(turned(b, (0, 0), (0, 0), turn), abs=1e-12)


def test_shifted_along_the_normals():
    layout = polygon_layout(CORNERS, OPTICS)
    offsets = np.arange(8.0).reshape(4, 2)
    found = layout.shifted(offsets)
    for i in range(4):
        along = CORNERS[(i + 1) % 4] - CORNERS[i]
        normal = np.array([-along[1], along[0]]) / np.hypot(*along)
        assert found.ends[i] == pytest.approx(layout.ends[i] + offsets[i][:, None] * normal)


@pytest.mark.parametrize("order", [1, -1])
def test_polygon(order):
    """Either way round the face lies on the side where its middle is."""
    corners = CORNERS[::order]
    layout = polygon_layout(corners, OPTICS)
    for i in range(4):
        before, here, after = corners[i - 1], corners[i], corners[(i + 1) % 4]
        assert layout.ends[i].tolist() == [here.tolist(), after.tolist()]
        assert layout.corners[i] == ((i - 1) % 4, i)
        assert layout.beside[i][0][0] == pytest.approx(before - here)
        assert layout.beside[i][1][0] == pytest.approx(corners[(i + 2) % 4] - after)
        assert layout.apart[i].tolist() == [[corners[(i + 2) % 4].tolist(), corners[(i + 3) % 4].tolist()]]
        inside = (corners.mean(0) - here) @ layout.normals[i] > 0
        assert layout.sides[i].tolist() == ([0, BACKGROUND] if inside else [BACKGROUND, 0])
    assert sorted(layout.joints) == [((0, 0), (3, 1)), ((0, 1), (1, 0)), ((1, 1), (2, 0)), ((2, 1), (3, 0))]
    labels = layout.face_at(np.arange(np.prod(OPTICS.shape))).reshape(OPTICS.shape)
    assert labels[30, 40] == 0
    assert labels[5, 5] == BACKGROUND
    assert (labels == np.where(polygon2mask(OPTICS.shape, corners[:, ::-1]), 0, BACKGROUND)).all()
    assert (layout.defocus == 0).all()
    assert layout.visible.all()


def test_block_seen_from_above(task1):
    """One face, four edges in one plane; what is not required is among the others."""
    layout = layout_of(scenes.Picture.of(task1, (0, 0)))
    assert len(layout.faces) == 1
    assert set(layout.names) <= {"e1", "e2", "e3", "e4", "e5", "e6", "e7", "e8", "e9", "e10", "e11", "e12"}
    assert len(layout.names) + len(layout.others) == 4
    assert sorted(layout.sides.ravel().tolist()) == [BACKGROUND] * len(layout.names) + [0] * len(layout.names)


def test_slivers_become_background(task1):
    """From nearly above the side faces are thin: without them one face is left, whole."""
    layout = layout_of(scenes.Picture.of(task1, (1.5, 100)))
    assert len(layout.faces) > 1
    found = layout.without_slivers(5.0)
    kept = [i for i, face in enumerate(found.faces) if np.abs(face).max() < 1e6]
    assert len(kept) == 1
    assert np.array_equal(found.faces[kept[0]], layout.faces[kept[0]])
    assert set(found.sides.ravel().tolist()) == {BACKGROUND, kept[0]}
    assert len(found.others) < len(layout.others)
    assert layout.without_slivers(1e-9) is layout


@pytest.mark.parametrize("pose", [(40, 100), (65, 20), (80, 200), (30, 315), (88.56, 100), (88.56, 280)])
def test_faces_beside_an_edge_are_told_by_their_middle(pose, task1):
    """Each required edge's seen faces, on the side where the middle of the face's picture is; slivers too."""
    layout = layout_of(scenes.Picture.of(task1, pose))
    for i, name in enumerate(layout.names):
        shown = [f for f in layout.sides[i] if f != BACKGROUND]
        assert len(shown) == len(set(shown)) == sum(_seen(task1, face, pose) for face in task1.solid.edge(name).faces)
        for side, face in enumerate(layout.sides[i]):
            if face != BACKGROUND:
                away = (layout.faces[face].mean(0) - layout.ends[i, 0]) @ layout.normals[i]
                assert (away > 0) == (side == 0)


def _seen(scene, face, pose):
    corner = scene.solid.vertices[scene.solid.faces[face][0]]
    return (scene.camera.distance * axes(pose)[0] - corner) @ scene.solid.normals[face] > 0


@pytest.fixture(scope="module")
def slotted(tmp_path_factory):
    """A plate with a slot of 4 x 14 mm, its round ends in steps of 7.5 degrees; sides of slot, plate and step."""
    file = tmp_path_factory.mktemp("slotted") / "plate.stl"
    newcomers_plate().export(file)
    pairs = {"slot": ("e10", "e12"), "plate": ("e5", "e8"), "step": ("e14", "e16")}
    asked = [{"name": k, "kind": "width", "features": [{"edge": e} for e in pair]} for k, pair in pairs.items()]
    return scenes.Scene.model_validate({
        "name": "slotted", "units": "mm", "object": {"kind": "mesh", "units": "mm", "file": str(file)},
        "camera": {"width": 640, "height": 512, "focal_px": 1250.0, "distance": 217.0, "look_at": [25.0, 15.0, 4.0],
                   "blur_px": 0.5},
        "material": {"diffuse_reflectance": 0.8}, "light": {"distance": 217.0}, "noise": {"sigma": 1.5},
        "measurands": asked,
    })  # fmt: skip


def _left(scene, pose):
    """By name: the layout's calipers, and the planner's lengths and trims, px, without the image's borders."""
    view = projected_edges(Pictures.of(scenes.Picture.of(scene, pose)))
    clear = reach(scene.locator.scale_px, scene.camera.blur_px)
    calipers = edge_calipers(layout_of(scenes.Picture.of(scene, pose)), clear, -1e9, 0.0)
    told = zip(view.names, view.visible, view.lengths, view.trims, strict=True)
    return {f.name: (f, *each) for f, (_, *each) in zip(calipers, told, strict=True)}, clear


def test_no_edge_is_trimmed_at_the_seam_of_its_side_and_a_round_end(slotted):
    """From 20 degrees beside the vertical the seams run along the slot's sides (1 in 38), and are no boundaries.

    The arcs turn away from the sides, so that the reach itself is left out at both ends.
    """
    found, clear = _left(slotted, (20, 0))
    for name in ("e10", "e12"):
        caliper, _, length, trims = found[name]
        assert length > 50
        assert caliper.status == status.OK
        assert caliper.positions[[0, -1]] == pytest.approx([clear, length - clear], abs=1e-9)
        assert trims == pytest.approx([clear, clear], abs=1e-9)


@pytest.mark.parametrize("pose", [(20, 0), (20, 90), (35, 180), (50, 300), (70, 5), (75, 181)])
def test_what_is_left_of_an_edge_is_what_the_planner_says(pose, slotted):
    """At bends of curved walls too: those are boundaries where one side is turned away, and only there."""
    for caliper, visible, length, trims in _left(slotted, pose)[0].values():
        left = length - trims.sum()
        assert (caliper.status == status.NOT_VISIBLE) == (not visible)
        if visible:
            assert (caliper.status == status.SHORT) == (left < MIN_USABLE)
        if caliper.positions.size:
            assert caliper.positions[[0, -1]] == pytest.approx([trims[0], length - trims[1]], abs=1e-9)


def test_some_of_the_edges_have_their_own_rows():
    """Of all that is told edge by edge, in the order asked for."""
    scene = scenes.load("bracket_mm")
    whole = layout_of(Picture.of(scene, (43, 261), (35, 100)))
    edges = np.arange(len(whole.names))[::-1][:2]
    some, corners = whole.only(edges)
    assert some.names == tuple(whole.names[e] for e in edges)
    for key in ("ends", "visible", "shown", "sides", "defocus", "clutter", "strong"):
        assert np.array_equal(getattr(some, key), getattr(whole, key)[edges]), key
    assert len(some.beside) == len(some.apart) == 2
    assert len(some.corners) == len(corners)
