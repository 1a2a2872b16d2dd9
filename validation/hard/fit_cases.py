"""Lines, corners, circles and ellipses from points that hardly determine them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from measure.features.conic import fit_ellipse
from measure.features.corners import intersect
from planner.features.propagation import corner_covariance, fit_line, line_covariance, offset_variance
from validation.hard.case import Answer, Case, Reference


def cases() -> list[Case]:
    """All cases of the fits."""
    return _lines() + _corners() + _ellipses()


def _points(count: int, offset: float, length: float = 60.0, noise: float = 0.1) -> np.ndarray:
    rng = np.random.default_rng(3)
    t = np.linspace(0, length, count)
    across = noise * rng.standard_normal(count)
    return np.stack([offset + 0.8 * t - 0.6 * across, offset + 0.6 * t + 0.8 * across], -1)


def _lines() -> list[Case]:
    rng = np.random.default_rng(4)
    wide = 10.0 ** rng.uniform(-6, 6, 40)
    settings = {
        "2 points": (_points(2, 0.0), np.ones(2)),
        "weights over 12 decades": (_points(40, 0.0), wide),
        "line 1e6 px from the origin": (_points(40, 1e6), np.ones(40)),
        "line 1e9 px from the origin": (_points(40, 1e9), np.ones(40)),
        "points within 1e-6 px": (_points(40, 0.0, 1e-6, 1e-9), np.ones(40)),
        "exactly vertical": (np.stack([np.full(9, 3.0), np.arange(9.0)], -1), np.ones(9)),
        "exactly straight, 45 deg": (np.stack([np.arange(9.0), np.arange(9.0)], -1), np.ones(9)),
    }
    found = []
    for name, (points, weights) in settings.items():
        for measurand, place in (("V(line at the end) px2", "end"), ("V(angle) rad2", "tilt")):
            ours, reference = partial(_line, points, weights, place), partial(_line_reference, points, weights, place)
            found.append(Case("fit", name, measurand, ours, reference))
    same = np.full((5, 2), 7.0)
    ours = partial(_line, same, np.ones(5), "tilt")
    found.append(Case("fit", "all points equal", "V(angle) rad2", ours, lambda: Reference(None, "rule")))
    return found


def _line(points: np.ndarray, weights: np.ndarray, place: str) -> Answer:
    fit = fit_line(points, weights)
    if not fit.spread > 0:
        return Answer(None, "ill_conditioned")
    if place == "tilt":
        return Answer(float(np.trace(line_covariance(fit)[:2, :2])))
    return Answer(float(offset_variance(fit, points[-1])))


def _line_reference(points: np.ndarray, weights: np.ndarray, place: str) -> Reference:
    """Principal axis by the plain formulas at 50 digits."""
    from validation.hard import precise
    from validation.hard.precise import mp, mpf

    count = len(points)

    def value(numbers):
        xs, ys, ws = numbers[:count], numbers[count : 2 * count], numbers[2 * count :]
        total = sum(ws)
        mx, my = (sum(w * v for w, v in zip(ws, values, strict=True)) / total for values in (xs, ys))
        bar = total * (count - 1) / count
        xx, yy, xy = (
            sum(w * (a - ma) * (b - mb) for w, a, b in zip(ws, one, two, strict=True)) / bar
            for one, ma, two, mb in ((xs, mx, xs, mx), (ys, my, ys, my), (xs, mx, ys, my))
        )
        tilt = (xx + yy + count / total) / (bar * (xx + yy) ** 2)
        angle = mp.atan2(2 * xy, xx - yy) / 2
        along = (xs[-1] - mx) * mp.cos(angle) + (ys[-1] - my) * mp.sin(angle)
        return tilt if place == "tilt" else (along**2 + 1 / total) * tilt + 1 / total

    numbers = [mpf(float(v)) for v in (*points[:, 0], *points[:, 1], *weights)]
    return Reference.precise(value(numbers), precise.condition_of(value, numbers))


def _corners() -> list[Case]:
    found = []
    for degrees in (90.0, 0.01, 179.99, 1e-7):
        a = np.array([0.3, 0.3 + np.radians(degrees)])
        normals = np.stack([-np.sin(a), np.cos(a)], -1)
        found.append(
            Case("fit", f"edges meeting at {degrees:g} deg", "V(corner) px2", partial(_corner, normals),
                 partial(_corner_reference, normals))
        )  # fmt: skip
    parallel = np.array([[0.6, 0.8], [0.6, 0.8]])
    found.append(
        Case("fit", "parallel edges", "V(corner) px2", partial(_corner, parallel), lambda: Reference(None, "rule"))
    )
    far = np.array([[[1e6, 1e6], [1e6 + 30.0, 1e6 + 10.0]]])
    cross = np.array([[[0.6, 0.8], [0.8, -0.6]]])
    ours = partial(_answer, lambda: intersect(cross, far)[0][0, 0])
    found.append(Case("fit", "corner 1e6 px from the origin", "x px", ours, partial(_crossing, cross[0], far[0])))
    return found


def _answer(value: Callable[[], float]) -> Answer:
    return Answer(float(value()))


def _corner(normals: np.ndarray) -> Answer:
    return Answer.of(float(np.trace(corner_covariance(normals, np.array([0.01, 0.02])))), "ill_conditioned")


def _corner_reference(normals: np.ndarray) -> Reference:
    from validation.hard import precise

    def value(numbers):
        (a1, b1), (a2, b2), (v1, v2) = numbers[:2], numbers[2:4], numbers[4:]
        return ((a2**2 + b2**2) * v1 + (a1**2 + b1**2) * v2) / (a1 * b2 - a2 * b1) ** 2

    numbers = [precise.mpf(float(x)) for x in (*normals.ravel(), 0.01, 0.02)]
    return Reference.precise(value(numbers), precise.condition_of(value, numbers))


def _crossing(normals: np.ndarray, points: np.ndarray) -> Reference:
    from validation.hard import precise

    def value(numbers):
        (a1, b1), (a2, b2), p, q = numbers[:2], numbers[2:4], numbers[4:6], numbers[6:]
        c1, c2 = a1 * p[0] + b1 * p[1], a2 * q[0] + b2 * q[1]
        return (c1 * b2 - c2 * b1) / (a1 * b2 - a2 * b1)

    numbers = [precise.mpf(float(x)) for x in (*normals.ravel(), *points.ravel())]
    return Reference.precise(value(numbers), precise.condition_of(value, numbers))


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
