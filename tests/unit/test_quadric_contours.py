"""The contour of a quadric whose polar plane cuts it in a parabola, which has no centre."""

import numpy as np
import pytest

from imaging.contours.quadrics import quadric_branches, touching_cone
from scenes.parts.surfaces import Quadric

EYE = np.array([3.0, 4.0, 5.0])
SHEETS = np.diag([1.0, 1.0, -1.0]), np.zeros(3), 2.3  # of two sheets; its asymptotic cone goes through the eye


@pytest.mark.parametrize("moved", [(0.0, 0.0, 0.0), (1.7, -0.4, 0.9)])
def test_a_parabola_is_where_lines_through_the_eye_touch(moved):
    """f = 0 and the gradient across the line of sight, at all points that are not far away, and in all of the plane."""
    quadric, eye = Quadric.about(np.array(moved), *SHEETS), EYE + moved
    status, (branch,) = quadric_branches(quadric, eye)
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
