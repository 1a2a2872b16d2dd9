"""The illumination model against 50-digit textbook formulas."""

import mpmath as mp
import numpy as np
import pytest

from planner.imaging.reflectance import beckmann, fresnel, reflected
from scenes import Material

mp.mp.dps = 50


def textbook_fresnel(angle, n, k):
    """Reflectance from the complex amplitude coefficients (Born and Wolf, section 14.2)."""
    index = mp.mpc(n, -k)
    cosine = mp.cos(angle)
    inside = mp.sqrt(1 - (mp.sin(angle) / index) ** 2)
    perpendicular = abs((cosine - index * inside) / (cosine + index * inside)) ** 2
    parallel = abs((index * cosine - inside) / (index * cosine + inside)) ** 2
    return float(parallel), float(perpendicular)


@pytest.mark.parametrize("n", [0.2, 0.9, 1.0001, 1.33, 1.5, 4.0])
@pytest.mark.parametrize("k", [0.0, 1e-3, 1.0, 10.0])
@pytest.mark.parametrize("degrees", [0, 1e-3, 20, 45, 56, 70, 85, 89.9])
def test_fresnel(n, k, degrees):
    if n < 1 and k == 0 and degrees > 11:
        pytest.skip("total reflection: the textbook root has two branches")
    angle = mp.radians(mp.mpf(degrees))
    ours = fresnel(float(mp.cos(angle)), n, k)
    assert np.allclose(ours, textbook_fresnel(mp.acos(mp.mpf(float(mp.cos(angle)))), n, k), rtol=1e-11, atol=1e-15)


def test_fresnel_as_printed_is_wrong():
    """Negative control: with the printed sin^2 cos^2 in rho_parallel, Brewster's angle does not extinguish."""
    angle = np.arctan(1.5)
    sine, cosine, a = np.sin(angle), np.cos(angle), np.sqrt(1.5**2 - np.sin(angle) ** 2)
    perpendicular = ((a - cosine) / (a + cosine)) ** 2
    printed = perpendicular * (a**2 - 2 * a * sine**2 / cosine + sine**2 * cosine**2) / (a + sine**2 / cosine) ** 2
    assert fresnel(cosine, 1.5, 0.0)[0] < 1e-30
    assert abs(printed) > 0.01


def test_matching_index_reflects_nothing():
    assert np.max(fresnel(np.linspace(0.001, 1, 100), 1.0, 0.0)) < 1e-30


def test_grazing_reflects_everything():
    assert np.allclose(fresnel(0.0, 1.5, 0.3), 1)


@pytest.mark.parametrize("m", [0.01, 0.2, 1.0])
@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.3, 1.0, 1.5])
def test_beckmann(m, angle):
    a = mp.mpf(angle)
    exact = mp.exp(-((mp.tan(a) / m) ** 2)) / (m**2 * mp.cos(a) ** 4)
    assert float(beckmann(np.cos(angle), np.sin(angle), m)) == pytest.approx(float(exact), rel=1e-9, abs=1e-300)


def test_beckmann_conserves_area():
    """The microfacets' projected area is pi in the paper's normalisation (which divides by pi in K)."""
    angle = np.linspace(0, np.pi / 2 - 1e-6, 20001)
    integrand = beckmann(np.cos(angle), np.sin(angle), 0.3) * np.cos(angle) * np.sin(angle) * 2 * np.pi
    assert np.trapezoid(integrand, angle) == pytest.approx(np.pi, rel=1e-4)


def unit(*v):
    return np.array(v) / np.linalg.norm(v)


def test_diffuse_is_cosine_and_zero_behind():
    material = Material(specular_fraction=0.1, diffuse_reflectance=0.8)
    up, light = unit(0, 0, 1), unit(1, 0, 1)
    assert reflected(material, up, light, unit(0, 1, 2)) == pytest.approx(0.9 * 0.8 * np.sqrt(0.5))
    assert reflected(material, up, -light, up) == 0
    assert reflected(material, up, light, -up) == 0


@pytest.mark.parametrize(
    ("towards_light", "towards_sensor", "smallest"),
    [
        ((0.5, 0.1, 1), (-0.3, 0.4, 1), "1"),
        ((0.5, 0.1, 1), (-3, 0.4, 0.6), "view"),
        ((4, 0.1, 0.5), (-0.3, 0.4, 1), "light"),
    ],
)
def test_specular_against_the_printed_formula(towards_light, towards_sensor, smallest):
    """Each of the three branches of the geometric attenuation G: nothing hidden, masking, shadowing."""
    material = Material(
        specular_fraction=0.4, diffuse_reflectance=0.7, refractive_index=1.8, extinction=2.0, roughness=0.3
    )
    n, light, view = unit(0, 0, 1), unit(*towards_light), unit(*towards_sensor)
    half = unit(*(light + view))
    nh, nv, nl, vh = n @ half, n @ view, n @ light, view @ half
    d = np.exp(-((np.tan(np.arccos(nh)) / 0.3) ** 2)) / (0.3**2 * nh**4)
    branches = {"1": 1.0, "view": 2 * nh * nv / vh, "light": 2 * nh * nl / vh}
    assert min(branches, key=branches.get) == smallest
    k = d * branches[smallest] / (np.pi * nl * nv)
    parallel, perpendicular = textbook_fresnel(mp.acos(float(vh)), 1.8, 2.0)
    specular, diffuse = 0.4 * k * float(parallel + perpendicular) / 2, 0.6 * 0.7
    assert specular > 1e-6 * diffuse
    assert reflected(material, n, light, view) == pytest.approx(nl * (specular + diffuse), rel=1e-12)


def test_specular_stays_finite_at_grazing_view():
    material = Material(specular_fraction=1.0, refractive_index=1.5, roughness=0.2)
    n = unit(0, 0, 1)
    values = reflected(
        material, n, unit(1, 0, 0.2), np.array([[-np.sqrt(1 - c * c), 0, c] for c in (1e-3, 1e-6, 1e-12)])
    )
    assert np.isfinite(values).all()
    assert (values > 0).all()
