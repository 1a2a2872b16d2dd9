"""Lines, corners, circles and ellipses from points that hardly determine them."""

from __future__ import annotations

from functools import partial

import numpy as np

from imaging.features.propagation import corner_covariance
from measure.features.calipers import Caliper
from measure.features.conic import fit_ellipse
from measure.features.corners import corner_response, intersect
from measure.features.lines import fit_lines, regression, trapezoid
from measure.features.optics import Optics
from measure.features.points import EdgePoints
from measure.measurement import separation
from validation.hard import precise
from validation.hard.case import Answer, Case, Reference
from validation.hard.precise import mp


def cases() -> list[Case]:
    """All cases of the fits."""
    return _lines() + _covariances() + _corners() + _distances() + _ellipses()


def edge_points(count: int, start: float, length: float = 60.0, noise: float = 0.1) -> EdgePoints:
    """Points on a line of slope 0.02 in the caliper of an edge, from ``start`` px along it on."""
    along = start + np.linspace(0, length, count)
    offset = 0.3 + 0.02 * np.linspace(0, length, count) + noise * np.random.default_rng(3).standard_normal(count)
    return _points(along, offset)


def _points(along: np.ndarray, offset: np.ndarray) -> EdgePoints:
    one = np.ones(1)
    return EdgePoints(along[None], offset[None], np.ones((1, along.size), bool), one, np.zeros(1, bool))


def _lines() -> list[Case]:
    """The line through an edge's points, as every point estimator fits it."""
    wide = 10.0 ** np.random.default_rng(4).uniform(-6, 6, 40)
    nine = np.arange(9.0)
    settings = {
        "2 points": (edge_points(2, 0.0), 1.0),
        "weights over 12 decades": (edge_points(40, 0.0), wide),
        "points 1e6 px along the edge": (edge_points(40, 1e6), 1.0),
        "points 1e9 px along the edge": (edge_points(40, 1e9), 1.0),
        "points within 1e-6 px": (edge_points(40, 0.0, 1e-6, 1e-9), 1.0),
        "exactly straight, 45 deg": (_points(nine, nine), 1.0),
        "at 89.999 deg across the edge": (_points(np.radians(1e-3) * nine, nine), 1.0),
    }
    found = []
    for name, (points, weights) in settings.items():
        for measurand, place in (("line at the end px", "end"), ("tilt rad", "tilt")):
            ours, reference = partial(line, points, weights, place), partial(line_reference, points, weights, place)
            found.append(Case("fit", name, measurand, ours, reference))
    nothing = {"all points equal": np.full(5, 7.0), "all points across the edge": nine}
    for name, offset in nothing.items():
        ours = partial(line, _points(np.full(offset.size, 3.0), offset), 1.0, "tilt")
        found.append(Case("fit", name, "tilt rad", ours, lambda: Reference(None, "rule")))
    return found


def line(points: EdgePoints, weights: np.ndarray | float, place: str) -> Answer:
    """Tilt of the line, or its offset beside the last point."""
    fit = fit_lines(points, weights)
    if not np.isfinite(fit.tilt[0]):
        return Answer(None, "ill_conditioned")
    end = fit.mean_offset + np.tan(fit.tilt) * (points.along[:, -1] - fit.mean_along)
    return Answer(float(fit.tilt[0] if place == "tilt" else end[0]))


def line_reference(points: EdgePoints, weights: np.ndarray | float, place: str) -> Reference:
    """Principal axis by the plain formulas at 50 digits."""
    count = points.along.size

    def value(numbers):
        xs, ys, ws = numbers[:count], numbers[count : 2 * count], numbers[2 * count :]
        total = sum(ws)
        mx, my = (sum(w * v for w, v in zip(ws, values, strict=True)) / total for values in (xs, ys))
        xx, yy, xy = (
            sum(w * (a - ma) * (b - mb) for w, a, b in zip(ws, one, two, strict=True))
            for one, ma, two, mb in ((xs, mx, xs, mx), (ys, my, ys, my), (xs, mx, ys, my))
        )
        tilt = mp.atan2(2 * xy, xx - yy) / 2
        return tilt if place == "tilt" else my + mp.tan(tilt) * (xs[-1] - mx)

    weights = np.broadcast_to(weights, count)
    return precise.reference(value, (*points.along[0], *points.offset[0], *weights))


def _covariances() -> list[Case]:
    """The variance of a line's offset beside its last point, of points that each err by 1 px independently."""
    wide = 10.0 ** np.random.default_rng(4).uniform(-6, 6, 12)
    settings = {
        "shortest edge: 3 points on 2 px": (np.linspace(0, 2, 3), 1.0),
        "12 points, weights over 12 decades": (np.linspace(0, 60, 12), wide),
        "12 points 1e6 px along the edge": (1e6 + np.linspace(0, 60, 12), trapezoid(np.arange(12))),
        "12 points within 1e-6 px": (np.linspace(0, 1e-6, 12), 1.0),
        "12 points on 1e6 px": (np.linspace(0, 1e6, 12), trapezoid(np.arange(12))),
    }
    return [
        Case("fit", name, "V(line at the end)", partial(_spread, *setting), partial(_spread_reference, *setting))
        for name, setting in settings.items()
    ]


def _spread(along: np.ndarray, weights: np.ndarray | float) -> Answer:
    whole = np.broadcast_to(weights, along.shape)
    lever = np.array([1.0, along[-1] - whole @ along / whole.sum()])
    return Answer(float(((lever @ regression(along, weights)) ** 2).sum()))


def _spread_reference(along: np.ndarray, weights: np.ndarray | float) -> Reference:
    count = along.size

    def value(numbers):
        places, shares = numbers[:count], numbers[count:]
        total = sum(shares)
        mean = sum(w * place for w, place in zip(shares, places, strict=True)) / total
        away = [place - mean for place in places]
        square = sum(w * s * s for w, s in zip(shares, away, strict=True))
        return sum((w / total + away[-1] * w * s / square) ** 2 for w, s in zip(shares, away, strict=True))

    return precise.reference(value, (*along, *np.broadcast_to(weights, count)))


def _corners() -> list[Case]:
    """Where two lines cross: predicted, and found in the image."""
    found = []
    for degrees in (90.0, 0.01, 179.99, 1e-7):
        a = np.array([0.3, 0.3 + np.radians(degrees)])
        normals = np.stack([-np.sin(a), np.cos(a)], -1)
        points = np.array([[80.0, 70.0], [80.0, 70.0]]) + 30 * np.stack([np.cos(a), np.sin(a)], -1)
        predicted = partial(_corner, normals), partial(_corner_reference, normals)
        found.append(Case("fit", f"edges meeting at {degrees:g} deg", "V(corner) px2", *predicted))
        name = f"lines found that meet at {degrees:g} deg"
        found.append(Case("fit", name, "x px", *_crossings(normals, points)))
        response = partial(_response, normals, points), partial(_response_reference, normals, points)
        found.append(Case("fit", name, "V(corner) px2", *response))
    parallel = np.array([[0.6, 0.8], [0.6, 0.8]])
    apart = np.array([[10.0, 20.0], [30.0, 70.0]])
    nothing = Reference(None, "rule")
    found += [
        Case("fit", "parallel edges", "V(corner) px2", partial(_corner, parallel), lambda: nothing),
        Case("fit", "parallel lines found", "x px", _crossings(parallel, apart)[0], lambda: nothing),
        Case("fit", "parallel lines found", "V(corner) px2", partial(_response, parallel, apart), lambda: nothing),
    ]
    far = np.array([[1e6, 1e6], [1e6 + 30.0, 1e6 + 10.0]])
    cross = np.array([[0.6, 0.8], [0.8, -0.6]])
    found.append(Case("fit", "corner 1e6 px from the origin", "x px", *_crossings(cross, far)))
    return found


def _corner(normals: np.ndarray) -> Answer:
    return Answer.of(float(np.trace(corner_covariance(normals, np.array([0.01, 0.02])))), "ill_conditioned")


def _corner_reference(normals: np.ndarray) -> Reference:
    def value(numbers):
        (a1, b1), (a2, b2), (v1, v2) = numbers[:2], numbers[2:4], numbers[4:]
        return ((a2**2 + b2**2) * v1 + (a1**2 + b1**2) * v2) / (a1 * b2 - a2 * b1) ** 2

    return precise.reference(value, (*normals.ravel(), 0.01, 0.02))


def _crossings(normals: np.ndarray, points: np.ndarray):
    """Our crossing of two lines through points, and the reference."""

    def ours() -> Answer:
        x = float(intersect(normals[None], points[None])[0][0, 0])
        return Answer(None, "ill_conditioned") if np.isnan(x) else Answer(x)

    return ours, partial(_crossing, normals, points)


def _crossing(normals: np.ndarray, points: np.ndarray) -> Reference:
    def value(numbers):
        (a1, b1), (a2, b2), p, q = numbers[:2], numbers[2:4], numbers[4:6], numbers[6:]
        c1, c2 = a1 * p[0] + b1 * p[1], a2 * q[0] + b2 * q[1]
        return (c1 * b2 - c2 * b1) / (a1 * b2 - a2 * b1)

    return precise.reference(value, (*normals.ravel(), *points.ravel()))


_LEVEL, _SLOPE = 0.01, 1e-6  # variance of a line's offset at its caliper's origin, px^2, and of its slope


def _response(normals: np.ndarray, points: np.ndarray) -> Answer:
    """The corner's variance from those of the lines in their calipers."""
    calipers = tuple(
        Caliper("", point, np.array([b, -a]), 60.0, np.empty(0), "ok", Optics((200, 200)), np.zeros(2))
        for (a, b), point in zip(normals, points, strict=True)
    )
    response = corner_response(calipers, (0, 1))
    variances = np.tile([_LEVEL, _SLOPE], 2)
    return Answer.of(float((response**2 @ variances).sum()), "ill_conditioned")


def _response_reference(normals: np.ndarray, points: np.ndarray) -> Reference:
    def value(numbers):
        (a1, b1), (a2, b2), p, q, (level, slope) = (numbers[i : i + 2] for i in range(0, 10, 2))
        size = a1 * b2 - a2 * b1
        c1, c2 = a1 * p[0] + b1 * p[1], a2 * q[0] + b2 * q[1]
        x, y = (c1 * b2 - c2 * b1) / size, (a1 * c2 - a2 * c1) / size
        along1, along2 = (x - p[0]) * b1 - (y - p[1]) * a1, (x - q[0]) * b2 - (y - q[1]) * a2
        first, second = (a2**2 + b2**2) / size**2, (a1**2 + b1**2) / size**2
        return first * (level + slope * along1**2) + second * (level + slope * along2**2)

    return precise.reference(value, (*normals.ravel(), *points.ravel(), _LEVEL, _SLOPE))


_JOINT = np.diag([0.01, 0.02, 0.03, 0.04]) + 0.005  # covariance of the two ends' (x, y), px^2


def _distances() -> list[Case]:
    """The distance of two corners and its variance, as every measurement tells it."""
    settings = {
        "corners 1e-6 px apart": np.array([[80.0, 70.0], [80.0 + 6e-7, 70.0 - 8e-7]]),
        "corners 1e6 px from the origin": np.array([[1e6, 1e6], [1e6 + 30.0, 1e6 - 40.0]]),
        "corners on one row, 1e-12 px off it": np.array([[80.0, 1e-12], [10.0, 0.0]]),
    }
    return [
        Case("fit", name, measurand, partial(_distance, ends, place), partial(_distance_reference, ends, place))
        for name, ends in settings.items()
        for measurand, place in (("distance px", 0), ("V(distance) px2", 1))
    ]


def _distance(ends: np.ndarray, place: int) -> Answer:
    (value,), (gradient,) = separation(ends[None])
    return Answer(float((value, gradient @ _JOINT @ gradient)[place]))


def _distance_reference(ends: np.ndarray, place: int) -> Reference:
    def value(numbers):
        r, c = numbers[2] - numbers[0], numbers[3] - numbers[1]
        size = mp.sqrt(r * r + c * c)
        pull = [-r / size, -c / size, r / size, c / size]
        joint = [precise.mpf(float(v)) for v in _JOINT.ravel()]
        variance = sum(pull[i] * joint[4 * i + j] * pull[j] for i in range(4) for j in range(4))
        return (size, variance)[place]

    return precise.reference(value, ends.ravel())


def _on_ellipse(parameters, t: np.ndarray) -> np.ndarray:
    x, y, a, b, angle = parameters
    c, s = np.cos(angle), np.sin(angle)
    u, v = a * np.cos(t), b * np.sin(t)
    return np.stack([x + c * u - s * v, y + s * u + c * v], -1)


def _ellipses() -> list[Case]:
    """Points computed on known ellipses: the fit must give the semi-axes back, to the rounding of the points."""
    five, many = np.array([0.1, 1.2, 2.7, 3.9, 5.1]), np.linspace(0, 2 * np.pi, 60, endpoint=False)
    settings = [
        ("ellipse from 5 points", (10.0, 20.0, 9.0, 4.0, 0.3), five, 1e-9),
        ("circle seen at 89 deg", (300.0, 200.0, 40.0, 40.0 * np.cos(np.radians(89)), 0.7), many, 1e-6),
        ("circle seen at 89.9 deg", (300.0, 200.0, 40.0, 40.0 * np.cos(np.radians(89.9)), 0.7), many, 1e-5),
        ("a circle as an ellipse", (300.0, 200.0, 40.0, 40.0, 0.0), many, 1e-9),
        ("arc of 20 degrees", (300.0, 200.0, 40.0, 30.0, 0.4), np.linspace(0.3, 0.65, 60), 1e-4),
        ("ellipse 1e6 px from the origin", (1e6, 1e6, 40.0, 20.0, 0.7), many, 1e-8),
    ]  # fmt: skip
    found = []
    for name, parameters, t, tolerance in settings:
        points = _on_ellipse(parameters, t)
        for measurand, index in (("semi-axis a px", 2), ("semi-axis b px", 3)):
            truth = Reference(parameters[index], "closed form", None, tolerance)
            found.append(
                Case("fit", name, measurand, partial(_axis, points, index), partial(_same, truth), ("ill_conditioned",))
            )
    line = np.stack([np.arange(20.0), 2 * np.arange(20.0)], -1)
    nothing = Reference(None, "rule", reason="ill_conditioned")
    found.append(
        Case("fit", "ellipse through points on a line", "semi-axis a px", partial(_axis, line, 2), lambda: nothing)
    )
    equal = np.full((6, 2), 5.0)
    found.append(Case("fit", "ellipse, all points equal", "semi-axis a px", partial(_axis, equal, 2), lambda: nothing))
    return found


def _same(reference: Reference) -> Reference:
    return reference


def _axis(points: np.ndarray, index: int) -> Answer:
    found = fit_ellipse(points, 0.01)
    reason = str(found.status)
    return Answer(float(found.parameters[index]), reason) if reason == "ok" else Answer(None, reason)
