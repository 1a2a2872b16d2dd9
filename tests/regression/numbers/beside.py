"""Measuring in the rare case, and what is said of a render before it: light unknown, clipped, lost, refused."""

from functools import cache, partial

import numpy as np

import measure
import planner
import render
import scenes
from imaging.features import rim_look
from imaging.light import behind
from imaging.pictures import Pictures
from measure import calibration
from measure.boards import parameters
from measure.boards.camera import calibrate_camera
from measure.features.arranged import find_arranged, goodness
from measure.features.layout import layout_of, polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape, prepared
from measure.find import choose, four_sides
from measure.fitting import photograph as fitted
from measure.fitting import start
from measure.fitting.parameters import Parameters
from measure.goodness import p_value
from measure.photo import lens, mtf, noise_curve, profiles
from measure.photo.noise_curve import NoiseCurve
from render import adaptive, curved, large, testing, texture, variant
from render.phenomena import register
from render.rays import Rays
from scenes import Noise, Picture
from tests.boards import SMALL
from tests.oracle import polygon_image
from tests.photographs import MADE, rectangle, turned
from tests.regression.numbers import measuring
from tests.regression.numbers.parts import small
from tests.regression.numbers.poses import load, uneven, without_error
from tests.regression.stored import CLOSED, SEARCHED

_SQUARE = np.array([[31.2, 24.7], [96.4, 33.1], [88.9, 81.6], [22.3, 70.2]])


@cache
def _drawn(name, sigma=1.7, count=2):
    scene = load(name)
    clean = planner.image(scene, *uneven(scene))
    return clean + np.random.default_rng(5).normal(0, sigma, (count, *clean.shape))


def _distance(name, **how):
    scene = load(name)
    sensor, light = uneven(scene)
    light = how.pop("light", light)
    images = how.pop("images") if "images" in how else _drawn(name)
    told = without_error(lambda: measure.distance(images, scene, sensor, light, **how))
    return told if isinstance(told, str) else {"told": told, "rows": told.as_rows(), "line": str(told)}


def _distances():
    far = np.roll(_drawn("task1"), (3, -2), (1, 2))
    off = np.roll(_drawn("task1"), (14, -9), (1, 2))
    cut, mixed = np.clip(_drawn("task1"), 0, 90.0), _drawn("low_light", 4.0, 3).copy()
    mixed[1] += 300.0
    faint = 0.01 * _drawn("task1") + np.random.default_rng(3).normal(0, 1.0, (2, *_drawn("task1").shape[1:]))
    return {
        "corrected": [_distance("task1", estimator=by, correct_bias=True) for by in ("gradient", "canny")],
        "light unknown": [_distance("task1", estimator=by, light=None) for by in ("gradient", "strip", "arrangement")],
        "not corrected": [_distance("task1", estimator="strip", correct_bias=True), _distance(
            "task1", light=None, correct_bias=True, estimator="gradient")],
        "threshold": [_distance("task1", estimator="canny", threshold=each) for each in (3.0, 200.0, 0, True, "1",
        1e99)],
        "estimator": [_distance("task1", estimator=each) for each in ("none", 3, None)],
        "far": _distance("task1", images=far), "off": _distance("task1", images=off),
        "off by points": _distance("task1", images=off, estimator="gradient"), "cut": _distance("task1", images=cut),
        "mixed": _distance("low_light", images=mixed), "faint": [_distance("task1", images=faint, estimator=by)
                                                                for by in ("gradient", "arrangement", "canny")],
        "one": _distance("task1", images=_drawn("task1")[0]), "none": _distance("task1", images=_drawn("task1")[:0]),
        "bad": [_distance("task1", images=each) for each in (np.ones((3, 4)), np.full((240, 256), np.nan), "x")],
        "not a distance": _distance("plate", images=np.ones((240, 256))),
    }  # fmt: skip


def _bounds():
    scene = load("task1")
    pose = uneven(scene)
    layout = layout_of(Picture.of(scene, *pose))
    return {
        "bound": [without_error(partial(measure.bound, load(name), *uneven(load(name)))) for name in (
            "task1", "wedge", "plate", "two_lights")],
        "dark": without_error(lambda: measure.bound(scene, pose[0])), "names": layout.names,
    }  # fmt: skip


def _arranged():
    scene = load("task1")
    dark = layout_of(Picture.of(scene, uneven(scene)[0]))
    tool, images = prepared(dark, "arrangement", 1.0), _drawn("task1")
    small_ = np.stack([polygon_image(_SQUARE, (105, 120), 0.8, level, 40.0) for level in (90.0, 3.0, 0.0)])
    small_ += np.random.default_rng(8).normal(0, 1.0, small_.shape)
    layout = polygon_layout(_SQUARE + 0.4, Optics((105, 120), 0.8, 1.0))
    bits = polygon_layout(_SQUARE + 0.4, Optics((105, 120), 0.8, 1.0, noise=Noise(sigma=1.0, bits=7)))
    return {
        "dark": find_arranged(images, dark, tool), "goodness": goodness(images, dark, tool),
        "polygon": find_arranged(small_, layout, prepared(layout, "arrangement", 1.0)),
        "beyond": find_arranged(small_ + 20, bits, prepared(bits, "arrangement", 1.0)),
        "shapes": [find_shape(small_, layout, by) for by in ("gradient", "strip", "isophote", "canny")],
    }  # fmt: skip


def _fits():
    scene = small("calibrated_rig", 4.0)
    sensor, light = uneven(scene)
    clean, rng = planner.image(scene, sensor, light), np.random.default_rng(9)
    shots = [clean + rng.normal(0, 2.0, clean.shape) for _ in range(3)]
    bad = [
        {"images": []}, {"images": [clean[:-1]]}, {"images": [clean, clean[:-1]]}, {"images": [clean], "free": ("k9",)},
        {"images": [clean], "noise": "none"}, {"images": [clean], "light": light}, {"images": [clean],
            "sensor": sensor},
    ]  # fmt: skip
    blank = measure.fit(scene, [np.full(clean.shape, 7.0) + rng.normal(0, 1, clean.shape)], sensor, light)
    given = measure.fit(scene, shots, sensor, light, noise="given")
    without = scene.model_copy(update={"settings": ()})
    return {
        "given": given, "blank": blank,
        "refused": [without_error(partial(measure.fit, scene, **each)) for each in bad],
        "no setting": without_error(lambda: measure.fit(without, [clean])),
        "kinds": without_error(lambda: measure.fit(load("plate"), [clean])),
    }  # fmt: skip


def _photographs_of_poses():
    rng, base = np.random.default_rng(1), polygon_image(_SQUARE, (105, 120), 0.8, 90.0, 40.0)
    moved = polygon_image(_SQUARE + 0.9, (105, 120), 0.8, 90.0, 40.0)
    images = [each + rng.normal(0, 1.5, base.shape) for each in (base, moved, base, base)]
    groups = fitted.grouped(images)
    scene = small("calibrated_rig", 2.0)
    pictures = Picture.of(scene, *uneven(scene))
    seen = Pictures.of(pictures)
    around = [fitted.Pixels.around(seen, most) for most in (200_000, 4000)]
    dots = np.zeros((40, 50))
    dots[10:20, 12:30] = 9.0
    return {
        "groups": groups, "coarse": [groups[0].coarse(3, smooth) for smooth in (0.0, 1.3)],
        "around": [[each.x, each.y, each.shape] for each in around],
        "outline": [start._outline(each) for each in (dots, dots * 0, dots + 4)],
        "dark": [start._dark(each) for each in (dots + 3.5, np.add.outer(
            np.arange(12.0) ** 2, 3 * np.arange(9.0) ** 1.5))],
        "shown": [start.shows_something(each, Noise(sigma=s)) for each in groups for s in (0.5, 400.0)],
        "turned": [start._turned(Parameters.of((pictures,)), Parameters.of((pictures,)).start(), turn) for turn in (
            (12.0, 0, 0), (0, -12.0, 0), (1.0, 2.0, 3.0))],
    }  # fmt: skip


def _cameras():
    boards, size = measuring.boards(), (240, 320)
    asked = [
        (boards[:1], SMALL.square, size), (boards, 0.0, size), (boards, True, size), (boards, SMALL.square, (240,)),
        (boards, SMALL.square, (240, 40000)), (boards, SMALL.square, size, "k9"), (boards, SMALL.square, size, "k1,k1"),
        (boards, SMALL.square, size, ""), (boards, SMALL.square, size, "abc" * 70), (boards, SMALL.square, size,
        "k1", -1.0), ("x", SMALL.square, size),
    ]  # fmt: skip
    told = {model: without_error(partial(calibrate_camera, boards, SMALL.square, size, model, 0.02)) for model in (
        "f", "k1,k2,p1,p2,k3")}  # fmt: skip
    same = without_error(lambda: calibrate_camera([boards[0]] * 3, SMALL.square, size, "k1"))
    return {"told": told, "same": same if isinstance(same, str) else same.status,
            "models": [parameters.read_model(each).names for each in ("none", "f,k3", "p1")],
            "refused": [without_error(partial(calibrate_camera, *each)) for each in asked]}  # fmt: skip


def _lenses():
    one = lens.Intrinsics(fx=420.0, fy=431.0, cx=131.0, cy=97.0, distortion=(-0.11, 0.03, 0.002, -0.001))
    points = np.array([[[3.0, 7.0], [200.0, 30.0]], [[131.0, 97.0], [77.0, 190.0]]])
    image, corners = rectangle(120, 70, 13), turned(120, 70, 13)
    optics = Optics(image.shape, 0.8, 2.3, 1.1, 5.0)
    asked = [{"fx": 1e-4}, {"fx": 0.0}, {"cx": 1e10}, {"distortion": (1.0,) * 6}, {"distortion": (1e7,)}]
    given = {"fx": 420.0, "fy": 431.0, "cx": 131.0, "cy": 97.0}
    ok = lens.straight_corners(image, polygon_layout(one.straighten(corners), optics), one)
    beside = [one.straighten(corners + move) for move in (np.array([100.0, 0]), np.array([0, 55.0]))]
    return {
        "straight": one.straighten(points), "bent": one.distort(points), "none": [one.straighten(points[:0]),
        one.distort(
            points[:0])], "matrix": one.matrix, "coefficients": one.coefficients, "corners": ok,
        "refused": [_words(partial(lens.Intrinsics, **(given | each))) for each in asked], "beside": [without_error(
            partial(lens.straight_corners, image, polygon_layout(each, optics), one)) for each in beside],
    }  # fmt: skip


def _words(make):
    try:
        make()
    except (ValueError, scenes.InvalidInput) as error:
        return str(error).splitlines()[1:3]
    return "taken"


def _edges():
    image, corners = rectangle(120, 70, 13), turned(120, 70, 13)
    asked = [(corners, 4), (corners, -1), (corners[:2], 1), (corners * [[1, 0.1]], 0), (
        turned(120, 70, 0), 0), (corners[:, :1], 0)]  # fmt: skip
    return {"two": mtf.mtf(image, corners[:2]), "other": mtf.mtf(image, corners, 3), "refused": [
        without_error(partial(mtf.mtf, image, *each)) for each in asked]}  # fmt: skip


def _calibrated():
    found = np.stack([1e-4 + 3 * np.array(calibration.RATIOS) ** 2, np.linspace(2, 4, len(calibration.RATIOS))], 1)
    lost = found.copy()
    lost[2:] = np.nan
    bent = found.copy()
    bent[-2:, 0] *= 1.9
    scene = small("task1", 2.0)
    return {"curves": [calibration._curve("strip", each, scene, 2.3) for each in (found, lost, bent)],
            "blur": [calibration.blur_for(k, 1.1) for k in (0.2, 3.0, 8.697)]}  # fmt: skip


def _shapes_found():
    flat = np.full((90, 120), 40.0)
    bad = [np.ones((3, 3)), np.ones((90, 120)), np.full((90, 120), np.nan), np.ones((2, 9, 9))]
    corners = np.array([[10.0, 12.0], [60.0, 15.0], [57.0, 44.0], [8.0, 40.0]])
    tiny, line = corners * 0.05, corners * [1.0, 0.001]
    return {
        "bad": [without_error(partial(measure.find, each)) for each in bad],
        "flat": without_error(lambda: measure.find(flat)),
        "kinds": [without_error(partial(measure.find, flat, each)) for each in (("star",), (), "circle", ("tag",
        "circle"))],
        "shaped": [four_sides.shaped(each) for each in (corners, tiny, line, corners[::-1], corners[[0, 2, 1, 3]])],
        "near": [four_sides.near(each, 1.0) for each in (corners, line)],
        "size": choose._size(flat),
    }  # fmt: skip


def _agreeing():
    rng = np.random.default_rng(3)
    one, other = rng.normal(50, 2.0, (2, 5, 6, 7))
    other[:, 2, 3] = 50.0
    one[:, 2, 3] = 50.0
    one[:, 1, 1], other[:, 1, 1] = 40.0, 41.0
    variance = rng.uniform(0.5, 2.0, (6, 7))
    variance[0, 0] = 0.0
    measured = measure.distance(_drawn("task1"), load("task1"), *uneven(load("task1")), estimator="gradient")
    true = float(measured.value_px.mean())
    asked = [
        (0.0, {}),
        (0.003, {}),
        (0.5, {}),
        (0.5, {"systematic_px": 0.49}),
        (0.02, {"level": 1e-9}),
        (0.2, {"level": 0.3}),
    ]
    bad = [(one[0], one[0, 1:], 1.0), (one, other[0], None), (one[:1], other, None)]
    return {
        "welch": testing._p_values(one, other, None), "z": testing._p_values(one, other[0], variance),
        "even": testing._p_values(one[0], other[0], 2.0), "same": testing._p_values(one[0], one[0], 0.0),
        "measures": [_asserted(partial(testing.assert_measures, measured, true + off, **how)) for off, how in asked],
        "bad": [_asserted(partial(testing._p_values, *each)) for each in bad],
    }  # fmt: skip


def _asserted(make):
    try:
        made = make()
    except AssertionError as error:
        return str(error)
    return made


def _pieces():
    scene = load("task1")
    picture = Picture.of(scene, *uneven(scene))
    k, size, asked = 2, (40, 50), []
    truth = np.zeros((80, 100))
    truth[:, 31:], truth[55:, :] = 50.0, 90.0

    def whole(random, rays):
        asked.append((random, rays))
        return truth.reshape(40, k, 50, k).mean((1, 3))

    def again(random, fine, marked, rays):
        asked.append((random, int(marked.sum()), float((marked * np.arange(100)).sum()), rays))
        return np.where(marked, truth + rays, fine)

    crop = slice(2 * 60, 2 * 60 + 80), slice(2 * 70, 2 * 70 + 100)
    counts = large.Counts(4, 16, 16, 256)
    made = [large.fine_pixels(picture, crop, large.Renders(whole, again, k, random), 3, counts) for random in (
        False, True)]  # fmt: skip
    places = {name: large.near_required(Picture.of(load(name), *uneven(load(name))), (slice(0, 240), slice(0, 250)), 1)
              for name in ("task1", "plate", "ball", "shaft")}  # fmt: skip
    return {"made": made, "asked": asked, "near": places, "size": size, "large": [large.is_large(
        (slice(0, rows), slice(0, 512)), 1, random) for rows in (256, 257, 2048, 2049) for random in (False,
        True)]}  # fmt: skip


def _random_rays():
    rays = Rays(None, 3, 20, 2, 5)
    return {"block": rays._block, "table": rays._table, "few": rays._table[:4, :5].astype(float),
        "strata": rays._strata(9),
            "sides": Rays(None, 1, 16, 0, 2)._block}  # fmt: skip


def _curved():
    found = {}
    for name in ("shaft", "ball", "plate", "task1"):
        solid = load(name).solid
        found[name] = {"faces": curved.stands_for(solid), "ends": [each.name for each in curved._ends(solid)],
                       "rims": [each.name for each in curved._rims(solid)], "shapes": [
                           curved.shape(None, each, {"type": "diffuse"}) for each in solid.curved],
                       "lunes": [curved._lunes(solid, each) for each in curved._rims(solid)[:2]]}  # fmt: skip
    return found


def _effects_named():
    scene = load("task1")
    asked = ["all", "", "lens_blur,fall_off", ("lens_blur",), "none such", ["x"]]
    noisy = scene.with_(jitter={"sensor_deg": 0.2, "light_deg": 1.0})
    return {
        "named": [without_error(lambda each=each: sorted(register.named(each))) for each in asked],
        "asked": [[each.effect.name, each.on, each.reason] for each in register.effects(scene, "lens_blur,fall_off")],
        "jitter": [[each.effect.name, each.on, each.reason, each.influence] for each in register.effects(noisy)],
        "refused": [without_error(partial(register.effects, each)) for each in (
            "task1", scene.model_copy(update={"settings": ()}))],
        "expose": [without_error(partial(render.expose, *each)) for each in (
            (np.ones((3, 4)), scene.noise, np.random.default_rng(1), 0), (np.ones((3, 4)), scene.noise, 1, 1),
            (np.ones((3, 4)), 1, np.random.default_rng(1), 1), (np.ones((3, 4)), scene.noise, np.random.default_rng(
                1), True), (np.ones(4), scene.noise, np.random.default_rng(1), 2))],
        "where": [_exposed(noise, where) for noise in (Noise(sigma=1.5, bits=8, gain=0.1, dark_level=4.0), Noise(
            sigma=0.7, prnu=0.02, dsnu=1.5)) for where in (None, np.add.outer(np.arange(70), np.arange(90)) > 120)],
        "release": [variant._release(each) for each in ("/a/libLLVM-15.so.1", "/b/libLLVM.so.19.1", "x")],
    }  # fmt: skip


def _exposed(noise, where):
    image = np.add.outer(np.linspace(3, 40, 70), np.linspace(0, 220, 90))
    return render.expose(image, noise, np.random.default_rng(3), 2, where=where)


def _textured():
    scene = load("printed_label")
    picture = Picture.of(scene, *uneven(scene))
    solid, pictures = scene.solid, Pictures.of(picture)
    return {"over": [texture._over(solid, pictures.sensor_at, sine) for sine in (1e-9, 0.3)], "texels": texture.texels(
        texture.Face(solid.triangles[:2], np.random.default_rng(1).random((2, 3, 2)), np.ones((3, 5)))),
        "crossed": adaptive.crossed(np.add.outer(np.arange(9.0) ** 2, np.arange(11.0) * 4), 1,
        step=adaptive.MISSED)}  # fmt: skip


def _rough_sides():
    """Sides with notches and bumps, in a picture that is not square."""
    rng, image = np.random.default_rng(7), polygon_image(_SQUARE, (105, 120), 0.8, 110.0, 40.0)
    for x, y, size in ((60, 29, 4), (92, 55, 2), (40, 75, 3), (27, 45, 2)):
        image[y - size // 2 : y + size // 2, x - size // 2 : x + size] += 30.0 * (-1) ** size
    image += rng.normal(0, 1.2, image.shape)
    return {"found": measure.find(image, ("quadrilateral",)), "refined": profiles.refined(image, _SQUARE + 0.6),
            "sigma": round(profiles.edge_sigma(image, _SQUARE), 3), "bent": adaptive.bent(image, 0.05),
            "diagonal": adaptive.bent(
                np.maximum(np.add.outer(2.0 * np.arange(9), np.arange(11.0)) - 11, 0.3 * np.arange(11.0)), 0.03),
            "flat": [adaptive.bent(image[:1], 0.05), adaptive.bent(image[:, :1], 0.05)]}  # fmt: skip


def _found_in(name):
    return without_error(lambda: measure.find(MADE[name].image()))


def _few_patches():
    """As many smooth patches as tell the noise, and one row less; levels that are whole, or whole fours, or neither."""
    rng = np.random.default_rng(8)
    image = 60 + rng.normal(0, 1.7, (35, 28)) + np.arange(28)
    ends = np.clip(np.rint(image * 2), 0, 200)
    made = {
        "rounded": np.rint(image),
        "fours": 4 * np.rint(image),
        "real": image,
        "ends": ends,
        "high": np.rint(40 * image),
    }
    told = {name: [measure.noise_curve(each), measure.noise_curve(each[:28])] for name, each in made.items()}
    curves = [curve for each in told.values() for curve in each]
    return told | {"variance": [curve.variance(np.array([0.0, 70.0, 190.0])) for curve in curves],
                   "noise": [curve.noise for curve in curves], "full": measure.noise_curve(ends, 200.0),
                   "scales": [noise_curve.scale_of(each, full) for each in made.values() for full in (None, 150.0)],
                   "falling": NoiseCurve(4.0, -0.1, 3.0, 1.0, 8).variance(np.array([0.0, 3.0, 20.0,
                   90.0]))}  # fmt: skip


def _goodness():
    """Of one part, of two, of none; at the ends of what is told."""
    squares = np.array([[9.0, 40.0], [0.9, 0.0], [1.1, 22.0], [80.0, 20.0], [10.0, 20.0], [0.5, 3.0]])
    freedom = np.array([[10.0, 20.0], [10.0, 0.0], [10.0, 20.0], [10.0, 20.0], [0.0, 0.0], [1.0, 2.0]])
    return {"two": p_value(squares, freedom), "one": p_value(squares[:, :1], freedom[:, :1])}


def _floors():
    floor = load("plate on a floor").floor
    points = np.array([[0.0, 0, 5.0], [1.0, 2, floor.height], [3.0, 1, -9.0], [0.0, 0, 2.0], [4.0, 4, 4.0]])
    ways = np.array([[0.1, 0.2, -1.0], [0.3, 0.1, -1.0], [0.0, 0.1, -1.0], [1e6, 3.0, -1.0], [0.2, 0.1, 1.0]])
    met = [behind._on_floor(floor, points, ways, np.full(5, t)) for t in (np.inf, 4.0)]
    ends = [behind._on_floor(floor, np.array([[half, 0.0, floor.height + 1.0], [0.0, -half, floor.height + 2.0]]),
                                 np.array([[0.0, 0, -1.0]] * 2), np.full(2, np.inf))[1]
            for half in (floor.half_side * 0.999, floor.half_side, floor.half_side * 1.001)]  # fmt: skip
    return {"met": met, "ends": ends}


def _around_rims():
    found = {}
    for name in ("plate", "flange"):
        pictures = Pictures.of(Picture.of(load(name), *uneven(load(name))))
        found[name] = [rim_look.places_around(pictures, each, spacing, most) for each in load(name).solid.circles[:4]
                       for spacing in (0.3, 2.0, 9.0) for most in (2, 64)]  # fmt: skip
    return found


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {
        "distances": _distances, "bounds": _bounds, "arranged": _arranged,
        "poses of photographs": _photographs_of_poses,
        "lenses": _lenses, "edges of mtf": _edges, "curves of calibration": _calibrated,
        "shapes that are none": _shapes_found, "agreeing": _agreeing, "pieces of large images": _pieces,
        "random rays": _random_rays, "curved shapes": _curved, "effects by name": _effects_named, "textured": _textured,
        "few patches": _few_patches, "goodness": _goodness, "floors": _floors, "around rims": _around_rims,
    }  # fmt: skip
    for name in ("square on its corner", "frame", "block", "ArUco", "tripod", "plain"):
        found[f"found in {name}"] = partial(_found_in, name)
    found["rough sides"] = _rough_sides
    return {name: (CLOSED, make) for name, make in found.items()} | {
        "fits": (SEARCHED, _fits), "cameras": (SEARCHED, _cameras),
    }  # fmt: skip
