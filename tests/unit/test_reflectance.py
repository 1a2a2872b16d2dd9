"""The reflectance against 50-digit textbook formulas, and the same lines of it run at 50 digits."""

import numpy as np
import pytest

from scenes import Material
from scenes.materials import torrance_sparrow as module
from scenes.materials.brdf import Index
from scenes.materials.torrance_sparrow import beckmann, fresnel
from scenes.materials.vectors import NUMPY, Ops, across
from tests import textbook
from tests.textbook import mp

MP = Ops(
    mp.sqrt, mp.exp, mp.log, min, max, lambda c, a, b: a if c else b,
    tiny=mp.mpf(10) ** -1000, flat=mp.mpf(10) ** -90, pi=mp.pi,
)  # fmt: skip
METAL = Material(specular_fraction=0.4, diffuse_reflectance=0.7, refractive_index=1.8, extinction=2.0, roughness=0.3)
GLASS = Material(specular_fraction=0.6, diffuse_reflectance=0.5, refractive_index=1.5, roughness=0.25)


def plain(material):
    """The material's one index."""
    return (Index(material.refractive_index, material.extinction),)


def textbook_fresnel(angle, n, k):
    """Reflectance (parallel, perpendicular) from the complex amplitudes."""
    return tuple(float(abs(part) ** 2) for part in textbook.amplitudes(mp.cos(angle), n, k))


def unit(*v):
    return np.array(v) / np.linalg.norm(v)


def across_ray(ray, rng):
    """A random direction across a ray."""
    return unit(*np.cross(ray, rng.standard_normal(3)))


def random_rays(rng):
    """Normal, light and sensor, both on its lit side; now and then all but grazing, or the sensor at the light."""
    normal = unit(*rng.standard_normal(3))
    rays = []
    for _ in range(2):
        aside, angle = across_ray(normal, rng), np.radians(rng.choice([rng.uniform(0, 80), 89.9]))
        rays.append(unit(*(np.cos(angle) * normal + np.sin(angle) * aside)))
    return normal, rays[0], rays[0].copy() if rng.random() < 0.1 else rays[1]


def random_material(rng):
    """Of short binary fractions, whose products are exact in floating point."""

    def between(low, high):
        return round(1024 * rng.uniform(low, high)) / 1024

    return Material(
        specular_fraction=between(0, 0.95), diffuse_reflectance=between(0.2, 1), refractive_index=between(0.3, 4),
        extinction=rng.choice([0.0, between(0, 5)]), roughness=between(0.15, 1),
    )  # fmt: skip


@pytest.mark.parametrize("n", [0.2, 0.9, 1.0001, 1.33, 1.5, 4.0])
@pytest.mark.parametrize("k", [0.0, 1e-3, 1.0, 10.0])
@pytest.mark.parametrize("degrees", [0, 1e-3, 20, 45, 56, 70, 85, 89.9])
def test_fresnel(n, k, degrees):
    """Both reflectances, and the real part of r_parallel times conjugate r_perpendicular."""
    cosine = float(mp.cos(mp.radians(mp.mpf(degrees))))
    parallel, perpendicular = textbook.amplitudes(cosine, n, k)
    exact = abs(parallel) ** 2, abs(perpendicular) ** 2, (parallel * mp.conj(perpendicular)).real
    assert np.allclose(fresnel(cosine, n, k), [float(x) for x in exact], rtol=1e-11, atol=1e-15)


@pytest.mark.parametrize("n", [1e-3, 1e-100, 1e-200])
def test_fresnel_of_next_to_no_index(n):
    """Straight on the amplitudes are opposite whatever the index, also where its square is no number any more."""
    parallel, perpendicular = textbook.amplitudes(1.0, n, 0.0)
    exact = abs(parallel) ** 2, abs(perpendicular) ** 2, (parallel * mp.conj(perpendicular)).real
    assert np.allclose(fresnel(1.0, n, 0.0), [float(x) for x in exact], rtol=1e-11)
    assert exact[2] < 0


def test_fresnel_as_printed_is_wrong():
    """Negative control: with the printed sin^2 cos^2 in rho_parallel, Brewster's angle does not extinguish."""
    angle = np.arctan(1.5)
    sine, cosine, a = np.sin(angle), np.cos(angle), np.sqrt(1.5**2 - np.sin(angle) ** 2)
    perpendicular = ((a - cosine) / (a + cosine)) ** 2
    printed = perpendicular * (a**2 - 2 * a * sine**2 / cosine + sine**2 * cosine**2) / (a + sine**2 / cosine) ** 2
    assert fresnel(cosine, 1.5, 0.0)[0] < 1e-30
    assert abs(printed) > 0.01  # margin: a hundredth, where the right one has 0


def test_matching_index_reflects_nothing():
    assert np.max(np.abs(fresnel(np.linspace(0.001, 1, 100), 1.0, 0.0))) < 1e-30


def test_grazing_reflects_everything():
    assert np.allclose(fresnel(0.0, 1.5, 0.3), [1, 1, 1])


@pytest.mark.parametrize("m", [0.01, 0.2, 1.0])
@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.3, 1.0, 1.5])
def test_beckmann(m, angle):
    a = mp.mpf(angle)
    exact = mp.exp(-((mp.tan(a) / m) ** 2)) / (m**2 * mp.cos(a) ** 4)
    assert float(beckmann(np.cos(angle), np.sin(angle) ** 2, m)) == pytest.approx(float(exact), rel=1e-9, abs=1e-300)


def test_beckmann_conserves_area():
    """The microfacets' projected area is pi in the paper's normalisation (which divides by pi in K)."""
    angle = np.linspace(0, np.pi / 2 - 1e-6, 20001)
    integrand = beckmann(np.cos(angle), np.sin(angle) ** 2, 0.3) * np.cos(angle) * np.sin(angle) * 2 * np.pi
    assert np.trapezoid(integrand, angle) == pytest.approx(np.pi, rel=1e-4)


def test_diffuse_is_cosine_and_zero_behind():
    material = Material(specular_fraction=0.1, diffuse_reflectance=0.8)
    up, light = unit(0, 0, 1), unit(1, 0, 1)
    assert material.reflected(plain(material), up, light, unit(0, 1, 2)) == pytest.approx(0.9 * 0.8 * np.sqrt(0.5))
    assert material.reflected(plain(material), up, -light, up) == 0
    assert material.reflected(plain(material), up, light, -up) == 0
    assert material.diffuse(True) == pytest.approx(0.9 * 0.4)


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
    n, light, view = unit(0, 0, 1), unit(*towards_light), unit(*towards_sensor)
    half = unit(*(light + view))
    nh, nv, nl, vh = n @ half, n @ view, n @ light, view @ half
    d = np.exp(-((np.tan(np.arccos(nh)) / 0.3) ** 2)) / (0.3**2 * nh**4)
    branches = {"1": 1.0, "view": 2 * nh * nv / vh, "light": 2 * nh * nl / vh}
    assert min(branches, key=branches.get) == smallest
    k = d * branches[smallest] / (np.pi * nl * nv)
    parallel, perpendicular = textbook_fresnel(mp.acos(float(vh)), 1.8, 2.0)
    expected = nl * (0.5 * (0.4 * k * parallel + 0.6 * 0.7) + 0.5 * (0.4 * k * perpendicular + 0.6 * 0.7))
    assert METAL.reflected(plain(METAL), n, light, view) == pytest.approx(expected, rel=1e-12)


def test_attenuation_is_one_face_on_and_falls_at_grazing_view():
    """What is left of a mirror's brightness when D, F and the cosines are taken out: 2 N.H N.V / V.H, at most 1."""
    mirror, light = GLASS.model_copy(update={"specular_fraction": 1.0, "roughness": 0.4}), unit(0, 0, 1)
    for polar in (0.0, 20.0, 75.0, 85.0):
        view = unit(np.sin(np.radians(polar)), 0, np.cos(np.radians(polar)))
        half = unit(*(light + view))
        nh, nv, vh = half[2], view[2], view @ half
        share = float(textbook.reflected_share(1.5, 0.0, textbook.exact(light), textbook.exact(view)))
        rest = float(textbook.beckmann(mp.mpf(nh), 0.4)) / (np.pi * nv) * share
        found = float(mirror.reflected(plain(mirror), light, light, view)) / rest
        assert found == pytest.approx(1.0 if polar <= 20 else 2 * nh * nv / vh, rel=1e-9)


def test_specular_stays_finite_at_grazing_view():
    material = Material(specular_fraction=1.0, refractive_index=1.5, roughness=0.2)
    n = unit(0, 0, 1)
    values = material.reflected(
        plain(material), n, unit(1, 0, 0.2),
        np.array([[-np.sqrt(1 - c * c), 0, c] for c in (1e-3, 1e-6, 1e-12)]),
    )  # fmt: skip
    assert np.isfinite(values).all()
    assert (values > 0).all()


@pytest.mark.parametrize("polarised", [False, True])
@pytest.mark.parametrize("analysed", [False, True])
def test_numpy_mpmath_and_the_textbook_agree(rng, polarised, analysed):
    """The very lines of `brightness`, run at 50 digits: numpy is within 1e-12 of them, they within 1e-40 of Jones'."""
    for _ in range(120):
        material, (normal, light, view) = random_material(rng), random_rays(rng)
        field = across_ray(light, rng) if polarised else None
        analyser = across_ray(view, rng) if analysed else None
        ours = float(material.reflected(plain(material), normal, light, view, field, analyser))
        exact_rays = [textbook.unit(textbook.exact(v)) for v in (normal, light, view)]
        axes = [
            None if axis is None else across(textbook.exact(axis), ray, MP)
            for axis, ray in ((field, exact_rays[1]), (analyser, exact_rays[2]))
        ]
        precise = material.brightness(plain(material), *exact_rays, *axes, ops=MP)
        assert abs(ours / precise - 1) < 1e-12, (material, normal, light, view)
        crossed = [
            None if axis is None else textbook.cross(ray, textbook.cross(textbook.exact(axis), ray))
            for axis, ray in ((field, exact_rays[1]), (analyser, exact_rays[2]))
        ]  # axis less its part along the ray
        assert abs(precise / textbook.brightness(material, *exact_rays, *crossed) - 1) < mp.mpf(10) ** -40


def test_the_comparison_tells_a_wrong_formula(monkeypatch):
    """Negative control: the coherent term left out, a part in 1e8 of D, or a polariser turned by 1e-9 is seen."""
    rng = np.random.default_rng(4)
    normal, light, view = unit(0, 0, 1), unit(0.5, 0.2, 1), unit(-0.4, 0.1, 1)
    field, analyser = across_ray(light, rng), across_ray(view, rng)
    exact = textbook.brightness(METAL, normal, light, view, field, analyser)

    def off(**changes):
        axes = [tuple(changes.get("field", field)), tuple(analyser)]
        value = METAL.reflected(plain(METAL), normal, light, view, *map(np.array, axes))
        return abs(float(value) / exact - 1)

    assert off() < 1e-12
    assert off(field=field + 1e-9 * np.cross(light, field)) > 1e-11
    true_fresnel, true_beckmann = module.fresnel, module.beckmann
    monkeypatch.setattr(module, "fresnel", lambda *args: (*true_fresnel(*args)[:2], 0.0))
    assert off() > 1e-4
    monkeypatch.setattr(module, "fresnel", true_fresnel)
    monkeypatch.setattr(module, "beckmann", lambda *args: (1 + 1e-8) * true_beckmann(*args))
    assert off() > 1e-11


def test_numpy_takes_tuples_and_arrays_alike(rng):
    vectors = rng.normal(size=(2, 500, 3)) * [1, 1, 0.5] + [0, 0, 1.2]
    light, sensor = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    up = (np.zeros(500), np.zeros(500), np.ones(500))
    for material in (METAL, GLASS):
        with np.errstate(all="ignore"):
            ours = material.brightness(plain(material), up, tuple(light.T), tuple(sensor.T), ops=NUMPY)
        assert (ours == material.reflected(plain(material), np.array([0, 0, 1.0]), light, sensor)).all()


def test_no_facet_is_turned_away():
    """D is exactly 0 there, and nothing is divided by a cosine of 0 on the way."""
    with np.errstate(all="raise"):
        found = beckmann(np.array([-1.0, -0.5, 0.0]), np.array([0.0, 0.75, 1.0]), 0.3)
    assert (found == 0).all()
