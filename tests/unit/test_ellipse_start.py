"""Where the search for an ellipse begins: places around the outline, the fit of points, the start from an image."""

import numpy as np
import pytest

from measure.features.blurred_ellipse import from_symmetric, outline, to_symmetric
from measure.features.optics import Optics
from measure.find import ellipse as module
from measure.find.ellipse import _positions, _start, find_ellipse
from tests.oracle import polygon_image

OPTICS = Optics((80, 90), 0.8, 1.0, 1.0, 3.0)
SHAPE = to_symmetric(np.array([44.0, 39.0, 22.0, 11.0, 0.5]))


@pytest.mark.parametrize("spacing", [1.0, 2.0])
def test_positions_are_evenly_spaced(spacing):
    """Perimeter over the spacing in number; each as far from the next, to 3 %, in the direction of the outline."""
    t, places, normals = _positions(SHAPE, OPTICS, spacing)
    h = (22 - 11) ** 2 / (22 + 11) ** 2
    perimeter = np.pi * 33 * (1 + 3 * h / (10 + np.sqrt(4 - 3 * h)))  # Ramanujan
    assert len(t) == int(perimeter / spacing)
    steps = np.linalg.norm(np.roll(places, -1, 0) - places, axis=1)
    assert steps == pytest.approx(np.full(len(t), perimeter / len(t)), rel=0.03)
    assert places == pytest.approx(outline(SHAPE, t)[0])
    tangent = np.roll(places, -1, 0) - np.roll(places, 1, 0)
    assert np.abs((tangent * normals).sum(1) / np.linalg.norm(tangent, axis=1)).max() < 0.07  # of chords
    assert ((places - [44, 39]) * normals).sum(1).min() > 0


@pytest.mark.parametrize(("x", "y"), [(14.0, 39.0), (44.0, 75.0), (80.0, 39.0), (44.0, 5.0)])
def test_positions_keep_off_the_border(x, y):
    """Window, four smoothing scales and a pixel: 8 px; what has that much room is all there."""
    shape = to_symmetric(np.array([x, y, 10.0, 10.0, 0.0]))
    t, places, _ = _positions(shape, OPTICS, 1.0)
    angle = 2 * np.pi * np.arange(62) / 62
    room = [8 <= x + 10 * np.cos(a) <= 81 and 8 <= y + 10 * np.sin(a) <= 71 for a in angle]
    assert len(t) == sum(room) < 62
    assert places.min() >= 8 - 1e-9  # margin: kept by its kind
    assert (places <= np.array([81, 71]) + 1e-9).all()  # margin: kept by its kind


@pytest.mark.parametrize(("window", "scale"), [(3.0, 1.6), (4.5, 0.7)])
def test_the_border_is_kept_off_by_what_the_locator_sees(window, scale):
    """Of an outline that just touches that much room all places are there, of one that is farther out not."""
    optics, margin = Optics((80, 90), 0.8, 1.0, scale, window), window + 4 * scale + 1
    counts = []
    for x in (margin + 10 + 0.01, margin + 10 - 0.3):
        counts.append(len(_positions(to_symmetric(np.array([x, 39.0, 10.0, 10.0, 0.0])), optics, 1.0)[0]))
    assert counts[0] == int(20 * np.pi / scale)
    assert counts[1] < counts[0]


@pytest.mark.parametrize("circle", [False, True])
def test_start_of_exact_points(circle):
    """From a pixel off to the ellipse on which the valid points lie; the others do not count; four are too few."""
    true = np.array([44.3, 38.6, 21.0, 21.0 if circle else 12.0, 0.0 if circle else 0.45])
    points = np.stack([outline(to_symmetric(true), np.linspace(0, 6, 30))[0]] * 2)
    valid = np.ones((2, 30), bool)
    points[0, 3], valid[0, 3] = 0.0, False
    valid[1, 4:] = False
    expected = to_symmetric(true + [1.0, -0.5, 0.7, 0.7 if circle else -0.6, 0.0])
    shapes, good = _start(points, valid, expected, circle)
    assert good.tolist() == [True, False]
    assert from_symmetric(shapes[0])[0][:4] == pytest.approx(true[:4], abs=0.02)
    assert (shapes[1] == expected).all()


def test_start_from_an_image(monkeypatch):
    """On a small circle the zero crossing lies inside the edge; the start allows for it."""
    starts = []
    monkeypatch.setattr(module, "likeliest_ellipse", lambda image, start, *rest: starts.append(start))
    t, radius = 2 * np.pi * np.arange(2000) / 2000, 7.0
    ring = np.array([44.3, 38.6]) + radius * np.column_stack([np.cos(t), np.sin(t)])
    image = polygon_image(ring, OPTICS.shape, OPTICS.blur_px, 100.0, 20.0)
    find_ellipse(image, [44.0, 39.0, 7.5, 7.5, 0.0], OPTICS, circle=True)
    ((x, y, xx, yy, xy),) = starts
    assert (x, y) == pytest.approx((44.3, 38.6), abs=5e-3)
    assert (xx, yy) == pytest.approx((radius, radius), abs=0.035)
    assert xy == 0
