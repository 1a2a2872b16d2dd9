"""Lines that noise has looked for from elsewhere: whether their errors are those that their derivative tells."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import measure
import render
import scenes
from imaging.geometry.segments import within_reach
from measure.estimators import isophote, strip_pixels
from measure.estimators.registry import estimator
from measure.features import line_noise
from measure.features.layout import layout_of, polygon_layout
from measure.features.line_noise import torn
from measure.features.optics import Optics
from measure.features.shape import find_shape, prepared
from validation.hard.polygon import polygon_image

SHAPE, NOISE = (100, 110), 2.0
CORNERS = np.array([[30.0, 30.0], [80.0, 30.0], [80.0, 70.0], [30.0, 70.0]])


def picture(off: float, step: float = 0.0) -> np.ndarray:
    """The rectangle, ``off`` px to the right of where it is expected, and to its left brighter by a step of so many
    grey levels that ends 3.5 px beside it and that nobody expects."""
    image = polygon_image(CORNERS + [off, 0.0], SHAPE, 0.7, 100.0, 20.0)
    image[:, :27] += step
    return image


def scatter(image, name):
    """Variance of the left side's place in 200 noisy images over the told one, and whether that is called untold."""
    layout = polygon_layout(CORNERS, Optics(SHAPE, blur_px=0.7, noise_variance=NOISE**2))
    tool = prepared(layout, name, 1.0)
    near = tool.respond_within(image)
    told = np.zeros((len(near), image.size))
    told[:, tool.pixels] = near
    side = int(np.argmin(layout.ends[..., 0].sum(1)))
    called = torn(image, layout, name, 1.0, sparse.csr_array(told))
    noisy = image + NOISE * np.random.default_rng(3).standard_normal((200, *SHAPE))
    found = find_shape(noisy, layout, name, 1.0, judged=False)
    start = np.einsum("ni,ni->n", found.normals[:, side], found.points[:, side] - layout.ends[side, 0])
    return start.var() / (NOISE**2 * (near[2 * side] ** 2).sum()), called[side], called[np.arange(4) != side]


@pytest.mark.parametrize("name", ["strip", "isophote"])
def test_a_line_that_lies_alike_from_wherever_it_is_looked_for_is_as_told(name):
    """Between two places of the grid of expectations; within 4.5 standard errors of 200 images."""
    ratio, called, others = scatter(picture(0.4375), name)
    assert ratio == pytest.approx(1.0, abs=4.5 * np.sqrt(2 / 199))
    assert not called
    assert not others.any()


def test_a_line_that_lies_elsewhere_from_elsewhere_is_not_as_told():
    """Fitted beside a step that nobody expects a strip's line depends on where it is looked for: here it is drawn to
    places of the grid, and scatters less."""
    ratio, called, others = scatter(picture(0.08, 50.0), "strip")
    assert ratio < 0.8  # margin: 0.63
    assert called
    assert not others.any()


@pytest.mark.parametrize(
    ("name", "jumping", "images", "called"),
    [("isophote", 3, 16, 4), ("isophote", 2, 128, 2), ("gradient", 3, 128, 3), ("gradient, isophote at s1", 3, 128, 3)],
)
def test_where_most_isophotes_jump_no_more_images_are_drawn(name, jumping, images, called, monkeypatch):
    """All count as such then; of half of them, and by others, each is told by all that are drawn."""
    layout, image = polygon_layout(CORNERS, Optics(SHAPE, blur_px=0.7, noise_variance=NOISE**2)), picture(0.4375)
    response, asked = np.zeros((8, image.size)), []

    def offsets(images, *given):
        asked.append(len(images))
        return np.zeros((len(images), 4, 2)), np.ones((len(images), 4), bool)

    monkeypatch.setattr(line_noise, "_offsets", offsets)
    edges = itertools.cycle(range(4))
    monkeypatch.setattr(line_noise, "is_linear", lambda *edge: next(edges) >= jumping)
    monkeypatch.setattr(line_noise, "_is_doubtful", lambda *given: True)
    assert torn(image, layout, name, 1.0, sparse.csr_array(response)).sum() == called
    assert sum(asked) == 1 + images


@pytest.mark.parametrize("name", ["isophote", "strip"])
def test_edges_out_of_reach_change_nothing(name, monkeypatch):
    """Whether they are asked for their distance or not: pixels and what these do to the lines."""
    bracket = scenes.load("bracket")
    layout = layout_of(scenes.Picture.of(bracket, bracket.settings[0].sensor, bracket.settings[0].light))
    image, asked = np.random.default_rng(2).uniform(50, 200, layout.optics.shape), []

    def all_of(segments, points, reach):
        asked.append(len(segments) - len(within_reach(segments, points, reach)))
        return segments

    near = estimator(layout, name)
    for module in (isophote, strip_pixels):
        monkeypatch.setattr(module, "within_reach", all_of)
    every = estimator(layout, name)
    assert (near.pixels == every.pixels).all()
    assert (
        np.nan_to_num(near.estimate(image[None]).level).tolist()
        == np.nan_to_num(every.estimate(image[None]).level).tolist()
    )
    assert sum(asked) > 20  # margin: that there are such edges


@pytest.mark.render
def test_what_a_riser_lights_is_measured_by_a_strip_that_knows_the_scene():
    """Of the bracket's third setting one edge is told half a pixel off by its neighbour's light where levels are taken
    for even: by such a strip it lies up to 20 sigma from where it lies in other images, and is refused."""
    bracket = scenes.load("bracket")
    picture = scenes.Picture.of(bracket, bracket.settings[2].sensor, bracket.settings[2].light)
    image = render.image(picture, quality=render.Quality(supersample=2))
    told = {name: measure.propagate(image, picture, estimator=name).status for name in ("strip", "gradient")}
    assert set(told.values()) <= set(scenes.status.MEASURED)
    noisy = render.expose(image, bracket.noise, np.random.default_rng(1), 200)
    layout = layout_of(picture)
    ratios = []
    for known in (layout, replace(layout, levels=None)):
        found, side = find_shape(noisy, known, "strip", judged=False), layout.names.index("e11")
        start = np.einsum("ni,ni->n", found.normals[:, side], found.points[:, side] - layout.ends[side, 0])
        ratios.append(start.var(ddof=1) / found.lines[:, 2 * side, 2 * side].mean())
    assert ratios[0] == pytest.approx(1.0, abs=4.5 * np.sqrt(2 / 199))
    assert ratios[1] > 3  # margin: some 8 times
