"""Forms: laws of zones against plain draws, what noise adds, and decisions that are right whatever the form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.ndimage import map_coordinates

import measure
import planner
import scenes
from imaging.features.locator import correlation
from imaging.features.measurand import measurands
from imaging.models.form_law import FormLaw, every, form_law
from imaging.pictures import Pictures
from measure.features.forms import FoundForm
from measure.features.layout import layout_of
from planner.uncertainty.forms import FormSize
from scenes import InvalidInput, Picture
from scenes.measurands.form import forms_of
from tests import toleranced
from validation.inspection import inspect

POINTS, SIGMA = 60, 0.01
STATED = stats.norm.sf(2)
AT = np.linspace(0, 1, POINTS)
LINE = np.stack([np.ones(POINTS), AT], -1)
ROUND = np.stack([np.ones(POINTS), np.cos(2 * np.pi * AT), np.sin(2 * np.pi * AT)], -1)
POSE = (30, 135), (15, 315)


def _law(reference="line", design=LINE, spacing=2.0):
    errors = SIGMA**2 * correlation(spacing * np.abs(np.subtract.outer(np.arange(POINTS), np.arange(POINTS))), 1.0)
    return FormLaw.beside(errors, design, reference, AT)


def _noise(law, count, seed):
    """Errors of points, drawn otherwise than the law draws them."""
    squares, axes = np.linalg.eigh(law.covariance)
    draws = np.random.default_rng(seed).standard_normal((count, POINTS))
    return draws @ (axes * np.sqrt(np.maximum(squares, 0.0))).T


FORMS = {
    "none": np.zeros(POINTS),
    "a bow": 5 * SIGMA * (AT - 0.5) ** 2 * 4,
    "waves": 3 * SIGMA * np.sin(7 * np.pi * AT),
    "a nick": 6 * SIGMA * (np.abs(AT - 0.4) < 0.01),
    "a small nick": 2 * SIGMA * (np.abs(AT - 0.4) < 0.01),
    "a step": 4 * SIGMA * (AT > 0.7),
    "rough": 2 * SIGMA * np.random.default_rng(5).standard_normal(POINTS),
}


def _left(law, form):
    design = {"line": LINE, "circle": ROUND}.get(law.reference)
    return form if design is None else form - design @ np.linalg.lstsq(design, form, rcond=None)[0]


@pytest.mark.parametrize("reference", ["line", "circle", "nominal"])
@pytest.mark.parametrize("name", ["none", "waves", "a nick"])
def test_a_law_is_that_of_plain_draws(reference, name):
    """Mean and 95 % quantile of 20000; the mean of independent points, and that without noise, are others."""
    law = _law(reference, {"circle": ROUND}.get(reference, LINE), spacing=0.8)
    form = _left(law, FORMS[name])
    numbers = form + _noise(law, 20_000, 1)
    zones = 2 * np.abs(numbers).max(1) if reference == "nominal" else np.ptp(numbers, axis=1)
    told = law.of(form)
    limit = 4 * told.u / np.sqrt(len(zones)) + 2 * told.u / np.sqrt(len(told.draws))
    assert zones.mean() == pytest.approx(told.mean, abs=limit)
    assert zones.std() == pytest.approx(told.u, rel=4 / np.sqrt(2 * len(zones)) + 0.01)
    assert stats.binomtest(int((zones > told.quantile(0.95)).sum()), len(zones), 0.05).pvalue > 1e-3
    assert name == "a nick" or told.mean - law.extreme(form) > 4 * limit  # of a lone point noise adds nothing
    apart = replace(law, covariance=np.diag(np.diag(law.covariance))).of(form)
    assert name != "none" or abs(apart.mean - zones.mean()) > limit  # of independent points


@pytest.mark.parametrize("name", FORMS)
def test_wrong_decisions_are_no_more_than_stated(name):
    """A part whose zone is just the limit: accepted, or refused, in 2.3 % at most, whatever its form."""
    law = _law()
    form = _left(law, FORMS[name])
    limit, count = float(np.ptp(form)), 1000
    sizes = [FormSize(0.0, 0.0, float(np.ptp(form + n)), law) for n in _noise(law, count, 2)]
    decided = [size.decide(limit) for size in sizes]
    most = stats.binom.isf(1e-3, count, STATED)
    assert decided.count("fail") <= most
    assert name == "none" or decided.count("pass") <= most
    covered = np.mean([size.interval()[0] <= limit <= size.interval()[1] for size in sizes])
    assert covered >= stats.binom.isf(1 - 1e-3, count, 0.95) / count


def test_a_normal_law_of_the_value_accepts_small_nicks():
    """Negative control: by the value and two standard deviations a nick that hides in noise is accepted too often."""
    law, form = _law(), _left(_law(), FORMS["a small nick"])
    found = [FoundForm(form + n, law, False).judged(noiseless=False) for n in _noise(law, 100, 3)]
    accepted = np.mean([value + 2 * variance**0.5 <= np.ptp(form) for value, variance in found])
    assert accepted > 5 * STATED


@pytest.mark.parametrize("high", [0.0, 4.0, 12.0])
def test_what_noise_adds_is_taken_off(high):
    """Without a form, and with waves: the mean is the true size within a part of what is taken off."""
    law = _law()
    form = _left(law, high * SIGMA * np.sin(4 * np.pi * AT))
    every = [FoundForm(form + n, law, False) for n in _noise(law, 150, 4)]
    value, variance = np.array([each.judged(noiseless=False) for each in every]).T
    added = np.mean([each.size for each in every]) - np.ptp(form)
    assert added > (1.0 if high else 5.0) * np.sqrt(variance.mean())
    assert abs(value.mean() - np.ptp(form)) < (0.35 if high else 0.05) * added


def test_a_noiseless_image_tells_what_noisy_ones_give():
    law = _law()
    bow = _left(law, 8 * SIGMA * (AT - 0.5) ** 2 * 4)
    for form in (0.0 * bow, bow):
        noisy = [FoundForm(form + n, law, False).judged(noiseless=False)[0] for n in _noise(law, 100, 6)]
        told, variance = FoundForm(form, law, False).judged(noiseless=True)
        assert told == pytest.approx(np.mean(noisy), abs=0.5 * variance**0.5)


def test_a_zone_is_not_smaller_than_two_points_say():
    """`FormLaw.apart` is the largest standard deviation of two points' difference, or of a point's place, twice."""
    law = _law()
    noise = _noise(law, 4000, 7)
    pairs = max(float((noise[:, i] - noise[:, j]).std()) for i in range(0, 60, 6) for j in range(0, i))
    assert law.apart >= pairs * (1 - 3 / np.sqrt(8000))
    assert replace(law, reference="nominal").apart == pytest.approx(2 * np.sqrt(np.diag(law.covariance).max()))


def test_points_are_far_enough_apart_to_tell_different_things():
    assert [every(spacing, 1.0) for spacing in (0.4, 1.0, 1.9, 3.0, 0.0)] == [5, 2, 1, 1, 1]


@pytest.fixture(scope="module")
def block():
    asked = {"name": "front", "kind": "straightness", "features": [{"edge": "e7"}], "tolerance": 0.05}
    return scenes.load("task1").with_(task=None, settings=[], measurands=[asked])


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    scene = toleranced.scene(tmp_path_factory.mktemp("plate"), ("back",))
    asked = [("bore", "roundness", {"circle": "c4"}), ("end", "roundness", {"circle": "c8"}),
             ("edge", "straightness", {"edge": "e5"})]  # fmt: skip
    return scene.with_(measurands=[
        {"name": name, "kind": kind, "features": [feature], "tolerance": 0.1} for name, kind, feature in asked
    ])  # fmt: skip


def test_predicted_without_an_image(block):
    """Noise twice as large makes zones twice as large; many pictures at once tell about the same as one."""
    picture = Picture.of(block, *POSE)
    law = form_law(Pictures.of(picture), block.quantities[0])
    loud = block.with_(noise={"sigma": 2 * block.noise.sigma})
    twice = form_law(Pictures.of(Picture.of(loud, *POSE)), loud.quantities[0])
    assert twice.noise.mean == pytest.approx(2 * law.noise.mean, rel=0.01)  # a little less stands out of the noise
    told = planner.predict(picture)
    assert told.measurands[0].variance_object == pytest.approx(law.noise.u**2)
    assert (told.status, told.measurands[0].value_object, told.measurands[0].bias_object) == ("ok", 0.0, 0.0)
    many = planner.variances(block, np.array([POSE[0], (35, 120)]), np.array(POSE[1]))
    assert many[0] == pytest.approx(law.noise.u**2, rel=0.05)  # of equal points, as many


def test_what_is_not_seen_has_no_form(block):
    """In shadow, and in the dark: with the reasons that an edge has."""
    hidden = planner.predict(block, (150, 135), (15, 315))
    assert (hidden.status, hidden.measurands[0].variance_object) == ("low_contrast", np.inf)
    dim = block.with_(camera={"exposure": block.camera.exposure / 200})
    assert planner.predict(dim, *POSE).status == "low_contrast"


def test_forms_are_seen_in_their_face(plate):
    """The plane of an edge is that of the larger face beside it, so that a unit across it is seen as such."""
    known = measurands(Pictures.of(plate, np.array([0.0, 0.0])))
    edge = forms_of(plate.quantities)[2]
    scale = plate.camera.focal_px / (plate.camera.distance + 6.0 - 6.0)
    assert known.seen.magnified(edge.features[0]) == pytest.approx(scale, rel=0.01)
    from_aside = measurands(Pictures.of(plate, np.array([60.0, 270.0]))).seen.magnified(edge.features[0])
    away = 300.0 - 20.0 * np.sin(np.radians(60))  # of the edge, which is 20 mm before the point that is looked at
    assert from_aside == pytest.approx(plate.camera.focal_px / away * np.cos(np.radians(60)), rel=0.07)


def test_zones_say_that_they_are_of_forms(plate):
    zone = plate.zones[0]
    assert (zone.is_form, zone.is_joint, zone.parts, zone.size) == (True, True, ("bore",), 0.1)


def test_undecided_where_nothing_is_known():
    law = _law()
    assert FormSize(0.1, 0.01, 0.1, None).decide(0.2) == "undecided"
    assert FormSize(0.1, np.nan, 0.1, law).decide(0.2) == "undecided"
    assert FormSize(0.1, 0.01, 0.1, law).decide(0.2, status="clutter") == "undecided"
    assert FormSize(0.05, 0.01, 0.1, law).decide(0.2) == "pass"
    assert FormSize(0.05, 0.01, 0.1, law, beside=0.06).decide(0.2) == "undecided"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: FormSize(0.0, 0.0, 0.0, _law()).quantile(1.0), "p must be between 0 and 1, got 1.0"),
        (lambda: FormSize(0.0, 0.0, 0.0, _law()).decide(1.0, -1.0), "k must be at least 0, got -1.0"),
        (lambda: _asked("straightness", {"centre_line": ["e5", "e8"]}), "must be an edge for kind straightness"),
        (lambda: _asked("straightness", {"circle": "c2"}), "features must be an edge for kind straightness"),
        (lambda: _asked("roundness", {"edge": "e5"}), "features must be a circle or a curved surface"),
        (lambda: _asked("roundness", {"circle": "c2"}, nominal=1.0), "nominal must be left out for kind roundness"),
    ],
)
def test_errors(call, message):
    with pytest.raises(InvalidInput, match=message):
        call()


def _asked(kind, feature, **more):
    block = scenes.load("plate")
    return block.with_(measurands=[{"name": "a", "kind": kind, "features": [feature], **more}])


@pytest.mark.parametrize(
    ("piece", "off", "state", "decision"),
    [
        (
            (0.7, 1.2),
            8.0,
            "misfit",
            "undecided",
        ),  # beyond the search window: what is left is straight
        ((0.35, 0.65), -5.0, "misfit", "undecided"),
        ((0.4, 0.6), 1.5, "ok", "fail"),  # within it: that the edge fits no line is what is measured
        ((0.0, 0.0), 0.0, "ok", "pass"),
    ],
)
def test_a_piece_that_is_elsewhere_is_not_left_out(piece, off, state, decision):
    """Of an edge in an exact image with noise, a piece is moved across it, px."""
    block = scenes.load("task1").with_(
        task=None,
        measurands=[{"name": "front", "kind": "straightness", "features": [{"edge": "e7"}], "tolerance": 0.1}],
    )
    picture = scenes.Picture.of(block, (30, 135), (15, 315))
    clean, layout = planner.image(picture), layout_of(picture)
    first, last = layout.ends[layout.names.index("e7")]
    along = (last - first) / np.linalg.norm(last - first)
    normal, (y, x) = np.array([-along[1], along[0]]), np.indices(clean.shape)
    share = ((x - first[0]) * along[0] + (y - first[1]) * along[1]) / np.linalg.norm(last - first)
    away = np.abs((x - first[0]) * normal[0] + (y - first[1]) * normal[1])
    moved = np.where((share > piece[0]) & (share < piece[1]) & (away < 25), off, 0.0)
    image = map_coordinates(clean, [y - moved * normal[1], x - moved * normal[0]], order=1, mode="nearest")
    image = image + np.random.default_rng(1).normal(0, 2.4, image.shape)
    (zone,) = inspect(measure.measure(image, picture)).zones
    assert (zone.status, zone.decision) == (state, decision)


def test_errors_where_a_shadow_ends(block):
    """Points beside a jump of the contrast along an edge scatter as told: neither side tells the other's noise."""
    picture = Picture.of(block.with_(noise={"sigma": 1.0}), *POSE)
    clean, layout = planner.image(picture), layout_of(picture)
    first, last = layout.ends[layout.names.index("e7")]
    along = (last - first) / np.linalg.norm(last - first)
    share = np.tensordot(along, np.indices(clean.shape)[::-1] - first[:, None, None], 1) / np.linalg.norm(last - first)
    dark = block.noise.dark_level
    shaded = dark + (clean - dark) * np.where(share > 0.5, 0.15, 1.0)
    noisy = shaded + np.random.default_rng(3).normal(size=(400, *clean.shape))
    found = measure.measure(noisy, picture).forms["front"]
    told = np.sqrt(np.diag(found[0].law.covariance))
    assert told.max() > 4 * told.min()
    ratio = np.std([each.points for each in found], axis=0) / told
    assert np.abs(ratio - 1).max() < 0.35  # 0.04 by chance; averaged contrasts are 0.9 off


def test_a_renders_noise_is_no_form(block):
    """What rays add to a form in each noise-free image is not taken for bias, and how far it is not known is told."""
    picture, rng = Picture.of(block, *POSE), np.random.default_rng(4)
    clean = planner.image(picture)
    exact = measure.correction(measure.Images((clean,)), picture).bias[0]
    told = [
        measure.correction(measure.Images(tuple(clean + rng.normal(0, 1.0, (3, *clean.shape))), by_pixel=True), picture)
        for _ in range(24)
    ]
    bias = np.array([each.bias[0] for each in told])
    assert abs(bias.mean() - exact) < 4 * bias.std(ddof=1) / len(told) ** 0.5
    u = np.sqrt(np.mean([each.sources["rendering"][0] ** 2 for each in told]))
    assert 0.5 < u / bias.std(ddof=1) < 2
    alone = [measure.propagate(clean + rng.normal(0, 1.0, clean.shape), picture) for _ in range(24)]
    values = np.array([each.measurands.value[0] for each in alone])
    assert values.mean() - exact > 8 * values.std(ddof=1) / len(alone) ** 0.5  # negative control
