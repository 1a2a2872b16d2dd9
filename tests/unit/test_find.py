"""Shapes found in pictures made with known ones, and nothing where a person sees nothing."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import measure
from measure.find import tags
from measure.find.candidate import CHESSBOARD, QUADRILATERAL, TAG, Candidate, ellipse_outline
from measure.find.choose import nearest
from measure.find.distinct import distinct
from scenes import InvalidInput
from tests.oracle import polygon_image
from tests.pattern_image import pattern_image, tag_cells
from tests.photographs import _TAG, MADE, SHIPPED, disc, plate, rectangle, tag, turned

QUICK = ("camera.png", "page.png", "coins.png", "phantom.png", "chessboard_GRAY.png", "gravel.png")


@pytest.mark.parametrize("name", [*MADE, *QUICK])
def test_as_a_person_sees_it(name):
    photo = {**MADE, **SHIPPED}[name]
    assert photo.missed(measure.find(photo.image())) == []


def test_the_comparison_can_fail():
    """A shape less, a shape more and a shape of another kind are told."""
    photo, found = MADE["plate"], measure.find(plate())
    assert len(photo.missed(found[1:])) == 1
    assert len(MADE["noise"].missed(found[:1])) == 1
    assert len(MADE["AprilTag"].missed(measure.find(tag("APRILTAG_36h11", 17), (QUADRILATERAL,)))) == 1


@pytest.mark.parametrize("seed", range(6))
def test_rectangle_turned_by_45_degrees(seed):
    """Centred on the image: one quadrilateral, its corners to a pixel, a third of where they are then sought."""
    size = ((100, 60), (60, 60), (160, 40))[seed % 3]
    (found,) = measure.find(rectangle(*size, 45, seed=seed))
    assert found.kind == QUADRILATERAL
    assert found.support > 0.95  # margin: a share, which is 1 at most
    true = turned(*size, 45)
    assert (
        np.linalg.norm(found.outline[:, None] - true, axis=-1).min(1).max() < 1
    )  # margin: where the measurement begins


@pytest.mark.parametrize("seed", range(20))
def test_nothing_in_noise(seed):
    rng = np.random.default_rng(seed)
    assert measure.find(100 + 5 * rng.standard_normal((150, 200))) == ()


@pytest.mark.parametrize("contrast", [6.0, -6.0])
def test_faint(contrast, rng):
    """Four times the noise is enough for a quadrilateral; its contrast is told to a quarter, with its sign."""
    image = polygon_image(turned(100, 60, 20), (200, 260), 0.8, contrast, 50.0) + 1.5 * rng.standard_normal((200, 260))
    (found,) = measure.find(image)
    assert found.contrast == pytest.approx(contrast / 1.5, rel=0.3)


def test_grey_levels_may_be_of_any_scale():
    """16 bit numbers, parts of one and negative numbers: the same shapes at the same places."""
    image = plate()[:300, :300]
    for other in ((200 * image).astype(np.uint16), image / 255, 3 * image - 500):
        found = measure.find(other)
        assert [one.kind for one in found] == [one.kind for one in measure.find(image)]
        assert found[0].outline == pytest.approx(measure.find(image)[0].outline, abs=0.02)


@pytest.mark.parametrize("shape", [(1, 1), (3, 400), (400, 3), (8, 8), (40, 2000)])
def test_small_images(shape, rng):
    assert measure.find(rng.normal(100, 2, shape)) == ()
    assert measure.find(np.full(shape, 7.0)) == ()


FAMILIES = ("APRILTAG_36h11", "APRILTAG_25h9", "APRILTAG_16h5", "4X4_1000", "5X5_1000", "6X6_1000", "ARUCO_ORIGINAL")


@pytest.mark.parametrize(("family", "turn"), [(family, k % 4) for k, family in enumerate(FAMILIES)])
def test_tags(family, turn):
    """Each tag with its number and family; the first corner is the tag's own, however it is turned."""
    (found,) = measure.find(tag(family, 7, turn), (TAG,))
    assert (found.identifier, found.family) == (7, family)
    # margin: where the measurement begins: a sixth of the 3 px within which it seeks
    assert found.outline == pytest.approx(np.roll(_TAG, turn, 0), abs=0.5)


@pytest.mark.parametrize(("side", "asked"), [(12.1, 1), (11.9, 0)])
def test_a_tag_is_read_from_12_pixels_along_its_shorter_side(side, asked, monkeypatch):
    """Dark, with a bright cell within; of a bright one and of a plain one none is read either."""
    image = np.full((60, 70), 200.0)
    image[15:46, 10:61] = 30.0
    image[26:33, 30:42] = 200.0
    calls = []
    reader = SimpleNamespace(detectMarkersMultiDict=lambda grey: calls.append(grey.shape) or ((), None, (), None))
    monkeypatch.setattr(tags, "_detector", lambda: reader)
    outline = np.array([[10.0, 30 - side / 2], [60, 30 - side / 2], [60, 30 + side / 2], [10, 30 + side / 2]])
    shape = Candidate(QUADRILATERAL, outline, 1.0, -10.0, 1.0)
    assert tags.tag(image, shape) is shape
    assert len(calls) == asked
    for other in (replace(shape, contrast=10.0), replace(shape, kind="circle")):
        assert tags.tag(image, other) is other
    assert tags.tag(np.where(image == 200.0, 30.0, image), shape) is shape
    assert len(calls) == asked


def test_a_tag_damaged_is_a_quadrilateral():
    cells = tag_cells("APRILTAG_36h11", 17)
    cells[3:5, 2:6] = 1 - cells[3:5, 2:6]
    found = measure.find(pattern_image(cells, _TAG, (200, 240)))
    assert found[0].kind == QUADRILATERAL
    assert TAG not in {one.kind for one in found}


def test_kinds():
    assert {one.kind for one in measure.find(plate(), ("circle", "ellipse"))} == {"circle"}
    assert measure.find(plate(), (CHESSBOARD,)) == ()
    with pytest.raises(InvalidInput, match=r"kind must be one of quadrilateral, circle, .*, got 'dog'"):
        measure.find(plate(), ("dog",))


def test_the_best_of_the_same_outline_remains():
    def square(inset, score):
        box = np.array([[0.0, 0], [100, 0], [100, 80], [0, 80]])
        inner = box + inset * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
        return Candidate(QUADRILATERAL, inner, 1.0, 10.0, score)

    kept = distinct([square(0, 5.0), square(2, 9.0), square(7, 4.0)], 1)
    assert [one.score for one in kept] == [9.0, 4.0]
    assert [one.score for one in distinct([square(0, 5.0), square(7, 4.0)], 3)] == [5.0]


def test_nearest():
    """A hole, if the point is in it; the plate, if it is beside the holes or outside."""
    image = plate()
    found = measure.find(image)
    (hole,), (whole,), (outside,) = (nearest(found, image, place) for place in ([165, 145], [300, 240], [5, 240]))
    assert (hole.kind, whole.kind, outside.kind) == ("circle", "quadrilateral", "quadrilateral")
    assert hole.centre == pytest.approx([160, 140], abs=0.5)
    with pytest.raises(InvalidInput, match="near must be x, y in the image of 640 x 480 px"):
        nearest(found, image, [700, 3])


def test_ellipse_outline():
    points = ellipse_outline(np.array([5.0, 6, 4, 2, 90]))
    assert points.mean(0) == pytest.approx([5, 6])
    assert np.ptp(points, axis=0) == pytest.approx([4, 8])


@pytest.mark.parametrize("radius", [6.0, 20.0, 60.0])
def test_discs(radius, rng):
    """One circle: centre and radius to a third of a pixel."""
    image = 50 + 100 * disc(100.3, 90.2, radius, (180, 200)) + rng.standard_normal((180, 200))
    (found,) = measure.find(image)
    assert found.kind == "circle"
    # margin: where the measurement begins: a ninth of the 3 px within which it seeks
    assert found.parameters[:4] == pytest.approx([100.3, 90.2, radius, radius], abs=0.34)
