"""The piece of an edge that stands out of the noise: what is left out, and that sigma is told truly of what is left."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

import scenes
from imaging.features.locator import MIN_CONTRAST, edge_blur
from imaging.features.projected_edges import projected_edges
from imaging.geometry.projection import edge_points
from imaging.light.edge_sides import side_signals
from imaging.models.along import used_trims
from imaging.models.strong import strong_piece, strong_pieces
from imaging.pictures import Pictures
from measure.estimators import crossings
from measure.estimators.gradient import GRADIENT
from measure.features.calipers import edge_calipers
from measure.features.layout import layout_of, polygon_layout
from measure.features.optics import Optics
from scenes import Picture

NONE = np.zeros(2)
SHADOWED = (43, 261), (35, 100)  # beside the foot of the bracket's riser a shadow begins: the other side is brighter
RISER = "e15"


@pytest.mark.parametrize(
    ("parts", "piece"),
    [
        ([(10, 20.0)], (0.0, 1.0)),
        ([(5, 20.0), (5, 10.1)], (0.0, 1.0)),  # by no more than a factor 2
        ([(5, 9.0), (5, 4.6)], (0.0, 1.0)),
        ([(5, 9.0), (5, 4.45)], (0.0, 0.46)),
        ([(5, 9.0), (1, 5.0), (4, 1.0)], (0.0, 0.5)),  # no jump
        ([(3, 1.0), (5, -9.0), (2, -2.0)], (0.34, 0.76)),
        ([(3, -20.0), (1, 0.0), (6, 6.3)], (0.44, 1.0)),
        ([(3, -20.0), (1, 0.0), (6, 6.2)], (0.0, 0.26)),
        ([(4, 20.0), (6, -20.0)], (0.44, 1.0)),  # a jump: 4 px beside it are left out
        ([(6, 20.0), (4, -20.0)], (0.0, 0.56)),
        ([(4, 6.2), (6, 0.0)], (0.0, 1.0)),  # nothing stands out
        ([(5, 20.0), (2, 0.0), (3, 20.0)], (0.0, 0.46)),
    ],
)
def test_longest_piece_of_one_sign(parts, piece):
    """Between two of a hundred parts it ends where the contrast would, changing evenly between their middles."""
    contrast = np.concatenate([np.full(10 * count, value) for count, value in parts])
    # margin: pieces are told to two digits
    assert strong_piece(contrast, 100.0, NONE, 4.0) == pytest.approx(piece, abs=0.0051)
    start, stop = strong_piece(-contrast[::-1], 100.0, NONE, 4.0)
    # margin: the same
    assert (1 - stop, 1 - start) == pytest.approx(piece, abs=0.0051)


@pytest.mark.parametrize("least", [2.0, -6.0])
def test_ends_move_evenly_with_the_contrast(least):
    """What is changed a little changes a piece a little: budgets take differences."""
    place = (np.arange(16) + 0.5) / 16
    ends = [strong_piece(least + 40 * place + more, 100.0, NONE, 4.0)[0] for more in (0.0, 1e-4)]
    assert ends[0] == pytest.approx((6.25 - least) / 40)
    assert ends[1] - ends[0] == pytest.approx(-1e-4 / 40)


def test_what_is_trimmed_decides_nothing():
    """Neither of contrast that changes beside a corner, nor of a piece of which less than 2 px are left."""
    contrast = np.array([1.0] * 10 + [-9.0] * 10 + [20.0] * 80)
    assert strong_piece(contrast, 100.0, np.array([20.0, 0.0]), 4.0) == (0.0, 1.0)
    assert strong_piece(contrast, 100.0, np.array([10.0, 0.0]), 4.0) == pytest.approx(
        (0.24, 1.0), abs=0.0051
    )  # margin: two digits
    ending = np.array([20.0] * 20 + [1.0] * 80)
    assert strong_piece(ending, 100.0, np.array([13.0, 0.0]), 4.0) == pytest.approx(
        (0.0, 0.16), abs=0.0051
    )  # margin: two digits
    assert strong_piece(ending, 100.0, np.array([14.5, 0.0]), 4.0) == (0.0, 1.0)


def test_of_a_scene():
    """What is left of the riser's foot has contrast of one sign; planner and calipers leave the same out."""
    scene = scenes.load("bracket_mm")
    picture = Picture.of(scene, *SHADOWED)
    pictures = Pictures.of(picture)
    view, layout = projected_edges(pictures), layout_of(picture)
    edge = view.names.index(RISER)
    start, stop = strong_pieces(pictures, view)[edge]
    assert (start, 0.7 < stop < 0.9) == (0.0, True)
    low, high = (
        np.subtract(*side_signals(pictures, (RISER,), edge_points(scene.solid, (RISER,), np.linspace(*ends, 9)))[0])
        for ends in ((0.05, stop - 0.02), (stop + 0.02, 0.98))
    )
    assert (np.sign(low) == np.sign(low[0])).all()
    # margin: the piece ends where the contrast is 6.25 times the noise
    assert (np.abs(low) > MIN_CONTRAST * np.sqrt(scene.noise.variance)).all()
    assert (np.sign(high) == -np.sign(low[0])).all()
    assert used_trims(pictures, view, trimmed=True)[edge, 1] == pytest.approx((1 - stop) * view.lengths[edge])
    caliper = edge_calipers(layout, 4.0, 9.0)[edge]
    assert caliper.positions[-1] == pytest.approx(stop * caliper.length)
    assert used_trims(pictures, view, trimmed=False)[edge, 1] < 0.1 * view.lengths[edge]


@pytest.mark.parametrize(
    ("name", "sensor", "light"),
    [("bracket_mm", *SHADOWED), ("task1", (30, 135), (15, 315)), ("printed_label", (30, 135), (35, 90))],
)
def test_elsewhere_the_whole_edge(name, sensor, light):
    """Of pictures that are glanced at, of one diffuse convex body, and beside prints."""
    pictures = Pictures.of(Picture.of(scenes.load(name), sensor, light))
    if name == "bracket_mm":
        pictures = replace(pictures, closely=False, _known={})
    assert (strong_pieces(pictures, projected_edges(pictures)) == [0.0, 1.0]).all()


def test_sigma_of_an_edge_whose_contrast_fades(rng, monkeypatch):
    """One side's light falls off along the edge, to less than the noise: the line through the points that are taken
    scatters as is told, and so does that through all of them, of which the faint ones count less; the line through all
    of them alike does not."""
    noise, count = 1.5, 1500
    optics = Optics((130, 140), 0.8, noise**2, 1.0, 3.0)
    layout = polygon_layout(np.array([[70.3, 14.0], [120.0, 14.0], [120.0, 116.0], [70.3, 116.0]]), optics)
    row, column = np.mgrid[:130, :140].astype(float)
    contrast = 45 * np.exp(-(row - 14.0) / 26)
    image = 60 + contrast * ndtr((column - 70.3) / edge_blur(0.8))
    edge = 3  # from below upwards
    along = 116.0 - (np.arange(102) + 0.5)
    strong = strong_piece(45 * np.exp(-(along - 14.0) / 26) / noise, 102.0, NONE, 4.6)
    assert strong[0] == pytest.approx(1 - 26 * np.log(4.8) / 102, abs=0.01)  # where it is 6.25 times the noise
    assert strong[1] == 1.0
    pieces = np.array([(0.0, 1.0)] * 3 + [strong])
    noisy = image + rng.normal(scale=noise, size=(count, *image.shape))
    ratio = []
    for known, alike in ((replace(layout, strong=pieces), False), (layout, False), (layout, True)):
        if alike:
            monkeypatch.setattr(crossings, "counted", lambda found, spread, size: np.ones(found.start.shape))
        part = GRADIENT.prepare(known, 0.0).parts[edge]
        middle = np.array([1.0, part.caliper.positions.mean()])
        told = np.sqrt(noise**2 * np.square(middle @ part.respond_within(image, part.pixels)).sum())
        found = part.estimate(noisy, noise**2)
        ratio.append(np.std(found.level[:, 0] + middle[1] * found.slope[:, 0]) / told)
    assert 0.95 < ratio[0] < 1.05  # margin: chance: 1500 pictures tell a deviation to 1.8 %
    assert 0.95 < ratio[1] < 1.05  # margin: as above
    # margin: 0.74; in noise alone they scatter no farther than the locator looks, whatever the slope says
    assert ratio[2] < 0.85
