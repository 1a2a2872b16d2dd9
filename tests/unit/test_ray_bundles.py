"""Rays that run one way skip triangles that none of them comes near: what each meets first stays the same."""

import numpy as np
import pytest

import scenes
from imaging.geometry import rays as rays_module
from imaging.geometry.rays import _first, _may_meet, _plates, first_face


def rays(kind, solid, rng, count):
    """Rays from one place to a rim, of one direction, towards one place, or every way."""
    inside = rng.uniform(-5, 65, (count, 3))
    if kind == "rim":
        circle, angle = solid.circles[0], rng.uniform(0, 2 * np.pi, count)
        origin = np.array([30.0, 20.0, 6.0]) + 300 * rng.standard_normal(3)
        place = circle.centre + 1.01 * circle.radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
        return np.broadcast_to(origin, (count, 3)), place - origin
    if kind == "parallel":
        return inside, rng.standard_normal(3) + 0.05 * rng.standard_normal((count, 3))
    return inside, (rng.uniform(0, 60, 3) - inside if kind == "towards" else rng.standard_normal((count, 3)))


@pytest.mark.parametrize("kind", ["rim", "parallel", "towards", "every way"])
def test_the_same_is_met(kind, rng):
    solid = scenes.load("bracket_mm").solid
    plates, left, met = _plates(solid), 0, 0
    for count in (1, 7, 300, 1100):
        origins, vectors = rays(kind, solid, rng, count)
        face, t = first_face(solid, origins, vectors, ())
        whole = _first(plates, origins, vectors)
        assert (face == whole[0]).all()
        assert t == pytest.approx(whole[1], rel=1e-12)
        met += (face >= 0).sum()
        left += _may_meet(plates, origins, vectors).sum()
    assert met > 10
    if kind == "rim":
        assert left < 0.5 * 4 * len(plates.faces)


@pytest.mark.parametrize("kind", ["rim", "parallel", "towards", "every way"])
def test_many_triangles_are_met_in_small_bundles(kind, rng, monkeypatch):
    """As if the bracket had thousands: rays from several places in any order, sorted, and back in their order."""
    monkeypatch.setattr(rays_module, "_MANY", 100)
    solid = scenes.load("bracket_mm").solid
    parts = [rays(kind, solid, rng, count) for count in (1, 20, 300, 900)]
    order = rng.permutation(1221)
    origins, vectors = (np.concatenate(each)[order] for each in zip(*parts, strict=True))
    vectors[0] = np.nan
    face, t = first_face(solid, origins, vectors, ())
    with np.errstate(invalid="ignore"):
        whole = _first(_plates(solid), origins, vectors)
    assert (face == whole[0]).all()
    assert t == pytest.approx(whole[1], rel=1e-12)
    assert (face >= 0).sum() > 10
