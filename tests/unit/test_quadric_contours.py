"""The contour of a quadric whose polar plane cuts it in a parabola, which has no centre."""

import numpy as np
import pytest

from imaging.contours.quadrics import _polar_plane, _polished, quadric_branches
from scenes.parts.surfaces import Quadric
from scenes.viewpoint import Viewpoint
from tests.conics import touching_cone

EYE = np.array([3.0, 4.0, 5.0])
SHEETS = np.diag([1.0, 1.0, -1.0]), np.zeros(3), 2.3  # of two sheets; its asymptotic cone goes through the eye


@pytest.mark.parametrize("moved", [(0.0, 0.0, 0.0), (1.7, -0.4, 0.9)])
def test_a_parabola_is_where_lines_through_the_eye_touch(moved):
    """f = 0 and the gradient across the line of sight, at all points that are not far away, and in all of the plane."""
    quadric, eye = Quadric.about(np.array(moved), *SHEETS), EYE + moved
    status, (branch,) = quadric_branches(quadric, Viewpoint(eye))
    assert status == "ok"
    points = branch.points(np.linspace(0.05, 0.95, 41))
    points = points[np.linalg.norm(points - eye, axis=1) < 300]
    assert len(points) > 20
    size = ((points - moved) ** 2).sum(1)  # of the terms of f
    assert np.abs(quadric.function(points) / size).max() < 1e-9
    assert np.abs((quadric.gradient(points) * (points - eye)).sum(1) / size).max() < 1e-9
    away = points - eye
    cone = np.einsum("ni,ij,nj->n", away, touching_cone(quadric, eye), away) / (away**2).sum(1) ** 2
    assert np.abs(cone).max() < 1e-9


@pytest.mark.parametrize("off", [2e-4, -2e-4])
def test_points_beside_a_contour_are_moved_across_it_alone(off):
    """Along the normal and the line of sight: nothing moves along the contour; 4e-8 is what two rounds leave."""
    form = np.array([[1, 0.2, 0], [0.2, 2, -0.1], [0, -0.1, 0.7]])
    quadric = Quadric(form, (0.3, -0.2, 0.1), -3.0)
    exact = quadric_branches(quadric, Viewpoint(EYE))[1][0].points(np.linspace(0, 1, 17)[:-1])
    normal, sight = quadric.normals(exact), (exact - EYE) / np.linalg.norm(exact - EYE, axis=1)[:, None]
    found = _polished(quadric, Viewpoint(EYE), exact + off * normal - 3 * off * sight)
    assert np.abs(quadric.function(found)).max() < 1e-12
    assert np.abs((quadric.gradient(found) * (found - EYE)).sum(1)).max() < 1e-11
    along = np.cross(normal, sight)
    # margin: what two rounds leave is of the order of off^2
    assert np.abs(((found - exact) * along).sum(1)).max() < 1e-3 * abs(off)
    unknown = exact + np.array([5.0, 0, 0])  # nothing is near: a step that is too long is not made
    assert (np.abs(_polished(quadric, Viewpoint(EYE), unknown) - unknown).max(1) == 0).any()


def test_the_polar_plane_is_as_large_as_what_it_cuts():
    """Of a unit sphere seen from 3: a circle of radius sqrt(8) / 3 about 1/3. Of a cone: through its apex, where
    the cut has no size of its own, as large as the eye is far."""
    sphere, eye = Quadric(np.eye(3), (0, 0, 0), -1.0), np.array([0.0, 0.0, 3.0])
    start, frame = _polar_plane(sphere, Viewpoint(eye), sphere.gradient(eye) / 2)
    assert start == pytest.approx([0, 0, 1 / 3], abs=1e-12)
    assert frame.T @ frame == pytest.approx(np.eye(2) * 8 / 9, abs=1e-12)
    cone, eye = Quadric(np.diag([1.0, 1.0, -1.0]), (0, 0, 0), 0.0), np.array([4.0, 0.0, 3.0])
    start, frame = _polar_plane(cone, Viewpoint(eye), cone.gradient(eye) / 2)
    assert start == pytest.approx([0, 0, 0], abs=1e-12)
    assert frame.T @ frame == pytest.approx(np.eye(2) * 25, abs=1e-9)
