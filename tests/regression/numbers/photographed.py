"""Round shapes, quadrilaterals and boards in photographs: noise that neighbours share, large ones, refusals."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
from scipy.ndimage import gaussian_filter

import measure
from measure.boards import approximate, growing
from measure.boards.chessboard import check_shape, chessboard, measured
from measure.estimators import ellipse as likeliest
from measure.features import blurred_ellipse, conic
from measure.features.optics import Optics
from measure.find import choose
from measure.find import ellipse as found_ellipse
from measure.find.candidate import Candidate, ellipse_outline
from measure.photo import binned, board_noise, edge_points, ellipses, quadrilateral, residuals, tags, tone_curve
from measure.photo import correlation as shared
from measure.photo.recording import recording
from scenes import Noise
from scenes.photograph import Photograph
from tests.boards import SMALL, poses
from tests.oracle import polygon_image
from tests.photographs import ellipse, rectangle, tag, turned
from tests.regression.numbers.poses import without_error
from tests.regression.stored import CLOSED

_SHAPE = 74, 86
_AT = np.array([41.3, 36.8, 21.7, 14.4, 31.0])
_SYMMETRIC = blurred_ellipse.to_symmetric(_AT / conic.UNITS)
_CORNERS = np.array([[31.2, 24.7], [96.4, 33.1], [88.9, 81.6], [22.3, 70.2]])


def _noise(sigma, shape, seed=3):
    return np.random.default_rng(seed).normal(0, sigma, shape)


@cache
def _shown(contrast=130.0, sigma=1.0, at=tuple(_AT), shape=_SHAPE, smooth=0.0, blur=0.8, level=60.0):
    """An ellipse in noise, which neighbours share where it is smooth."""
    noise = _noise(sigma, shape)
    noise = gaussian_filter(noise, smooth) * (1 + 2.2 * smooth) if smooth else noise
    return level + contrast * ellipse(at, shape, blur) + noise


def _optics(shape=_SHAPE, sigma=1.0, noise=None):
    return Optics(shape, 0.8, sigma**2, 1.1, 4.7, noise)


def _blurred():
    shapes = blurred_ellipse.to_symmetric(np.array([[40.0, 30, 20, 11, 0.4], [41.0, 31, 9, 9, 0], [1, 2, 5, 7, -0.3]]))
    t = np.linspace(0.2, 5.9, 7)
    points = np.random.default_rng(2).uniform(20, 60, (1, 5, 2))
    columns, rows = np.arange(17, 64), np.arange(15, 40)
    coverage, derivatives = blurred_ellipse.ellipse_image(shapes[0], columns, rows, 0.9)
    return {
        "symmetric": shapes, "back": [blurred_ellipse.from_symmetric(each) for each in shapes],
        "outline": blurred_ellipse.outline(shapes[0], t), "curvature": blurred_ellipse.curvature(shapes[0], t),
        "relative": blurred_ellipse.relative(shapes, points), "middle": blurred_ellipse.relative(
            shapes[:1], shapes[:1, None, :2]),
        "coverage": coverage, "parts": coverage[::6, ::9], "derivatives": derivatives,
        "across": blurred_ellipse._across(np.arange(4, 15), np.array([3.3, 8.1, 13.9]), 0.7),
    }  # fmt: skip


def _found_in_stack(circle, gain=0.0):
    """Bright, dark, faint, none, and with something beside it."""
    noise = Noise(sigma=1.0, gain=gain, dark_level=3.0) if gain else None
    other = polygon_image(np.array([[52.0, 12], [60, 14], [58, 24], [51, 22]]), _SHAPE, 0.8, 60.0, 0.0)
    at = (*_AT[:2], 17.2, 17.2, 0.0) if circle else tuple(_AT)
    made = [_shown(130.0, at=at), _shown(-90.0, at=at, level=170.0), _shown(4.0, at=at), _shown(0.0, at=at),
            _shown(130.0, at=at) + other, _shown(2.1, at=at)]  # fmt: skip
    near = np.array(at) + [0.6, -0.8, 0.5, -0.4, 0 if circle else 3.0]
    stack = np.stack(made).reshape(2, 3, *_SHAPE)
    found = found_ellipse.find_ellipse(stack, near, _optics(noise=noise), circle=circle)
    one = found_ellipse.fitted_ellipse(made[0], near, _optics(noise=noise), circle)
    return {"stack": found, "centre": found.centre, "one": one}


def _not_found():
    image, optics = _shown(), _optics()
    asked = {
        "beside": _AT + [60, 0, 0, 0, 0], "far off": _AT + [8.0, -7.0, 5.0, 4.0, 0], "none": [1.0, 2.0, 3.0, 0.0, 4.0],
        "four": [1.0, 2.0, 3.0, 4.0], "large": [1.0, 2.0, 3e5, 4.0, 0.0], "cut": _AT + [-19.0, 0, 0, 0, 0],
    }  # fmt: skip
    found = {name: without_error(partial(found_ellipse.find_ellipse, image, near, optics))
             for name, near in asked.items()}  # fmt: skip
    size = without_error(lambda: found_ellipse.find_ellipse(image[:-1], _AT, optics))
    fitted = [found_ellipse.fitted_ellipse(image, near, optics, False)[1] for near in (asked["beside"], asked["cut"])]
    wide = found_ellipse.find_ellipse(image, _AT, optics, spacing=5.3)
    return found | {"size": size, "fitted": fitted, "sparse": wide}


def _likeliest():
    optics, free = _optics(), likeliest.free_parameters(False)
    angles = np.linspace(0.3, 6.4, 31)
    part = likeliest.Sought(angles, np.sin(2 * angles + 0.4) > -0.5)
    whole = likeliest.Sought(angles, np.ones(31, bool))
    t = np.linspace(-7, 9, 23)
    start = _SYMMETRIC + [0.3, -0.2, 0.4, -0.3, 0.2]
    linear = likeliest._Linear.at(_shown(), start, 0.8, optics, free, whole)
    far = [likeliest.likeliest_ellipse(_shown(), _SYMMETRIC + away, optics, False, whole) for away in (
        np.array([3.0, 2.0, 2.0, 1.0, 0.0]), np.array([9.0, 0, 0, 0, 0]), np.array([0, 0, -21.0, -14.0,
            0]))]  # fmt: skip
    return {
        "near": part.near(t), "whole": whole.near(t), "of part": likeliest.likeliest_ellipse(
            _shown(), start, optics, False, part),
        "circle": likeliest.likeliest_ellipse(_shown(at=(41.3, 36.8, 17.2, 17.2, 0.0)), np.array(
            [41.0, 37.0, 17.0, 17.0, 0.0]), optics, True, whole), "far": far,
        "linear": [linear.design.sum(0), linear.inverse, linear.change, linear.residual, linear.pixels],
        "fits": [linear.fits(_optics(sigma=sigma), _shown()) for sigma in (0.2, 0.9, 1.3, 9.0)],
        "is ellipse": likeliest.is_ellipse(np.array([[0, 0, 5, 4, 0.0], [0, 0, 5, 4, 3.6], [0, 0, 2, 1, 0],
                                                     [0, 0, 3.0, 1.5, 0.7]])),
        "axes": [likeliest._with_axes(shape, np.diag([1.0, 2, 3, 4, 5]), circle) for shape in (
            _SYMMETRIC, np.array([1.0, 2, 5, 5, 0])) for circle in (False, True)],
        "singular": likeliest._Linear.at(np.ones(_SHAPE), start, 0.8, optics, free, whole) is None,
        "around": likeliest._near(_SYMMETRIC, optics, part),
    }  # fmt: skip


def _by_points(circle):
    image = _shown(at=(41.3, 36.8, 17.2, 17.2, 0.0)) if circle else _shown()
    near = np.array([41.0, 37.1, 17.5, 17.0, 0.0]) if circle else _AT + [0.4, -0.5, 0.3, 0.2, 2.0]
    block = polygon_image(np.array([[60.0, 25], [70, 27], [66, 50], [56, 46]]), _SHAPE, 0.8, 90.0, 0.0)
    rough = Photograph(_shown(smooth=0.7))
    return {
        "found": edge_points.ellipse_by_points(image, near, _optics(), circle),
        "beside another": edge_points.ellipse_by_points(image + block, near, _optics(), circle),
        "little noise": edge_points.ellipse_by_points(image, near, _optics(sigma=0.05), circle),
        "faint": edge_points.ellipse_by_points(_shown(1.5), near, _optics(), circle).status,
        "half": edge_points.ellipse_by_points(image[:, :62], near, _optics((74, 62)), circle),
        "none": edge_points.ellipse_by_points(image, near + [50, 0, 0, 0, 0], _optics(), circle).status,
        "shared": edge_points.ellipse_by_points(rough.levels, near, _optics(), circle, recording(rough)),
    }  # fmt: skip


def _through_points():
    t = np.linspace(0.1, 6.1, 30)
    at = np.array([40.0, 30.0, 20.0, 12.0, 25.0])
    points = ellipse_outline(at, 30) + _noise(0.1, (30, 2))
    away = points.copy()
    away[[3, 17]] += [2.0, -1.5]
    many = points.copy()
    many[::3] += [3.0, 1.0]
    told = [edge_points._fitted(each, np.diag(np.full(30, v)), False) for each in (points, away, many)
            for v in (0.01, 0.002)]  # fmt: skip
    normals = np.stack([np.cos(t), np.sin(t)], 1)
    return {
        "fitted": told, "few": edge_points._fitted(points[:11], np.eye(11) * 0.01, False),
        "line": edge_points._fitted(np.stack([t, 2 * t], 1), np.eye(30), False).status,
        "distances": conic.nearly_away(points, at), "curvature": edge_points._curvature(at, normals),
        "outline": ellipse_outline(at, 7),
    }  # fmt: skip


def _measured_round(**how):
    photo = Photograph(_shown(**how))
    near = np.array(how.get("at", _AT)) + [0.4, -0.5, 0.3, 0.2, 1.0]
    found = ellipses.measure_ellipse(photo, near)
    return {"found": found, "residuals": residuals.of_ellipse(photo.levels, found.parameters)}


def _edges():
    image = _shown()
    found = residuals.of_sides(rectangle(60, 41, 17, (90, 120)), turned(60.8, 40.1, 16.5, (90, 120)))
    short = residuals.of_sides(image, np.array([[40.0, 30], [43, 30.5], [42, 34]]))
    return {
        "sides": found, "rms": [each.rms for each in found], "short": short, "round": residuals.of_ellipse(image, _AT),
        "blur": [residuals.ellipse_blur(_shown(blur=b), _AT) for b in (0.31, 0.8, 1.7)],
        "dark": residuals.ellipse_blur(-image, _AT),
        "around": conic.around(_AT, 5),
    }  # fmt: skip


@cache
def _correlated():
    image = 90 + 20 * np.linspace(0, 1, 154)[None] + gaussian_filter(_noise(3.0, (161, 154)), (0.9, 0.5))
    return Photograph(image)


def _correlation():
    seen, rng = recording(_correlated()), np.random.default_rng(4)
    white = recording(Photograph(90 + _noise(1.3, (140, 154))))
    rows = np.zeros((2, 30, 40))
    rows[0, 3:9, 4:11], rows[1, 5:20, 0:6] = rng.normal(0, 1, (6, 7)), rng.normal(0, 1, (15, 6))
    flat, sigma = np.flatnonzero(rows.any(0)), rng.uniform(1, 2, (30, 40))
    sparse = shared.sparse.csr_array(rows.reshape(2, -1))
    one = shared.Correlation(rng.uniform(0.1, 0.5, (7, 7)), 0.3)
    none = shared.correlation(replace(seen.patches, corner=np.empty((0, 2), int), pixels=np.empty((0, 49)),
                                      level=np.empty(0), variance=np.empty(0)), seen.curve)  # fmt: skip
    beside = recording(_correlated(), _CORNERS)
    return {
        "seen": seen.correlation, "curve": seen.curve, "is white": [seen.correlation.white, white.correlation.white],
        "white": white.correlation, "none": none, "covariance": one.covariance(
            rows.reshape(2, -1)[:, flat], flat, sigma.ravel()[flat], 40),
        "of many": one.covariance_of_many(sparse, sigma),
        "system": shared._system(shared._lags(), shared.SIDE),
        "lags": shared._lags(),
        "beside": [beside.correlation, beside.curve, len(beside.patches.level), beside.compressed, beside.status],
    }  # fmt: skip


def _quadrilateral(image, **how):
    return without_error(lambda: quadrilateral.measure_quadrilateral(image, **how))


@cache
def _four_sides(blur=0.8, smooth=0.0, shape=(105, 120), contrast=110.0):
    noise = _noise(1.2, shape)
    noise = gaussian_filter(noise, smooth) * (1 + 2.2 * smooth) if smooth else noise
    return polygon_image(_CORNERS, shape, blur, contrast, 40.0) + noise


def _bent_sides():
    """Levels that rise across the picture, and one side that is blurred more."""
    image = _four_sides()
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    uneven = image * (1 + 0.1 * (x / 120) ** 2 + 0.05 * y / 105)
    half = gaussian_filter(_four_sides(), 1.3)
    mixed = np.where(x > 60, half, image) + _noise(1.0, image.shape, 8)
    return [_quadrilateral(each, corners=_CORNERS) for each in (uneven, mixed)]


def _corners_given():
    image = _four_sides()
    bad = {"three": _CORNERS[:3], "crossed": _CORNERS[[0, 2, 1, 3]], "outside": _CORNERS + [30.0, 0],
           "above": _CORNERS - [0, 25.0]}  # fmt: skip
    covariance = np.diag(np.arange(1.0, 9)) * 0.01
    return {name: _quadrilateral(image, corners=corners) for name, corners in bad.items()} | {
        "values": quadrilateral._values(_CORNERS, covariance), "turned": quadrilateral._values(
            _CORNERS[::-1], covariance),
    }  # fmt: skip


def _wide():
    """Long sides that are blurred over many pixels."""
    corners = np.array([[60.3, 50.1], [330.7, 62.4], [318.2, 250.9], [51.6, 236.0]])
    image = polygon_image(corners, (300, 390), 3.6, 110.0, 40.0) + _noise(1.2, (300, 390))
    coarse = binned.binned(Photograph(image), 3, True)
    return {"size": binned.bin_size(image, corners), "sharp": binned.bin_size(_four_sides(), _CORNERS),
            "levels": coarse.levels, "compressed": coarse.compressed, "into": binned.into(corners, 3),
            "back": binned.back(corners, 3), "found": _quadrilateral(image, corners=corners)}  # fmt: skip


def _chosen():
    image = np.clip(40 + 90 * ellipse((30.2, 40.1, 14.0, 9.0, 20.0), (90, 130), 0.8)
                    + polygon_image(_CORNERS * 0.4 + [65.0, 20.0], (90, 130), 0.8, 110.0, 0.0), 0, 255)  # fmt: skip
    image = image + _noise(1.0, image.shape)
    bad = {"box": [(1, 2, 3), (50, 10, 40, 60), (10, 60, 40, 60), (-9, 3, -1, 50), (129.5, 3, 150, 50), (3, 89.5, 9,
        99)],
           "near": [(1, 2, 3), (-1, 4), (4, 90.0), (130.0, 3)]}  # fmt: skip
    asked = {f"{name} {i}": {name: each} for name, some in bad.items() for i, each in enumerate(some)} | {
        "in box": {"box": (3.4, 12.2, 61.7, 77.3)}, "near": {"near": (33.0, 42.0)}, "far": {"near": (124.0, 80.0)},
        "round": {"kinds": ("circle", "ellipse")}, "none": {"kinds": ("chessboard",)}, "both": {
            "near": (3, 4), "corners": _CORNERS}, "corners": {"corners": _CORNERS * 0.4 + [65.2, 20.3]},
        "most": {"most": 0}, "kind": {"kinds": ("star",)}, "no board in box": {
            "kinds": ("chessboard",), "box": (0, 0, 60, 60)}, "two kinds": {"kinds": ("tag", "chessboard")},
    }  # fmt: skip
    return {name: without_error(partial(measure.photograph, image, most=how.pop("most", 1), **how))
            for name, how in asked.items()}  # fmt: skip


def _candidates():
    one = Candidate("ellipse", ellipse_outline(_AT), 0.9, 3.0, 11.0, _AT, grid=np.ones((2, 2, 2)))
    four = Candidate("quadrilateral", _CORNERS, 0.8, -3.0, 7.0)
    points = np.array([[41.0, 37.0], [70.0, 37.0], [10.0, 4.0], [60.0, 50.0]])
    return {
        "told": [[each.centre, each.area, each.sizes, [each.distance(p) for p in points]] for each in (one, four)],
        "moved": [each.moved(np.array([3.0, -5.0])) for each in (one, four)],
        "nearest": [[each.kind for each in choose.nearest((one, four), np.ones((105, 120)), p)] for p in points],
        "no": choose.nearest((), np.ones((105, 120)), points[0]),
    }  # fmt: skip


def _tags():
    image, corners = tag("4X4_50", 7), np.array([[70.3, 40.2], [160.3, 48.0], [154.0, 135.0], [61.0, 128.0]])
    return [tags.plain(each, corners, "4X4_1000", 1.5) for each in (image, image + 0.3)]


@cache
def _board_picture():
    rng = np.random.default_rng(11)
    return SMALL.image(poses(SMALL, 1, rng, 600.0)[0])


def _grown_boards():
    clean = _board_picture()
    grey = approximate.eight_bits(clean)
    whole = approximate.approximate_corners(clean, None)
    part = whole[1:4, 1:5]
    over = np.concatenate([whole, 2 * whole[-1:] - whole[-2:-1]])
    beside = np.concatenate([2 * whole[:, :1] - whole[:, 1:2], whole], 1)
    return {
        "grey": grey, "whole": whole, "grown": growing.grown(grey, part), "turned": growing.grown(
            grey, np.rot90(part)),
        "trimmed": [growing.trimmed(grey, each) for each in (over, beside, whole[:3, :4])],
        "known": approximate.approximate_corners(clean, SMALL.board),
        "other": approximate.approximate_corners(clean, (SMALL.board[0] + 4, SMALL.board[1])),
        "small": [f(grey[:15, :15], (3, 3)) for f in (approximate._by_sectors, approximate._by_squares)],
        "next": [growing._next(grey, np.rot90(part, k)) for k in range(4)],
        "alternation": growing._alternation(grey, part[0], growing.steps(part)[0]),
    }  # fmt: skip


def _noisy_board():
    clean = _board_picture()
    image = clean + gaussian_filter(_noise(3.0, clean.shape), 0.6)
    grid = approximate.approximate_corners(clean, SMALL.board)
    board, seen = measured(image, grid, 1.2), recording(Photograph(image))
    far = measured(image, grid * 0.1, 1.2)
    faint = measured(100 + 0.02 * clean + _noise(1.0, clean.shape), grid, 1.0)
    cut = measured(np.clip(image, 0, 215), grid, 1.2)
    grown, alike = board_noise.board_covariance(image, board, grid, seen)
    white = board_noise.board_covariance(image, board, grid, recording(Photograph(clean + _noise(1.0, clean.shape))))
    return {"board": board, "covariance": grown, "alike": alike, "white": white, "far": far, "faint": faint.status,
        "cut": cut,
            "none": board_noise.respond(image, far, grid * 0.1).nnz}  # fmt: skip


def _board_refused():
    image = _board_picture()
    asked = [lambda: chessboard(image, (3, 2)), lambda: chessboard(image, (3.0, 4)), lambda: chessboard(image, [201,
        3]),
             lambda: chessboard(image, noise=0), lambda: chessboard(image, noise=True), lambda: chessboard(image,
             noise="1"),
             lambda: chessboard(image * 0, (5, 4)), lambda: chessboard(image * 0)]  # fmt: skip
    return {"refused": [without_error(each) for each in asked], "shape": [check_shape(None), check_shape([3, 200])],
            "given": chessboard(image + _noise(1.0, image.shape), SMALL.board, 1.7)}  # fmt: skip


def _tones():
    rng = np.random.default_rng(2)
    design = np.stack([np.tanh(np.linspace(-3, 3, 40)), np.ones(40), np.linspace(0, 1, 40)], 1)
    levels = 40 + 60 / (1 + np.exp(-np.linspace(-4, 5, 40)))
    left, root = rng.normal(0, 0.5, 40), rng.uniform(0.5, 2, 40)
    told = tone_curve.tone_curve(design, levels, left, root, 2)
    curves = [told, tone_curve.ToneCurve(0.1, 0.02, 0.1), tone_curve.ToneCurve(0.03, 0.02, 4.0),
              tone_curve.ToneCurve(0.5, 0.4, 4.0), tone_curve.ToneCurve(0.5, 0.05, 4.0), tone_curve.UNTOLD,
              tone_curve.ToneCurve(0.05, 0.02, 4.0), tone_curve.ToneCurve(-0.04, 0.02, 0.3)]  # fmt: skip
    return {"told": told, "dark": tone_curve.tone_curve(design, levels * 0, left, root, 2),
            "whole": tone_curve.tone_curve(np.eye(40), levels, left, root, 2),
            "said": [[each.bent, each.straight, each.status(True), each.status(False)] for each in curves],
            "together": [tone_curve.together(tuple(curves)), tone_curve.together((tone_curve.UNTOLD,))]}  # fmt: skip


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {
        "blurred ellipse": _blurred, "candidates": _candidates, "of tags": _tags, "of tones": _tones,
        "through points": _through_points, "correlation": _correlation, "edges of outlines": _edges,
    }  # fmt: skip
    more = {
        "round things": partial(_found_in_stack, False), "round holes": partial(_found_in_stack, True),
        "round things in shot noise": partial(_found_in_stack, False, 0.05), "no round thing": _not_found,
        "likeliest ellipse": _likeliest, "ellipse by points": partial(_by_points, False),
        "circle by points": partial(_by_points, True), "round": _measured_round,
        "round, of a circle": partial(_measured_round, at=(41.3, 36.8, 17.2, 17.2, 0.0)),
        "round, in shared noise": partial(_measured_round, smooth=0.7, sigma=3.0),
        "round, beside nothing": partial(_measured_round, contrast=3.0),
        "round, large": partial(_measured_round, at=(190.2, 175.6, 165.0, 151.0, 12.0), shape=(350, 380)),
        "round, large, in shared noise": partial(_measured_round, at=(190.2, 175.6, 165.0, 151.0, 12.0), shape=(
            350, 380), smooth=0.7, sigma=3.0),
        "four sides": lambda: _quadrilateral(_four_sides(), corners=_CORNERS + 0.4),
        "four sides in shared noise": lambda: _quadrilateral(_four_sides(smooth=0.7), corners=_CORNERS - 0.3),
        "four sides by strips": lambda: _quadrilateral(_four_sides(), estimator="strip", corners=_CORNERS),
        "four sides by strips in shared noise": lambda: _quadrilateral(_four_sides(smooth=0.7), estimator="strip",
                                                                       corners=_CORNERS),
        "four sides by isophotes": lambda: _quadrilateral(_four_sides(), estimator="isophote", corners=_CORNERS),
        "four sides by points in shared noise": lambda: _quadrilateral(
            _four_sides(smooth=0.7), estimator="gradient", corners=_CORNERS),
        "four sides, bent": _bent_sides, "four sides, given": _corners_given, "four sides, wide": _wide,
        "chosen": _chosen, "boards, grown": _grown_boards, "boards, noisy": _noisy_board,
        "boards, refused": _board_refused,
    }  # fmt: skip
    return {name: (CLOSED, make) for name, make in (found | more).items()}
