"""By which estimator is measured where none is named."""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from measure import best
from measure.features.layout import layout_of
from measure.quantities import find
from scenes import InvalidInput, Picture, Pose
from scenes.status import CLUTTER, ILL_CONDITIONED, LOW_CONTRAST, OK, SIGN_CHANGE
from validation import simulation
from validation.cli import measurands
from validation.inspection import inspect
from validation.remeasured import Method

NEAR, FAR = (30, 135), (15, 315)


def test_an_arrangement_that_tells_too_little_is_measured_by_edge_points(task1, monkeypatch):
    """Decided of the picture and its lights; of a scene, or without a light, nothing is known."""
    picture = Picture.of(task1, NEAR, FAR)
    assert measure.best_estimator(picture) == "arrangement"
    monkeypatch.setattr(best, "is_told", lambda *given: False)
    assert measure.best_estimator(picture) == "gradient"
    assert measure.best_estimator(picture.unlit()) == "arrangement"
    assert measure.best_estimator(task1) == "arrangement"


def test_what_is_no_plain_scene_is_measured_by_edge_points():
    bracket = scenes.load("bracket")
    assert measure.best_estimator(bracket) == "gradient"
    assert measure.best_estimator(Picture.of(bracket, NEAR, FAR)) == "gradient"


@pytest.mark.render
def test_where_an_arrangement_is_ill_conditioned_the_default_measures():
    """A pose of the ring light at which slivers make an arrangement's errors no linear ones: edge points are `ok`, and
    scatter as told over 200 images, within 4.5 standard errors."""
    scene = scenes.load("ring_light")
    picture = Picture.of(scene, (15.5, 283.7))
    assert measure.best_estimator(picture) == "gradient"
    image = render.image(picture, quality=render.Quality(supersample=2))
    assert measure.propagate(image, picture, estimator="arrangement").status == "ill_conditioned"
    off = simulation.simulated(picture, Method("gradient"))
    assert off.status == ("ok",)
    noisy = render.expose(image, scene.noise, np.random.default_rng(1), 200)
    found = measure.measure(noisy, picture, correction=off)
    assert (found.status == "ok").all()
    ratio = found.value[:, 0].var(ddof=1) / off.covariance[0, 0]
    assert ratio == pytest.approx(1.0, abs=4.5 * np.sqrt(2 / 199))
    assert abs(found.value[:, 0].mean() - np.hypot(12.5, 7.5)) < 3 * found.u[:, 0].mean()


@pytest.mark.parametrize(
    ("states", "taken", "asked"),
    [
        ((OK, OK, OK), "gradient", 1),
        ((ILL_CONDITIONED, OK, OK), "isophote", 2),
        ((LOW_CONTRAST, OK, OK), "isophote", 2),
        ((ILL_CONDITIONED, CLUTTER, CLUTTER), "gradient", 3),
        ((CLUTTER, OK, OK), "isophote", 2),
        ((CLUTTER, CLUTTER, OK), "strip", 3),
        ((CLUTTER, ILL_CONDITIONED, OK), "strip", 3),
        ((CLUTTER, CLUTTER, CLUTTER), "gradient", 3),
    ],
)
def test_another_estimator_measures_where_it_alone_tells_the_value(states, taken, asked, task1, monkeypatch):
    """Of the simulated picture; corrections of states that are made up, by gradient, isophotes, strips."""
    monkeypatch.setattr(best, "is_told", lambda *given: False)
    seen, made = made_up(dict(zip(("gradient", "isophote", "strip"), states, strict=True)))
    assert simulation.best(Picture.of(task1, NEAR, FAR), made).estimator == taken
    assert seen == ["gradient", "isophote", "strip"][:asked]


@pytest.mark.parametrize("state", [CLUTTER, ILL_CONDITIONED, LOW_CONTRAST, SIGN_CHANGE])
def test_where_things_hide_or_light_each_other_strips_alone_are_asked(state):
    """They know the scene's levels; above a megapixel where noise decides."""
    picture = Picture.of(scenes.load("grey_floor"), (30, 15), (15, 315))
    for other, taken in ((OK, "strip"), (CLUTTER, "gradient")):
        seen, made = made_up({"gradient": state, "strip": other})
        assert simulation.best(picture, made).estimator == taken
        assert seen == ["gradient", "strip"]


@pytest.mark.parametrize(
    ("one", "other", "both", "taken"),
    [
        ((OK, CLUTTER, OK), (OK, OK, CLUTTER), (OK, OK, OK), "gradient, strip at e4 e9"),
        ((OK, LOW_CONTRAST, OK), (OK, OK, LOW_CONTRAST), (OK, OK, OK), "gradient, strip at e4 e9"),
        ((OK, CLUTTER, CLUTTER), (CLUTTER, OK, OK), (CLUTTER, OK, CLUTTER), "strip"),  # they share an edge
        ((OK, SIGN_CHANGE, OK), (OK, OK, OK), None, "strip"),
        ((OK, LOW_CONTRAST, OK), (OK, LOW_CONTRAST, OK), None, "gradient"),
    ],
)
def test_each_edge_is_measured_by_the_estimator_that_tells_its_values(one, other, both, taken):
    """Where each of two tells values that the other does not; the pair is asked once more, and taken if it tells
    most."""
    scene = scenes.load("grey_floor").with_(task=None, measurands=[
        {"name": name, "kind": "angle", "features": [{"edge": first}, {"edge": last}]}
        for name, first, last in (("a", "e7", "e11"), ("b", "e4", "e9"), ("c", "e4", "e11"))
    ])  # fmt: skip
    seen, made = made_up({"gradient": one, "strip": other})
    _, mixed = made_up(dict.fromkeys(("gradient, strip at e4 e9", "gradient, strip at e11 e4 e9"), both))

    def by(picture, method):
        return made(picture, method) if method.locator in measure.ESTIMATORS else mixed(picture, method)

    assert simulation.best(Picture.of(scene, (30, 15), (15, 315)), by).estimator == taken
    assert seen == ["gradient", "strip"]


def test_images_above_a_megapixel_are_simulated_once_where_a_bias_is_not_known():
    """But where noise decides which edge it is, twice."""
    picture = Picture.of(scenes.load("bracket_mm"), (30, 40), (35, 67))
    for state, asked in (
        (CLUTTER, ["gradient"]), (LOW_CONTRAST, ["gradient"]), (ILL_CONDITIONED, ["gradient", "strip"]),
    ):  # fmt: skip
        seen, made = made_up({"gradient": state, "strip": OK})
        simulation.best(picture, made)
        assert seen == asked


def test_what_pixels_of_a_sensor_are_not_is_not_asked_of_them():
    """Strips take pixels for equal, or for independent."""
    for name, asked in (("grey_floor", ("strip",)), ("task1", ("isophote", "strip"))):
        scene = scenes.load(name)
        assert measure.other_estimators(scene) == asked
        for noise in ({"row_sigma": 0.5}, {"colour": {"pattern": "RGGB"}}):
            assert measure.other_estimators(scene.with_(noise=noise)) == ("isophote",)


def made_up(states):
    """Names of estimators that were asked, and what makes corrections of states by estimator, of all values or each."""
    seen = []

    def made(picture, method):
        seen.append(method.locator)
        count, given = len(picture.scene.quantities), states[method.locator]
        each = (given,) * count if isinstance(given, str) else given
        bias = np.array([0.0 if state in (OK, CLUTTER) else np.nan for state in each])
        doubt = {"reflectance": np.array([9.0 if state == CLUTTER else 0.1 for state in each])}
        of = picture.scene.quantities, method.locator, None, bias, bias, doubt, doubt, np.eye(count), np.eye(count)
        return measure.Correction(*of, each)

    return seen, made


@pytest.mark.render
def test_where_noise_decides_for_edge_points_isophotes_measure():
    """A pose of the grey floor at which a shadow runs beside an edge: by isophotes it scatters as told over 400 images,
    within 4.5 standard errors, which twice the variance would not be, and about what the noise-free image tells."""
    scene = scenes.load("grey_floor")
    picture = Picture.of(scene, Pose(49.8, 285.4), (Pose(34.9, 356.0),))
    image = render.image(picture, quality=render.Quality(supersample=2))
    told = {name: measure.propagate(image, picture, estimator=name) for name in ("gradient", "isophote")}
    assert told["gradient"].status == ILL_CONDITIONED
    assert told["isophote"].status in (OK, CLUTTER)
    noisy = render.expose(image, scene.noise, np.random.default_rng(1), 400)
    found = measure.measure(noisy, picture, estimator="isophote")
    assert np.isin(found.status, (OK, CLUTTER)).all()
    variance, expected = found.value[:, 0].var(ddof=1), told["isophote"].measurands
    limit = 4.5 * np.sqrt(2 / 399)
    assert variance / expected.covariance[0, 0] == pytest.approx(1.0, abs=limit)
    assert variance / (2 * expected.covariance[0, 0]) != pytest.approx(1.0, abs=limit)
    assert abs(found.value[:, 0].mean() - expected.value[0]) < 4.5 * np.sqrt(variance / 400)


def test_edges_by_two_estimators_are_each_what_its_own_finds(task1, rng):
    """Lines and their covariance in noisy images; what is propagated, too, and that of edges of both."""
    picture = Picture.of(task1, NEAR, FAR)
    clean = planner.image(picture)
    images = render.expose(clean, task1.noise, rng, 3)
    mixed = measure.mixed_estimator("gradient", "isophote", ["e9", "e4"])
    names = ("gradient", "isophote", mixed)
    one, other, both = (find(images, picture, name).shape for name in names)
    edges = layout_of(picture).names
    for e, name in enumerate(edges):
        own = other if name in ("e4", "e9") else one
        assert (both.normals[:, e] == own.normals[:, e]).all()
        assert (both.points[:, e] == own.points[:, e]).all()
        here = slice(2 * e, 2 * e + 2)
        assert (both.lines[:, here, here] == own.lines[:, here, here]).all()
    assert not np.array_equal(one.points, other.points)  # margin
    one, other, both = (measure.propagate(clean, picture, estimator=name).measurands for name in names)
    assert both.status == ("ok",)
    assert len({float(each.covariance[0, 0]) for each in (one, other, both)}) == 3
    assert min(one.covariance, other.covariance) < both.covariance < max(one.covariance, other.covariance)


def test_estimators_of_pairs_of_names(task1):
    picture = Picture.of(task1, NEAR, FAR)
    image = np.zeros((task1.camera.height, task1.camera.width))
    with pytest.raises(InvalidInput, match="estimator must be of two that measure each edge by itself, got 'strip'"):
        measure.measure(image, picture, estimator="gradient, strip at e4")
    with pytest.raises(InvalidInput, match="estimator must be at edges that are measured, got 'e400'"):
        measure.measure(image, picture, estimator="gradient, isophote at e400")
    with pytest.raises(InvalidInput, match=r"estimator must be one of canny, .*, got 'sobel'"):
        measure.measure(image, picture, estimator="sobel, isophote at e4")
    assert measure.mixed_estimator("strip", "isophote", ["e4"]) is None


def test_by_what_is_measured_is_said_where_it_is_not_the_default(task1):
    picture = Picture.of(task1, NEAR, FAR)
    image = planner.image(picture)
    names = ("arrangement", "isophote", "gradient, isophote at e4")
    found = [measure.measure(image, picture, estimator=name) for name in names]
    assert [each.estimator for each in found] == list(names)
    assert measurands.by_others(inspect(*found)) == [
        f"Straight edges in picture {k} by {names[k - 1]}, which tells more of the values than arrangement does."
        for k in (2, 3)
    ]
    (line,) = measurands.by_others(inspect(found[1]))
    assert line.startswith("Straight edges by isophote, ")
    assert {row["estimator"] for row in measurands.facts(inspect(found[2]))} == {names[2]}
