"""Polarised and spectral light against 50-digit textbook formulas, over random inputs with the hard corners."""

import numpy as np
import pytest

import planner
import scenes
from imaging.light.appearance import is_separable, signal
from imaging.light.irradiance import bands, electric_field
from imaging.pictures import Pictures
from scenes import Material
from scenes.materials.brdf import Index
from scenes.materials.torrance_sparrow import beckmann, fresnel
from tests import textbook
from tests.textbook import mp
from tests.unit.test_reflectance import plain, textbook_fresnel, unit


def hard_cosines(rng, count):
    """Uniform, near grazing, near normal, and exactly normal."""
    kinds = [rng.random(count), 10 ** rng.uniform(-12, 0, count), 1 - 10 ** rng.uniform(-16, 0, count), np.ones(count)]
    return np.choose(rng.integers(4, size=count), kinds)


def agrees(ours, exact, *, relative=1e-12, absolute=1e-16):
    """Absolute: of a quantity of size 1 near its own zero (Brewster's angle), where no input has more digits."""
    return abs(mp.mpf(float(ours)) - exact) <= max(relative * abs(exact), absolute)


def test_fresnel_to_1e_12(rng):
    count = 1500
    cosines = hard_cosines(rng, count)
    ns = np.choose(
        rng.integers(3, size=count), [np.ones(count), 1 + 10 ** rng.uniform(-12, 0, count), rng.uniform(1, 4, count)]
    )
    ks = np.choose(
        rng.integers(3, size=count), [np.zeros(count), np.full(count, 10.0), 10 ** rng.uniform(-8, 1, count)]
    )
    for cosine, n, k in zip(cosines, ns, ks, strict=True):
        exact = [abs(part) ** 2 for part in textbook.amplitudes(float(cosine), float(n), float(k))]
        ours = fresnel(float(cosine), float(n), float(k))
        assert agrees(ours[0], exact[0]), (cosine, n, k)
        assert agrees(ours[1], exact[1]), (cosine, n, k)


def test_beckmann_to_1e_12(rng):
    count = 800
    cosines, roughness = hard_cosines(rng, count), 10 ** rng.uniform(-2, 0, count)
    for cosine, m in zip(cosines, roughness, strict=True):
        sine2 = float((1 - cosine) * (1 + cosine))
        c, s2 = mp.mpf(float(cosine)), mp.mpf(sine2)
        exact = mp.exp(-s2 / (m * c) ** 2) / (mp.mpf(m) ** 2 * c**4)
        assert agrees(beckmann(float(cosine), sine2, m), exact, absolute=1e-300), (cosine, m)


def test_attenuation_to_1e_12(rng):
    """Pure gloss at any pair of angles, grazing ones too: the whole brightness is D G F / (pi N.V), to 1e-12 of it."""
    mirror = Material(specular_fraction=1.0, refractive_index=1.5, roughness=0.7)
    for cosines in hard_cosines(rng, 2 * 300).reshape(-1, 2):
        turn = rng.uniform(0, 2 * np.pi, 2)
        sines = np.sqrt((1 - cosines) * (1 + cosines))
        light, view = (unit(s * np.cos(a), s * np.sin(a), c) for c, s, a in zip(cosines, sines, turn, strict=True))
        exact = textbook.brightness(mirror, (0, 0, 1), light, view)
        steep = 1 / (light + view)[2] ** 2 * ((light + view) ** 2).sum()  # a rounding of D's exponent counts for more
        ours = mirror.reflected(plain(mirror), unit(0, 0, 1), light, view)
        assert agrees(ours, exact, relative=1e-12 * max(steep, 1), absolute=1e-300), (light, view)


def test_share_of_polarised_light():
    """Field across the plane of incidence: all perpendicular; within it: none; 45 degrees and unpolarised: half."""
    mirror = Material(specular_fraction=1.0, refractive_index=1.5, extinction=0.3, roughness=0.5)
    light, view, normal = unit(0.3, 0.2, 1.0), unit(-0.5, 0.1, 1.0), unit(0, 0, 1)
    across = unit(*np.cross(light, view))
    within = np.cross(across, light)
    angle = mp.acos(textbook.dot(textbook.exact(light), textbook.unit(textbook.exact(light + view))))
    parallel, perpendicular = textbook_fresnel(angle, 1.5, 0.3)
    plain_value = mirror.reflected(plain(mirror), normal, light, view)
    whole = plain_value / ((parallel + perpendicular) / 2)

    def share(field):
        return (mirror.reflected(plain(mirror), normal, light, view, field) / whole - parallel) / (
            perpendicular - parallel
        )

    assert share(across) == pytest.approx(1, abs=1e-13)
    assert share(within) == pytest.approx(0, abs=1e-13)
    assert share(across + within) == pytest.approx(0.5)
    back = [float(mirror.reflected(plain(mirror), normal, light, light, field)) for field in (across, within, None)]
    assert back == pytest.approx([back[2]] * 3)  # light = view direction: no plane of incidence


@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0])
def test_polarised_level_against_the_textbook(angle):
    """A mirror-like setting: the specular part is proportional to rho_par J_par + rho_perp J_perp."""
    glass = Material(specular_fraction=1.0, refractive_index=1.5, roughness=0.1)
    at = 100 * unit(np.sin(0.9), 0, np.cos(0.9))
    light, view, normal = unit(*at), unit(-np.sin(0.9), 0, np.cos(0.9)), unit(0, 0, 1)
    polarised = glass.reflected(plain(glass), normal, light, view, electric_field(at, angle))
    unpolarised = glass.reflected(plain(glass), normal, light, view)
    parallel, perpendicular = textbook_fresnel(mp.mpf(0.9), 1.5, 0)
    share = np.sin(np.radians(angle)) ** 2  # at 0 the field lies in the vertical plane, which is the plane of incidence
    expected = (parallel * (1 - share) + perpendicular * share) / ((parallel + perpendicular) / 2)
    assert polarised / unpolarised == pytest.approx(expected, rel=1e-12)


def test_polarisation_leaves_a_diffuse_surface_alone(task1):
    lit = task1.model_copy(update={"light": scenes.Light(distance=100, polarisation_deg=20)})
    ours, theirs = (planner.predict(s, (30, 135), (15, 315)).variance_px2 for s in (lit, task1))
    assert ours == theirs


TABLE = ((450.0, 1.2, 2.5), (550.0, 0.4, 2.4), (650.0, 0.2, 3.4))


@pytest.fixture(scope="module")
def metal(task1):
    material = Material(specular_fraction=0.5, diffuse_reflectance=0.4, roughness=0.3, index_table=TABLE)
    camera = task1.camera.model_copy(update={
        "responsivity": ((400, 0.2), (700, 1.0)), "transmission": ((400, 0.9), (700, 0.8))
    })  # fmt: skip
    light = scenes.Light(distance=100, spectrum=((400, 1.0), (700, 2.0)))
    return task1.model_copy(update={"material": material, "camera": camera, "light": light})


def test_spectral_sum(metal):
    """Shares are C S Q by the trapezium rule, and the level is the sum of the bands' levels."""
    curve = [np.interp(450 + 100 * i, [400, 700], ends) for i in range(3) for ends in ((0.2, 1), (0.9, 0.8), (1, 2))]
    weight = np.prod(np.reshape(curve, (3, 3)), axis=1) * [50, 100, 50]
    found = bands(metal)
    assert [band.share for band in found] == pytest.approx(weight / weight.sum())
    pictures = Pictures.of(metal, (30, 190), (20, 0))
    points = np.array([[6.0, 3.0, 2.5]])
    to_light, to_sensor = (at - points[0] for at in (pictures.lights_at[0], pictures.sensor_at))
    parts = [
        metal.material.reflected((Index(*row[1:]),), unit(0, 0, 1), unit(*to_light), unit(*to_sensor)) for row in TABLE
    ]
    near = metal.camera.exposure * 100**2 / (to_light @ to_light)
    together = signal(pictures, points, np.array([0.0, 0, 1]), 1)
    assert together == pytest.approx(near * weight @ parts / weight.sum(), rel=1e-12)


def test_a_flat_table_changes_nothing(metal):
    same = metal.material.model_copy(update={"index_table": tuple((nm, 1.5, 0.3) for nm in (450.0, 550.0, 650.0))})
    single = same.model_copy(update={"index_table": (), "refractive_index": 1.5, "extinction": 0.3})
    values = [
        planner.predict(metal.model_copy(update={"material": m}), (30, 135), (15, 315)).variance_px2
        for m in (same, single)
    ]
    assert values[0] == pytest.approx(values[1], rel=1e-12)


def test_a_table_must_rise():
    with pytest.raises(ValueError, match=r"material\.index_table must be rows of rising wavelength"):
        Material(index_table=((500, 1, 0), (400, 1, 0)))


@pytest.mark.parametrize("name", ["task1", "glossy", "wedge", "bracket"])
def test_whole_viewing_space_without_nan_or_warning(name, task1, metal):
    """Warnings are errors here; every pose gives a positive number or infinity, with a reason."""
    scene = {"task1": task1, "glossy": metal}.get(name) or scenes.load(name)
    if name == "glossy":
        scene = scene.model_copy(update={"light": scenes.Light(distance=100, polarisation_deg=30)})
    for model in ("paper", "calibrated", "bound"):
        space = planner.ViewingSpace(4 if is_separable(scene) and model != "bound" else 15)
        for objective in ("image", "object"):
            for fixed in ({"sensor": (90, 90)}, {"light": (15, 315)}):
                values = planner.variance_map(scene, **fixed, space=space, model=model, objective=objective)
                assert not np.isnan(values).any()
                assert (values > 0).all()
    hidden = np.flatnonzero(np.isinf(values))[:20]
    for pose in space.poses[hidden].tolist():
        assert planner.predict(scene, pose, (15, 315)).status != "ok"
