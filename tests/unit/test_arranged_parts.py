"""Parts of the search for the most likely arrangement, each with stand-ins for the rest."""

from types import SimpleNamespace

import numpy as np
import pytest

import measure
import render
from measure.features import contrasts
from measure.features.arranged import _area, _inverted, _is_beyond
from measure.features.contrasts import _contrast
from measure.features.locating import _rivals
from scenes import Noise, Picture, load

USED = np.s_[2:5, 3:6]


@pytest.mark.parametrize(("value", "beyond"), [(256.0, True), (255.0, False), (-0.5, True), (0.0, False)])
@pytest.mark.parametrize("used", [True, False])
def test_beyond(value, beyond, used):
    """Images that the sensor cannot have recorded are known by the pixels that are used, not by others."""
    images = np.full((3, 8, 9), 100.0)
    images[1][(3, 4) if used else (0, 0)] = value
    images[2, 7, 8] = 1000.0  # so that it is looked at closely
    tool = SimpleNamespace(
        noise=Noise(sigma=1.0, bits=8), taken=lambda stack: stack[:, USED[0], USED[1]].reshape(3, -1)
    )
    assert _is_beyond(images, tool).tolist() == [False, beyond and used, False]


def test_without_digits_nothing_is_beyond():
    tool = SimpleNamespace(noise=Noise(sigma=1.0, bits=None), taken=None)
    assert not _is_beyond(np.full((2, 4, 4), -1e9), tool).any()


@pytest.mark.parametrize(
    ("apart", "settled", "worse", "ambiguous"),
    [
        (0.6, True, 8.9, True), (0.4, True, 0.0, False), (0.0, True, 0.0, False), (-0.6, True, 1.0, True),
        (0.6, False, 1.0, False), (0.6, True, 9.1, False),
    ],
)  # fmt: skip
def test_two_maxima(apart, settled, worse, ambiguous):
    """Half a pixel apart and within 3 sigma of each other; what else differs does not matter."""
    tool = SimpleNamespace(model=SimpleNamespace(free=np.arange(2)), parameters=lambda state: np.array(state))
    best = SimpleNamespace(state=[1.0, 2, 3, 4, 50], cost=100.0, settled=True)
    rest = SimpleNamespace(state=[1.0, 2, 3, 4 + apart, 90], cost=100.0 + worse, settled=settled)
    assert _rivals(tool, best, rest) is ambiguous


def test_contrast_along_a_piece(rng):
    """A polynomial of the second degree in the levels, at its start, its middle and its end; sigma by drawn levels."""
    contrast = rng.normal(size=(4, 3, 2 * 2 + 5 + 1))  # of two free vertices, five levels and the blur
    root = rng.normal(size=(5, 5))
    covariance = np.zeros((10, 10))
    covariance[4:9, 4:9] = root @ root.T
    tool = SimpleNamespace(model=SimpleNamespace(free=np.arange(2)))
    pieces = SimpleNamespace(contrast=contrast)
    centre = SimpleNamespace(expansion=SimpleNamespace(pieces=pieces), covariance=covariance)
    found, sigma = _contrast(tool, centre)
    for k, t in enumerate((0.0, 0.5, 1.0)):
        expected = np.array([[np.polyval(piece[::-1, level], t) for level in range(4, 9)] for piece in contrast])
        assert found[:, k] == pytest.approx(expected)
        drawn = expected @ root @ rng.standard_normal((5, 40_000))
        assert sigma[:, k] == pytest.approx(drawn.std(1), rel=0.02)  # margin: 5.7 standard errors of 40,000 draws


@pytest.mark.parametrize(
    ("contrast", "state"),
    [
        ([[9, 9, 9], [9, 9, 9]], "ok"), ([[9, 4.1, 9], [9, -9, 9]], "sign_change"),
        ([[9, 3.9, 9], [9, 9, 9]], "low_contrast"),
        ([[9, 9, 9], [9, 9, -2.1]], "sign_change"), ([[9, 9, 9], [9, 9, -1.9]], "ok"),
        ([[-9, -9, -9], [-9, -9, 2.1]], "sign_change"), ([[9, 9, 9], [-3.9, -3.9, -3.9]], "low_contrast"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("sigma", [1.0, 7.0])
def test_what_an_edge_shows(contrast, state, sigma, monkeypatch):
    """Each of an edge's pieces by 4 standard deviations in its middle; no change of sign by 2; a hidden edge none."""
    here = sigma * np.array([[*contrast, [0.1, 0.1, 0.1]]], float)
    monkeypatch.setattr(contrasts, "contrasts", lambda tool, found: (here, np.full(here.shape, sigma)))
    monkeypatch.setattr(contrasts, "_shown", lambda tool: np.array([True, False, True]))
    tool = SimpleNamespace(
        arrangement=SimpleNamespace(edges=np.array([7, 0, 0, 2])), model=SimpleNamespace(moving=np.array([1, 2, 3]))
    )
    middle, found = contrasts.seen_edges(tool, SimpleNamespace(names=("a", "b", "c")), None)
    assert found.tolist() == [[state, "not_visible", "low_contrast"]]
    assert middle[0] == pytest.approx([sigma * (contrast[0][1] + contrast[1][1]) / 2, 0, 0.1 * sigma])


@pytest.mark.parametrize(
    ("start", "stop", "shown"),
    [((5, 5), (30, 5), True), ((5, 5), (5.5, 5), False), ((-9, 5), (5, 5), True), ((-50, 5), (0.5, 5), False),
     ((5, 19), (35, 19), True), ((5, 19.1), (35, 19.1), False), ((39.1, 2), (39.1, 18), False),
     ((39, 2), (39, 18), True)],
)  # fmt: skip
def test_edges_within_the_image(start, stop, shown):
    """At least 2 px of them, in an image of 40 x 20 px."""
    arrangement = SimpleNamespace(
        vertices=np.array([start, stop], float), required=np.array([[0, 1]]), recorded=lambda places: places
    )
    assert contrasts._shown(SimpleNamespace(arrangement=arrangement, shape=(20, 40))).tolist() == [shown]


def beside_an_edge(vertices):
    """A tool for a triangle, region 1, and a quadrilateral, region 2, that share piece 1, the only one of an edge.

    Region 3, beside none, is the triangle the other way round.
    """
    pieces = np.array([[0, 1], [1, 2], [2, 0], [2, 1], [1, 3], [3, 4], [4, 2], [1, 0], [2, 1], [0, 2]])
    sides = np.array([[1, 0], [1, 2], [1, 0], [0, 0], [2, 0], [2, 0], [2, 0], [3, 0], [3, 0], [3, 0]])
    edges = np.array([-1, 5, -1, -1, -1, -1, -1, -1, -1, -1])
    arrangement = SimpleNamespace(pieces=pieces, sides=sides, edges=edges)
    return SimpleNamespace(arrangement=arrangement), np.array(vertices, float)


PLACES = [[0, 0], [5, 1], [2, 7], [9, 3], [6, 8]]


def test_areas_are_those_of_the_shoelace_formula():
    """Triangle and quadrilateral share a piece: the second counts it the other way round."""
    tool, vertices = beside_an_edge([PLACES, np.array(PLACES) * [1, -2]])
    for region, corners in ((1, [0, 1, 2]), (2, [2, 1, 3, 4])):
        x, y = np.array(PLACES, float)[corners].T
        area = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2
        assert area == pytest.approx({1: 16.5, 2: 26.5}[region])
        assert _area(tool.arrangement, region, vertices) == pytest.approx([area, -2 * area])


@pytest.mark.parametrize(
    ("vertex", "place", "inverted"),
    [(0, [0, 0], False), (0, [6, 6], True), (4, [6, 8], False), (4, [2.8, -20.4], True), (3, [-60, 3], True)],
)
def test_a_face_turned_inside_out_is_seen(vertex, place, inverted):
    """Whichever of the two faces beside the required edge it is, in whichever image."""
    turned = [list(each) for each in PLACES]
    turned[vertex] = place
    tool, vertices = beside_an_edge([PLACES, turned, PLACES])
    assert _inverted(tool, vertices).tolist() == [False, inverted, False]


@pytest.mark.render
def test_a_quantity_is_measured_beside_another_that_is_hidden():
    """Nothing of the front is seen: the top is what it is where it alone is asked for, and its sigma too."""
    scene, sensor, lights = load("two_lights"), (22.5, 152.4), ((30.5, 342.2), (15.8, 341.5))
    picture = Picture.of(scene, sensor, lights)
    clean = render.image(picture, quality=render.Quality(supersample=2, everywhere=True))
    images = render.expose(clean, scene.noise, np.random.default_rng(1), 3)
    alone = picture.with_scene(scene.tried(measurands=scene.measurands[:1]))
    both, one = (measure.measure(images, each, estimator="arrangement") for each in (picture, alone))
    assert both.status.tolist() == [["ok", "not_visible"]] * 3
    assert both.value[:, 0] == pytest.approx(one.value[:, 0], rel=1e-12)
    told, known = (measure.propagate(clean, each, estimator="arrangement").measurands for each in (picture, alone))
    assert told.status == ("ok", "not_visible")
    assert told.covariance[0, 0] == pytest.approx(known.covariance[0, 0], rel=1e-12)
    assert np.isinf(told.covariance[1, 1])
    assert told.response[[0]].toarray() == pytest.approx(known.response.toarray(), rel=1e-9, abs=1e-15)
    assert not told.response[[1]].nnz


@pytest.mark.render
def test_an_edge_between_dark_faces_leaves_the_others_alone():
    """Both faces beside it are dark: its quantity has low contrast, the other one is measured."""
    picture = Picture.of(load("two_lights"), (40.1, 193.7), ((43.1, 147.3), (32.0, 9.9)))
    clean = render.image(picture, quality=render.Quality(supersample=2, everywhere=True))
    assert measure.propagate(clean, picture, estimator="arrangement").measurands.status == ("ok", "low_contrast")
