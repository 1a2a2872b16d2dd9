"""Corrections from simulated images: what they depend on, what is changed for them, and who counts in what."""

import dataclasses
import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse import csr_array

import measure
import planner
import scenes
from imaging.colour import seen
from imaging.geometry.projection import project
from imaging.models.inputs import of_other_surfaces, with_lights_moved
from imaging.models.texture import texture_errors
from imaging.pictures import Pictures
from measure import Correction, Images
from measure.correction import _levels, _with_pooled
from render import EffectTolerance, Quality
from scenes import Picture, Pose
from scenes.cameras.colour import Colour
from scenes.status import allowed
from tests.oracle import block_image
from validation import kept, simulation
from validation.remeasured import Method
from validation.simulation import How, corrections, inputs, proof, shown
from validation.simulation import how as ways
from validation.simulation import images as imagery

POSES = (30, 90), (15, 270)
ROUGH = Images((np.zeros((2, 2)),))


def changed(images, source):
    """The first render, changed by each input of a source."""
    first = images.renders[0]
    return first + images.changed[source].toarray().reshape(-1, *first.shape)


@pytest.fixture(scope="module")
def picture(small_task1):
    return Picture.of(small_task1, *POSES)


@pytest.fixture(scope="module")
def exact(small_task1):
    return block_image(small_task1, *POSES)


def _made(picture, **more):
    """A correction of a length known to a tolerance, by hand."""
    given = {
        "quantities": picture.scene.quantities, "estimator": "gradient", "threshold": None,
        "bias": np.array([0.3]), "bias_image": np.array([-0.4]),
        "sources": {"rendering": np.array([0.03])}, "sources_image": {"rendering": np.array([0.02])},
        "covariance": np.array([[0.04]]), "covariance_image": np.array([[0.09]]), "simulated": ("ok",),
    }  # fmt: skip
    return Correction(**(given | more))


def test_what_needs_no_image_counts_in_the_object_and_in_the_image_as_it_is_told(picture, exact):
    off = measure.correction(Images((exact,), known={"light_place": (np.array([0.25]), np.array([0.5]))}), picture)
    assert off.sources["light_place"].tolist() == [0.25]
    assert off.sources_image["light_place"].tolist() == [0.5]


def test_what_its_simulation_cannot_measure_has_no_value(picture, exact):
    """Beside a status that says so stands no number, in the object, in the image, or of the distance alone."""
    good, lost = (
        measure.measure(exact, picture, correction=_made(picture, simulated=(state,)))
        for state in ("ok", "ill_conditioned")
    )
    assert (good.status[0], lost.status[0], lost.first.status.item()) == ("ok", "ill_conditioned", "ill_conditioned")
    for name, given in (("value", good), ("value_image", good), ("value_px", good.first)):
        assert np.isfinite(getattr(given, name)).all()
        assert np.isnan(getattr(lost if given is good else lost.first, name)).all()
    for spread in (lost.sigma, lost.covariance_image, lost.first.variance_px2):
        assert np.isinf(spread).all()


def test_renders_beside_tell_the_noise_and_nothing_of_the_bias(small_task1, picture, exact):
    """Of a sensor that stands 0.05 degrees aside the other image is: the bias stays that of the first alone."""
    other = block_image(small_task1, (30.05, 90), (15, 270))
    alone, beside, both = (
        measure.correction(images, picture)
        for images in (Images((exact,)), Images((exact,), beside=(other,)), Images((exact, other)))
    )
    assert beside.bias.tolist() == alone.bias.tolist()
    assert beside.bias_image.tolist() == alone.bias_image.tolist()
    assert abs(both.bias_image[0] - alone.bias_image[0]) > 1e-4
    assert np.isfinite(beside.u_bias).all()
    assert np.isinf(alone.u_bias).all()
    same_but_for_the_response = 1e-3  # which is that of one image, and of the mean of two
    assert beside.sources["rendering"] == pytest.approx(
        both.sources["rendering"] * math.sqrt(2), rel=same_but_for_the_response
    )


def test_few_renders_scatter_by_no_less_than_all_features_tell():
    """Values 1, 2, 3, 6 scatter by the root of 14/3."""
    values = np.array([[1.0, 5.0], [2.0, 5.0], [3.0, 5.0], [6.0, 5.0]])
    assert _with_pooled(values, np.array([0.5, 0.5])) == pytest.approx([math.sqrt(14 / 3), 0.5])


def test_the_renders_noise_counts_in_the_image_by_the_images_own_scatter(picture, exact):
    """Equal renders but for a twentieth of the camera's noise: value for value the same part of sigma, cm and px."""
    rng = np.random.default_rng(5)
    renders = tuple(exact + 0.05 * picture.scene.noise.sigma * rng.normal(size=exact.shape) for _ in range(2))
    off = measure.correction(Images(renders), picture)
    in_object = off.sources["rendering"][0] / off.sigma[0]
    in_image = off.sources_image["rendering"][0] / math.sqrt(off.covariance_image[0, 0])
    assert in_image == pytest.approx(in_object, rel=0.1)  # margin: one length, not quite the same of both
    assert 0.01 < in_object < 0.5  # margin: 0.05 by chance: two renders tell it to 70 %


@pytest.mark.parametrize(("texture", "status"), [(0.5, "ok"), (math.inf, "clutter")])
def test_textures_that_a_closed_form_tells_are_no_reason_to_doubt(picture, texture, status):
    """Their scatter is in the uncertainty; sigma is 0.2, and what else is not known 0.03."""
    sources = {"rendering": np.array([0.03]), "texture": np.array([texture])}
    made = _made(picture, sources=sources)
    assert made.status == (status,)
    assert made.u_bias == pytest.approx([math.hypot(0.03, texture)])
    other = {"rendering": np.array([0.03]), "reflectance": np.array([0.5])}
    assert _made(picture, sources=other).status == ("clutter",)


def test_all_that_the_numbers_depend_on_names_the_file(small_task1, picture, tmp_path, monkeypatch):
    """Each of these changed alone is another correction; the same said again is the same."""
    method, how = Method("canny", 12.0), How()
    lens = small_task1.model_copy(update={"camera": small_task1.camera.model_copy(update={"blur_px": 0.7})})
    others = [
        (Picture.of(small_task1, (30, 91), (15, 270)), method, how),
        (Picture.of(small_task1, (31, 90), (15, 270)), method, how),
        (Picture.of(small_task1, (30, 90), (15, 271)), method, how),
        (Picture.of(small_task1, (30, 90), (16, 270)), method, how),
        (picture.with_scene(lens), method, how),
        (picture, Method("canny", 10.0), how),
        (picture, Method("gradient"), how),
        (picture, method, dataclasses.replace(how, quality=Quality(seed=7))),
        (picture, method, dataclasses.replace(how, effects="physical")),
        (picture, method, dataclasses.replace(how, variant="scalar_rgb_double")),
        (picture, method, dataclasses.replace(how, tolerance=EffectTolerance(bias_px=0.5))),
        *((_on_other_parts(picture, each), method, how) for each in ("vertices", "curved")),
    ]
    named = [kept._digest(*each) for each in [(picture, method, how), *others]]
    assert len(set(named)) == len(named)
    assert kept._digest(Picture.of(small_task1, *POSES), Method("canny", 12.0), How()) == named[0]
    monkeypatch.setattr(kept, "_code", lambda: b"other code")
    assert kept._digest(picture, method, how) not in named


def _on_other_parts(picture, what):
    """The picture of a part with the same keys in its scene's file: another mesh at the same path, or another wall."""
    solid = picture.scene.solid
    if what == "vertices":
        other = dataclasses.replace(solid, vertices=solid.vertices * [1, 1, 1.001])
    else:
        ball = scenes.load("ball").solid.curved
        other = dataclasses.replace(solid, curved=ball)
    return _Stands(picture, other)


@dataclass
class _Stands:
    """A picture whose scene says what it said, of another solid."""

    picture: Picture
    solid: object

    @property
    def scene(self):
        return self

    @property
    def bodies(self):
        return self.solid

    def __getattr__(self, name):
        given = self.__dict__["picture"]
        return getattr(given, name) if name in ("sensor", "lights") else getattr(given.scene, name)


@pytest.mark.parametrize("package", ["scenes", "imaging", "render", "measure"])
def test_another_line_of_the_code_names_another_file(package, tmp_path, monkeypatch):
    """Each package's: a program that measures otherwise corrects otherwise."""
    before = kept._code.__wrapped__()
    (tmp_path / "changed.py").write_text("another = 1\n")
    module = getattr(kept, package)
    monkeypatch.setattr(module, "__file__", str(tmp_path / "__init__.py"))
    assert kept._code.__wrapped__() != before


def test_what_is_kept_comes_back(picture, tmp_path):
    """Each number in its own place, what is not known as it was."""
    two = {"first": np.array([0.1]), "second": np.array([np.inf])}
    image = {"first": np.array([0.5]), "second": np.array([0.25])}
    made = _made(picture, sources=two, sources_image=image, bias=np.array([np.nan]), covariance=np.array([[np.inf]]))
    kept._write(tmp_path / "a.json", made)
    found = kept._read(tmp_path / "a.json", picture, Method("gradient"))
    for field in dataclasses.fields(Correction):
        ours, theirs = getattr(found, field.name), getattr(made, field.name)
        if isinstance(theirs, dict):
            assert list(ours) == list(theirs)
            assert all(np.array_equal(ours[name], theirs[name]) for name in theirs)
        elif isinstance(theirs, np.ndarray):
            np.testing.assert_array_equal(ours, theirs)
        else:
            assert ours == theirs


@pytest.mark.parametrize(
    ("noise", "sigma", "half", "quiet"),
    [
        ((0.09, 0.09), (1.0, 1.0), 0.0, True),
        ((0.09, 0.11), (1.0, 1.0), 0.0, False),
        ((0.11, 0.09), (1.0, 1.0), 0.0, False),
        ((0.9, 0.9), (1.0, 1.0), 100.0, True),
        ((1.1, 0.9), (1.0, 1.0), 100.0, False),
        ((0.09, np.inf), (1.0, 1.0), 0.0, True),
        ((0.09, 5.0), (1.0, np.inf), 0.0, True),
    ],
)
def test_renders_are_enough_when_every_value_s_noise_is_a_tenth_of_sigma_or_a_hundredth_of_the_tolerance(
    picture, noise, sigma, half, quiet
):
    quantity = picture.scene.quantities[0]
    if half:
        quantity = dataclasses.replace(quantity, tolerance=scenes.Tolerance(plus=0.5 * half, minus=1.5 * half))
    made = _made(
        picture, quantities=(quantity,) * 2, sources={"rendering": np.array(noise)},
        covariance=np.diag(np.square(sigma)), bias=np.zeros(2),
    )  # fmt: skip
    assert (corrections._noise(made) <= 1) is quiet


def test_lights_are_moved_one_at_a_time():
    """Each a hundredth of its distance away, and by as much to the side; all else stays."""
    scene = scenes.load("two_lights").with_(uncertainty={"light_place": 0.01})
    picture = Picture.of(scene, (60, 277), [(75, 280), (45, 276)])
    moved, seen = list(with_lights_moved(picture)), []
    for each in moved:
        far = [b.distance / a.distance for a, b in zip(scene.lights, each.scene.lights, strict=True)]
        turned = [_angle(a, b) for a, b in zip(picture.lights, each.lights, strict=True)]
        assert each.sensor == picture.sensor
        assert [light.intensity for light in each.scene.lights] == [0.6, 0.4]
        seen.append((*np.round(far, 9), *np.round(turned, 9)))
    step = round(0.01, 9)
    assert seen == [
        (1.01, 1, 0, 0), (1, 1, step, 0), (1, 1, step, 0), (1, 1.01, 0, 0), (1, 1, 0, step), (1, 1, 0, step),
    ]  # fmt: skip


def _angle(one: Pose, other: Pose) -> float:
    """Between two directions, rad."""
    ways = []
    for polar, azimuth in (np.radians(list(one)), np.radians(list(other))):
        ways.append([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    return math.asin(np.linalg.norm(np.cross(*ways)))


def test_each_surface_reflects_less_by_a_tenth_or_more():
    """One at a time: the part, the floor, and a face's own material."""
    scene = scenes.load("grey_floor").with_(uncertainty={"reflectance": 0.1})
    own = {"kind": "torrance_sparrow", "name": "matt", "where": "top", "diffuse_reflectance": 0.3}
    scene = scene.with_(materials=[own])
    picture = Picture.of(scene, (30, 90), (15, 270))

    def reflected(each):
        return each.material.specular_fraction, each.floor.reflectance, each.materials[0].diffuse_reflectance

    for times, part in ((1.0, 0.9), (-1.0, 1.1)):
        others = of_other_surfaces(picture, times)
        found = [np.divide(reflected(each.scene), reflected(scene)) for each in others]
        assert np.array(found) == pytest.approx(np.array([[part, 1, 1], [1, part, 1], [1, 1, part]]))
    assert scene.floor.reflectance == 0.2


def test_the_light_in_closed_form_is_what_exact_images_show(task1):
    """The value is measured in an exact image for each other place of the light; a place farther away changes none."""
    scene, values = task1.with_(uncertainty={"light_place": 0.05}), []
    picture = Picture.of(scene, (30, 135), (15, 315))
    for each in (picture, *with_lights_moved(picture)):
        image = block_image(scene, (30, 135), tuple(each.lights[0]))
        found = measure.measure(image, picture, estimator="gradient")
        values.append((found.value[0], found.first.value_px))
    expected = np.linalg.norm(np.array(values[1:]) - values[0], axis=0)
    told = np.concatenate(inputs.light_in_closed_form(picture, How().by(Method("gradient"))))
    assert told == pytest.approx(expected, rel=0.6)  # margin: differences of 1e-4 px of a form of first order


@pytest.mark.parametrize("estimators", [("arrangement",), ("strip",), ("gradient", "arrangement")])
def test_the_light_in_closed_form_is_that_of_locators_whose_bias_it_is(estimators, task1):
    picture = Picture.of(task1, (30, 135), (15, 315))
    assert inputs.light_in_closed_form(picture, How().by(*map(Method, estimators))) is None


@pytest.mark.render
def test_the_place_of_a_light_moves_an_arrangement_by_what_its_images_show():
    """A thin wall is lit or dark beside what the gradient locator finds, which a closed form tells: 0.024 cm for half a
    degree, where the arrangement has it as an edge of its own. Elsewhere the form has no value at all."""
    scene = scenes.load("wedge")
    for sensor, light in (((10.5, 69.3), (37.7, 72.2)), ((49.8, 285.4), (34.9, 356))):
        found = simulation.simulated(Picture.of(scene, sensor, light), Method("arrangement"))
        assert found.status == ("ok",)
        assert found.sources["light_place"][0] < 0.1 * found.sigma[0]


@pytest.mark.parametrize(("off", "rendered"), [(0.05, 0), (0.2, 7)])
def test_lights_elsewhere_are_drawn_where_the_image_model_draws_the_render(small_task1, off, rendered, monkeypatch):
    """Parts of a pixel's noise that they differ by: half of what is allowed, and twice as much."""
    picture, shown = Picture.of(small_task1, *POSES), []

    def image(how, other, effects, seed):
        shown.append(other)
        return planner.image(other)

    monkeypatch.setattr(How, "_rendered", image)
    here = planner.image(picture)
    first = here + off * small_task1.noise.sigma * np.random.default_rng(3).choice([-1, 1], here.shape)
    images = imagery.completed(picture, (first,), (), How().by(Method("arrangement")))
    assert len(shown) == rendered
    read = measure.region_of_interest(picture, estimators=("arrangement",)) | bool(rendered)
    others = [planner.image(each) - here for each in with_lights_moved(picture, math.sqrt(3.0))]
    for made, other in zip(changed(images, "light_place")[::2], others, strict=True):
        assert np.abs(other[read]).max() > 0.1
        of_first_order = pytest.approx(other[read] / math.sqrt(3.0), abs=0.1 * np.abs(other).max())
        assert (made - first)[read] == of_first_order
        assert (made - first)[~read] == pytest.approx(0.0, abs=2e-3)  # is not drawn


@pytest.mark.parametrize("poses", [POSES, ((30, 135), (15, 315))])
def test_what_is_drawn_of_lights_elsewhere_is_what_exact_images_show(small_task1, poses, monkeypatch):
    """A standard uncertainty of 0.07 and 0.08 of sigma to 3e-4 of it; renders of few rays have 0.9 of the former."""
    scene, method, found = small_task1.with_(uncertainty={"light_place": 0.03}), Method("arrangement"), []
    picture = Picture.of(scene, *poses)
    first = block_image(scene, *poses)
    told = measure.propagate(first, picture, estimator="arrangement").measurands
    monkeypatch.setattr(How, "_rendered", None)
    for made in (imagery.drawn, lambda each, where: block_image(each.scene, each.sensor, each.lights[0])):
        monkeypatch.setattr(imagery, "drawn", made)
        off = simulation.of_render(picture, method, first, told)
        found.append(off.sources["light_place"][0] / off.sigma[0])
    assert found[0] == pytest.approx(found[1], rel=1e-3)
    assert found[1] > 0.05  # margin: that there is something to tell


class _Rendered(How):
    """A way to make images that are told apart by the seed alone, and that notes what was asked for."""

    def image(self, picture, seed=0):
        more = 1000 * (self.quality.denser - 1) + 3000 * self.quality.gathered
        return np.full((picture.scene.camera.height, picture.scene.camera.width), float(seed + more))

    def active(self, picture):
        return frozenset({"interreflection"})


@pytest.mark.parametrize(
    ("noise", "finer", "count"),
    [(0.0699, None, 1), (0.0701, 0.03, 1), (0.3, 0.0701, 2), (0.3, 0.15, 5), (9.0, 9.0, 6), (np.inf, None, 1)],
)  # fmt: skip
@pytest.mark.parametrize(("variant", "first"), [("scalar_mono", 3001), ("llvm_ad_mono", 1001)])
def test_as_many_renders_are_measured_as_make_what_is_left_quiet(
    picture, noise, finer, count, variant, first, monkeypatch
):
    """Finer ones where a pair is noisy; the worst value counts, six at most; others of as many tell their biases, by
    light that is gathered where it is."""
    asked = []

    def correction(images, *given):
        told = [noise, finer][len(asked)] / np.sqrt(2)  # of the mean of two
        asked.append(images)
        return _made(picture, sources={"rendering": np.array([0.01, told])}, covariance=np.eye(2), bias=np.zeros(2))

    monkeypatch.setattr(measure, "correction", correction)
    whole = np.full((2, 2), 0.5)
    how = _Rendered(Quality(), variant)
    found = simulation.steadied(picture, whole, Method("gradient"), how)
    assert found.whole is whole
    if finer is None:
        assert (len(asked), found.measured, found.others[0].flat[0]) == (1, (whole,), 1)
        return
    assert [each.flat[0] for each in found.measured] == [2000 + i for i in range(count)]
    assert [each.flat[0] for each in found.others] == [first + i for i in range(count)]
    assert [[each.flat[0] for each in pair.renders] for pair in asked] == [[0.5, 1], [2000, first]]


@pytest.mark.parametrize(
    ("active", "everywhere", "gathered"),
    [
        ({"interreflection", "shadows"}, False, True), ({"interreflection", "shadows"}, True, False),
        ({"light_size"}, False, False), ({"light_size", "interreflection"}, False, False),
    ],
)  # fmt: skip
def test_more_rays_make_quieter_what_is_not_gathered(picture, active, everywhere, gathered, monkeypatch):
    """Light of some size is none that patches tell, with light between faces or without."""
    monkeypatch.setattr(_Rendered, "active", lambda how, picture: frozenset(active))
    quieter = _Rendered(Quality(), "scalar_mono", everywhere=everywhere).quieter(picture)
    assert (quieter.quality.gathered, quieter.quality.denser) == ((True, 1) if gathered else (False, 2))


def test_an_image_without_random_light_is_measured_as_it_is(picture, monkeypatch):
    monkeypatch.setattr(_Rendered, "active", lambda how, picture: frozenset({"shadows"}))
    monkeypatch.setattr(measure, "correction", None)
    found = simulation.steadied(picture, whole := np.zeros((2, 2)), Method("gradient"), _Rendered())
    assert found.measured == (whole,)
    assert found.mean(picture) is whole
    assert [each.flat[0] for each in found.others] == [1]


def test_a_mean_of_renders_is_taken_where_something_is_measured(picture):
    """Elsewhere the whole image is kept."""
    height, width = picture.scene.camera.height, picture.scene.camera.width
    whole, *some = (np.full((height, width), level) for level in (10.0, 14.0, 16.0))
    mean = simulation.Renders(whole, tuple(some), ()).mean(picture)
    assert set(np.unique(mean)) == {10.0, 15.0}
    ends = picture.scene.solid.vertices[[v for e in ("e4", "e9") for v in picture.scene.solid.edge(e).ends]]
    at = np.rint(project(ends.reshape(2, 2, 3).mean(1), np.array(list(picture.sensor)), picture.scene.camera)).astype(
        int
    )
    assert [mean[y, x] for x, y in at] == [15.0, 15.0]
    assert mean[0, 0] == mean[-1, -1] == 10.0


def test_what_is_measured_is_corrected_by_as_many_renders_of_other_rays(picture, monkeypatch):
    """For each method, with what propagation says of it; those that are measured tell their own noise beside."""
    asked = []
    monkeypatch.setattr(measure, "correction", lambda *given: asked.append(given) or len(asked))
    monkeypatch.setattr(proof, "completed", lambda *given: given)
    monkeypatch.setattr(proof, "sure", lambda picture, found, *more: found)
    measured, others = ((np.full((2, 2), sign * float(i)) for i in range(1, 4)) for sign in (-1, 1))
    renders = simulation.Renders(np.zeros((2, 2)), tuple(measured), tuple(others))
    methods, how = (Method("strip", None), Method("isophote", 0.4)), _Rendered()
    assert simulation.independent(picture, methods, renders, ("one", "two"), how) == (1, 2)
    assert [(given[2], given[3], given[4]) for given in asked] == [("strip", None, "one"), ("isophote", 0.4, "two")]
    assert asked[0][0] == (picture, renders.others, renders.measured, how.by(*methods).gathering)


def test_textures_of_which_nobody_knows_how_they_lie_are_left_out_and_count_in_u(small_task1, monkeypatch):
    """The simulation is of the part without them; u(bias) has what the gradient locator's closed form tells."""
    asked = []

    def quiet(picture, method, how, shown):
        asked.append(picture)
        told = measure.propagate(block_image(small_task1, *POSES), picture, estimator=method.locator)
        return _made(picture), told.measurands

    monkeypatch.setattr(corrections, "_until_quiet", quiet)
    grain = {"kind": "statistical", "where": "top", "contrast": 0.1, "correlation": 0.3}
    scene = small_task1.with_(textures=[grain])
    picture, how = Picture.of(scene, *POSES), How()
    found = corrections._simulated.__wrapped__(picture, Method("gradient"), how)
    spread = texture_errors(Pictures.of(picture)).variances
    assert asked[0].scene.textures == ()
    # margin: the closed form is of the first order, and has no corners
    assert (found.sources["texture"][0], found.sources_image["texture"][0]) == pytest.approx(
        (spread[1][0] ** 0.5, spread[0][0] ** 0.5), rel=0.1
    )
    assert found.sources["rendering"].tolist() == [0.03]
    plain = corrections._simulated.__wrapped__(Picture.of(small_task1, *POSES), Method("gradient"), how)
    assert "texture" not in plain.sources


def test_a_material_that_cannot_tell_how_it_reflects_less_leaves_the_bias_unknown(monkeypatch):
    """On a hollow part; of one plain body it changes nothing but the scale."""
    for name, plain in (("bracket", False), ("task1", True)):
        scene = scenes.load(name)
        picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
        assert inputs.of_unknown_kinds(picture) == {}
        with monkeypatch.context() as changed:
            changed.setattr(type(scene.material), "dimmed", lambda *given: None)
            found = inputs.of_unknown_kinds(picture)
        assert (found == {}) == plain
        if not plain:
            assert [each.tolist() for each in found["reflectance"]] == [[np.inf] * len(scene.quantities)] * 2


@pytest.mark.parametrize(
    ("estimators", "everywhere"),
    [
        (("gradient", "isophote", "canny"), False),
        (("strip",), True),
        (("arrangement",), True),
        (("canny", "strip"), True),
    ],
)
def test_what_is_measured_from_afar_is_simulated_everywhere(estimators, everywhere):
    assert How().by(*map(Method, estimators)).everywhere is everywhere


@pytest.mark.parametrize(
    ("width", "variant", "count"), [(96, "scalar_rgb", 4), (2448, "scalar_rgb", 2), (2448, "llvm_mono", 4)]
)
def test_two_renders_do_where_many_pixels_tell_how_noisy_they_are(picture, width, variant, count, monkeypatch):
    """Of a small image four are cheap; of a compiled variant the pixels have random numbers in common."""
    asked, size, quiet = [], {"width": width, "height": width}, {"rendering": np.array([0.01])}
    camera = picture.scene.camera.model_copy(update=size)
    large = picture.with_scene(picture.scene.model_copy(update={"camera": camera}))
    monkeypatch.setattr(_Rendered, "image", lambda how, picture, seed=0: seed)
    monkeypatch.setattr(shown, "completed", lambda picture, renders, *given: asked.append(renders) or ROUGH)
    monkeypatch.setattr(measure, "correction", lambda *given: _made(picture, sources=quiet))
    monkeypatch.setattr(measure, "propagate", lambda mean, *_, **more: SimpleNamespace(measurands=mean))
    found, told = corrections._until_quiet(large, Method("gradient"), _Rendered(variant=variant))
    assert told == (count - 1) / 2  # of the renders' mean
    assert found.sources["rendering"].tolist() == [0.01]
    assert asked == [tuple(range(count))]


@pytest.mark.parametrize("below", [False, True])
def test_what_is_compared_is_rendered_once(monkeypatch, below):
    """The part as it is, and each of three steps of the light's place, both ways: seven images, none twice.

    Below a megapixel with all light, and two more where it reflects less and more; else direct light alone, whose rest
    in the render is what surfaces send to each other.
    """
    scene, asked = scenes.load("bracket"), []

    def rendered(how, shown, effects, seed):
        asked.append((shown, how.quality.alike, effects == "auto" or "interreflection" in effects))
        return np.full((2, 2), 50.0 + len(asked))

    monkeypatch.setattr(How, "_rendered", rendered)
    monkeypatch.setattr(
        imagery, "of_one_surface", lambda picture, renders, direct, part: csr_array(-direct().reshape(1, -1))
    )
    monkeypatch.setattr(imagery, "LARGE", 1 << 20 if below else 1)
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
    images = imagery.completed(picture, (np.full((2, 2), 77.0),), (), How())
    assert [each[1:] for each in asked] == [(True, below)] * (7 + 2 * below)
    assert [shown is picture for shown, *_ in asked].count(True) == 1
    assert len({shown for shown, *_ in asked}) == 7 + 2 * below
    dark, here, first = scene.noise.dark_level, 52 if below else 51, 54 if below else 52

    def told(one, other, times):
        one, other = (dark + (77 - dark) * (level - dark) / (here - dark) for level in (one, other))
        return [77 + (one - other) / (2 * times), 77 + (one + other - 2 * 77) / (2 * times)]

    reflected = told(51, 53, 1.0) if below else [77 - 51]
    lit = [value for k in range(first, first + 6, 2) for value in told(k, k + 1, math.sqrt(3.0))]
    assert [each.flat[0] for each in changed(images, "reflectance")] == pytest.approx(reflected, rel=1e-12)
    assert [each.flat[0] for each in changed(images, "light_place")] == pytest.approx(lit, rel=1e-12)


@pytest.mark.parametrize("overall", [False, True])
def test_a_shadow_that_reaches_an_edge_from_where_a_light_may_stand_counts(monkeypatch, overall):
    """From within a standard uncertainty of where it is meant to stand it changes nothing, nor the other way."""
    scene = scenes.load("bracket").with_(uncertainty={"light_place": 0.01})
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)

    def rendered(how, shown, effects, seed):
        farther = shown.scene.lights[0].distance / scene.lights[0].distance - 1
        return scene.noise.dark_level + np.array([[100.0, 0.0 if farther > 0.015 else 100.0]])

    monkeypatch.setattr(How, "_rendered", rendered)
    images = imagery.completed(picture, (How().image(picture),), (), How())
    here, straight, bent = images.renders[0], *changed(images, "light_place")[:2]
    if overall:
        of_all = imagery.of_all(picture, images, How())[0]
        at = 2 + images.changed["reflectance"].shape[0]
        here, straight, bent = of_all[1], *of_all[at : at + 2]
    shadow = 100.0 / (2 * math.sqrt(3.0))
    assert (here - straight)[0, 1] == pytest.approx(shadow, rel=0.01)  # the rest is scaled to the same sum of squares
    assert (here - bent)[0, 1] == pytest.approx(0.0 if overall else shadow, rel=0.01, abs=1e-12)
    near = next(with_lights_moved(picture))
    assert rendered(None, near, None, 0) == pytest.approx(here)  # negative control: one standard uncertainty tells none


@pytest.mark.parametrize("overall", [False, True])
def test_a_reflectance_does_what_it_does_on_both_sides(monkeypatch, overall):
    """Light that goes to and fro between two faces, r / (1 - r) of the direct: its derivative by what is reflected, not
    what a step less does, which is a tenth smaller; as images beside edges have it, and those of the whole picture."""
    scene, r = scenes.load("bracket").with_(uncertainty={"reflectance": 0.1}), 0.5
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)

    def rendered(how, shown, effects, seed):
        part = shown.scene.material.lambertian / scene.material.lambertian
        return scene.noise.dark_level + 100.0 * part * np.array([[1.0, 1.0 / (1.0 - part * r)]])

    monkeypatch.setattr(How, "_rendered", rendered)
    images = imagery.completed(picture, (How().image(picture),), (), How())
    beside = *images.renders, *changed(images, "reflectance")
    here, straight, bent = imagery.of_all(picture, images, How())[0, 1:4] if overall else beside
    u = scene.uncertainty.reflectance.u
    by_part = (here - straight)[0] / (100.0 * u)
    assert by_part == pytest.approx([1.0, 1 / (1 - r) ** 2], rel=0.02)
    off = 0.0 if overall else r / (1 - r) ** 3 * u**2  # half its second derivative
    assert (bent - here)[0] / 100.0 == pytest.approx([0.0, off], rel=0.03, abs=1e-12)
    one_sided = (here - rendered(None, next(of_other_surfaces(picture)), None, 0))[0]
    assert one_sided[1] < 0.95 * (here - straight)[0, 1]  # negative control


def test_what_changes_a_doubtful_bias_is_told_by_four_sets_of_rays(monkeypatch):
    """Each of other rays, of the picture as it is and as it is changed the same ones: the mean of what they tell."""
    scene, seeds, ways = scenes.load("bracket"), [], {}
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
    dark = scene.noise.dark_level

    def rendered(how, shown, effects, seed):
        seeds.append(how.quality.seed + seed)
        if shown is not picture:
            ways.setdefault(shown, (-1.0) ** len(ways))  # one way, and the other
        step = ways.get(shown, 0.0) * (1 + (how.quality.seed + seed - 7) ** 2)
        return np.full((2, 2), dark + 50.0 + step)

    monkeypatch.setattr(How, "_rendered", rendered)
    how = How(quality=Quality(seed=7))
    images = imagery.completed(picture, (np.full((2, 2), dark + 100.0),), (), how)
    settled = imagery.settled(picture, images, how)
    assert sorted(seeds) == sorted(9 * [7, 8, 9, 10])
    assert {name: some.shape[0] for name, some in settled.changed.items()} == {"reflectance": 2, "light_place": 6}
    for name in settled.changed:
        far = 1.0 if name == "reflectance" else math.sqrt(3.0)
        for settled_one, first_one in zip(  # others: what is bent
            changed(settled, name)[::2], changed(images, name)[::2], strict=True
        ):
            assert first_one == pytest.approx(np.full((2, 2), dark + 100.0 + 2.0 / far), rel=1e-12)
            mean = 1 + (0 + 1 + 4 + 9) / 4
            assert settled_one == pytest.approx(np.full((2, 2), dark + 100.0 + 2.0 * mean / far), rel=1e-12)
    assert settled.renders is images.renders


@pytest.mark.parametrize(
    ("u", "below", "random", "asked"),
    [
        (0.9, True, True, []),
        (1.1, True, True, ["overall", "settled"]),
        (1.1, True, False, ["overall"]),
        (1.1, False, True, []),
    ],
)
def test_more_is_rendered_where_a_bias_is_not_known_well_enough(picture, u, below, random, asked, monkeypatch):
    """u(bias) a tenth below what is allowed is `ok`, above `clutter` until more tells; not above a megapixel, and no
    other rays where those that are compared have no noise."""
    monkeypatch.setattr(shown, "is_random", lambda *given: random)
    made, done = _made(picture), []
    limit = allowed(float(made.sigma[0]))
    sources = {"rendering": np.array([0.0]), "light_place": np.array([u * limit])}
    doubtful = dataclasses.replace(made, sources=sources, simulated=("clutter",))
    monkeypatch.setattr(_Rendered, "image", lambda how, picture, seed=0: seed)
    monkeypatch.setattr(corrections, "LARGE", 1 << 20 if below else 1)
    monkeypatch.setattr(shown, "completed", lambda *given: ROUGH)
    monkeypatch.setattr(shown, "of_all", lambda *given: done.append("overall"))
    monkeypatch.setattr(shown, "settled", lambda *given: done.append("settled") or ROUGH)
    monkeypatch.setattr(measure, "correction", lambda *given: doubtful)
    monkeypatch.setattr(measure, "propagate", lambda mean, *_, **more: SimpleNamespace(measurands=mean))
    corrections._until_quiet(picture, Method("gradient"), _Rendered())
    assert done == asked


def test_methods_that_are_judged_together_share_what_settles_them(picture, monkeypatch):
    """Both are doubtful at first, and when the whole picture is rendered; settled images are made once, tell both."""
    fine, made = Images(ROUGH.renders, {"settled": csr_array((1, 4))}), []
    doubtful, sure = (
        _made(picture, sources={"rendering": np.array([0.0]), "light_place": np.array([u])}) for u in (9.0, 0.1)
    )
    monkeypatch.setattr(proof, "completed", lambda *given: ROUGH)
    monkeypatch.setattr(shown, "is_random", lambda *given: True)
    monkeypatch.setattr(shown, "of_all", lambda *given: made.append("overall"))
    monkeypatch.setattr(shown, "settled", lambda *given: made.append("settled") or fine)
    monkeypatch.setattr(measure, "correction", lambda images, *given: sure if images.changed else doubtful)
    renders = simulation.Renders("image", ("image",), ("other",))
    told = simulation.independent(picture, (Method("gradient"), Method("canny")), renders, (None, None))
    assert told == (sure, sure)
    assert made == ["overall", "settled"]


@pytest.mark.parametrize(("below", "fine"), [(True, 4), (False, 2)])
def test_what_is_compared_has_finer_pixels_up_to_a_megapixel(picture, below, fine, monkeypatch):
    """The edge of a shadow moves in steps of a fine pixel where a light does."""
    monkeypatch.setattr(ways, "LARGE", 1 << 20 if below else 1)
    quality = How(quality=Quality(seed=3)).compared(picture).quality
    assert (quality.supersample, quality.seed, quality.alike) == (fine, 3, True)


def test_what_few_rays_tell_of_all_levels_moves_no_edge():
    """An edge that few rays show aside: of a picture that is a tenth darker the image is, too; a spot of 5 is one."""
    first, here = np.array([[100.0, 100.0, 20.0, 20.0]]), np.array([[100.0, 70.0, 20.0, 20.0]])

    def after(here, other):
        return first + imagery._moved(first, lambda: here, other, 0.0).toarray()

    assert after(here, 0.9 * here) == pytest.approx(0.9 * first, rel=1e-12)
    with_spot = first + np.array([[0.0, 0.0, 0.0, 5.0]])
    assert after(first, with_spot) == pytest.approx(with_spot, rel=1e-12)
    assert after(0 * here, 0 * here).tolist() == [[0.0] * 4]


@pytest.mark.parametrize("filters", [False, True])
def test_what_is_recorded_of_a_changed_render_is_that_of_the_whole_image(filters):
    """Also where filters mix neighbours, and where the end of the scale cuts off what is changed."""
    scene = scenes.load("task1")
    noise = scene.noise.tried(colour=Colour(pattern="RGGB", demosaicing="bilinear") if filters else None)
    scene = scene.tried(noise=noise)
    rng, size = np.random.default_rng(5), (scene.camera.height, scene.camera.width)
    first, change = rng.uniform(20, 254, size), np.zeros(size)
    change[40:60, 30:90] = rng.normal(0, 5, (20, 60))
    images = Images((first,), {"pose": csr_array(change.reshape(1, -1))})
    levels = _levels(images, first, Picture.of(scene, *POSES))
    assert levels[1] == pytest.approx(seen(scene.noise, first + change).level, rel=1e-12)
    assert np.abs(levels[1] - levels[0]).max() > 1
