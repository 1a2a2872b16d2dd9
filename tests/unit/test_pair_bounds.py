"""Bounds of pairs where things hide and shade each other: no value is below, and the search by them is that of all."""

import dataclasses

import numpy as np
import pytest

import scenes
from imaging.geometry.projection import direction
from imaging.geometry.rays import reaches
from imaging.light.appearance import signal
from imaging.pictures import Pictures
from planner.search import brightest, exhaustive
from planner.search.lit import all_lit
from planner.search.lobes import Around, Lobes, Shining
from planner.search.objective import SearchProblem
from planner.search.pair_bounds import PairBounds, has_pair_bounds
from tests.bounded import all_values, drawn_lights, drawn_poses, drawn_problem, searched_values, values_within


def drawn(seed, sensors=10, lights=20, names=None):
    """Bounds and values of all pairs of a drawn scene."""
    rng = np.random.default_rng([1, seed])
    problem = drawn_problem(rng, *([names] if names else []))
    poses = drawn_poses(rng, sensors), drawn_lights(rng, problem, lights)
    return PairBounds.of(problem, *poses), all_values(problem, *poses)


def told(bounds):
    return bounds.rows(np.arange(len(bounds.measures)), np.inf)


def test_no_value_is_below_its_bound():
    """1200 pairs of hollow, floored, convex, glossy parts, under one light and two; 5 % more is caught."""
    caught = 0
    for seed in (3, 6, 8, 10, 11, 21):
        bounds, values = drawn(seed)
        # margin: a bound, by its kind
        assert (told(bounds) <= values).all()
        some = np.isfinite(values)
        caught += (1.05 * told(bounds)[some] > values[some]).sum()
    assert caught > 20


def _lit(noise, high, low, most, least):
    """As if no shadow fell on what is behind an edge."""
    return _BEFORE(noise, high, low, most, np.where(most > 0, most, least))


def _nothing(noise, high, low, most, least):
    """As if nothing were there."""
    return _BEFORE(noise, high, low, 0 * most, 0 * least)


_BEFORE = brightest._before


@pytest.mark.parametrize("wrong", [_lit, _nothing])
def test_without_shadows_or_what_is_behind_a_bound_is_contradicted(wrong, monkeypatch):
    """On a floor before an upright, from where they are looked at."""
    problem = SearchProblem.of(scenes.load("grey_floor"), "calibrated", "object")
    rng = np.random.default_rng(2)
    poses = drawn_poses(rng, 15), drawn_poses(rng, 30)
    values = all_values(problem, *poses)
    assert (told(PairBounds.of(problem, *poses)) <= values).all()  # margin: a bound, by its kind
    monkeypatch.setattr(brightest, "_before", wrong)
    assert (told(PairBounds.of(problem, *poses)) > values).any()


def test_uneven_contrast_counts():
    """As if correlated errors took off no more at a dim end: contradicted."""
    bounds, values = drawn(1, names=("bracket",))
    even = dataclasses.replace(bounds, loss=0 * bounds.loss)
    assert (told(bounds) <= values).all()  # margin: a bound, by its kind
    assert (told(even) >= told(bounds)).all()
    assert (told(even) > told(bounds)).any()


@pytest.mark.parametrize("seed", [0, 4, 11])
def test_the_search_is_that_of_all_pairs(seed):
    """The best pair, and of each sensor near it the best light; far fewer are evaluated."""
    rng = np.random.default_rng(seed)
    problem = drawn_problem(rng)
    poses = drawn_poses(rng, 16), drawn_lights(rng, problem, 24)
    found = exhaustive.best_pair(problem, *poses, lambda *_: None)
    values = searched_values(problem, *poses)
    assert np.isfinite(values).any()
    assert found.variance == pytest.approx(values.min(), rel=1e-9)
    assert values[found.sensor, found.light] == pytest.approx(values.min(), rel=1e-9)
    near = values.min(1) <= exhaustive.DEAREST * values.min()
    assert found.least[near] == pytest.approx(values.min(1)[near], rel=1e-9)
    assert (found.least[~near] > 0.99 * exhaustive.DEAREST * values.min()).all()
    assert found.evaluated < values.size == found.pairs
    assert found.guaranteed


@pytest.mark.parametrize("name", ["bracket", "plate"])
def test_faces_that_are_all_lit_have_no_place_in_shadow(name):
    """By rays from drawn places of plane faces to drawn lights; of an inner face some lights reach a part only."""
    scene, rng = scenes.load(name), np.random.default_rng(4)
    bodies, lights = scene.bodies, 100 * direction(drawn_poses(rng, 40))
    known, free = [], []
    for face in np.flatnonzero(bodies.plane).tolist():
        corners = bodies.triangles[bodies.triangle_faces == face]
        shares = rng.dirichlet(np.ones(3), (60, len(corners)))
        places = np.einsum("nti,tij->ntj", shares, corners).reshape(-1, 3)
        known.append(all_lit(bodies, face, lights))
        at = np.broadcast_to(lights[:, None], (len(lights), *places.shape))
        over = reaches(bodies, np.broadcast_to(places, at.shape), np.full(at.shape[:-1], face), at)
        free.append(over.mean(1))
    known, free = np.array(known), np.array(free)
    assert (free[known] == 1).all()
    assert known.sum() > 0.8 * (free == 1).sum() if name == "bracket" else known.any()
    assert ((free > 0) & (free < 1)).any() == (name == "bracket")


def _dark(lobes, face, where):
    """As if no face had a lobe."""
    return (np.zeros((1, len(where.radii))),) * 2


@pytest.mark.parametrize("wrong", [None, _dark])
def test_what_lobes_can_do_is_bounded(wrong, monkeypatch):
    """Between polarisers and not, sensors in groups of some 10 degrees; as if there were no gloss is contradicted."""
    if wrong is not None:
        monkeypatch.setattr(Lobes, "of", wrong)
    below, closest, rng = 0, 0.0, np.random.default_rng(5)
    for name in ("copper", "polarised"):
        problem = SearchProblem.of(scenes.load(name), "calibrated", "object")
        poses = [rng.uniform(low, np.add(low, 20), (10, 2)) for low in ((20, 200), (10, 0))]
        values = all_values(problem, *poses)
        for within, of in ((False, values), (True, values_within(problem, *poses))):
            bounds, some = PairBounds.of(problem, *poses, within_scale=within), np.isfinite(of)
            for limit in (0.0, np.inf):  # roughly, and once more
                told = bounds.rows(np.arange(10), limit)
                below += (told[some] > of[some]).sum()
                closest = max(closest, (told[some] / of[some]).max(initial=0.0))
    assert (below == 0) == (wrong is None)
    assert closest > 0.8


@pytest.mark.parametrize("name", ["glossy_metal", "copper", "polarised", "anodised"])
def test_a_lobe_is_within_its_bounds(name):
    """Signals at places of pieces of edges from sensors of a group; near them if there is one sensor and one place. As
    if all sensors looked from the middle, it is not."""
    scene, rng = scenes.load(name), np.random.default_rng(8)
    lights, edges = rng.uniform((10, 0), (60, 360), (40, 2)), scene.solid.edges[:6]
    shining = [Shining(scene.light, *Pictures.of(scene, np.zeros(2), lights).emitters[0][2:5:2])]
    beyond = 0
    for edge in edges:
        sensors, face = rng.uniform((20, 40), (27, 55), (12, 2)), edge.faces[0]
        start, stop = scene.solid.vertices[list(edge.ends)]
        points = start + np.linspace(0.25, 0.5, 5)[:, None] * (stop - start)
        pictures = Pictures.of(scene, sensors[:, None], lights[None])
        normal, material = scene.bodies.normals[face], scene.surfaces.of(face)
        bright = signal(pictures, points, normal, 1, material=material)
        exact = bright - signal(pictures, points, normal, 1, material=material.matt())
        where = Around(points[[2]], np.array([np.linalg.norm(stop - start) / 8]))
        least, most = (each[None] for each in Lobes(scene, shining, sensors).of(face, where))
        slack = 1e-9 * bright
        assert (exact >= least - slack).all()
        assert (exact <= most + slack).all()
        least, most = (each[None] for each in Lobes(scene, shining, sensors[:1]).of(face, where))
        beyond += (exact > most + slack).sum() + (exact < least - slack).sum()
        alone = Around(points[[2]], np.zeros(1))
        least, most = (each[:, 0] for each in Lobes(scene, shining, sensors[:1]).of(face, alone))
        lit = bright[0, :, 2] > 0
        assert least[lit] == pytest.approx(exact[0, lit, 2], rel=0.02, abs=0.05) or all(_polarised(scene))
        assert most[lit] == pytest.approx(exact[0, lit, 2], rel=0.02, abs=0.05) or any(_polarised(scene))
    assert beyond > 100


def _polarised(scene):
    return scene.light.polarisation_deg is not None, scene.camera.analyser_deg is not None


def test_which_scenes_have_bounds():
    """Not printed ones, rings of light, circles alone, parts whose place is not known."""
    known = {name: has_pair_bounds(scenes.load(name), "calibrated") for name in (
        "bracket", "grey_floor", "plate", "two_lights", "glossy_metal", "printed_label", "ring_light", "flange",
        "board_block", "shaft",
    )}  # fmt: skip
    assert [name for name, is_bounded in known.items() if is_bounded] == [
        "bracket",
        "grey_floor",
        "plate",
        "two_lights",
        "glossy_metal",
    ]
    assert not has_pair_bounds(scenes.load("bracket"), "paper")
