"""Polarisers, lamps and filters as unknowns of a plan: what they cost, what they may gain, and how it is judged."""

from dataclasses import replace

import numpy as np
import pytest

import planner
import scenes
from imaging.light.appearance import analyser_axis, polarisation_axis, signal
from imaging.light.edge_sides import of_sides
from imaging.light.irradiance import bands
from imaging.pictures import Pictures
from planner.design import Choice, exposure_time, own_choice, throughput, with_choice
from planner.prediction import variances
from planner.search.local import Start, descend
from scenes import Filter, InvalidInput, Lamp
from validation.vary_check import Scatter, judged

GLOSSY = ((45, 225), (45, 105))
ANGLES = np.array([0.0, 60.0, 120.0])


@pytest.fixture(scope="module")
def polarised():
    return scenes.load("polarised")


@pytest.fixture(scope="module")
def copper():
    return scenes.load("copper")


def levels(scene, choice, points):
    """Signals of points (n, 3) of a face that looks up, and the squared lengths of both axes across the rays."""
    world = with_choice(scene, choice, "white")
    world = world.model_copy(update={"camera": world.camera.model_copy(update={"exposure": 100.0})})
    pictures = Pictures.of(world, np.array([40.0, 0.0]), np.array([45.0, 170.0]))
    found, sizes = signal(pictures, points, np.array([0.0, 0.0, 1.0]), 1), 1.0
    axes = (analyser_axis(world, pictures.sensors), polarisation_axis(world, 0, pictures.lights_at[0]))
    for axis, at in zip(axes, (pictures.sensor_at, pictures.lights_at[0]), strict=True):
        ray = (at - points) / np.linalg.norm(at - points, axis=-1, keepdims=True)
        sizes = sizes * (1.0 if axis is None else 1 - (ray @ axis) ** 2)
    return found, sizes


def form(degrees):
    return np.array([1.0, np.cos(2 * np.radians(degrees)), np.sin(2 * np.radians(degrees))])


def test_nine_pictures_tell_those_of_all_angles(polarised, rng):
    """Bilinear in (1, cos 2a, sin 2a) of both angles, once an axis counts as long as it is across the ray."""
    points = rng.uniform(-6, 6, (20, 3)) * (1, 1, 0)
    known = np.array([[np.prod(levels(polarised, Choice(a, p), points), axis=0) for p in ANGLES] for a in ANGLES])
    inverse = np.linalg.inv(np.array([form(angle) for angle in ANGLES]))
    coefficients = np.einsum("ia,jp,apn->ijn", inverse, inverse, known)
    assert np.abs(coefficients[1:, 1:]).max() > 1  # both angles matter
    for a, p in rng.uniform(0, 180, (10, 2)):
        found, sizes = levels(polarised, Choice(a, p), points)
        assert np.einsum("i,j,ijn->n", form(a), form(p), coefficients) / sizes == pytest.approx(found, rel=1e-10)


def test_no_polariser_is_two_crossed_ones(polarised):
    """At the reference point, where the axes lie across the rays."""
    point = np.zeros((1, 3))

    def level(a, p):
        return levels(polarised, Choice(a, p), point)[0]

    assert level(None, 30.0) == pytest.approx(level(20.0, 30.0) + level(110.0, 30.0))
    assert level(20.0, None) == pytest.approx((level(20.0, 50.0) + level(20.0, 140.0)) / 2)


def test_polarisers_cost_light_or_time(polarised):
    assert with_choice(polarised, own_choice(polarised)) is polarised
    none = Choice(None, None)
    assert with_choice(polarised, none, "time").camera.exposure == 2 * polarised.camera.exposure
    assert exposure_time(polarised, none, "white") == pytest.approx(1 / 4)
    assert with_choice(polarised, none, "white").camera.exposure == pytest.approx(polarised.camera.exposure / 2)


def test_white_keeps_its_level(polarised):
    """A diffuse surface alone: whatever stands before lens and lamp."""
    material = polarised.material.model_copy(update={"specular_fraction": 0.0})
    scene, level = polarised.model_copy(update={"material": material}), []
    for choice in (own_choice(scene), Choice(None, None), Choice(30.0, None), Choice(None, 10.0)):
        pictures = Pictures.of(with_choice(scene, choice, "white"), np.array([20.0, 0.0]), np.array([30.0, 90.0]))
        level.append(float(signal(pictures, np.zeros((1, 3)), np.array([0.0, 0.0, 1.0]), 1)[0]))
    assert level == pytest.approx([level[0]] * 4)


def test_light_of_lamps_and_filters(copper):
    """A flat lamp from 450 to 700 nm; a triangle of 10 nm between two rows of the table passes 10 / 250 of it."""
    narrow = Filter(name="narrow", transmission=((515.0, 0.0), (525.0, 1.0), (535.0, 0.0)))
    scene = copper.model_copy(
        update={"filters": (narrow,), "lamps": (Lamp(name="x", spectrum=((450, 2.0),), power=3),)}
    )
    assert throughput(scene, Choice(None, None, filter="narrow")) == pytest.approx(10 / 250)
    assert throughput(scene, Choice(None, 0.0, lamp="x", filter="narrow")) == pytest.approx(3 / 2 * 10 / 250)
    found = [band for band in bands(with_choice(scene, Choice(None, None, "x", "narrow"))) if band.share > 0]
    assert [(band.n, band.share) for band in found] == [(pytest.approx(1.05), 1.0)]
    assert found[0].k == pytest.approx(2.6)


def test_the_own_choice_stays_without_gain():
    """Polarisers take light of a diffuse block and give nothing."""
    found = planner.plan(scenes.load("task1"), sensor=(30, 135), light=(15, 315), vary=("analyser", "polarisation"))
    assert found.varied.gain == found.varied.gain_same_poses == 1
    assert found.varied.best.choice == Choice(None, None)
    assert found.varied.best.scene is found.scene
    assert found.varied.fixed.variance == found.variance


@pytest.mark.parametrize(
    ("name", "poses", "vary", "hold", "least"),
    [
        ("polarised", ((30, 135), (15, 315)), ("analyser", "polarisation"), "time", 1.5),
        ("glossy_metal", GLOSSY, ("analyser", "polarisation"), "time", 1.0),
        ("copper", ((50, 278), (51, 88)), ("band",), "time", 1.4),
    ],
)
def test_gains(name, poses, vary, hold, least):
    said = []
    found = planner.plan(
        scenes.load(name), sensor=poses[0], light=poses[1], vary=vary, hold=hold, report=lambda *told: said.append(told)
    ).varied
    choices = [told[1:] for told in said if told[0] == "trying choices"]
    assert choices == sorted(choices)
    assert choices[-1] == (found.evaluated, found.evaluated)  # all that is to be tried, from the first one on
    assert {whole for _, whole in choices} == {found.evaluated}
    assert found.gain >= found.gain_same_poses >= 1  # margin: same poses are among all, by their kind
    assert found.gain >= least  # margin: the least that is said of each
    assert (found.best.sensor, found.best.light) == (found.fixed.sensor, found.fixed.light)
    best = variances(found.best.scene, np.array(list(found.best.sensor)), np.array(list(found.best.light)))
    assert found.best.variance == pytest.approx(best)
    assert found.fixed.choice == own_choice(scenes.load(name))


@pytest.mark.parametrize(
    ("name", "vary", "hold", "line"),
    [
        ("task1", ("colour",), "time", "vary must be some of analyser, polarisation, band, each once, got 'colour'"),
        ("task1", ("analyser", "analyser"), "time", "vary must be some of .* got 'analyser,analyser'"),
        ("task1", ("analyser",), "power", "hold must be one of time, white, got 'power'"),
        ("task1", ("band",), "time", "task1: lamps or filters must be given to vary the band, got none"),
    ],
)
def test_bad_input(name, vary, hold, line):
    with pytest.raises(InvalidInput, match=line):
        planner.plan(scenes.load(name), vary=vary, hold=hold)


def test_bands_need_indices_and_light(copper):
    bare = copper.model_copy(update={"material": scenes.load("task1").material})
    with pytest.raises(InvalidInput, match=r"material.index_table must be given to vary the band"):
        planner.plan(bare, vary=("band",))
    dark = (Lamp(name="ultraviolet", spectrum=((300, 1.0), (350, 0.0))),)
    with pytest.raises(InvalidInput, match=r"must let some light pass within material.index_table \(450 to 700 nm\)"):
        planner.plan(copper.model_copy(update={"lamps": dark, "filters": ()}), vary=("band",))


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[[lamps]]\nname = 'a'\nspectrum = [[500, 1], [400, 1]]", "lamps.spectrum must be rows of rising wavelength"),
        ("[[lamps]]\nname = 'a'\nspectrum = [[500, 0]]", "lamps.spectrum must have a value above 0, got none for 'a'"),
        ("[[filters]]\nname = 'a'\ntransmission = [[500, 1.5]]", "filters.transmission must be at most 1, got 1.5"),
        (2 * "[[lamps]]\nname = 'a'\nspectrum = [[500, 1]]\n", "lamps must have different names, got 'a' twice"),
    ],
)
def test_bad_lamps(tmp_path, text, line):
    path = tmp_path / "bad.toml"
    path.write_text((scenes.load.__globals__["BUNDLED"] / "task1.toml").read_text() + "\n" + text)
    with pytest.raises(InvalidInput, match=line):
        scenes.load(path)


def test_descents_stay_where_trust_is():
    """The minimum of a square lies beyond a border: the descent comes near the border and not across."""
    begin = Start(np.array([40.0, 0.0]), np.array([20.0, 0.0]), np.array([50.0]), held=(True, True))
    end = descend(
        begin, lambda _s, _k, turns: (turns[0] - 10) ** 2 + 1, sizes=(8.0, 1.0), trusted=lambda _s, _k, t: t[0] > 30,
        fast=True,
    )  # fmt: skip
    assert 30 < end.angles[0] < 30.5  # margin: near the border and not across it
    assert (end.sensor == begin.sensor).all()


def scatter(rng, sigma2, predicted, n=1000):
    measured = float(rng.normal(0, np.sqrt(sigma2), n).var(ddof=1))
    return Scatter("distance", predicted, predicted, measured, 1.0, n, 0, (0.0, 1.0), "ok")


def test_verdict_keeps_its_level_and_sees_a_wrong_gain(rng):
    """True gains are contradicted about once in a hundred; one wrong by 1.3 nearly always, by 2 always."""
    wrong = [[not judged(scatter(rng, 2.0, 2.0 * f), scatter(rng, 1.0, 1.0)).agrees for f in (1, 1.3, 2)]
             for _ in range(500)]  # fmt: skip
    rates = np.mean(wrong, axis=0)
    assert rates[0] < 0.03  # margin: chance: 5 of 500 expected, 15 are 4.5 standard deviations more
    assert rates[1] > 0.85  # margin: chance: 93 % of 500, 7 standard errors
    assert rates[2] == 1


def test_lost_pictures_contradict(rng):
    good = scatter(rng, 1.0, 1.0)
    found = judged(good, replace(good, failed=20))
    assert found.verdict == "contradict: 20 of 1000 pictures could not be measured."
    assert np.isnan(found.gain)


def test_saturation_is_felt_beside_an_edge_that_is_seen_end_on():
    """One picture's levels do not depend on what else is looked at with it, nor on what is unknown of that."""
    scene = scenes.load("glossy_metal")
    sides = np.array([[[300.0], [0.0]], [[np.nan], [np.nan]]])
    found, alone = of_sides(scene, sides), of_sides(scene, sides[:1])
    assert found.squared[0, 0] == alone.squared[0, 0] == pytest.approx(235**2)
    assert found.noise_variance[0, 0] == pytest.approx(scene.noise.variance / 2)


def test_a_plan_tells_the_variance_of_its_poses():
    """The refinement ends where it is not trusted, so the grid's poses stay, with their variance."""
    found = planner.plan(scenes.load("polarised"), step_deg=15)
    assert found.variance == pytest.approx(found.prediction.variance_object)


def test_what_is_varied_is_set_up_too():
    """Poses that were moved with the angles are to a tenth of a degree, and so are those that were not."""
    found = planner.plan(scenes.load("polarised"), sensor=(30, 135), step_deg=45, vary=("polarisation",)).varied
    assert tuple(found.best.sensor) == (30, 135)
    assert found.best.light != found.fixed.light
    for each in (found.fixed, found.same_poses, found.best):
        angles = np.array(list(each.light))
        assert np.abs(angles - angles.round(1)).max() < 1e-9
        told = variances(each.scene, np.array(list(each.sensor)), angles)
        assert each.variance == pytest.approx(told)
