"""Limbs of quadrics of random coefficients: no NaN, no wrong side, whatever their rank."""

import numpy as np

from imaging.contours import limb
from imaging.geometry.projection import sensor_position
from scenes.parts.surfaces import Quadric
from tests.conics import image_conic
from tests.unit.test_limbs import CAMERA, lines


def test_random_quadrics():
    """1000 of random coefficients, some of rank 3, 2 and 1, some nearly plane: no NaN, no wrong side, at any status."""
    rng = np.random.default_rng(19)
    pose, statuses, checked = (35.0, 20.0), {}, 0
    eye = sensor_position(CAMERA, np.array(pose))
    for k in range(1000):
        quadric = _random(rng, k, eye)
        found = limb(quadric, pose, CAMERA, 12)
        statuses[found.status] = statuses.get(found.status, 0) + 1
        assert (found.status == "ok") == bool(found.strands)
        for strand in found.strands:
            for numbers in (strand.at, strand.outward, strand.design, strand.eye_design, strand.arc, strand.curvature):
                assert np.isfinite(numbers).all()
            near = (np.abs(strand.at).max(1) < 1000) & (strand.magnification * np.abs(strand.points - eye).max(1) < 1e7)
            conic = image_conic(quadric, pose, CAMERA)
            for side, met in ((-1, True), (1, False)):
                start, way = lines(strand.at + side * 0.01 * strand.outward, pose)
                t = quadric.intersections(start, way)
                hits = (np.isfinite(t) & (t > 0)).any(1)
                assert (hits == met)[near].all(), (k, found.status)
                place = np.column_stack([strand.at + side * 0.01 * strand.outward, np.ones(len(strand.at))])
                assert not strand.closed or ((((place @ conic) * place).sum(1) > 0) == met)[near].all()
            checked += near.sum()
    assert checked > 1500
    assert set(statuses) >= {"ok", "inside", "degenerate", "none"}


def _random(rng: np.random.Generator, k: int, eye: np.ndarray) -> Quadric:
    """The kinds turn by turn: any, of lower rank, nearly plane, with the eye nearly on it."""
    form, linear, constant = rng.normal(size=(3, 3)), rng.normal(size=3), rng.normal()
    form = form + form.T
    if k % 5 == 1:
        way = rng.normal(size=3)
        form = np.outer(way, way) * rng.choice([-1, 1])
    if k % 5 == 2:
        way = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        form = way @ np.diag([1.0, rng.uniform(0.2, 2), rng.choice([0.0, 1e-9, -1e-9])]) @ way.T
        linear, constant = form @ rng.normal(size=3), -rng.uniform(0.5, 4)
    if k % 5 == 3:
        form = form * 10.0 ** rng.uniform(-12, -2)
    if k % 10 == 4:
        constant -= Quadric(form, linear, constant).function(eye) * (1 - rng.choice([0.0, 1e-14, 1e-9, 1e-6]))
    if k % 50 == 0:
        one, two = rng.normal(size=(2, 4))
        form, linear = np.outer(one[:3], two[:3]), one[3] * two[:3] + two[3] * one[:3]
        form, constant = (form + form.T) / 2, one[3] * two[3]
    return Quadric(form, linear, constant)
