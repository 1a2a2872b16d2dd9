"""The formulas as one writes them at first fail the same references: the hard cases are hard, the tolerances tell."""

from importlib import import_module

import numpy as np
import pytest

from imaging import pictures
from measure.features.lines import Lines
from scenes.materials.torrance_sparrow import beckmann
from validation.hard import Answer, Case, Reference, fit_cases, planner_cases, precise, run
from validation.hard.case import EPSILON
from validation.hard.scenes_for import task1

FAR_LINES = (1e6, 1e9)


def naive_fit(points, weights):
    """`measure.features.lines.fit_lines` with its moments by subtracting squares."""
    weight = points.valid * np.broadcast_to(weights, points.along.shape)
    x, y, total = points.along, points.offset, weight.sum(1)
    mx, my = ((weight * p).sum(1) / total for p in (x, y))
    xx, yy, xy = ((weight * p).sum(1) / total - q for p, q in ((x * x, mx * mx), (y * y, my * my), (x * y, mx * my)))
    return Lines(mx, my, np.arctan2(2 * xy, xx - yy) / 2, points.valid.sum(1), np.zeros(len(x)))


@pytest.mark.parametrize("offset", FAR_LINES)
def test_subtracting_squares_fails(offset, monkeypatch):
    points = fit_cases.edge_points(40, offset)
    case = Case(
        "fit", "", "", lambda: fit_cases.line(points, 1.0, "tilt"),
        lambda: fit_cases.line_reference(points, 1.0, "tilt"),
    )  # fmt: skip
    assert run(case).verdict == "right"
    monkeypatch.setattr(fit_cases, "fit_lines", naive_fit)
    assert run(case).verdict == "WRONG"


@pytest.mark.parametrize("offset", FAR_LINES)
def test_normal_equations_fail_for_a_far_line(offset):
    """Slope of y = p x + q from [x 1]^T [x 1]: the reference is the same least squares at 50 digits."""
    points = fit_cases.edge_points(40, offset)
    x, y = points.along[0], points.offset[0] + 0.5 * points.along[0]

    def exact(numbers):
        xs, ys = numbers[:40], numbers[40:]
        mx, my = sum(xs) / 40, sum(ys) / 40
        return sum((a - mx) * (b - my) for a, b in zip(xs, ys, strict=True)) / sum((a - mx) ** 2 for a in xs)

    def centred():
        return Answer(float((x - x.mean()) @ (y - y.mean()) / ((x - x.mean()) @ (x - x.mean()))))

    def normal_equations():
        design = np.stack([x, np.ones(40)], 1)
        try:
            return Answer(float(np.linalg.solve(design.T @ design, design.T @ y)[0]))
        except np.linalg.LinAlgError:  # of some BLAS kernels: to the last digit singular
            return Answer(0.0)

    numbers = [precise.mpf(float(v)) for v in (*x, *y)]
    truth = Reference.precise(exact(numbers), precise.condition_of(exact, numbers))
    assert run(Case("fit", "", "", centred, lambda: truth)).verdict == "right"
    assert run(Case("fit", "", "", normal_equations, lambda: truth)).verdict == "WRONG"


@pytest.mark.parametrize("cosine", [1e-8, 1e-6])
def test_tan_of_an_angle_near_90_degrees_fails(cosine):
    """The exponent (tan / m)^2 of eq. 1's D: from sine and cosine, or by way of the angle."""
    m = 0.5 / cosine  # so that D is of order one
    sine = np.sqrt((1 - cosine) * (1 + cosine))

    def exact(numbers):
        c, s, rough = numbers
        return precise.mp.exp(-((s / (rough * c)) ** 2)) / (rough**2 * c**4)

    numbers = [precise.mpf(float(v)) for v in (cosine, sine, m)]
    truth = Reference.precise(exact(numbers), precise.condition_of(exact, numbers))

    def by_angle():
        return Answer(float(np.exp(-((np.tan(np.arccos(cosine)) / m) ** 2)) / (m**2 * cosine**4)))

    assert run(Case("fit", "", "", lambda: Answer(float(beckmann(cosine, sine, m))), lambda: truth)).verdict == "right"
    assert run(Case("fit", "", "", by_angle, lambda: truth)).verdict == "WRONG"


def test_lengths_from_image_coordinates_fail_for_a_tiny_object(monkeypatch):
    """The image's middle added before the difference is taken, as it once was."""
    case = planner_cases.variance("", task1(object={"size": [1.25e-8, 7.5e-9, 2.5e-9]}), (30, 135), (15, 315), "paper")
    assert run(case).verdict == "right"
    pictures._of_picture.cache_clear()  # what was projected before
    outline = import_module("imaging.features.projected_edges")
    plain, known = outline.from_axis, import_module("imaging.pictures")._of_picture
    monkeypatch.setattr(outline, "from_axis", lambda *args: (plain(*args) + 127.5) - 127.5)
    known.cache_clear()  # edges are projected once a picture
    assert run(case).verdict == "WRONG"
    known.cache_clear()


def test_the_last_digit_counts():
    """A relative error of 10 x the bound of a well-conditioned case is caught, one of a few roundings is not."""
    case = planner_cases.variance("", task1(), (30, 135), (15, 315), "paper")
    value = case.ours().value
    for factor, verdict in ((1 + 1e-9, "WRONG"), (1 + 8 * EPSILON, "right")):
        off = Case("planner", "", "", lambda factor=factor: Answer(value * factor), case.reference)
        assert run(off).verdict == verdict
