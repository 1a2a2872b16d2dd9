"""Each estimator of straight edges on exact images of a polygon: offsets, contrast, and how they respond to pixels."""

from dataclasses import replace

import numpy as np
import pytest

from imaging.geometry.segments import distance_to_segment
from measure.estimators.registry import estimator
from measure.estimators.strip import _strip
from measure.features.calipers import edge_calipers
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from tests.oracle import polygon_image

SHAPE, BLUR, CONTRAST = (120, 130), 0.7, 100.0
CORNERS = np.array([[22.3, 18.6], [108.1, 25.2], [101.7, 99.4], [17.2, 92.9]])
OPTICS = Optics(SHAPE, BLUR, 1.0, 1.0, 3.0)


def moved_sides(by, turn):
    """The corners of the sides moved outwards by so many px at their middles, and turned there."""
    ends = np.stack([CORNERS, np.roll(CORNERS, -1, 0)], 1)
    middle, along = ends.mean(1), ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    outward = np.stack([along[:, 1], -along[:, 0]], 1)
    points, ways = middle + np.array(by)[:, None] * outward, along + np.array(turn)[:, None] * outward
    crossed = []
    for e in range(4):
        t = np.linalg.solve(np.stack([ways[e - 1], -ways[e]], 1), points[e] - points[e - 1])
        crossed.append(points[e - 1] + t[0] * ways[e - 1])
    return np.array(crossed)


def found(name, corners=CORNERS, blur=BLUR, more=0.0):
    tool = estimator(polygon_layout(CORNERS, OPTICS), name)
    image = polygon_image(corners, SHAPE, blur, CONTRAST, 20.0) + more
    return tool, tool.estimate(image[None])


def at_middle(tool, estimate):
    """Offset at the middle of each edge, px, positive outwards."""
    half = np.array([caliper.length / 2 for caliper in tool.calipers])
    sign = np.array([-1.0 if caliper.normal @ (np.mean(CORNERS, 0) - caliper.at(half[:1], np.zeros(1))[0]) > 0 else 1.0
                     for caliper in tool.calipers])  # fmt: skip
    return sign * (estimate.level + estimate.slope * half)[0], sign * estimate.slope[0]


@pytest.mark.parametrize("name", ["strip", "isophote", "gradient", "canny"])
def test_offset_tilt_and_contrast(name):
    """Sides a few hundredths of a pixel off are told to 2 thousandths, their contrast to 7 %."""
    by, turn = [0.03, -0.02, 0.04, -0.05], [2e-4, -3e-4, 1e-4, 4e-4]
    tool, estimate = found(name, moved_sides(by, turn))
    offset, tilt = at_middle(tool, estimate)
    off = 6e-3 if name == "canny" else 1.5e-3
    assert offset == pytest.approx(by, abs=off)
    assert tilt == pytest.approx(turn, abs=off / 20)
    assert np.abs(estimate.contrast[0, :, 0]) == pytest.approx(np.full(4, CONTRAST), rel=0.07)
    assert np.abs(estimate.contrast[0, :, 1]).max() * 80 < 0.02 * CONTRAST
    assert (estimate.state == "ok").all()


@pytest.mark.parametrize("blur", [0.66, 0.74])
def test_strip_does_not_take_blur_for_offset(blur):
    tool, estimate = found("strip", blur=blur)
    assert np.abs(at_middle(tool, estimate)[0]).max() < 2e-3


def test_strip_does_not_take_slopes_of_the_level_for_offset():
    """A blurred step between levels that grow across and along it by the same slope is a blurred step plus a ramp."""
    ramp = np.add.outer(0.4 * np.arange(SHAPE[0]), -0.3 * np.arange(SHAPE[1]))
    tool, estimate = found("strip", more=ramp)
    assert np.abs(at_middle(tool, estimate)[0]).max() < 1e-3


@pytest.mark.parametrize("name", ["strip", "isophote", "gradient"])
def test_response(name, rng):
    """The derivative by the pixels, against small patterns added to the image."""
    tool = estimator(polygon_layout(CORNERS, OPTICS), name)
    clean = polygon_image(CORNERS, SHAPE, BLUR, CONTRAST, 20.0)
    lines = tool.respond_within(clean)
    pattern = rng.standard_normal(SHAPE)
    ahead, behind = (tool.estimate((clean + step * pattern)[None]) for step in (1e-3, -1e-3))
    numeric = np.stack([(ahead.level - behind.level)[0], (ahead.slope - behind.slope)[0]], 1).ravel() / 2e-3
    assert np.asarray(lines @ pattern.ravel()[tool.pixels]).ravel() == pytest.approx(numeric, rel=1e-2, abs=1e-7)


@pytest.mark.parametrize("apart", [None, 4.0, 6.5])
def test_pixels_of_a_strip(apart):
    """Beside the part that is used, clear of other edges; of a crowding one all along, so many times nearer to it."""
    layout = polygon_layout(CORNERS, OPTICS)
    caliper = edge_calipers(layout, 4.0, 0.0, 8.0)[0]
    start, stop = layout.ends[0]
    if apart:
        beside = (layout.ends[0] + apart * caliper.normal)[None]
        layout = replace(layout, others=beside, apart=(beside, *layout.apart[1:]))
    flat, ideal, along, across = _strip(layout, caliper, 0, 4.0)
    y, x = (part.ravel() for part in np.mgrid[: SHAPE[0], : SHAPE[1]])
    away = np.stack([x, y], 1) - start
    u, v = away @ caliper.direction, away @ caliper.normal
    first, last = caliper.positions[[0, -1]]
    wanted = (u >= first - 0.5) & (u <= last + 0.5) & (np.abs(v) <= 16)
    for a, b in layout.ends[1:]:
        wanted &= distance_to_segment(np.stack([x, y], 1).astype(float), a, b) > 4.0
    if apart:
        wanted &= (np.abs(v - apart) > 4.0) | (np.abs(v - apart) > 1.5 * np.abs(v))
    assert flat.tolist() == np.flatnonzero(wanted).tolist()
    assert ideal == pytest.approx(np.stack([x, y], 1)[wanted])
    assert along == pytest.approx(u[wanted])
    assert across == pytest.approx(v[wanted])
    assert np.linalg.norm(stop - start) == pytest.approx(caliper.length)
