"""Scenes fitted to photographs, part by part: what is free, what is looked at, how likely it is, and where to begin."""

from dataclasses import replace
from functools import cache

import numpy as np

import planner
from measure.fitting import fit as fitting
from measure.fitting import goodness, information, likelihood, noise, photograph, sides, start, unmodelled
from measure.fitting.parameters import OPTIONS, Parameters, radius_px
from measure.fitting.photograph import Pixels, Shots
from scenes import Noise, Picture
from tests.regression.numbers.poses import load, uneven
from tests.regression.stored import CLOSED, SEARCHED

_SMALL = {"width": 128, "height": 104}
_NOISE = Noise(sigma=1.7, gain=0.04, dark_level=6.0, prnu=0.003, dsnu=0.2)


def _scene(name):
    scene = load(name)
    smaller = scene.camera.model_dump() | _SMALL | {"focal_px": scene.camera.focal_px * 128 / scene.camera.width}
    return scene.with_(camera=smaller, noise=_NOISE.model_dump())


@cache
def _two():
    """Two poses of a block under one light that moves."""
    scene = _scene("task1")
    sensor, light = uneven(scene)
    return tuple(Picture.of(scene, pose, lamp) for pose, lamp in ((sensor, light), ((41, 77), (52, 203))))


@cache
def _problem(count=1, options=(), shrink=1, smooth=0.0):
    pictures = _two()[:count]
    parameters = Parameters.of(pictures, options)
    rng = np.random.default_rng(5)
    shots = []
    for k, picture in enumerate(pictures):
        clean = planner.image(picture)
        images = [clean + rng.normal(0, 1.7, clean.shape) for _ in range(k + 1)]
        shots.append(Shots.of(images, tuple(range(k + 1))))
    values = parameters.start()
    seen = [likelihood.seen_coarsely(parameters.pictures_at(values, k), shrink, smooth) for k in range(count)]
    return likelihood.Problem(parameters, tuple(shots), tuple(map(Pixels.around, seen)), shrink, smooth), values


def _off(values):
    """Values a little away, no two as far."""
    return values * (1 + 1e-3 * np.cos(1.0 + np.arange(values.size))) + 0.02 * np.sin(2.0 + np.arange(values.size))


def _parameters():
    found = {}
    scene = _scene("task1")
    ring = scene.with_(light={"distance": 90.0, "mount": "camera"}, settings=[{"sensor": [33, 71]}])
    mounted = Picture.of(ring, (33, 71))
    lights = load("two_lights")
    several = Picture.of(lights, *uneven(lights))
    asked = {
        "one": (_two()[:1], ()), "two": (_two(), tuple(OPTIONS)), "mounted": ((mounted,), ("k1",)), "lights": (
            (several, several), ("focal",)),
    }  # fmt: skip
    for name, (pictures, options) in asked.items():
        parameters = Parameters.of(pictures, options)
        values = _off(parameters.start())
        beyond = values.copy()
        for i, each in enumerate(parameters.free):
            if each.kind in ("sensor", "light"):
                beyond[i] += (-95.0, 700.0)[each.where[-1]] if each.where[0] == 0 else (170.0, -50.0)[each.where[-1]]
        beyond[parameters.names.index("camera.roll_deg")] = 171.0
        covariance = np.cov(np.random.default_rng(3).normal(size=(values.size, 60)))
        scene = parameters.scene_at(values)
        found[name] = {
            "free": parameters.free, "start": parameters.start(), "camera": scene.camera, "noise": scene.noise,
            "poses": [parameters.poses_at(values, k) for k in range(len(pictures))],
            "settled": parameters.settled(beyond, covariance), "radius": radius_px(pictures[0]),
            "picture": [[each.sensor, each.lights] for each in [parameters.picture_at(values, 0)]],
        }  # fmt: skip
    return found


def _photographs():
    rng, shape = np.random.default_rng(7), (43, 58)
    slope = np.add.outer(np.arange(43.0), 2 * np.arange(58.0))
    images = [slope + rng.normal(0, 1.5, shape) for _ in range(3)]
    images.insert(1, images[0] + np.where(np.arange(58) < 9, 3.0, 0.0) + rng.normal(0, 1.5, shape))
    shots = Shots.of(images, (0, 2, 3))
    pictures = _problem()[0].parameters.pictures_at(_problem()[1], 0)
    large = Picture.of(load("task1"), *uneven(load("task1")))
    fine = Parameters.of((large,)).pictures_at(Parameters.of((large,)).start(), 0)
    behind = Parameters.of((_two()[0],))
    away = behind.start()
    away[behind.names.index("aim.right")] = 300.0
    return {
        "grouped": [each.members for each in photograph.grouped(images)], "shots": shots, "coarse": [
            shots.coarse(*how) for how in ((1, 0.0), (2, 0.7), (3, 0.0), (5, 1.3))],
        "window": [Pixels.around(each) for each in (pictures, fine)],
        "tiled": [Pixels.around(fine, most) for most in (60_000, 20_000, 4_000)],
        "of": Pixels.around(pictures).of(planner.image(_two()[0])), "beside": Pixels.around(
            behind.pictures_at(away, 0)),
    }  # fmt: skip


def _likely():
    found = {}
    for name, how in {"one": (1,), "two": (2, ("k1",)), "coarse": (1, (), 2, 1.3), "smooth": (2, (), 1, 0.8)}.items():
        problem, values = _problem(*how)
        at, which = _off(values), np.arange(values.size)
        found[name] = {
            "observed": problem.observed(), "expected": problem.expected(at, _NOISE), "signal": problem.signal(at, 0),
            "variance": problem.variance(at, _NOISE), "jacobian": problem.jacobian(at, _NOISE, which[::2]),
            "beside": problem.beside(at, which),
        }  # fmt: skip
    grazing = Picture.of(_scene("task1"), (30, 135), (44.8, 315))
    parameters = Parameters.of((grazing,))
    problem = replace(_problem()[0], parameters=parameters)
    found["kinks"] = [problem.beside(parameters.start() + away, np.arange(len(parameters.free))) for away in (0.0, 0.3)]
    without = replace(parameters, free=tuple(each for each in parameters.free if each.name != "noise.dark_level"))
    bare = replace(problem, parameters=without)
    found["dark of the noise"] = bare.levels(without.start(), _NOISE, 0)
    return found


def _searched():
    problem, values = _problem()
    which = np.array([i for i, each in enumerate(problem.parameters.free) if each.name != "camera.blur_px"])
    return [likelihood.most_likely(problem, _off(values), _NOISE, which, 4.0, nearly) for nearly in (False, True)]


def _told():
    rng = np.random.default_rng(4)
    white = rng.normal(size=(40, 5)) * [1.0, 30.0, 0.2, 5.0, 1e-3]
    twice, none = white.copy(), white.copy()
    twice[:, 3], none[:, 1] = 2 * twice[:, 1] + 1e-7 * twice[:, 3], 0.0
    problem, values = _problem()
    which = np.array([0, 1, 3, 5, 8])
    jacobian = problem.jacobian(values, _NOISE, which) / 1.7
    free = problem.parameters
    return {
        "covariance": [information.covariance_of(each) for each in (white, none)], "singular": np.diag(
            information.covariance_of(twice)) > 1e3 * np.diag(information.covariance_of(white)),
        "told": [information.are_told(free, which, scale * jacobian) for scale in (1.0, 1e-2, 1e-4, 1e-7)],
        "alone": [information.are_alone(problem, values, _NOISE, some, jacobian[:, : some.size], np.full(
            jacobian.shape[0], 2.9)) for some in (which, which[:2])],
    }  # fmt: skip


def _noise():
    rng = np.random.default_rng(6)
    signal = rng.uniform(0, 150, 400)
    freedom = np.where(np.arange(400) < 300, 1.0, 3.0)
    square = rng.chisquare(freedom) / freedom
    models = {
        "photons": (2.9 + 0.05 * signal) * square, "white": 3.0 * square, "falls": (9.0 - 0.05 * signal) * square,
        "no dark": 0.05 * signal * square - 0.2,
    }  # fmt: skip
    curves = {name: noise.curve(signal, variance, freedom) for name, variance in models.items()}
    curves["one level"] = noise.curve(np.full(400, 60.0), models["white"], freedom)
    problem, values = _problem()
    seen = problem.signal(values, 0)
    return {
        "curves": curves, "noise": [each.noise(Noise(sigma=1.0, bits=bits)) for each in curves.values()
                                    for bits in (None, 8)],
        "neighbours": noise.by_neighbours(problem.shots[0], problem.pixels[0], seen, 2.9),
        "repeated": noise.by_repetition(_problem(2)[0].shots[1], _problem(2)[0].pixels[1], _problem(2)[0].signal(
            _problem(2)[1], 1)),
        "of a fit": [fitting._curve(*_problem(count), _NOISE) for count in (1, 2)],
    }  # fmt: skip


def _goodness():
    found = {}
    for count in (1, 2):
        problem, values = _problem(count)
        at = _off(values)
        sigma, expected = np.sqrt(problem.variance(at, _NOISE)), problem.expected(at, _NOISE)
        which = np.arange(0, values.size, 2)
        white = problem.jacobian(at, _NOISE, which) / sigma[:, None]
        rest, covariance = (problem.observed() - expected) / sigma, information.covariance_of(white)
        beside = unmodelled.directions(problem, at, _NOISE, expected)
        parts = goodness.parts(rest, expected / sigma, expected, problem.pixels, white, covariance, beside)
        found[str(count)] = {
            "beside": beside, "parts": parts, "p": [goodness.p_value(parts, freedom) for freedom in (np.inf, 900.0)],
            "as a whole": fitting._goodness(at, _NOISE, None, (problem, white, sigma**2)),
        }  # fmt: skip
    lens, values = _problem(1, ("k1",))
    found["with k1"] = len(unmodelled.directions(lens, values, _NOISE, lens.expected(values, _NOISE)))
    some = [goodness.Part(90.0, 100.0), goodness.Part(3.0, 0.4), goodness.Part(31.0, 20.0)]
    found["p"] = [goodness.p_value(each, 500.0) for each in (some, some[:1], some[1:2], some[1:])]
    level = np.cumsum(np.array([0.0, 1, 2.5, 0, 0, 3, 1, 0])).reshape(1, 2, 4)
    found["edges"] = goodness._edges(np.concatenate([level, 2 * level[:, ::-1]]))
    found["sums"] = goodness._sums(np.arange(2 * 9 * 10 * 2.0).reshape(-1, 2) ** 1.1, (2, 9, 10))
    return found


def _flat_sides():
    """Light that just grazes a face, and one that does not."""
    found = {}
    for name, light in {"grazing": (44.9, 315), "clear": (20, 300)}.items():
        picture = Picture.of(_scene("task1"), (30, 135), light)
        parameters = Parameters.of((picture,))
        values = parameters.start()
        image = planner.image(picture)
        shots = (Shots(image, 1, None, (0,)),)
        problem = likelihood.Problem(parameters, shots, (Pixels.around(parameters.pictures_at(values, 0)),))
        which = np.array([parameters.names.index(each) for each in (
            "camera.exposure", "noise.dark_level", "sensor.polar", "light.polar", "light.azimuth")])  # fmt: skip
        variance = problem.variance(values, _NOISE)
        white = problem.jacobian(values, _NOISE, which) / np.sqrt(variance)[:, None]
        flat = sides.flatter_side(problem, values, _NOISE, which, white, variance)
        found[name] = {"moved": flat - values, "turns": [
            sides._turns_away(problem, values, i, which, white * scale) for i in which[2:3] for scale in (1.0, 1e-3)
        ]}  # fmt: skip
    return found


def _begun():
    pictures = _two()
    parameters = Parameters.of(pictures)
    values, scene = parameters.start(), parameters.scene
    clean = planner.image(pictures[0])
    moved = np.roll(clean, (3, -5), (0, 1)) * 1.2 + 4.0
    shots = tuple(Shots(each, count, None, (0,)) for each, count in ((moved, 1), (planner.image(pictures[1]), 4)))
    dim = [Shots(6.0 + share * (clean - 6.0), count, None, (0,)) for share in (1.0, 0.01, 3e-3) for count in (1, 30)]
    flat = np.full(clean.shape, 7.0)
    return {
        "shows": [start.shows_something(each, scene.noise) for each in dim], "turned": [
            start._turned(parameters, values, turn) - values for turn in ((-12.0, 7.0, 3.0), (0.0, -9.0, 0.0))],
        "movable": start._movable(parameters), "dark": start._dark(clean), "outline": [
            start._outline(each) for each in (clean, moved[2:, 4:], flat)],
        "aligned": start._aligned(parameters, shots, values, scene.noise), "nothing": start._aligned(
            parameters, (Shots(flat, 1, None, (0,)),), values, scene.noise) - values,
        "problems": [[each.shrink, each.smooth, [part.shape for part in each.pixels]] for each in (
            start._problem(parameters, shots, values, share) for share in start._COARSE)],
        "left": [start._left(parameters, shots, values, scene.noise, share) for share in start._COARSE],
        "whole": start._whole(parameters, values, scene.noise, 2), "difference": start.aligned_difference(
            Parameters.of(pictures[:1]), shots[:1], scene.noise),
    }  # fmt: skip


def cases():
    """By name: relative tolerance, and what makes the result."""
    return {
        "fit: parameters": (CLOSED, _parameters), "fit: photographs": (CLOSED, _photographs),
        "fit: likelihood": (CLOSED, _likely), "fit: search": (SEARCHED, _searched), "fit: information": (CLOSED, _told),
        "fit: noise": (CLOSED, _noise), "fit: goodness": (CLOSED, _goodness),
        "fit: flat sides": (SEARCHED, _flat_sides), "fit: beginning": (CLOSED, _begun),
    }  # fmt: skip
