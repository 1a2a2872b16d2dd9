"""Blurred ellipses against polygons of many corners, derivatives against central differences."""

import numpy as np
import pytest

from measure.features.blurred_ellipse import curvature, ellipse_image, from_symmetric, outline, relative, to_symmetric
from tests.oracle import polygon_image

ELLIPSES = [(14.3, 11.7, 7.0, 4.0, 0.4), (15.0, 12.2, 5.0, 5.0, 0.0), (13.1, 12.0, 9.0, 2.5, -1.1)]
COLUMNS, ROWS = np.arange(30), np.arange(25)


def turned(parameters, t):
    x, y, a, b, angle = parameters
    c, s = np.cos(angle), np.sin(angle)
    u, v = a * np.cos(t), b * np.sin(t)
    return np.column_stack([x + c * u - s * v, y + s * u + c * v])


@pytest.mark.parametrize("blur", [0.4, 0.9])
@pytest.mark.parametrize("parameters", ELLIPSES)
def test_image(parameters, blur):
    corners = turned(parameters, 2 * np.pi * np.arange(4000) / 4000)
    exact = polygon_image(corners, (25, 30), blur, 1.0)
    found, _ = ellipse_image(to_symmetric(parameters), COLUMNS, ROWS, blur)
    assert found == pytest.approx(exact, abs=1e-5)  # of a polygon of 4000 corners
    part, _ = ellipse_image(to_symmetric(parameters), COLUMNS[8:20], ROWS[5:17], blur)
    assert part == pytest.approx(found[5:17, 8:20], abs=1e-12)


@pytest.mark.parametrize("parameters", ELLIPSES)
def test_derivatives(parameters):
    shape, blur, step = to_symmetric(parameters), 0.7, 1e-4
    _, found = ellipse_image(shape, COLUMNS, ROWS, blur)
    for i in range(6):
        move = step * (np.arange(6) == i)
        ahead, behind = (ellipse_image(shape + s * move[:5], COLUMNS, ROWS, blur + s * move[5])[0] for s in (1, -1))
        assert found[i] == pytest.approx((ahead - behind) / (2 * step), abs=1e-5)  # second order of the step


@pytest.mark.parametrize("parameters", ELLIPSES)
def test_symmetric_form_and_back(parameters):
    shape = to_symmetric(parameters)
    xx, yy, xy = shape[2:]
    matrix = np.array([[xx, xy], [xy, yy]])
    assert np.sort(np.linalg.eigvalsh(matrix)) == pytest.approx(sorted(parameters[2:4]))
    angle = parameters[4]
    axis = np.array([np.cos(angle), np.sin(angle)])
    assert matrix @ axis == pytest.approx(parameters[2] * axis)
    back, derivative = from_symmetric(shape)
    assert back == pytest.approx(parameters, abs=1e-12)
    if parameters[2] != parameters[3]:
        steps = 1e-6 * np.eye(5)
        numeric = [(from_symmetric(shape + h)[0] - from_symmetric(shape - h)[0]) / 2e-6 for h in steps]
        assert derivative == pytest.approx(np.array(numeric).T, abs=1e-7)
    else:
        assert np.isinf(derivative[4, 2:]).any()


@pytest.mark.parametrize("parameters", ELLIPSES)
def test_outline_curvature_and_relative(parameters):
    """Points on the ellipse, normals across tangents, curvature from three points, sizes along rays."""
    shape, t, h = to_symmetric(parameters), np.linspace(0.1, 6.2, 17), 1e-4
    places, normals = outline(shape, t)
    x, y, a, b, angle = parameters
    c, s = np.cos(angle), np.sin(angle)
    dx, dy = places[:, 0] - x, places[:, 1] - y
    assert ((c * dx + s * dy) / a) ** 2 + ((-s * dx + c * dy) / b) ** 2 == pytest.approx(np.ones(17))
    before, after = outline(shape, t - h)[0], outline(shape, t + h)[0]
    tangent = after - before
    assert np.abs((tangent * normals).sum(1)).max() < 1e-9
    assert (normals * (places - [x, y])).sum(1).min() > 0
    speed, second = tangent / (2 * h), (after - 2 * places + before) / h**2
    bend = np.abs(speed[:, 0] * second[:, 1] - speed[:, 1] * second[:, 0]) / np.linalg.norm(speed, axis=1) ** 3
    assert curvature(shape, t) == pytest.approx(bend, rel=1e-5)
    away = np.array([x, y]) + 1.3 * (places - [x, y])
    size, unit, gradient = relative(np.array([shape]), away[None])
    assert size == pytest.approx(np.full((1, 17), 1.3))
    assert unit[0] == pytest.approx(np.column_stack([np.cos(t), np.sin(t)]))
    for axis in range(2):
        move = 1e-6 * np.eye(2)[axis]
        ahead, behind = (relative(np.array([shape]), (away + k * move)[None])[0] for k in (1, -1))
        assert gradient[0, :, axis] == pytest.approx(((ahead - behind) / 2e-6)[0], abs=1e-7)
