"""The BSDF with a texture and without a lobe, against what it says; the defaults of a plain material."""

import math

import numpy as np
import pytest

from render import bsdf, variant
from render.texture import Face
from scenes import Material
from scenes.materials.brdf import Brdf, Index

GLOSSY = Material(specular_fraction=0.3, diffuse_reflectance=0.8, refractive_index=1.6, extinction=0.7, roughness=0.3)


class Plain(Brdf):
    """A material that says no more than it must."""

    kind: str = "plain"

    @property
    def lambertian(self) -> float:
        return 0.7


def test_a_material_that_says_no_more_has_no_lobe():
    plain = Plain()
    assert plain.is_diffuse
    assert (plain.lobe_reflectance, plain.lobe_slope, plain.dispersion) == (0.0, 1.0, ())
    assert plain.matt() is plain.with_dispersion(((500.0, 1.5, 0.0),)) is plain
    assert plain.indices() == (Index(1.0, 0.0, 1.0),)
    assert (plain.diffuse(), plain.diffuse(True)) == (0.7, 0.35)
    up, light, sensor = np.array([0, 0, 1.0]), np.array([0.6, 0, 0.8]), np.array([0, -0.8, 0.6])
    assert plain.reflected((), up, light, sensor) == pytest.approx(0.7 * 0.8)
    assert plain.reflected((), up, light * [1, 1, -1], sensor) == plain.reflected((), up, light, -sensor) == 0


@pytest.mark.parametrize("analyser", [None, (0.8, 0.6, 0.0)])
@pytest.mark.parametrize(
    ("light", "sensor"), [((0.6, 0.0, 0.8), (0.0, 0.28, 0.96)), ((0.0, -0.8, 0.6), (0.48, 0.6, 0.64))]
)
def test_a_texture_s_factor_is_of_the_matt_part_alone(analyser, light, sensor):
    """By the cosine of the light; the sensor, which stands that way, looks through its analyser."""
    mitsuba = variant.use(variant.SCALAR)
    import drjit as dr

    known = (Index(GLOSSY.refractive_index, GLOSSY.extinction),)
    place = tuple(100 * x for x in sensor)
    table = Face(np.zeros((0, 3, 3)), np.zeros((0, 3, 2)), np.full((2, 2), 1.4))
    values = []
    for texture in (None, table):
        surface = bsdf.Interaction(GLOSSY, known, place, sensor_angle=0.01, analyser=analyser, texture=texture)
        made = mitsuba.load_dict(bsdf.describe(mitsuba, surface))
        hit = dr.zeros(mitsuba.SurfaceInteraction3f)
        hit.sh_frame, hit.uv = mitsuba.Frame3f(mitsuba.Normal3f(0, 0, 1)), mitsuba.Point2f(0.3, 0.7)
        hit.wi = mitsuba.Vector3f(*sensor)
        there = made.eval(mitsuba.BSDFContext(), hit, mitsuba.Vector3f(*light), True)
        values.append(float(np.array(there).ravel()[0]) * math.pi)
        assert not np.array(made.eval(mitsuba.BSDFContext(), hit, mitsuba.Vector3f(*light[:2], -light[2]), True)).any()
        hit.wi = mitsuba.Vector3f(*sensor[:2], -0.5 * sensor[2])  # nor is it seen from behind
        assert not np.array(made.eval(mitsuba.BSDFContext(), hit, mitsuba.Vector3f(*light), True)).any()
    up = np.array([0, 0, 1.0])
    axis = None if analyser is None else np.array(analyser)
    exact = float(GLOSSY.reflected(known, up, np.array(light), np.array(sensor), analyser=axis))
    assert values[0] == pytest.approx(exact, rel=1e-4)
    assert values[1] - values[0] == pytest.approx(0.4 * GLOSSY.diffuse(analyser is not None) * light[2], rel=1e-3)
