"""Strips whose levels the scene knows: walls a pixel wide and shadows beside an edge, in images of another maker."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import measure
import scenes
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import project_ideal
from imaging.light.behind import seen_at
from imaging.pictures import Pictures
from measure.estimators import scene_strip
from measure.estimators.kinds import ESTIMATORS
from measure.estimators.likelihood import Columns, LikelihoodEstimator
from measure.features.layout import layout_of, polygon_layout
from measure.features.levels import EdgeLevels, _ends
from measure.features.optics import Optics
from measure.features.shape import find_shape
from scenes import InvalidInput, Picture

SHAPE, BLUR, DARK, FINE = (80, 96), 0.7, 16.0, 16
CORNERS = np.array([[20.3, 20.4], [74.3, 20.4], [74.3, 60.375], [20.3, 60.375]])  # edge 2 is the lower one
EDGE, WALL = 60.375, 1.5
OPTICS = Optics(SHAPE, BLUR, 1.0, dark_level=DARK)


def seen(y, edge=EDGE, wall=WALL, border=2.0):
    """From inside out: 120; a wall of 60, as wide in the image as said; a shadow of 25 up to ``border`` px past the
    edge, and 100."""
    return np.select([y < edge, y < edge + wall, y < EDGE + border], [120.0, 60.0, 25.0], 100.0)


def image(**about):
    """By points 1/16 px apart, blurred by scipy."""
    y, x = (np.mgrid[: SHAPE[0] * FINE, : SHAPE[1] * FINE] + 0.5) / FINE - 0.5
    inside = (x > 20.3) & (x < 74.3) & (y > 20.4)
    levels = gaussian_filter(np.where(inside, seen(y, **about), DARK), BLUR * FINE, truncate=6.0)
    return levels.reshape(SHAPE[0], FINE, SHAPE[1], FINE).mean((1, 3))


class Levels:
    """The scene's knowledge of the lower edge; ``step`` px: standard uncertainty of where the shadow ends."""

    def __init__(self, step=0.0):
        self.step = step

    def beside(self, name, half_width):
        along = np.arange(-2.0, 57.0)
        ends = _ends(along.size, half_width)
        away = -(ends[:, 1:] + ends[:, :-1]) / 2  # the normal points inwards
        one, other = (seen(EDGE + away, border=2.0 + sign * self.step) for sign in (1, -1))
        return EdgeLevels(along, ends, seen(EDGE + away), ((one - other) / 2)[None] if self.step else one[:0][None][:0])


def known(levels):
    """The layout of the lower edge alone, crowded by a wall and a shadow that it knows."""
    whole = polygon_layout(CORNERS, OPTICS)
    return replace(whole.only(np.array([2]))[0], levels=levels, clutter=np.zeros(1, bool))


def found(layout, picture, name="strip"):
    """How far below its place the edge is found, at its middle, px, and its status."""
    shape = find_shape(picture[None], layout, name, judged=False)
    middle = layout.ends.mean(1)[0]
    return float(shape.normals[0, 0] @ (shape.points[0, 0] - middle) * np.sign(shape.normals[0, 0, 1])), shape


@pytest.mark.parametrize("away", [-0.1875, 0.0, 0.125, 0.1875])
def test_an_edge_before_a_narrow_wall_and_a_shadow_is_found_where_it_is(away):
    """With what lies beside it, as a pose moves both. Taken for even, the same pixels tell another place."""
    picture = image(edge=EDGE + away, border=2.0 + away)
    place, shape = found(known(Levels()), picture)
    assert place == pytest.approx(away, abs=0.02)
    assert shape.status[0] in scenes.status.MEASURED
    blind, _ = found(replace(known(None), looks=None), picture)
    assert not abs(blind - away) < 0.1


def test_a_shadow_that_ends_elsewhere_moves_the_edge_unless_it_is_an_unknown():
    """A fifth of a px nearer to the edge; the uncertainty is 0.3 px."""
    picture = image(border=1.8125)
    free, bound = (abs(found(known(levels), picture)[0]) for levels in (Levels(0.3), Levels()))
    assert free < 0.02
    assert bound > 3 * free


def test_what_is_told_of_the_noise_is_what_noise_does(rng):
    """400 images: a variance within 4.5 standard errors; the shadow an unknown, so sigma is larger."""
    layout, clean = known(Levels(0.3)), image()
    shape = find_shape(clean + rng.standard_normal((400, *SHAPE)), layout, "strip", judged=False)
    start = np.einsum("ni,ni->n", shape.normals[:, 0], shape.points[:, 0] - layout.ends[0, 0])
    told = shape.lines[:, 0, 0].mean()
    assert start.var(ddof=1) / told == pytest.approx(1.0, abs=4.5 * np.sqrt(2 / 399))
    assert told > find_shape(clean[None], known(Levels()), "strip", judged=False).lines[0, 0, 0]


def test_an_input_that_is_known_before_lies_between_fixed_and_free(rng):
    """Nearly exact, it is as if it were not there; hardly known, as one more unknown."""
    layout = known(None)
    caliper = ESTIMATORS["gradient"].prepare(layout, 12.0).calipers[0]
    pixels, offsets, levels = np.arange(60), rng.standard_normal((60, 2)), rng.standard_normal((60, 2))
    ramp = offsets @ [0.5, 0.2] + 0.3 * rng.standard_normal(60)
    one = np.ones((1, 2))

    def variance(inputs, more, deviation):
        columns = Columns(np.concatenate([levels, more], 1), np.pad(one, ((0, 0), (0, more.shape[1]))),
                          np.pad(one, ((0, 0), (0, more.shape[1]))), offsets, np.zeros((60, 0)), inputs)  # fmt: skip
        return LikelihoodEstimator.of((caliper,), pixels, columns, OPTICS, deviation).unit[0, 0]

    none = np.zeros((60, 0))
    fixed, free = variance(np.zeros((0, 60)), none, 1.0), variance(np.zeros((0, 60)), ramp[:, None], 1.0)
    exact, hardly, between = (variance(ramp[None], none, deviation) for deviation in (1e6, 1e-6, 3.0))
    assert exact == pytest.approx(fixed, rel=1e-6)
    assert hardly == pytest.approx(free, rel=1e-6)
    assert 1.05 * fixed < between < free / 1.05


def test_cells_meet_on_the_edge_and_elsewhere_in_each_row():
    ends = _ends(80, 5.0)
    assert (ends[:, ends.shape[1] // 2] == 0).all()
    assert (np.diff(ends, axis=1) >= 0).all()
    assert np.diff(ends, axis=1).max() < 0.25 + 1e-9
    assert ends[:, 0].max() <= -4.75  # margin
    assert np.ptp(np.sort(ends[:, -1] % 0.25)) > 0.23  # margin: a row's ends are its own


def test_levels_are_those_that_the_picture_shows():
    """Of a floor's picture: what the layout knows beside an edge is what rays of the camera meet, on both sides."""
    scene = scenes.load("grey_floor")
    picture = Picture.of(scene, (30, 15), (15, 315))
    layout = layout_of(picture)
    beside = layout.levels.beside(layout.names[0], 4.0)
    assert beside.levels.shape == beside.middles.shape
    assert len(beside.changed) == 3 + 2  # the light's place, the part's and the floor's reflectances
    ends = scene.solid.vertices[list(scene.solid.edge(layout.names[0]).ends)]
    start, stop = project_ideal(ends, np.array([30.0, 15.0]), scene.camera)
    row = beside.along.size // 2
    across = np.array([-(stop - start)[1], (stop - start)[0]]) / np.linalg.norm(stop - start)
    places = (
        start
        + beside.along[row] * (stop - start) / np.linalg.norm(stop - start)
        + beside.middles[row][:, None] * across
    )
    seen = seen_at(Pictures.of(picture), places - image_centre(scene.camera), finely=True)
    assert beside.levels[row] == pytest.approx(scene.noise.dark_level + seen, abs=1e-9)
    assert beside.levels[row] == pytest.approx(layout.looks(places), rel=0.1)  # light told less finely there: 0.047
    assert np.ptp(beside.levels[row]) > 5  # margin: there is an edge


def test_strips_are_one_by_one_only_where_the_scene_is_known(task1):
    """There another estimator may measure some edges; of a plain scene that is refused in one line."""
    scene = scenes.load("grey_floor")
    assert measure.mixed_estimator("gradient", "strip", ["e4"], scene) == "gradient, strip at e4"
    assert measure.mixed_estimator("gradient", "strip", ["e4"], task1) is None
    kind = ESTIMATORS["strip"]
    assert kind.within(scene) is scene_strip.SCENE_STRIP
    assert kind.within(task1) is kind
    picture = Picture.of(task1, (30, 135), (15, 315))
    with pytest.raises(InvalidInput, match="must be of two that measure each edge by itself, got 'strip'"):
        measure.measure(np.zeros((task1.camera.height, task1.camera.width)), picture, estimator="gradient, strip at e4")
