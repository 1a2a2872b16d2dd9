"""Bounds of pairs where things hide and shade each other: no value is below, and the search by them is that of all."""

import dataclasses

import numpy as np
import pytest

import scenes
from imaging.geometry.projection import direction
from imaging.geometry.rays import reaches
from planner.search import brightest, exhaustive
from planner.search.lit import all_lit
from planner.search.objective import SearchProblem
from planner.search.pair_bounds import PairBounds, has_pair_bounds
from tests.bounded import all_values, drawn_lights, drawn_poses, drawn_problem


def drawn(seed, sensors=10, lights=20, names=None):
    """Bounds and values of all pairs of a drawn scene."""
    rng = np.random.default_rng([1, seed])
    problem = drawn_problem(rng, *([names] if names else []))
    poses = drawn_poses(rng, sensors), drawn_lights(rng, problem, lights)
    return PairBounds.of(problem, *poses), all_values(problem, *poses)


def told(bounds):
    return bounds.rows(np.arange(len(bounds.measures)))


def test_no_value_is_below_its_bound():
    """1200 pairs of hollow, floored, convex parts, under one light and two; 5 % more is caught."""
    caught = 0
    for seed in (0, 4, 5, 8, 9, 11):
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
    values = all_values(problem, *poses)
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


def test_which_scenes_have_bounds():
    """Not glossy or printed ones, rings of light, circles alone, parts whose place is not known."""
    known = {name: has_pair_bounds(scenes.load(name), "calibrated") for name in (
        "bracket", "grey_floor", "plate", "two_lights", "glossy_metal", "printed_label", "ring_light", "flange",
        "board_block", "shaft",
    )}  # fmt: skip
    assert [name for name, is_bounded in known.items() if is_bounded] == [
        "bracket",
        "grey_floor",
        "plate",
        "two_lights",
    ]
    assert not has_pair_bounds(scenes.load("bracket"), "paper")
