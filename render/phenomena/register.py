"""All effects, and the decision which of them a scene or one of its settings calls for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from imaging.pictures import Pictures
from render.phenomena.base import EFFECTS, EVERYTHING, NOTHING, Effect, EffectTolerance, Influence
from render.phenomena.lens import DepthOfField, LensBlur, LensDistortion, RelativeIllumination
from render.phenomena.pose import PoseJitter
from render.phenomena.sensor import FixedPattern, Quantisation, ReadNoise, Saturation, ShotNoise
from render.phenomena.shading import (
    Analyser,
    AttachedShadow,
    BacklightShown,
    FallOff,
    LightSize,
    Polarisation,
    SpecularLobe,
    Spill,
    Texture,
    Wavelength,
)
from render.phenomena.transport import CastShadow, FloorReflectance, Interreflection
from scenes import InvalidInput, Picture, Scene
from scenes.errors import given

DIMMED = RelativeIllumination()
for _effect in (
    AttachedShadow(), CastShadow(), Interreflection(), FloorReflectance(), SpecularLobe(), Polarisation(),
    Analyser(), Wavelength(), Texture(), FallOff(), LightSize(), BacklightShown(), Spill(), DepthOfField(),
    LensBlur(), LensDistortion(), DIMMED, ShotNoise(), ReadNoise(),
    FixedPattern(), Quantisation(), Saturation(), PoseJitter(),
):  # fmt: skip
    EFFECTS.add(_effect.name)(_effect)


@dataclass(frozen=True)
class Decision:
    """Whether an effect is simulated.

    Attributes
    ----------
    effect : Effect
    on : bool
    reason : str
    influence : Influence
        Estimated bound; exactly zero where the effect cannot matter.
    """

    effect: Effect
    on: bool
    reason: str
    influence: Influence


@dataclass(frozen=True)
class ChosenEffects:
    """The scene reduced to the effects that are simulated, their names, and why."""

    scene: Scene
    active: frozenset[str]
    decisions: tuple[Decision, ...]


def effects(
    scene: Scene, tolerance: EffectTolerance = EffectTolerance(), wanted: str | Iterable[str] = "auto"
) -> tuple[Decision, ...]:
    """Which effects the scene's settings call for, all settings together, or which the user wants instead.

    Examples
    --------
    >>> import scenes
    >>> [d.effect.name for d in effects(scenes.load("task1")) if d.on][:3]
    ['attached_shadow', 'fall_off', 'lens_blur']

    Raises
    ------
    InvalidInput
        If the scene has no settings, or an effect is unknown.
    """
    if not isinstance(scene, Scene):
        raise InvalidInput(f"scene must be a Scene, got {given(scene)}")
    asked = None if wanted == "auto" else named(wanted)
    if not scene.settings:
        raise InvalidInput(f"{scene.name}: settings must be a list of at least one sensor and light, got none")
    found = _decisions(of_settings(scene), tolerance)
    return found if asked is None else tuple(_overruled(decision, asked) for decision in found)


def choose(
    scene: Scene, wanted: str | Iterable[str], tolerance: EffectTolerance, picture: Picture | None = None
) -> ChosenEffects:
    """Reduce a scene to the wanted effects.

    Parameters
    ----------
    wanted : {"auto", "all"} or iterable of str
    tolerance : EffectTolerance
        What ``auto`` may leave out.
    picture : Picture, optional
        Decide for one setting; for all of the scene's when not given.

    Raises
    ------
    InvalidInput
        If an effect is unknown.
    """
    if wanted == "auto":
        decisions = _decisions(of_settings(scene) if picture is None else of_settings(scene, picture), tolerance)
        active = frozenset(decision.effect.name for decision in decisions if decision.on)
    else:
        decisions, active = (), named(wanted)
    reduced = scene
    for name in set(EFFECTS) - active:
        reduced = EFFECTS[name].without(reduced)
    return ChosenEffects(reduced, active, decisions)


def named(wanted: str | Iterable[str]) -> frozenset[str]:
    """Names of effects, from a list or from text: "all", or names with commas between.

    Raises
    ------
    InvalidInput
        If there is no such effect.
    """
    if wanted == "all":
        return frozenset(EFFECTS)
    names = frozenset(wanted.split(",") if isinstance(wanted, str) else wanted) - {""}
    unknown = sorted(names - set(EFFECTS))
    if unknown:
        raise InvalidInput(f"effects must be auto, all or some of {', '.join(EFFECTS)}, got {unknown[0]!r}")
    return names


def _overruled(decision: Decision, asked: frozenset[str]) -> Decision:
    on = decision.effect.name in asked
    return replace(decision, on=on, reason="asked for" if on else "not asked for")


def of_settings(scene: Scene, *pictures: Picture) -> Pictures:
    """The pictures asked about, as one set: those given, or those of the scene's settings."""
    pictures = pictures or tuple(Picture.of(scene, each.sensor, each.light) for each in scene.settings)
    lights = tuple(np.array([list(p.lights[i]) for p in pictures]) for i in range(len(scene.lights)))
    return Pictures(scene, np.array([list(p.sensor) for p in pictures]), lights)


def _decisions(pictures: Pictures, tolerance: EffectTolerance) -> tuple[Decision, ...]:
    return tuple(_decide(effect, pictures, tolerance) for effect in map(EFFECTS.__getitem__, EFFECTS))


def _decide(effect: Effect, pictures: Pictures, tolerance: EffectTolerance) -> Decision:
    absent = effect.absent(pictures)
    if absent is not None:
        return Decision(effect, False, absent, NOTHING)
    # formulas of influence are those of edges: of a limb all is simulated that can matter
    influence = EVERYTHING if pictures.scene.solid.curved else effect.influence(pictures)
    if effect.cost == 1.0:
        return Decision(effect, True, "free", influence)
    on = tolerance.exceeded_by(influence)
    return Decision(effect, on, "above the tolerance" if on else "below the tolerance", influence)
