"""Textures: what they are, how they are rendered, and what they do to edges."""

import json
import sys

import numpy as np
import pytest
from scipy import stats

import measure
import planner
import render
import scenes
import validation
from imaging.features.measurand import measurands
from imaging.geometry.projection import project
from imaging.light.appearance import diffuse_signal, face_signal, is_separable
from imaging.light.sheets import sheets
from imaging.models.texture import texture_errors
from imaging.pictures import Pictures
from scenes import ImageTexture, InvalidInput, Picture, Setting, StatisticalTexture
from scenes.load import BUNDLED
from tests.proofs.uneven import shifts
from validation import picture_file
from validation.cli import main as cli

SENSOR, LIGHT = (30, 135), (15, 315)
AT = ("--sensor", "30,135", "--light", "15,315")
UNEVEN = StatisticalTexture(kind="statistical", faces=("top",), contrast=0.03, correlation=1.0)


def textured(scene, *textures, **camera):
    """The scene with textures, before a camera of other numbers."""
    camera = scene.camera.model_copy(update=camera)
    return scene.model_copy(update={"textures": textures, "camera": camera, "settings": ()})


def small(scene, *textures):
    return textured(scene, *textures, width=128, height=120, focal_px=400.0)


def part(seed, **values):
    return UNEVEN.model_copy(update={"seed": seed, **values})


def pictures(scene, sensor=SENSOR, light=LIGHT):
    return Pictures.of(Picture.of(scene, sensor, light))


@pytest.fixture
def label(tmp_path):
    def made(levels, **values):
        picture_file.write(tmp_path / "a.png", np.asarray(levels, float))
        place = {"origin": (3.0, 5.5, 2.5), "direction": (1, 0, 0), "width": 6.0, "height": 3.0}
        return ImageTexture(kind="image", face="top", file=tmp_path / "a.png", **{**place, **values})

    return made


STATISTICAL = "kind = 'statistical'\nwhere = 'top'\ncontrast = 0.1\n"
IMAGE = "kind = 'image'\nface = 'top'\nfile = 'a.png'\nwidth = 2.0\nheight = 1.0\n"
PLACE = "origin = [1, 2, 2.5]\ndirection = [1, 0, 0]\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("kind = 'woven'", r"textures\[0\] must be a known kind \(statistical, image\), got"),
        (STATISTICAL, r"textures\[0\]\.correlation must be given, got nothing"),
        (STATISTICAL + "correlation = 1e-4", r"textures\[0\]\.correlation must be at least 0\.0588 on face top"),
        (STATISTICAL.replace("0.1", "0.5") + "correlation = 1.0", r"textures\[0\]\.contrast must be at most 0\.2, got"),
        (STATISTICAL.replace("'top'", "'up'") + "correlation = 1.0", r"\.where must be one of top, .*, or a table"),
        (IMAGE.replace("'top'", "'up'") + PLACE, r"textures\[0\]\.faces\[0\] must be one of top, .*, got 'up'"),
        (IMAGE + PLACE.replace("2.5]", "2.4]"), r"textures\[0\]\.origin must be on face top, got \[1\.0, 2\.0, 2\.4\]"),
        (IMAGE + PLACE.replace("[1, 0, 0]", "[0, 0, 1]"), r"textures\[0\]\.direction must lie in face top, got"),
        (IMAGE.replace("a.png", "b.png") + PLACE, r"textures\[0\]: file must be a readable image, got .*b\.png \(No"),
        (IMAGE + PLACE + "white = 1.0", r"textures\[0\]: file must be of levels from 0 to 10 times white, got"),
        (
            STATISTICAL + "correlation = 1.0\n[[textures]]\n" + IMAGE + PLACE,
            r"textures\[1\] must be on faces without a texture, got 'top', which has textures\[0\]",
        ),
    ],
)  # fmt: skip
def test_a_bad_texture_is_one_line(tmp_path, text, line):
    picture_file.write(tmp_path / "a.png", np.full((4, 8), 100.0))
    path = tmp_path / "bad.toml"
    path.write_text((BUNDLED / "task1.toml").read_text() + f"\n[[textures]]\n{text}\n")
    with pytest.raises(InvalidInput, match=line) as error:
        scenes.load(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


def test_a_field_has_the_contrast_and_the_correlation_that_are_said(task1):
    """Standard deviation and autocorrelation at one correlation length over 60 parts; other numbers are rejected."""
    values, step = [], None
    for seed in range(60):
        sheet = sheets(textured(task1, part(seed)))[0]
        values.append(sheet.values[::8, :: sheet.values.shape[1] - 1])  # nodes a correlation length apart, far columns
        step = sheet.rectangle.size[1] / (sheet.values.shape[0] - 1)
    flat = (np.array(values) - 1) / UNEVEN.contrast
    assert 8 * step == pytest.approx(UNEVEN.correlation, rel=0.1)
    count = flat.size
    expected = np.exp(-((8 * step / UNEVEN.correlation) ** 2))
    # neighbours a correlation length apart share exp(-2): fewer are independent
    spread = np.sqrt(2 / count * (1 + 2 * expected**2))
    assert abs((flat**2).mean() - 1) < 4 * spread
    assert abs((flat**2).mean() / 1.3**2 - 1) > 4 * spread  # margin: 10 standard errors
    found = (flat[:, 1:] * flat[:, :-1]).mean()
    # margin: 4 standard errors
    assert abs(found - expected) < 4 * np.sqrt((1 + 2 * expected**2) / count)
    # margin: 9 standard errors
    assert abs(found - expected**2) > 4 * np.sqrt((1 + 2 * expected**2) / count)


def test_parts_faces_and_textures_are_independent_and_seeds_repeat(task1):
    both = part(1, faces=("top", "bottom"))
    first, again, other = (
        sheets(textured(task1, texture)) for texture in (both, part(1, faces=("top", "bottom")), part(2))
    )
    assert np.array_equal(first[0].values, again[0].values)
    # margin: chance: a few correlation lengths each way
    assert abs(np.corrcoef(first[0].values.ravel(), first[1].values.ravel())[0, 1]) < 0.5
    assert abs(np.corrcoef(first[0].values.ravel(), other[0].values.ravel())[0, 1]) < 0.5


def test_a_print_lies_where_it_is_said_to(task1, label):
    """Left half bright, right half dark, upper half brighter: by the corners, and 1 beside the print."""
    scene = textured(task1, label([[200, 100], [100, 50]], white=100.0))
    sheet = sheets(scene)[0]
    points = np.array(
        [[3.2, 5.3, 2.5], [8.8, 5.3, 2.5], [3.2, 2.7, 2.5], [8.8, 2.7, 2.5], [2.0, 4.0, 2.5], [9.5, 6, 2.5]]
    )
    assert sheet.at(points) == pytest.approx([2, 1, 1, 0.5, 1, 1])
    assert not is_separable(scene)
    seen, bare = (face_signal(pictures(each), points, 0, 1) for each in (scene, textured(task1)))
    assert seen / bare == pytest.approx([2, 1, 1, 0.5, 1, 1])


@pytest.mark.render
@pytest.mark.parametrize(("gloss", "radius"), [(False, 0.0), (True, 0.0), (True, 0.5)])
def test_rendered_texture_is_that_of_the_sheet(task1, gloss, radius):
    """A wide field in the middle of the face, diffuse, as a table, and through the BSDF: to 1 % of its contrast."""
    scene = small(task1, part(5, correlation=4.0, contrast=0.1))
    if gloss:
        metal = scenes.load("anodised").materials[0].material.model_copy(update={"specular_fraction": 0.3})
        scene = scene.model_copy(update={"material": metal})
    if radius:
        scene = scene.model_copy(update={"light": scene.light.model_copy(update={"radius": radius})})
    bare = scene.model_copy(update={"textures": ()})
    quality = render.Quality(supersample=1, samples=16, edge_samples=16, random_samples=16)
    chosen = ["attached_shadow", "fall_off", "texture", *["specular_lobe"] * gloss, *["light_size"] * bool(radius)]
    image = render.image(scene, SENSOR, LIGHT, quality, effects=chosen)
    plain = render.image(bare, SENSOR, LIGHT, quality, effects=[name for name in chosen if name != "texture"])
    points = np.array([[x, y, 2.5] for x in np.linspace(3, 9, 7) for y in np.linspace(2, 5.5, 4)])
    x, y = np.rint(project(points, pictures(scene).sensors, scene.camera)).astype(int).T
    known, matt = sheets(scene)[0].at(points) - 1, diffuse_signal(pictures(bare), points, 0, 1)
    found = (image - plain)[y, x] / matt
    assert np.std(known) > 0.03  # margin: that there is contrast to be told
    assert found @ known / (known @ known) == pytest.approx(1, abs=0.03)
    # margin: half a pixel aside the texture has changed by so much
    assert np.std(found - known) < 0.15 * np.std(known)  # the pixel's middle is up to half a px away


@pytest.mark.render
def test_the_shift_of_a_part_is_that_of_its_rendered_picture(task1):
    """Noise-free distances of parts less that of an even one: a tenth of the scatter over parts, by two poses."""
    for sensor, light, parts in ((SENSOR, LIGHT, 5), ((45, 225), (30, 345), 2)):
        scene = small(task1, UNEVEN).model_copy(update={"settings": (Setting(sensor=sensor, light=light),)})
        found = shifts(scene, 0, parts)
        sigma = np.sqrt(found.variance)
        assert np.std(found.measured - found.predicted) < 0.1 * sigma  # margin: a tenth of the scatter is the claim
        # margin: a tenth of the scatter is the claim
        assert abs(np.mean(found.measured - found.predicted)) < 0.1 * sigma
        assert np.abs(found.measured).max() > 0.5 * sigma  # margin: that there is a shift to be told


def test_scatter_over_parts_is_the_predicted_variance(task1):
    """Shifts of 200 parts against the variance over parts: a chi-square test; others are rejected."""
    moved, count = [], 200
    for seed in range(count):
        moved.append(texture_errors(pictures(small(task1, part(seed)))).shifts[0][0])

    def p_value(**values):
        variance = texture_errors(pictures(small(task1, part(0, **values)))).variances[0][0]
        statistic = np.sum(np.square(moved)) / variance
        return 2 * min(stats.chi2.cdf(statistic, count), stats.chi2.sf(statistic, count))

    assert p_value() > 0.01
    for wrong in (0.75, 1.33):
        assert p_value(contrast=wrong * UNEVEN.contrast) < 1e-3
    assert p_value(correlation=2 * UNEVEN.correlation) < 1e-3


def test_without_textures_nothing_is_said_of_them(task1):
    assert texture_errors(pictures(task1)) is None
    assert planner.predict(task1, SENSOR, LIGHT).measurands[0].texture_variance_object is None


def test_a_dark_or_hidden_face_adds_nothing_and_contrast_adds_up(task1):
    """On the bottom nothing is seen of it; twice the contrast is four times the variance; two faces add theirs."""

    def variance(*textures):
        return texture_errors(pictures(small(task1, *textures), (30, 135), (40, 170))).variances[0][0]

    one = variance(UNEVEN)
    assert variance(part(0, faces=("bottom",))) == 0
    assert variance(part(0, contrast=0.06)) == pytest.approx(4 * one, rel=1e-6)
    back = variance(part(0, faces=("back",)))
    assert back > 0
    assert variance(part(0, faces=("top", "back"))) == pytest.approx(one + back, rel=1e-5)


@pytest.mark.render
def test_a_print_near_an_edge_moves_it_as_predicted(task1, label):
    """A grey bar 0.45 cm from an edge, seen as 3.6 px: the bias of the rendered picture, not that without it."""
    levels = np.full((8, 40), 255.0)
    levels[2:6] = 150.0
    bar = label(levels, origin=(2.0, 7.15, 2.5), width=8.0, height=0.5)
    scene, bare = textured(task1, bar), textured(task1)
    sensor, light = (30, 90), (15, 270)
    found, even = (planner.predict(each, sensor, light) for each in (scene, bare))
    truth = measure.distance(render.image(scene, sensor, light), scene, sensor, light).value_px - found.value_px
    assert abs(found.bias_px - even.bias_px) > 0.003  # margin: that there is a shift to be told
    # margin: first order, 10 % off; without the print all of it is missed
    assert found.bias_px == pytest.approx(float(truth), abs=0.15 * abs(found.bias_px - even.bias_px))


@pytest.mark.render
def test_propagation_knows_the_part_and_tells_of_the_others(task1):
    """A part whose shift is far above the noise is still ok, for the shift is predicted; its variance is told apart."""
    scene = textured(task1, part(3, contrast=0.1, correlation=0.4))
    image = render.image(scene, SENSOR, LIGHT)
    found = measure.propagate(image, scene, SENSOR, LIGHT)
    assert abs(found.bias_px) > 3 * found.variance_px2**0.5  # margin: far above the noise is what is said, 6 sigma here
    assert found.status == "ok"
    assert found.measurands.texture_variance_image[0] > 4 * found.variance_px2
    plain = measure.propagate(image, textured(task1), SENSOR, LIGHT)
    assert plain.status == "clutter"
    assert plain.measurands.texture_variance is None


def test_effects_tell_of_textures(task1):
    def decision(scene):
        (found,) = [each for each in render.effects(scene) if each.effect.name == "texture"]
        return found

    even = decision(task1)
    assert (even.on, even.reason, even.influence.bias_px) == (False, "the faces are even", 0)
    for contrast, on in ((0.05, True), (1e-4, False)):
        scene = task1.model_copy(update={"textures": (part(0, contrast=contrast),)})
        found = decision(scene)
        assert found.on is on
        sigma = (
            max(
                planner.predict(scene, each.sensor, each.light).measurands[0].texture_variance_image
                for each in scene.settings
            )
            ** 0.5
        )
        assert found.influence.bias_px == pytest.approx(4 * sigma)
        assert found.effect.without(scene).textures == ()


def test_plan_tells_of_textures(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["ice", "plan", "printed_label", *AT, "--no-check", "--json"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code in (0, None)
    told = json.loads(capsys.readouterr().out)["measurands"][0]
    assert 0 < told["sigma_texture_image"] < 0.1
    assert told["bias"] != 0


def test_what_is_not_known_is_not_told():
    """On a plate with a hole and an uneven top: at outer edges the scatter is known, at the hole it is not."""
    scene = scenes.load("plate")
    scene = scene.model_copy(update={"textures": (part(0, faces=(), where="top"),)})
    told = planner.predict(scene, scene.settings[0].sensor, scene.settings[0].light).measurands
    known = {each.name: np.isfinite(each.texture_variance_object) for each in told}
    assert known == {
        "hole to corner": False, "bore": False, "length": True, "square": True, "hole from front": False,
    }  # fmt: skip
    assert all(np.isnan(each.bias_object) != known[each.name] for each in told)


def test_measurands_are_joint(task1):
    """Gradients of all quantities meet the one covariance of the lines: an angle of two parallel sides too."""
    scene = scenes.load("printed_label")
    found = texture_errors(pictures(scene))
    assert found.covariance.shape == (2 * len(measurands(pictures(scene)).view.names),) * 2
    assert np.linalg.eigvalsh(found.covariance).min() > -1e-12 * np.abs(found.covariance).max()


@pytest.mark.render
def test_a_run_tells_the_scatter_over_parts_beside_the_noise(tmp_path, task1):
    """Only where there are textures; the bias that is judged is the rendered part's."""
    scene = scenes.load("printed_label")
    scene = scene.model_copy(update={"settings": scene.settings[:1]})
    (told,) = validation.run(scene, renders=60, seed=1, workers=1, out=tmp_path / "a").to_json()["settings"]
    forecast = planner.predict(scene, scene.settings[0].sensor, scene.settings[0].light).measurands[0]
    assert told["predicted"]["texture"] == pytest.approx(forecast.texture_variance_image, rel=1e-12)
    assert told["measurands"][0]["texture"] == pytest.approx(forecast.texture_variance_object, rel=1e-12)
    assert told["predicted_bias"] == 0
    assert abs(told["bias"]) < 4 * np.sqrt(told["empirical"] / 60)
    # margin: that there is a bias to be told from chance, and that the closed form tells it, too
    assert abs(told["correction"]) > 4 * np.sqrt(told["empirical"] / 60)
    assert told["correction"] == pytest.approx(forecast.bias_image, abs=0.3 * np.sqrt(told["empirical"]))
    even = task1.model_copy(update={"settings": task1.settings[:1]})
    (plain,) = validation.run(even, renders=10, seed=1, workers=1, out=tmp_path / "b").to_json()["settings"]
    assert "texture" not in plain["predicted"]
    assert "texture" not in plain["measurands"][0]
