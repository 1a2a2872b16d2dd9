"""Shares that several lights have of the sum of their intensities."""

from __future__ import annotations

from scenes import Scene

_STEP = 0.1  # between shares


def with_shares(scene: Scene, shares: tuple[float, ...]) -> Scene:
    """The scene whose lights have shares of the sum of their intensities."""
    total = sum(light.intensity for light in scene.lights)
    lights = [light.model_copy(update={"intensity": s * total}) for light, s in zip(scene.lights, shares, strict=True)]
    return scene.lit_by(*lights)


def shares_of(scene: Scene) -> tuple[float, ...]:
    """Shares that a scene's lights have of the sum of their intensities."""
    total = sum(light.intensity for light in scene.lights)
    return tuple(light.intensity / total for light in scene.lights)


def shares_of_two(scene: Scene) -> tuple[tuple[float, float], ...]:
    """Shares of two lights in tenths; lights that are alike may change places, so the first has at most half."""
    one, two = (light.model_copy(update={"intensity": 1.0}) for light in scene.lights)
    count = round(1 / _STEP)
    most = count // 2 if one == two and one.mount == "free" else count
    return tuple((i / count, 1 - i / count) for i in range(most + 1))
