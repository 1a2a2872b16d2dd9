"""The register of effects: exact zeros, decisions, and what each looks at."""

import numpy as np
import pytest

import render
import scenes
from imaging.geometry.projection import direction
from planner import Pictures
from render.phenomena import EFFECTS, EffectTolerance, choose
from render.phenomena.edges import brightest
from render.phenomena.register import of_settings
from scenes import Floor, InvalidInput, Noise, Obstacle, Picture, Pose
from scenes.load import load, names

SENSOR, LIGHT = Pose(30, 135), Pose(15, 315)
NEEDED = {
    "glossy_metal": {"specular_lobe", "saturation"},
    "polarised": {"polarisation", "analyser", "specular_lobe"},
    "grey_floor": {"floor", "cast_shadow", "interreflection"},
    "macro": {"depth_of_field"},
    "anodised": {"specular_lobe"},
    "printed_label": {"texture"},
    "low_light": {"shot_noise", "fixed_pattern"},
}


def active(scene, **tolerance):
    return choose(scene, "auto", EffectTolerance(**tolerance), Picture.of(scene, SENSOR, LIGHT)).active


def test_register_has_every_effect_once():
    wanted = (
        "attached_shadow cast_shadow interreflection floor specular_lobe polarisation analyser wavelength fall_off "
        "light_size backlight spill depth_of_field lens_blur lens_distortion shot_noise read_noise fixed_pattern "
        "quantisation saturation pose_jitter texture relative_illumination"
    )
    assert set(EFFECTS) == set(wanted.split())


@pytest.mark.parametrize("name", NEEDED)
def test_bundled_scenes_get_what_they_need_and_task1_does_not(name, task1):
    on = {decision.effect.name for decision in render.effects(scenes.load(name)) if decision.on}
    assert NEEDED[name] <= on
    assert not NEEDED[name] & {d.effect.name for d in render.effects(task1) if d.on}


@pytest.mark.parametrize("name", [name for name in names() if load(name).settings and name != "task1_part1"])
def test_what_cannot_matter_is_exactly_zero_and_neutral(name):
    scene = scenes.load(name)
    for decision in render.effects(scene):
        if decision.reason not in ("free", "above the tolerance", "below the tolerance"):
            assert tuple(decision.influence) == (0, 0)
            assert not decision.on
        bias, variance = decision.influence
        # margin: what is off lies below the tolerance, by its kind
        assert decision.on or (bias <= 0.01 and variance <= 0.05)


def test_tolerance_decides(task1):
    scene = task1.model_copy(update={"floor": Floor(reflectance=1e-3)})
    assert "floor" in active(scene)
    assert not {"floor", "interreflection"} & active(scene, bias_px=0.1, variance=0.1)
    assert choose(scene, "auto", EffectTolerance(0.1, 0.1), Picture.of(scene, SENSOR, LIGHT)).scene.floor is None


def test_decision_is_made_for_the_setting(task1):
    """An upright that shades a required edge from one light and not from the other."""
    scene = task1.model_copy(update={"obstacles": (Obstacle(corner=(14, 0, 0), size=(1, 7.5, 10)),)})
    shades = EFFECTS["cast_shadow"]

    def influence(light):
        return shades.influence(Pictures.of(scene, [[30, 135]], [light]))

    assert influence((40, 0)).variance == np.inf
    assert influence((40, 180)) == (0, 0)


def test_named_effects_and_bad_names(task1):
    assert choose(task1, "floor,lens_blur", EffectTolerance()).active == {"floor", "lens_blur"}
    assert choose(task1, ["floor"], EffectTolerance()).active == {"floor"}
    assert choose(task1, "all", EffectTolerance()).active == set(EFFECTS)
    with pytest.raises(InvalidInput, match=r"effects must be auto, all or some of .*, got 'fog'"):
        choose(task1, "fog", EffectTolerance())
    with pytest.raises(InvalidInput, match="settings must be a list of at least one"):
        render.effects(task1.model_copy(update={"settings": ()}))


def test_depth_of_field_grows_with_the_aperture(task1):
    def influence(radius):
        lens = task1.camera.lens.model_copy(update={"aperture_radius": radius})
        scene = task1.model_copy(update={"camera": task1.camera.model_copy(update={"lens": lens})})
        return next(d.influence for d in render.effects(scene) if d.effect.name == "depth_of_field")

    assert influence(0.2).variance / influence(0.1).variance == pytest.approx(4, rel=0.05)


def test_shaken_poses_scatter_as_said(task1, rng):
    scene = task1.model_copy(update={"jitter": task1.jitter.model_copy(update={"sensor_deg": 0.1})})
    poses = np.array([list(render.shaken(scene, "sensor", SENSOR, rng)) for _ in range(2000)])
    along = (poses - [30, 135]) * [1, np.sin(np.radians(30))]
    assert along.std(0) == pytest.approx(0.1, rel=4 / np.sqrt(2 * 2000))
    assert render.shaken(scene, "light", LIGHT, rng) == LIGHT


@pytest.mark.parametrize("polar", [0.0, 0.3, 90.0, 179.8, 180.0])
@pytest.mark.parametrize("role", ["sensor", "light"])
def test_a_pose_beside_a_pole_is_shaken_across_it(task1, polar, role):
    """By as much as is drawn along the meridian and beside it, in degrees of the sphere, whatever the polar angle."""
    jitter = task1.jitter.model_copy(update={"sensor_deg": 1.5, "light_deg": 0.6})
    scene, sigma = task1.model_copy(update={"jitter": jitter}), 1.5 if role == "sensor" else 0.6
    for seed in range(8):
        away, around = sigma * np.random.default_rng(seed).standard_normal(2)
        found = render.shaken(scene, role, Pose(polar, 40.0), np.random.default_rng(seed))
        turn = np.radians(40 + around / max(np.sin(np.radians(polar)), 0.01))
        there = np.radians(polar + away)
        expected = [np.sin(there) * np.cos(turn), np.sin(there) * np.sin(turn), np.cos(there)]
        assert direction(np.array(list(found))) == pytest.approx(expected, abs=1e-12)


def test_saturation_only_where_levels_reach_the_end(task1):
    assert "saturation" not in active(task1)
    bright = task1.model_copy(update={"noise": Noise(sigma=2.4, bits=7)})
    assert "saturation" in active(bright)


def test_costs(task1):
    """No effect makes a render cheaper; what says that it costs nothing costs 1; what is absent says why."""
    pictures = Pictures.of(task1, np.array([[30.0, 135.0]]), np.array([[15.0, 315.0]]))
    every = {name: EFFECTS[name] for name in EFFECTS}
    reasons = {name: effect.absent(pictures) for name, effect in every.items()}
    assert all(reason is None or reason for reason in reasons.values())
    assert {name: effect.cost >= 1 for name, effect in every.items()} == dict.fromkeys(EFFECTS, True)
    free = {name for name, effect in every.items() if effect.cost == 1}
    assert free == {name for name, effect in every.items() if "costs nothing" in effect.switch}


@pytest.mark.parametrize("name", ["ball", "shaft_ring", "flange"])
def test_curved_surfaces_reach_the_end_of_the_scale(name):
    """The brightest facet that is seen tells it; of the ball, of which nothing else is seen, as a render does."""
    scene = scenes.load(name).with_(noise={"bits": 8, "gain": 0.05})
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
    level = brightest(of_settings(scene, picture))
    seen = render.image(picture, quality=render.Quality(supersample=2, edge_samples=4)).max() - scene.noise.dark_level
    assert level == pytest.approx(seen, rel=0.01) if name == "ball" else 0.5 * seen < level < 1.01 * seen
    for exposure, said in ((1.0, False), (255 / level, True)):
        brighter = scene.with_(camera={"exposure": exposure * scene.camera.exposure})
        told = {each.effect.name: each for each in render.effects(brighter)}
        assert told["saturation"].on == said
