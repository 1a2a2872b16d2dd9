"""Levels beside a limb and what a locator makes of them, against rays and brute-force images."""

import numpy as np
import pytest
from scipy.optimize import brentq

from imaging.contours import limb
from imaging.contours.shading import Profile, fitted
from imaging.features.limb_locator import limb_crossing
from imaging.features.locator import edge_blur, kappa2
from scenes.parts.surfaces import Sphere
from tests.curved import SURFACES
from tests.matt import Lamps, levels_inside
from tests.unit.test_limbs import CAMERA, POSES

LAMPS = Lamps(np.array([[-17.6, 14.8, 19.3], [-4.8, -27.5, 2.4]]), np.array([1.2e5, 0.7e5]))
LAMP = Lamps(LAMPS.at[:1], LAMPS.power[:1])
BLUR, SCALE = 0.6, 1.0


def sampled_profile(surface, strand, sensor, camera, lamps, reach) -> Profile:
    """The profile over ``reach`` px, nearly best: through the exact level at Chebyshev's places of sqrt(d)."""
    places = (np.polynomial.chebyshev.chebpts1(12) + 1) / 2
    return fitted(places, levels_inside(surface, strand, sensor, camera, reach * places**2, lamps), reach)


def _lit(surface, pose, share: float):
    """The strand's one point on which the first lamp shines most, or nearest to a share of that."""
    strands = limb(surface, pose, CAMERA, 200).strands
    most = max(float((s.normals * (LAMP.at - s.points)).sum(1).max()) for s in strands)
    off, u, which = min(
        (abs(float(f) - share * most), float(u), k)
        for k, s in enumerate(strands)
        for f, u in zip((s.normals * (LAMP.at - s.points)).sum(1), s.u, strict=True)
    )
    assert off < 0.05 * most  # margin: the nearest of 200 points
    return limb(surface, pose, CAMERA, np.array([u])).strands[which]


def _line_crossing(surface, pose, beyond: float, count: int, share: float = 1.0) -> tuple[float, float]:
    """Shift of the zero crossing by brute force and that by the model, px: ``count`` rays across a limb's point."""
    strand = _lit(surface, pose, share)
    edges = np.linspace(-9, 9, count + 1)
    middle = (edges[1:] + edges[:-1]) / 2  # outwards
    levels = np.full(count, beyond)
    inner = middle < 0
    levels[inner] = levels_inside(surface, strand, pose, CAMERA, -middle[inner], LAMP)[0]
    width = np.hypot(edge_blur(BLUR), SCALE)

    def second(place):
        x = (place - middle) / width
        return (levels * (x**2 - 1) * np.exp(-(x**2) / 2)).sum() * (edges[1] - edges[0])

    profile = sampled_profile(surface, strand, pose, CAMERA, LAMP, 6 * width)
    found = limb_crossing(profile, beyond, BLUR, SCALE)
    return brentq(second, -1.5, 1.5, xtol=1e-12), float(found.shift[0])


@pytest.mark.parametrize("name", ["sphere", "cylinder", "cone", "torus", "ellipsoid"])
@pytest.mark.parametrize("beyond", [0.0, 255.0])
def test_crossing_against_rays(name, beyond):
    """40,000 rays across the limb: the crossing is where the profile's closed form has it, within 1e-3 px."""
    exact, found = _line_crossing(SURFACES[name], POSES[1], beyond, 40_000)
    assert found == pytest.approx(exact, abs=1e-3)
    assert abs(exact) > 2e-3  # the step model, 0, is off by more


@pytest.mark.parametrize(("name", "rays"), [("sphere", 1_000_000), ("torus", 40_000)])
def test_crossing_at_a_dim_limb(name, rays):
    """A million rays for the sphere: a limb that is nearly dark itself is found 0.3 px and more inside."""
    exact, found = _line_crossing(SURFACES[name], POSES[1], 0.0, rays, 0.05)
    assert found == pytest.approx(exact, abs=1e-3)
    assert exact < -0.3  # margin: the order is said: no small shift


def test_crossing_of_a_round_image():
    """In two dimensions, a disc of the levels of a sphere: the image's curvature adds its part inwards."""
    radius, width = 60.0, np.hypot(edge_blur(BLUR), SCALE)
    profile = Profile(np.array([[40.0, 30.0, -1.0]]), np.zeros(1))
    grid = (np.arange(1000) + 0.5) / 1000 * 14 - 7
    x, y = np.meshgrid(grid + radius, grid, indexing="ij")
    inside = radius - np.hypot(x, y)
    level = np.where(inside > 0, profile.levels(np.maximum(inside, 0).ravel())[0].reshape(x.shape), 10.0)

    def second(place):
        u, v = (x - radius - place) / width, y / width
        return (level * (u**2 - 1) * np.exp(-(u**2 + v**2) / 2)).sum()

    exact = brentq(second, -1.0, 1.0, xtol=1e-10)
    assert limb_crossing(profile, 10.0, BLUR, SCALE, 1 / radius).shift[0] == pytest.approx(exact, abs=2e-3)
    # margin: more than twice the limit for the right one
    assert abs(limb_crossing(profile, 10.0, BLUR, SCALE).shift[0] - exact) > 5e-3


def test_variance_against_noisy_images():
    """Scatter of the crossing in noise of known variance over the prediction; a step's is rejected, as is 1.3 times."""
    rng, sigma, count = np.random.default_rng(3), 0.5, 4000
    profile = Profile(np.array([[30.0, 25.0, -1.5]]), np.zeros(1))
    reach = np.arange(-10, 11)
    kernel = _kernel(reach)
    fine = (np.arange(4000) + 0.5) / 4000 * 30 - 15
    ideal = np.where(fine > 0, profile.levels(np.maximum(fine, 0))[0], 0.0)  # inwards
    blur = edge_blur(BLUR)
    pixels = np.array([(ideal * np.exp(-((fine - p) ** 2) / (2 * blur**2))).sum() for p in reach])
    pixels *= (fine[1] - fine[0]) / (np.sqrt(2 * np.pi) * blur)
    found = limb_crossing(profile, 0.0, BLUR, SCALE)
    rows = np.exp(-(reach**2) / (2 * SCALE**2)) / (np.sqrt(2 * np.pi) * SCALE)
    noise = (rng.normal(0, sigma, (count, len(reach), len(reach))) * rows[:, None]).sum(1)
    places = [_zero(pixels + each, kernel, reach, -found.shift[0]) for each in noise]
    ratio = np.var(places, ddof=1) / found.variance(sigma**2, SCALE)[0]
    error = np.sqrt(2 / (count - 1))
    assert abs(ratio - 1) < 4 * error
    assert abs(ratio / 1.3 - 1) > 4 * error  # margin: 30 % are 10 standard errors
    step = kappa2(SCALE, BLUR) * sigma**2 / profile.coefficients[0, 0] ** 2
    assert abs(np.var(places) / step - 1) > 4 * error
    # margin: second order of the noise
    assert np.mean(places) == pytest.approx(-found.shift[0], abs=0.01)


def _kernel(reach):
    def second(place):
        x = (place - reach) / SCALE
        return (x**2 - 1) * np.exp(-(x**2) / 2) / (np.sqrt(2 * np.pi) * SCALE**3)

    return second


def _zero(row, kernel, reach, start):
    return brentq(lambda place: row @ kernel(place), start - 0.6, start + 0.6, xtol=1e-8)


def test_a_terminator_near_the_limb_is_told():
    """Where the attached shadow ends inside the reach powers of sqrt(d) leave much out."""
    ball = Sphere((0.5, -1.0, 0.5), 2.0)
    strand = limb(ball, (0, 0), CAMERA, 64).strands[0]
    low = Lamps(np.array([[300.0, -1.0, 300.0]]), np.array([2e7]))
    left = sampled_profile(ball, strand, (0, 0), CAMERA, low, 8.0).left_out
    facing = (strand.normals * (low.at - strand.points)).sum(1)
    assert left[facing > 100].max() < 0.05
    assert left[(facing > -100) & (facing < 0)].max() > 0.2  # margin: the order is said, against 0.05
