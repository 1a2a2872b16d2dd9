"""What is said of an ellipse for which the likelihood has no maximum."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import measure
from measure.features.optics import Optics
from measure.find import ellipse
from measure.photo import edge_points, ellipses
from measure.photo.noise_curve import NoiseCurve
from measure.photo.photograph import _quantities
from measure.photo.recording import recording
from scenes import status
from scenes.photograph import Photograph
from tests.oracle import polygon_image

TRUE = np.array([40.3, 35.7, 14.0, 14.0, 0.0])


@pytest.mark.parametrize(("contrast", "expected"), [(60.0, status.ILL_CONDITIONED), (4.0, status.LOW_CONTRAST)])
def test_no_maximum(contrast, expected, monkeypatch):
    """Of noise 2: an edge of 30 times the noise was there to be measured, one of twice the noise was not."""
    t = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    outline = np.column_stack([TRUE[0] + 14 * np.cos(t), TRUE[1] + 14 * np.sin(t)])
    image = polygon_image(outline, (70, 80), 0.7, contrast)
    optics = Optics((70, 80), 0.7, 4.0)
    monkeypatch.setattr(ellipse, "likeliest_ellipse", lambda *_: None)
    found = measure.find_ellipse(image, TRUE, optics)
    assert found.status == expected
    assert np.isnan(found.parameters).all()
    assert np.isnan(found.covariance).all()


@pytest.mark.parametrize(
    ("major", "minor", "whole"), [(149.0, 20.0, True), (151.0, 20.0, False), (151.0, 151.0, False)]
)
def test_large_ellipses_are_found_by_their_edge_points(major, minor, whole, monkeypatch):
    """Large along the longer axis: there the likelihood of all pixels is not asked."""
    asked = []
    monkeypatch.setattr(ellipses, "fitted_ellipse", lambda *given: asked.append(1) or (None, status.LOW_CONTRAST))
    none = measure.find_ellipse(np.zeros((70, 80)), TRUE, Optics((70, 80), 0.7, 4.0))
    monkeypatch.setattr(ellipses, "ellipse_by_points", lambda *given: none)
    ellipses._found(np.zeros((9, 9)), np.array([4.0, 4.0, major, minor, 0.0]), None, None, False)
    assert bool(asked) == whole


@pytest.mark.parametrize("contrast", [20.0, 60.0])
def test_a_picture_without_noise_is_weighted_by_a_millionth_of_its_range(contrast):
    """Or a fit of exact levels would divide by nothing."""
    t = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    outline = np.column_stack([TRUE[0] + 14 * np.cos(t), TRUE[1] + 14 * np.sin(t)])
    photo = Photograph(polygon_image(outline, (70, 80), 0.7, contrast))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ellipses, "recording", lambda image: silent(recording(image)))
        found = ellipses.measure_ellipse(photo, TRUE)
    assert found.noise == pytest.approx(1e-6 * np.ptp(photo.levels), rel=1e-4)


@pytest.mark.parametrize("kind", ["circle", "ellipse"])
def test_diameters_and_axes_are_twice_what_is_fitted_and_so_are_their_errors(kind):
    """Places and the angle as they are."""
    told = SimpleNamespace(kind=kind, parameters=np.array([30.0, 40.0, 9.0, 7.0, 25.0]), covariance=np.diag(
        [0.01, 0.04, 0.09, 0.16, 0.25]))  # fmt: skip
    found = {each.name: (each.value, pytest.approx(each.sigma, rel=1e-12), each.unit) for each in _quantities(told)}
    places = {"centre x": (30.0, 0.1, "px"), "centre y": (40.0, 0.2, "px")}
    axes = {"axis a": (18.0, 0.6, "px"), "axis b": (14.0, 0.8, "px"), "angle": (25.0, 0.5, "deg")}
    assert found == places | ({"diameter": (18.0, 0.6, "px")} if kind == "circle" else axes)


def silent(seen):
    return replace(seen, curve=NoiseCurve(0.0, 0.0, 0.0, 0.0, None))


@pytest.mark.parametrize(
    ("share", "contrast", "expected"),
    [(0.51, 1.01, "fitted"), (0.49, 9.0, "low_contrast"), (1.0, 0.99, "low_contrast"), (1.0, 1.01, "fitted")],
)
def test_an_outline_is_fitted_where_half_of_its_places_have_an_edge_above_the_noise(
    share, contrast, expected, monkeypatch
):
    """The points that are fitted are those; on a circle they lie outside the steepest places by the blur's bend."""
    optics, seen = Optics((200, 220), 0.8, 4.0, 1.5, 6.0), {}

    def along(optics, positions, places, normals):
        valid = np.arange(len(places)) < np.floor(share * len(places))
        told = SimpleNamespace(valid=valid[None], offset=np.full((1, len(places)), 0.25), contrast=[level])
        seen["count"] = int(valid.sum())
        return SimpleNamespace(locate=lambda images: told)

    level = contrast * edge_points.MIN_CONTRAST * 2.0
    monkeypatch.setattr(edge_points, "gradient_along", along)
    monkeypatch.setattr(edge_points, "_covariance", lambda locator, *_: np.eye(1000)[: seen["all"], : seen["all"]])
    monkeypatch.setattr(edge_points, "_fitted", lambda *given: seen.update(points=given[0], by=given[1]) or "fitted")
    near = np.array([110.0, 100.0, 40.0, 40.0, 0.0])
    seen["all"] = int(2 * np.pi * 40 / (2 * 1.5))
    found = edge_points.ellipse_by_points(np.zeros((200, 220)), near, optics, True)
    if expected != "fitted":
        assert str(found.status) == expected
        return
    assert found == "fitted"
    assert len(seen["points"]) == seen["count"]
    far = 40 + 0.25 + (1.5**2 + 0.8**2 + 1 / 12) / 2 / 40
    assert np.linalg.norm(seen["points"] - [110, 100], axis=1) == pytest.approx(np.full(seen["count"], far))
    assert seen["by"] == pytest.approx(np.eye(seen["count"]) / level**2)
