"""What decided a status, with its number: lengths, contrasts and angles found again from the picture itself."""

import re

import numpy as np
import pytest

import planner
from imaging.features.locator import MIN_USABLE
from imaging.geometry.projection import project
from scenes.status import allowed, corrected, unsure


def numbers(text):
    return [float(each) for each in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", re.sub(r"\b[ecv]\d+", "", text))]


def bad(scene, sensor, light, status):
    told = planner.predict(scene, sensor, light).measurands
    return next(each for each in told if each.status == status)


def length_px(scene, name, sensor):
    ends = scene.solid.vertices[list(scene.solid.edge(name).ends)]
    a, b = project(ends, np.array(sensor, float), scene.camera)
    return float(np.hypot(*(b - a)))


def test_a_short_edge_says_how_long_it_is_and_how_long_it_must_be(task1):
    """Seen from farther and farther away the edge falls below what it must be, whose length is about the same."""
    far = task1.with_(camera={**task1.camera.model_dump(), "distance": task1.camera.distance * 9})
    each = bad(far, (30, 135), (15, 315), "short")
    name = re.search(r"e\d+", each.reason)[0]
    length, least = numbers(each.reason)[:2]
    assert length == pytest.approx(length_px(far, name, (30, 135)), rel=0.01)  # margin: three digits are told
    assert length < least
    closer = task1.camera.distance * 9 * 0.9 * length / least
    nearer = task1.with_(camera={**task1.camera.model_dump(), "distance": closer})
    assert name not in planner.predict(nearer, (30, 135), (15, 315)).measurands[0].reason


def test_a_faint_edge_says_its_contrast_and_what_is_needed(task1):
    dim = task1.with_(camera={**task1.camera.model_dump(), "exposure": task1.camera.exposure / 40})
    found = planner.predict(dim, (30, 135), (15, 315))
    each = found.measurands[0]
    assert each.status == "low_contrast"
    contrast, least, times = numbers(each.reason)
    name = re.search(r"e\d+", each.reason)[0]
    assert contrast == pytest.approx(
        next(e.contrast for e in found.edges if e.name == name), rel=0.05
    )  # margin: 2 digits
    assert least == pytest.approx(5 * dim.noise.sigma, rel=0.2)  # margin: shot noise adds to it
    assert contrast < least
    assert times == 5


def test_what_is_not_seen_is_named(task1):
    each = bad(task1, (150, 40), (15, 315), "not_visible")
    assert each.reason.startswith("the camera does not see ")
    assert set(re.findall(r"e\d+", each.reason)) <= set(task1.required)


def test_a_flat_corner_says_at_which_angle_its_edges_meet(task1):
    """Of two corners the flatter one is named, with the angle between its edges' images."""
    camera = task1.camera.model_dump()
    large = {key: camera[key] * 20 for key in ("width", "height", "focal_px")}
    low = task1.with_(object={"kind": "block", "size": [12.5, 7.5, 2.5]}, camera={**camera, **large})
    sensor = (88.3, 230)
    each = bad(low, sensor, (30, 200), "ill_conditioned")
    one, other = re.findall(r"e\d+", each.reason)
    ways = []
    for name in (one, other):
        a, b = project(low.solid.vertices[list(low.solid.edge(name).ends)], np.array(sensor), low.camera)
        ways.append((b - a) / np.hypot(*(b - a)))
    angle, least = numbers(each.reason)
    # margin: two digits are told
    assert angle == pytest.approx(np.degrees(np.arcsin(abs(np.linalg.det(ways)))), rel=0.06)
    assert angle < least
    assert least == pytest.approx(np.degrees(np.arcsin(0.02)), rel=0.06)  # margin: two digits are told
    flatter = task1.with_(object={"kind": "block", "size": [12.5, 7.5, 2.5]})
    each = bad(flatter, (88.5, 230), (30, 200), "short")
    length, least, lost = numbers(each.reason)
    assert length < lost
    assert least - lost == pytest.approx(MIN_USABLE, abs=1)
    assert each.reason.endswith(f"{lost:.3g} at its ends lie too near to other edges")


def test_a_doubt_says_what_is_allowed_where_the_status_changes():
    """At the number that is told a correction is ok, just above it is not."""
    for sigma, tolerance in ((1.0, 0.0), (0.002, 0.05), (0.02, 0.05)):
        text = unsure(1.5 * allowed(sigma, tolerance), sigma, tolerance, "mm")
        least = numbers(text)[2]
        assert corrected("clutter", "clutter", 0.999 * least, sigma, tolerance) == "ok"
        assert corrected("clutter", "clutter", 1.001 * least, sigma, tolerance) == "clutter"
    assert unsure(np.inf, 1.0, 0.0, "mm") == "how large its bias is cannot be told"


def test_a_reason_belongs_to_its_status(task1):
    """Of another status than predicted nothing is said but what a correction is not sure of; ok says nothing."""
    each = planner.predict(task1, (30, 135), (15, 315)).measurands[0]
    assert (each.reason, each.why("ok"), each.why("misfit")) == ("", "", "")
    sigma = each.variance_object**0.5
    assert each.why("clutter", 3 * sigma, sigma) == unsure(3 * sigma, sigma, 0.0, "cm")
