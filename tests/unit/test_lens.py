"""The lens' distortion against OpenCV's own projection, its derivative against central differences, and its fold."""

import cv2
import numpy as np
import pytest

import scenes
from imaging.geometry.lens import image_centre, lens_jacobian, recorded, undistorted
from imaging.geometry.projection import jacobian, project
from scenes import Lens
from tests.oracle import pinhole

LENSES = [(-0.2,), (0.3,), (-0.25, 0.12), (0.0, 0.0, 0.01, -0.02), (-0.3, 0.1, 0.004, 0.006, -0.02)]


def camera(coefficients, task1, **changes):
    values = {"focal_px": 300.0, "lens": Lens(distortion=tuple(coefficients)), **changes}  # 300 px: a wide angle
    return task1.camera.model_copy(update=values)


def opencv(points, seen):
    """`cv2.projectPoints` of ideal image points (n, 2), px."""
    middle = (np.array([seen.width, seen.height]) - 1) / 2
    rays = np.column_stack([(points - middle) / seen.focal_px, np.ones(len(points))])
    matrix = np.array([[seen.focal_px, 0, middle[0]], [0, seen.focal_px, middle[1]], [0, 0, 1]])
    distortion = np.zeros(5)
    distortion[: len(seen.lens.distortion)] = seen.lens.distortion
    return cv2.projectPoints(rays, np.zeros(3), np.zeros(3), matrix, distortion)[0][:, 0]


def anywhere(rng, seen, count=400):
    """Ideal points all over the image and a little beyond it."""
    return rng.uniform(-20, 20 + np.array([seen.width, seen.height]), (count, 2))


@pytest.mark.parametrize("coefficients", LENSES)
def test_recorded_is_opencvs(task1, rng, coefficients):
    """To 1e-9 px; p1 and p2 in each other's place would be seen (negative control)."""
    seen = camera(coefficients, task1)
    points = anywhere(rng, seen)
    ours = recorded(points, seen)
    assert ours == pytest.approx(opencv(points, seen), abs=1e-9)
    assert np.abs(ours - points).max() > 1
    if len(coefficients) > 3:
        swapped = camera((*coefficients[:2], coefficients[3], coefficients[2], *coefficients[4:]), task1)
        assert np.abs(ours - opencv(points, swapped)).max() > 0.1


@pytest.mark.parametrize("coefficients", LENSES)
def test_undistorted_takes_it_back(task1, rng, coefficients):
    seen = camera(coefficients, task1)
    points = anywhere(rng, seen)
    assert undistorted(recorded(points, seen), seen) == pytest.approx(points, abs=1e-9)
    assert undistorted(recorded(points[0], seen), seen) == pytest.approx(points[0], abs=1e-9)


@pytest.mark.parametrize("coefficients", LENSES)
def test_its_derivative_against_central_differences(task1, rng, coefficients):
    seen, step = camera(coefficients, task1), 1e-4
    points = anywhere(rng, seen, 50)
    columns = [(recorded(points + d, seen) - recorded(points - d, seen)) / (2 * step) for d in step * np.eye(2)]
    ours = lens_jacobian(points, seen)
    assert ours == pytest.approx(np.stack(columns, -1), abs=1e-6)
    assert np.abs(ours - np.eye(2)).max() > 0.01


@pytest.mark.parametrize("coefficients", LENSES)
def test_projection_through_the_lens(task1, coefficients):
    """Where points in space are recorded, against a pinhole and OpenCV; its derivative by their position."""
    seen, pose, step = camera(coefficients, task1, distance=30.0), np.array([35.0, 70.0]), 1e-5
    points = task1.solid.vertices
    assert project(points, pose, seen) == pytest.approx(opencv(pinhole(points, pose, seen), seen), abs=1e-9)
    columns = [
        (project(points + d, pose, seen) - project(points - d, pose, seen)) / (2 * step) for d in step * np.eye(3)
    ]
    assert jacobian(points, pose, seen) == pytest.approx(np.stack(columns, -1), rel=1e-6, abs=1e-6)


def test_nothing_is_recorded_beyond_the_fold(task1):
    """r (1 - 0.2 r^2) grows up to r = sqrt(1 / 0.6): farther out OpenCV's formula comes back, and an image would show
    everything twice."""
    seen = camera((-0.2,), task1)
    fold = np.sqrt(1 / 0.6)
    middle = image_centre(seen)
    away = np.array([[fold - 1e-6, 0], [0, fold - 1e-6], [fold + 1e-6, 0], [0, -fold - 1e-6], [2 * fold, 0]])
    ours = recorded(middle + seen.focal_px * away, seen)
    assert np.isfinite(ours).all(-1).tolist() == [True, True, False, False, False]
    assert np.isfinite(opencv(middle + seen.focal_px * away, seen)).all()
    farthest = seen.focal_px * fold * (1 - 0.2 * fold**2)
    found = undistorted(middle + np.array([[farthest - 0.01, 0], [farthest + 0.01, 0]]), seen)
    assert np.isfinite(found).all(-1).tolist() == [True, False]


def test_a_lens_without_coefficients_changes_nothing(task1, rng):
    seen = camera((0.0,), task1)
    points = anywhere(rng, seen)
    assert (recorded(points, seen) == points).all()
    assert (undistorted(points, seen) == points).all()
    assert not seen.lens.bends


def test_five_coefficients_or_k1_alone():
    assert Lens(distortion=-0.2).coefficients == (-0.2, 0, 0, 0, 0)
    assert Lens(distortion=[-0.2, 0.1]).coefficients == (-0.2, 0.1, 0, 0, 0)
    assert Lens().model_copy(update={"distortion": -0.2}).coefficients == (-0.2, 0, 0, 0, 0)
    for bad in ([0.1] * 6, "0.1", 11.0, [float("nan")]):
        with pytest.raises(ValueError, match="distortion"):
            Lens(distortion=bad)


def test_a_corner_that_the_lens_does_not_record_is_not_visible(task1):
    """Through a lens so bent that the block's corners lie beyond its fold."""
    import planner

    scene = task1.model_copy(update={"camera": camera((-9.0,), task1, focal_px=100.0, distance=20.0)})
    assert np.isnan(project(scene.solid.vertices, np.array([10.0, 20.0]), scene.camera)).any()
    found = planner.predict(scene, (10, 20), (20, 200))
    assert found.status == "not_visible"
    assert found.variance_px2 == np.inf
    assert scenes.load("task1").camera.lens == Lens()
