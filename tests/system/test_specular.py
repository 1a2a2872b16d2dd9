"""The paper's reflectance inside the renderer, against the textbook and closed forms of polarisation."""

import math

import numpy as np
import pytest

from imaging.light.irradiance import bands
from render import bsdf, variant
from render.lights import lamps
from render.parts import Part
from scenes import Material, Picture
from tests import textbook
from tests.unit.test_reflectance import plain

pytestmark = pytest.mark.render
METAL = Material(specular_fraction=0.5, diffuse_reflectance=0.6, refractive_index=1.8, extinction=2.0, roughness=0.2)
GLASS = Material(specular_fraction=0.5, diffuse_reflectance=0.6, refractive_index=1.5, roughness=0.3)


def ray(polar, azimuth=0.0):
    polar, azimuth = np.radians([polar, azimuth])
    return np.array([math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)])


def variants_here():
    return sorted({variant.SCALAR, variant.choose()})


@pytest.mark.parametrize("name", variants_here())
@pytest.mark.parametrize("material", [METAL, GLASS])
def test_bsdf_is_the_papers_reflectance(name, material):
    """Light and sensor from normal to 80 degrees, in and out of the plane of incidence: 1e-4 of the value."""
    mitsuba = variant.use(name)
    import drjit as dr

    surface = bsdf.Interaction(material, plain(material), (0.0, 0.0, 100.0), sensor_angle=0.0)
    made, context = mitsuba.load_dict(bsdf.describe(mitsuba, surface)), mitsuba.BSDFContext()
    hit = dr.zeros(mitsuba.SurfaceInteraction3f)
    hit.sh_frame = mitsuba.Frame3f(mitsuba.Normal3f(0, 0, 1))
    for t in (0, 20, 40, 60, 70, 80):
        for u, phi in ((0, 0), (30, 180), (60, 90), (80, 180), (80, 175)):
            light, sensor = ray(t), ray(u, phi)
            hit.wi = mitsuba.Vector3f(*sensor.tolist())
            ours = np.array(made.eval(context, hit, mitsuba.Vector3f(*light.tolist()), True)).ravel()[0] * math.pi
            assert ours == pytest.approx(float(textbook.brightness(material, (0, 0, 1), light, sensor)), rel=1e-4)


def seen(material, light, sensor, polarisation=None, analyser=None):
    return float(material.reflected(plain(material), ray(0), light, sensor, polarisation, analyser))


def test_polarisation_in_the_plane_of_incidence():
    """Parallel light at Brewster's angle: nothing specular. J_par = J_perp = 1/2 is the mean of the two."""
    mirror = GLASS.model_copy(update={"diffuse_reflectance": 0.0})
    brewster = np.degrees(np.arctan(1.5))
    light, sensor = ray(brewster), ray(brewster, 180)
    parallel, across = np.cross([0, 1, 0], light), np.array([0, 1.0, 0])
    values = [seen(mirror, light, sensor, polarisation) for polarisation in (parallel, across)]
    assert abs(values[0]) < 1e-12 * values[1]
    assert sum(values) / 2 == pytest.approx(seen(mirror, light, sensor), rel=1e-12)


def test_two_crossed_analysers_pass_everything_together(rng):
    light, sensor = ray(35, 20), ray(50, 170)
    first = np.cross(sensor, [0, 0, 1.0])
    first /= np.linalg.norm(first)
    pair = first, np.cross(sensor, first)
    polarisation = np.cross(light, rng.normal(size=3))
    polarisation /= np.linalg.norm(polarisation)
    for material in (METAL, GLASS):
        for source in (None, polarisation):
            both = sum(seen(material, light, sensor, source, analyser) for analyser in pair)
            assert both == pytest.approx(seen(material, light, sensor, source), rel=1e-12)


def test_crossed_polarisers_leave_half_of_the_diffuse_term():
    """Face on, a mirror keeps the polarisation: the crossed analyser stops it, the parallel one passes all of it."""
    up = ray(0)
    diffuse = 0.5 * 0.6
    mirror = seen(GLASS, up, up) - diffuse
    assert seen(GLASS, up, up, np.eye(3)[0], np.eye(3)[1]) == pytest.approx(diffuse / 2, rel=1e-9)
    assert seen(GLASS, up, up, np.eye(3)[0], np.eye(3)[0]) == pytest.approx(diffuse / 2 + mirror, rel=1e-9)


def test_the_spectrum_weighs_the_indices(task1):
    material = GLASS.model_copy(update={"index_table": ((450.0, 1.52, 0.0), (650.0, 1.48, 0.0))})
    light = task1.light.model_copy(update={"spectrum": ((450.0, 1.0), (650.0, 3.0))})
    index = bands(task1.model_copy(update={"material": material, "light": light}))
    assert [i.share for i in index] == [0.25, 0.75]
    assert [i.n for i in index] == [1.52, 1.48]


def test_polarised_light_is_known_by_the_size_it_is_simulated_with(task1):
    """A lamp of radius 0.4 cm at 100 cm spans 8 mrad, and nothing where its size is not simulated."""

    def angle(radius, *effects):
        light = task1.light.model_copy(update={"radius": radius, "polarisation_deg": 20.0})
        picture = Picture.of(task1.model_copy(update={"light": light}), (30, 135), (15, 315))
        part = Part(picture, frozenset()).reduced(frozenset({"polarisation", *effects}))
        (lamp,) = lamps(part.picture, part.active)
        return lamp.angle

    assert angle(0.4, "light_size") == pytest.approx(0.008)
    assert angle(0.4) == angle(0.0, "light_size") == 0.0
