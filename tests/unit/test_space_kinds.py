"""Heights, and angles between faces: values, derivatives, and what one picture says of them."""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging.blurred.whole import image
from imaging.bundles.bundle import Bundle
from imaging.bundles.unknowns import Freedom
from scenes import InvalidInput, Picture
from tests import placements as parts

LIGHT = (22.0, 60.0)


def corner(vertex, *edges):
    return {"vertex": vertex, "edges": list(edges)}


@pytest.fixture(scope="module")
def wedge(tmp_path_factory):
    """A wedge of 14 mm whose slope falls by 14 mm over 10 mm: the angle between slope and top, a corner's height."""
    made = parts.scene(
        tmp_path_factory.mktemp("kinds"), "wedge", placement={"from": "known", "datums": [], "datum_sd": None}
    )
    solid = made.solid
    at = {tuple(np.round(place)): name for name, place in zip(solid.vertex_names, solid.vertices, strict=True)}
    by_ends = {frozenset(solid.vertex_names[end] for end in edge.ends): edge.name for edge in solid.sharp}

    def edge(one, other):
        return by_ends[frozenset((at[one], at[other]))]

    top = [(-24, -16, 14), (24, -16, 14), (24, 6, 14), (-24, 6, 14)]
    foot = [(-24, 16, 0), (24, 16, 0)]
    rows = [*zip(top, top[1:] + top[:1], strict=True)]
    names = {place: [edge(*row) for row in rows if place in row] for place in top}
    slope = [edge(top[2], foot[1]), edge(top[3], foot[0])]
    low = corner(at[foot[1]], slope[0], edge(foot[1], foot[0]))
    features = [low, *(corner(at[place], *names[place]) for place in top[:3])]
    asked = [
        {"name": "drop", "kind": "height", "features": features, "tolerance": 0.05},
        {"name": "slope", "kind": "face_angle", "tolerance": 0.1,
         "features": [{"edge": each} for each in (*slope, edge(*rows[0]), edge(*rows[1]))]},
    ]  # fmt: skip
    return made.with_(measurands=asked, uncertainty={"part_shift": None, "part_tilt_deg": None})


def test_values_and_derivatives(wedge):
    """By the part's own corners; central differences of both by every coordinate."""
    tri = [Picture.of(wedge, sensor, LIGHT) for sensor in ((35.0, 60.0), (35.0, 120.0))]
    bundle = Bundle.of(tri, Freedom("known"))
    values, gradient = bundle.nominal
    np.testing.assert_allclose(values, [14.0, 180 - np.degrees(np.arctan2(14, 10))], rtol=1e-6)
    for k in range(bundle.unknowns.count):
        step = 1e-4 * np.eye(bundle.unknowns.count)[k]
        ahead, behind = (bundle.at(sign * step).evaluated(bundle.quantities)[0] for sign in (1, -1))
        np.testing.assert_allclose(gradient[:, k], (ahead - behind) / 2e-4, rtol=1e-6, atol=1e-8)


def test_one_picture_does_not_tell_them(wedge):
    picture = Picture.of(wedge, (35.0, 60.0), LIGHT)
    told = planner.predict(picture).measurands
    assert [each.status for each in told] == ["ambiguous", "ambiguous"]
    assert told[0].reason == "a height needs at least 2 pictures that are adjusted together"
    assert [each.variance_object for each in told] == [np.inf, np.inf]
    found = measure.measure(image(picture), picture, estimator="gradient")
    assert set(found.status) == {"ambiguous"}
    assert np.isnan(found.value).all()
    np.testing.assert_allclose(found.nominal, [14.0, 180 - np.degrees(np.arctan2(14, 10))], rtol=1e-6)


def test_two_pictures_do(wedge):
    """Sets of noisy images, 12 of noisy images: inside 4 times chance of what each tells."""
    tri, rng, count = [Picture.of(wedge, s, LIGHT) for s in ((35.0, 60.0), (35.0, 120.0))], np.random.default_rng(8), 12
    shots = [(render.expose(image(each), wedge.noise, rng, count), each) for each in tri]
    found = measure.bundle(shots, "known")
    assert (found.status == "ok").all(), found.reason
    ratio = found.value.var(0, ddof=1) / (found.sigma**2).mean(0)
    assert (np.abs(ratio - 1) < 4 * np.sqrt(2 / count)).all(), ratio
    assert (np.abs(found.value.mean(0) - found.nominal) < 5 * found.sigma.mean(0) / np.sqrt(count)).all()


def test_no_chain_is_made_of_them(wedge):
    asked = wedge.model_dump(by_alias=True, mode="json", include={"measurands"})["measurands"]
    with pytest.raises(InvalidInput, match="of must be numbers that one picture tells, got drop, slope"):
        wedge.with_(measurands=[*asked, {"name": "all", "kind": "mean", "of": ["drop", "slope"]}])


@pytest.mark.parametrize(
    ("kind", "features", "says"),
    [
        ("height", [{"circle": "c2"}, {"circle": "c4"}], "features must be a corner or a circle, then at least three"),
        ("height", [{"circle": "c2"}, {"circle": "c4"}, {"edge": "e10"}, {"circle": "c1"}], "must be a corner or"),
        ("face_angle", [{"edge": "e10"}, {"edge": "e15"}], "features must be an edge, then an edge, then an edge"),
        ("face_angle", [{"edge": e} for e in ("e10", "e16", "e12", "e14")], "two edges of a face, then two of another"),
        ("face_angle", [{"edge": e} for e in ("e10", "e15", "e13", "e17")], "two faces that are not parallel"),
    ],
)  # fmt: skip
def test_what_makes_none_is_told_in_a_line(kind, features, says):
    with pytest.raises(InvalidInput, match=says):
        scenes.load("bracket_station").with_(measurands=[{"name": "it", "kind": kind, "features": features}])
