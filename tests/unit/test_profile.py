"""The top of the gradient across an edge: the same from either of the pixels that it lies between."""

import numpy as np
import pytest

from measure.estimators.profile import profile_kernel, top
from tests.oracle import polygon_image

PLACE = 20  # row and column of the first pixel, in a picture of 41 x 41 px


def edge(normal, distance, blur):
    """A straight edge of contrast 100, so far along its unit normal from the first pixel."""
    along = np.array([normal[1], -normal[0]])
    start = PLACE + distance * normal - 40 * along
    corners = np.array([start, start + 80 * along, start + 80 * along + 40 * normal, start + 40 * normal])
    return polygon_image(corners, (41, 41), blur, 100.0)


def profiles(images, kernel, x, y):
    radius = int(np.sqrt(len(kernel))) // 2
    part = images[:, y - radius : y + radius + 1, x - radius : x + radius + 1]
    return part.reshape(len(images), -1) @ kernel


@pytest.mark.parametrize(("step", "blur"), [((0, 1), 0.6), ((1, 0), 1.0), ((1, 1), 0.3), ((-1, 1), 0.6)])
@pytest.mark.parametrize("phase", [0.46, 0.5, 0.53])
def test_the_same_from_both_pixels_beside_it(step, blur, phase, rng):
    """From one pixel and from the next along the normal; rms of 50 pictures with noise of 1, which moves it by 0.01 px.

    Negative control: the tops of the Gaussians with the gradient's first three derivatives at the two pixels differ by
    ten times as much and more, for noise is no Gaussian.
    """
    length = np.linalg.norm(step)
    normal = np.array(step) / length
    kernel = profile_kernel(1.0, normal)
    images = edge(normal, phase * length, blur) + rng.standard_normal((50, 41, 41))
    here, next_one = profiles(images, kernel, PLACE, PLACE), profiles(images, kernel, PLACE + step[0], PLACE + step[1])
    shifts, goods, gaussians = [], [], []
    for found in (here, next_one):
        shift, _, _, good = top(found)
        d1, d2, d3 = found[:, :3].T
        shifts.append(shift)
        goods.append(good)
        gaussians.append(d1 * d2 / (d2**2 - d1 * d3))
    assert np.all(goods)
    assert shifts[0].mean() == pytest.approx(phase * length, abs=0.012)
    assert 0.005 < shifts[0].std() < 0.03  # margin: the noise moves them, and not far
    assert rms(shifts[0] - shifts[1] - length) < 2e-4
    assert rms(gaussians[0] - gaussians[1] - length) > 2e-3  # margin: ten times the limit of what is right


def rms(values):
    return np.sqrt(np.mean(values**2))
