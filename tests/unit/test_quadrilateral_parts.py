"""What is told of a quadrilateral in a photograph: lengths, angles and their errors, larger pixels, shared noise."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from measure.photo import quadrilateral
from measure.photo.noise_curve import NoiseCurve
from scenes import status

CORNERS = np.array([[20.0, 11.0], [93.0, 24.0], [81.0, 77.0], [12.0, 59.0]])
COVARIANCE = np.cov(np.random.default_rng(3).normal(size=(8, 40)))


def numbers(corners):
    """Sides, diagonals and angles by the law of cosines, as they are told in turn."""
    away = np.linalg.norm(corners[:, None] - corners, axis=-1)
    sides = [away[i, (i + 1) % 4] for i in range(4)]
    angles = []
    for i in range(4):
        a, b, c = away[i, (i + 1) % 4], away[i, i - 1], away[(i + 1) % 4, i - 1]
        angles.append(np.degrees(np.arccos((a**2 + b**2 - c**2) / (2 * a * b))))
    return np.array([*sides, away[0, 2], away[1, 3], *angles])


def test_lengths_and_angles_have_the_errors_of_their_corners():
    """By central differences of what the law of cosines says, with correlated corners."""
    told = quadrilateral._values(CORNERS, COVARIANCE)
    names = ["side 1-2", "side 2-3", "side 3-4", "side 4-1", "diagonal 1-3", "diagonal 2-4"]
    assert [each.name for each in told] == names + [f"angle {i}" for i in range(1, 5)]
    assert [each.unit for each in told] == ["px"] * 6 + ["deg"] * 4
    assert [each.value for each in told] == pytest.approx(numbers(CORNERS), rel=1e-9)
    step = 1e-5
    moved = [
        (numbers(CORNERS + step * e) - numbers(CORNERS - step * e)) / (2 * step) for e in np.eye(8).reshape(8, 4, 2)
    ]
    sigma = np.sqrt(np.einsum("im,ij,jm->m", moved, COVARIANCE, moved))
    assert [each.sigma for each in told] == pytest.approx(sigma, rel=1e-6)


@pytest.mark.parametrize("size", [2, 3])
def test_what_larger_pixels_tell_is_said_in_those_of_the_photograph(size):
    """Places count from the middle of the first pixel; lengths, blurs and errors grow with the pixels."""
    curve, other = NoiseCurve(4.0, 0.0, 0.0, 0.0, None), NoiseCurve(0.5, 0.0, 0.0, 0.0, None)
    found = quadrilateral.Quadrilateral(
        CORNERS, COVARIANCE, (), 0.3, 0.8, "ok", 0.4, "strip", other, np.array([0.7, 0.8, 0.9, 1.0])
    )  # fmt: skip
    told = quadrilateral._finer(found, size, SimpleNamespace(curve=curve), np.full((9, 9), 50.0))
    assert told.corners == pytest.approx(size * CORNERS + (size - 1) / 2, rel=1e-12)
    assert told.covariance == pytest.approx(size**2 * COVARIANCE, rel=1e-12)
    sizes = [(a.value / b.value, a.sigma / b.sigma) for a, b in zip(
        told.measurands, quadrilateral._values(CORNERS, COVARIANCE), strict=True)]  # fmt: skip
    assert np.array(sizes) == pytest.approx(np.array([[size, size]] * 6 + [[1, 1]] * 4), rel=1e-9)
    assert (told.noise, told.curve, told.blur_px) == (pytest.approx(2.0), curve, pytest.approx(0.8 * size))
    assert told.side_blur_px == pytest.approx(size * np.array([0.7, 0.8, 0.9, 1.0]))
    none = replace(found, corners=np.full((4, 2), np.nan), covariance=np.full((8, 8), np.nan))
    assert quadrilateral._finer(none, size, SimpleNamespace(curve=curve), np.zeros((9, 9))).measurands == ()


@pytest.mark.parametrize(("growth", "alike"), [(1.04, True), (1.06, False), (0.96, True), (0.94, False)])
def test_shared_noise_matters_from_5_per_cent_of_a_standard_deviation(growth, alike, monkeypatch):
    """Where the pixels' response cannot be told, variances grow by the sum of what neighbours share."""
    found = quadrilateral._Found(CORNERS, COVARIANCE, "ok", 0.5, "strip", 1.0, None)
    seen = SimpleNamespace(correlation=SimpleNamespace(kernel=np.array([[0.1, 1.0, 0.3]])))
    one = np.eye(8)
    one[5, 5] = growth
    monkeypatch.setattr(quadrilateral, "grown_covariance", lambda *given: one @ COVARIANCE @ one)
    told = quadrilateral._grown(np.zeros((9, 9)), found, seen)
    assert told.alike == alike
    assert told.covariance == pytest.approx(one @ COVARIANCE @ one, rel=1e-12)
    monkeypatch.setattr(quadrilateral, "grown_covariance", lambda *given: np.full((8, 8), np.nan))
    told = quadrilateral._grown(np.zeros((9, 9)), found, seen)
    assert told.covariance == pytest.approx(1.4 * COVARIANCE, rel=1e-12)
    assert not told.alike


@pytest.mark.parametrize(("state", "uneven", "fits", "said"), [
    ("ok", False, "ok", "ok"), ("ok", True, "ok", "clutter"), ("ok", False, "misfit", "misfit"),
    ("short", True, "misfit", "short"),
])  # fmt: skip
def test_the_worst_of_what_is_wrong_with_sides_is_said(state, uneven, fits, said):
    shape = SimpleNamespace(status=np.array([state]))
    told = quadrilateral._judged(shape, fits, SimpleNamespace(uneven=uneven))
    assert told == status.worst(said, state if state in status.MEASURED else said)
