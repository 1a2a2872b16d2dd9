"""Light and shadow on turned parts: against integrals, conservation and rays."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import dblquad

import scenes
from imaging.features.limb_lent import unlent
from imaging.features.limb_outline import limb_outline
from imaging.geometry.rays import first_face
from imaging.light import revolved
from imaging.light.revolved import light_around, passes, rings_of
from imaging.pictures import Pictures
from scenes import Turned
from scenes.parts.surfaces import axes_beside
from tests.curved import area_points

STEP = Turned(kind="turned", profile=[(0.0, 6.0), (20.0, 6.0), (20.0, 10.0), (30.0, 10.0)]).solid
CONES = Turned(kind="turned", profile=[(-9.0, 3.0), (-2.0, 5.0), (-2.0, 6.5), (3.0, 4.0), (8.0, 7.0)]).solid


def seen_from(part: Turned, sensor, light, reflectance: float) -> Pictures:
    """A turned part under a point of light far away."""
    data = scenes.load("shaft").model_dump(mode="json", exclude_defaults=True)
    data["measurands"] = [{"name": "d", "kind": "diameter", "features": [{"surface": "d1"}]}]
    data |= {"object": part.model_dump(mode="json"), "material": {"diffuse_reflectance": reflectance}}
    data |= {"light": {"distance": 1e5}, "settings": []}
    scene = scenes.Scene.model_validate(data)
    return Pictures.of(scenes.Picture.of(scene, sensor, light))


def factor(away: float, inner: float, outer: float) -> float:
    """Of a shoulder for a place on the wall before it, by integration over the shoulder."""

    def share(angle, r):
        over = r * np.cos(angle) - inner
        return max(over, 0.0) * away * r / (away**2 + r**2 + inner**2 - 2 * r * inner * np.cos(angle)) ** 2 / np.pi

    half = np.arccos(inner / outer)
    return dblquad(share, inner, outer, -half, half, epsabs=1e-7)[0]


@pytest.mark.parametrize("away", [1.0, 4.0])
def test_a_lit_shoulder_lights_the_wall_before_it(away):
    """Lit along the axis, which leaves the wall dark: single reflection, for the second is 1e-3 of it at most."""
    part = Turned(kind="turned", axis="z", profile=[(0.0, 6.0), (20.0, 6.0), (20.0, 10.0), (30.0, 10.0)])
    pictures = seen_from(part, (90.0, 0.0), (180.0, 0.0), 0.01)
    angle = np.array([0.3, 2.0, 4.5])
    place = np.stack([6 * np.cos(angle), 6 * np.sin(angle), np.full(3, 20 - away)], -1)
    found = light_around(pictures, pictures.scene.solid.round("d1"), place)
    lit = pictures.scene.camera.exposure * 0.01
    np.testing.assert_allclose(found / lit, 0.01 * factor(away, 6.0, 10.0), rtol=0.1)  # rings of finite width


def test_what_leaves_one_ring_arrives_elsewhere():
    """Form factors are reciprocal, and of no ring do they sum up to more than 1."""
    rings = rings_of(STEP)
    whole = np.fft.irfft(revolved._factors(rings), 64, axis=-1).sum(-1)
    assert (whole >= -1e-12).all()
    assert whole.sum(1).max() <= 1 + 1e-9  # margin: reciprocity, by its kind
    assert whole.sum(1).max() > 0.3  # margin: rings do see each other
    apart = np.abs(rings.z[:, None] - rings.z) > 1.0
    both = rings.area[:, None] * whole
    np.testing.assert_allclose(np.where(apart, both, 0), np.where(apart, both.T, 0), atol=1e-3 * both.max())


@pytest.mark.parametrize("solid", [STEP, CONES], ids=["step", "cones"])
def test_shadows_are_those_of_rays(solid):
    """Of 300 places and lights; but for those within a facet's depth of a border."""
    rng, rings = np.random.default_rng(2), rings_of(solid)
    curved = [solid.curved[i] for i in rng.integers(len(solid.curved), size=300)]
    u, v = rng.random((2, 300))
    place = np.array([area_points(c.surface, a, b) for c, a, b in zip(curved, u, v, strict=True)])
    normal = np.array([c.surface.normals(p) for c, p in zip(curved, place, strict=True)])
    way = rng.normal(size=place.shape)
    way *= 200 * np.sign((way * normal).sum(1, keepdims=True)) / np.linalg.norm(way, axis=1, keepdims=True)
    free = passes(rings, place, place + way)
    rays = [
        first_face(solid, (p + w)[None], -w[None], c.faces)[1][0] for p, w, c in zip(place, way, curved, strict=True)
    ]
    traced = np.array(rays) > 1 - 1e-6
    assert (free == traced).mean() > 0.98  # margin: a share, which is 1 at most
    assert not traced.all()


@pytest.mark.parametrize(("off", "turned"), [(4e-6, True), (4e-4, False)])
def test_an_axis_that_rounding_moved_is_the_same(off, turned):
    """Walls of a part 30 long, one axis off by a ten millionth of it, or by a hundred thousandth."""
    one, other = STEP.curved
    surface = dataclasses.replace(other.surface, point=other.surface.point + off * axes_beside(other.surface.axis)[0])
    moved = dataclasses.replace(STEP, curved=(one, dataclasses.replace(other, surface=surface)))
    assert revolved._is_turned(moved) == turned


def test_other_parts_have_no_rings():
    assert rings_of(scenes.load("ball").solid) is None
    assert rings_of(scenes.load("bracket").solid) is None


@pytest.mark.parametrize(("reflectance", "clear"), [(0.0, True), (0.004, True), (0.4, False)])
def test_a_bright_floor_is_told(reflectance, clear):
    """It lights the limb from below by what nobody knows; seen from 60 degrees part of the limb faces downwards."""
    data = scenes.load("ball").model_dump(mode="json", exclude_defaults=True) | {"floor": {"reflectance": reflectance}}
    scene = scenes.Scene.model_validate(data)
    pictures = Pictures.of(scenes.Picture.of(scene, (60, 30), (40, 60)))
    outline = limb_outline(scene.solid.round("ball"), pictures.sensors, scene.camera)
    assert unlent(pictures, outline).all() == clear


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_rings_are_those_of_the_part_in_any_unit(unit):
    """Walls and a shoulder of a hundredth between two of them, as many and so many times as large."""
    profile = [(0.1, 6.0), (20.3, 6.0), (20.3, 6.01), (30.7, 6.01), (33.0, 4.0)]
    one, other = (
        rings_of(Turned(kind="turned", profile=[(u * z, u * r) for z, r in profile]).solid) for u in (1, unit)
    )
    assert other.profile == pytest.approx(unit * one.profile)
    assert other.of_wall == one.of_wall
    assert len(one.own) == 3 * revolved._ON_WALL + revolved._ON_SHOULDER == len(other.own)
    assert other.own == one.own
