"""Layouts are moved as rigid bodies, and a polygon's neighbours are the ones beside it."""

import numpy as np
import pytest
from skimage.draw import polygon2mask

import scenes
from measure.features.layout import BACKGROUND, layout_of, polygon_layout
from measure.features.optics import Optics
from tests.oracle import axes

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
        assert layout.beside[i][0][0] == pytest.approx((before - here) / np.hypot(*(before - here)))
        onward = corners[(i + 2) % 4] - after
        assert layout.beside[i][1][0] == pytest.approx(onward / np.hypot(*onward))
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
