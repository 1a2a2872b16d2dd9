"""Steps on the way whose slips a result may hide: of the rare branch, the row left out, the second of two."""

import copy
import json
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

import measure
import planner
from imaging.boards import saddle
from measure.boards import bend
from measure.estimators import crossing, crossings, profile, windows
from measure.features import conic
from measure.find import four_sides, rounds
from measure.photo import rounding
from planner import design
from planner.budgeting.plans import systematic
from planner.budgeting.sources import sources
from planner.search import lights, varying
from render import adaptive, optics
from scenes.parts.surfaces import roots
from tests.regression.numbers.poses import load, uneven, without_error
from tests.regression.stored import CLOSED, SEARCHED
from validation import comparison

_REFERENCE = Path(__file__).parents[1] / "reference.json"


def _profiles():
    rng = np.random.default_rng(2)
    kernel = profile.profile_kernel(1.3, np.array([0.6, 0.8]))
    rows = rng.normal(0, 1, (6, kernel.shape[1])) * np.array([3.0, *np.full(kernel.shape[1] - 1, 0.4)])
    shift, gradient, fall, good = profile.top(rows)
    return {"kernel": kernel, "shift": shift, "gradient": gradient, "fall": fall, "good": good,
            "moved": profile.top_kernel(kernel, np.array([0.3, -0.7]))}  # fmt: skip


def _crossings():
    rng = np.random.default_rng(5)
    x = np.linspace(-3, 3, 25)
    rows = -np.tanh(x - np.array([[0.31], [-0.77], [1.1], [0.0]])) + rng.normal(0, 0.02, (4, 25))
    one = rows[..., None]  # image
    best = crossings.bracket(one)
    places, normals = rng.uniform(6, 14, (3, 2)), np.array([[1.0, 0], [0.6, 0.8], [-0.8, 0.6]])
    return {
        "polarity": crossings.polarity(rows), "rise": crossings.rise(rows), "reversed": crossings.is_reversed(rows),
        "bracket": tuple(each[:, 0] for each in best[:3]),
        "refined": tuple(each[:, 0] for each in crossings.refine(best._replace(start=np.zeros((4, 1))))),
        "weights": crossings.cubic_weights(np.array([0.1, 0.5, 0.83])),
        "across": windows.places_across(places, normals, 1.7),
        "rows": crossing.gaussian_rows(places, 1.3, (20, 22)).toarray(),
    }  # fmt: skip


def _shared():
    rng = np.random.default_rng(3)
    weights = rng.uniform(0.1, 1.0, (2, 3, 2, 7))
    squared = rng.uniform(40, 90, (4, 2, 7)) * np.array([1.0, 0.02, 1.3, 0.7])[:, None, None]
    squared[3, 1, 2] = 0.01
    noise = rng.uniform(2, 5, (4, 2, 7))
    mixed = rng.uniform(1, 9, (3, 2, 2, 4)), rng.uniform(1, 9, (5, 2, 2, 4))
    return {
        "even": lights._variances(weights, squared.copy(), 3.1),
        "own": lights._variances(weights, squared.copy(), noise),
        "mixtures": [list(lights._mixtures(*mixed, share)) for share in ((0.3, 0.7), (1.0, 0.0), (0.0, 1.0))],
    }  # fmt: skip


def _polarisers():
    angles = (None, 0.0, 31.0, 89.0, 90.0, 133.0, 179.0)
    scene = load("copper")
    return {
        "apart": [[varying._apart(a, b) for a in angles] for b in angles],
        "bands": design.bands_of(scene), "angles": design.angles_of(load("polarised"), ("analyser",), 45.0),
        "through": [design.throughput(load("polarised"), planner.Choice(a, b)) for a in angles for b in angles],
    }  # fmt: skip


def _of_two_lamps():
    """Two lights of different colours: whose spectrum counts is the first's."""
    scene = load("copper")
    first = scene.lights[0].model_copy(update={"spectrum": ((510.0, 0.2), (563.0, 1.0), (640.0, 0.1))})
    second = scene.lights[0].model_copy(update={"spectrum": ((455.0, 1.0), (601.0, 0.4))})
    both = scene.model_copy(update={"light": None, "several_lights": (first, second)})
    made = [without_error(lambda c=c: planner.with_choice(both, c)) for c in (planner.Choice(None, None, filter=f.name)
                                                                              for f in scene.filters)]  # fmt: skip
    return {"own": design.own_choice(both), "wavelengths": design._wavelengths(both, None, None),
            "made": [each if isinstance(each, str) else [each.lights, each.camera.exposure]
                     for each in made]}  # fmt: skip


def _three_lights():
    scene = load("two_lights")
    third = scene.lights[0].model_copy(update={"distance": scene.lights[0].distance * 1.3})
    more = scene.model_copy(update={"several_lights": (*scene.lights, third), "settings": ()})
    found = planner.plan(more, step_deg=60.0, refined=False)
    return {"sensor": found.sensor, "light": found.light, "shares": found.shares, "variance": found.variance,
            "alone": found.alone, "evaluated": found.evaluated, "guarantee": found.guarantee}  # fmt: skip


def _moved_by_station(name):
    scene = load(name)
    return systematic(scene, np.array(list(uneven(scene)[0])), sources(scene))


def _ends():
    outline = rounds_outline()
    corners = np.array([[10.0, 12.0], [60.0, 15.0], [57.0, 44.0], [8.0, 40.0]])
    return {
        "polygon": four_sides.polygon(outline.astype(np.float32)), "deviation": four_sides.deviation(outline, corners),
        "shaped": [four_sides.shaped(corners * scale) for scale in ([1, 1], [1, 0.05], [0.1, 0.1])],
        "sides": four_sides._sides(corners, 0.13), "near": [four_sides.near(corners, away) for away in (0.3, 1.1, 4.0)],
        "ellipse": rounds.ellipse(outline.astype(np.float32)),
        "from ellipse": rounds.deviation(outline, np.array([33.0, 27.0, 26.0, 15.0, 12.0])),
        "outline": rounds._outline(np.array([33.0, 27.0, 26.0, 15.0, 12.0])),
        "inside": [rounds._inside(np.array([33.0, 27.0, a, 15.0, 12.0]), np.array([66, 50])) for a in (26.0, 33.0)],
    }  # fmt: skip


def rounds_outline():
    """Points about an ellipse."""
    angle = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    return np.stack([33 + 26 * np.cos(angle + 0.1), 27 + 14 * np.sin(angle) + 2 * np.cos(angle)], 1)


def _conic_steps():
    rng = np.random.default_rng(4)
    points = rounds_outline()[::7] + rng.normal(0, 0.2, (13, 2))
    parameters = np.array([33.0, 27.0, 26.0, 14.0, 0.2])
    distances, jacobian = conic._distances(points, parameters)
    return {
        "distances": distances, "jacobian": jacobian, "start": conic._start(points, False),
        "circle": conic._start(points, True), "tidy": conic._tidy(np.array([1.0, 2.0, 3.0, 5.0, 0.4])),
        "whole": conic._whole(np.diag([1.0, 2.0, 3.0]), True), "free": conic._free(jacobian, True),
        "spread": conic._spread(np.array([0.1, 0.2, 0.3]), True), "solved": conic._solve(jacobian, 1 + np.arange(13.0)),
    }  # fmt: skip


def _roots():
    a, b, c = np.array([1.0, 0.0, -2.0, 1e-9]), np.array([-3.0, 2.0, 1.0, 4.0]), np.array([2.0, 5.0, 3.0, -1.0])
    return {"quadratic": roots.quadratic_roots(a, b, c),
            "real": roots.real_roots(np.array([[-6.0, 11, -6, 1], [1, 0, 1, 0.5], [0.3, -1, 0, 2]]))}  # fmt: skip


def _bent_boards():
    grid = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0)), -1) * 20 + 30
    grid += 0.02 * (grid - 80) * ((grid - 80) ** 2).sum(-1, keepdims=True) / 3000
    places = np.random.default_rng(1).normal(0, 2, (2, 9, 2)) + np.array([20.0, 30.0])
    shape = np.array([[20.3, 29.8, 0.3, 1.7, -0.2], [19.9, 30.4, -0.4, 1.5, 0.1]])
    return {"bends": bend.bends(grid), "saddle": saddle.response(places, shape, np.array([[0.01, -0.02], [0.0, 0.03]]))}


def _seen_finely():
    fine = np.add.outer(np.arange(9.0) ** 2, 3 * np.arange(11.0))
    fine[4:, 6:] += 70
    camera = load("calibrated_rig").camera
    small = camera.model_copy(update={"width": 11, "height": 9})
    return {
        "crossed": [adaptive.crossed(fine, reach, 0.1) for reach in (0, 2)], "bent": adaptive.bent(fine, 0.05),
        "binned": optics.blur_and_bin(np.kron(fine, np.ones((2, 2))), small, 2, (0, 0)),
        "distorted": optics.distort(np.kron(fine, np.ones((2, 2))), small, (0, 0), 2),
        "rounded": rounding.before_rounding(np.rint(np.random.default_rng(1).normal(7, 0.4, (90, 16))),
                                            np.full((16, 1), 0.25), 0.2),
    }  # fmt: skip


def _compared_with_nothing():
    """No image, none failed, and no images at all."""
    before = comparison.read(_REFERENCE)
    after = copy.deepcopy(before)
    for row in (after["settings"][0], *after["settings"][0]["classic"]):
        row |= {"n": 0, "failed": 0, "empirical": None, "bias": None}
    for row in (after["settings"][1], *after["settings"][1]["classic"]):
        row |= {"failed": row["n"], "empirical": None, "bias": None}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "result.json"
        path.write_text(json.dumps(after), encoding="utf-8")
        read = comparison.read(path)
    return comparison.compare(before, read, 0.05)


def _of_few_patches():
    rng = np.random.default_rng(8)
    image = 60 + rng.normal(0, 1.7, (37, 44)) + np.arange(44)
    return {"rounded": measure.noise_curve(np.rint(image)), "not": measure.noise_curve(image),
            "coarse": measure.noise_curve(4 * np.rint(image / 4))}  # fmt: skip


def _quads():
    image = np.full((90, 120), 40.0)
    image[30:60, 35:90] = 150.0
    image += np.random.default_rng(4).normal(0, 1.1, image.shape)
    return without_error(lambda: measure.find(image))


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {"of profiles": _profiles, "of crossings": _crossings, "of shared light": _shared,
             "of polarisers": _polarisers, "of two lamps": _of_two_lamps, "of outlines": _ends,
             "of conics": _conic_steps, "of roots": _roots, "of bent boards": _bent_boards,
             "of fine pictures": _seen_finely, "of few patches": _of_few_patches,
             "compared with nothing": _compared_with_nothing}  # fmt: skip
    return {f"steps {name}" if name[0] == "o" else name: (CLOSED, make) for name, make in found.items()} | {
        "plan of three lights": (SEARCHED, _three_lights), "find": (SEARCHED, _quads),
        "moved calibrated_rig": (CLOSED, partial(_moved_by_station, "calibrated_rig")),
        "moved two_lights": (CLOSED, partial(_moved_by_station, "two_lights")),
    }  # fmt: skip
