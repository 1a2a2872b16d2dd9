"""`fit`: a scene's camera, poses, brightness and noise from photographs of its part."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from imaging.blurred.whole import check_drawable
from measure.fitting.goodness import p_value, parts
from measure.fitting.information import are_alone, are_told, covariance_of
from measure.fitting.likelihood import Problem, most_likely
from measure.fitting.noise import Curve, by_neighbours, by_repetition, curve
from measure.fitting.parameters import Parameters, options_of
from measure.fitting.photograph import Pixels, Shots, grouped
from measure.fitting.result import HELD, Fit
from measure.fitting.sides import flatter_side
from measure.fitting.start import aligned_difference, near, shows_something
from measure.fitting.unmodelled import directions
from measure.goodness import WORST
from measure.photo.noise import noise_sigma
from measure.photo.tone_curve import tone_curve
from scenes import InvalidInput, Noise, Picture, Scene, Setting, several
from scenes.photograph import Photograph
from scenes.status import LOW_CONTRAST, MISFIT, OK, worst

_ROUNDS = 2  # of weights and noise
_GROSS = 50.0  # noise variances: a mean squared residual of more is no part that the scene knows


def fit(
    scene: Scene,
    images: Sequence[Any],
    sensor: Any = None,
    light: Any = None,
    *,
    free: Sequence[str] = (),
    noise: Literal["estimated", "given"] = "estimated",
) -> Fit:
    """Fit a scene to photographs of it, by maximum likelihood with the image model.

    What the photographs do not tell is held where the scene has it; where it is likeliest, if the scene's value is
    none that they can have been taken with.

    Free are the camera's six degrees of freedom (pose, distance, roll, aim), every free light's pose, exposure, level
    of darkness, blur and noise; photographs of several poses share all but the poses. A light's distance is held: it
    is nearly the same as its brightness. Of a telecentric camera the magnification is free in place of the distance,
    which changes nothing.

    Parameters
    ----------
    scene : Scene
        One convex body before darkness, without textures.
    images : sequence of array_like, shape (height, width), or of Photograph
        Grey levels of photographs, linear in the light, as large as the camera's; those that differ by noise alone are
        repetitions of one pose, and tell the noise (`measure.fitting.photograph.grouped`).
    sensor, light : Pose or pair of float, optional
        Where the search begins, degrees, for all photographs; the scene's settings, whichever is nearest, where not
        given. Some 15 degrees off are found back.
    free : sequence of {"focal", "k1"}
        What else is free: focal length (told only by a large object nearby, and not of a telecentric camera), first
        coefficient of distortion.
    noise : {"estimated", "given"}
        Whether the noise is estimated too, or the scene's.

    Returns
    -------
    Fit

    Raises
    ------
    InvalidInput
        If the scene is one of another kind, photographs are not of the camera's size, or there is no pose to begin at.
    """
    check_drawable(scene)
    options = options_of(scene.camera)
    for name in free:
        if name not in options:
            raise InvalidInput(f"free must be some of {', '.join(options)}, got {name!r}")
    if noise not in ("estimated", "given"):
        raise InvalidInput(f"noise must be estimated or given, got {noise!r}")
    if scene.noise.colour is not None:
        raise InvalidInput(
            "noise.colour must be left out to fit a scene, whose pixels count alike, got a colour sensor"
        )
    known = all(image.tone_known for image in images if isinstance(image, Photograph))
    shots = tuple(grouped([image.levels if isinstance(image, Photograph) else image for image in images]))
    _check_size(scene, shots)
    begin = scene.noise if noise == "given" else _guessed(scene.noise, shots)
    pictures = tuple(_nearest(scene, each, sensor, light, begin) for each in shots)
    parameters = Parameters.of(pictures, tuple(free))
    return _fitted(parameters, shots, begin, noise == "estimated", known)


def _check_size(scene: Scene, shots: tuple[Shots, ...]) -> None:
    height, width = shots[0].mean.shape
    camera = scene.camera
    if (width, height) != (camera.width, camera.height):
        raise InvalidInput(
            f"photographs must be {camera.width} x {camera.height} px as the scene's camera, got {width} x {height}"
        )


def _guessed(noise: Noise, shots: tuple[Shots, ...]) -> Noise:
    """The noise before anything else is known."""
    sigma = max(noise_sigma(shots[0].mean) * np.sqrt(shots[0].count), 0.3)
    return noise.model_copy(update={"sigma": sigma, "gain": 0.0})


def _nearest(scene: Scene, shots: Shots, sensor: Any, light: Any, noise: Noise) -> Picture:
    """The nominal picture of a pose: the one given, or that of the settings whose image is most alike."""
    if sensor is not None:
        return Picture.of(scene, sensor, () if light is None and not scene.free else _required(light))
    if light is not None:
        raise InvalidInput("sensor must be given with light, got none")
    if not scene.settings:
        raise InvalidInput("sensor must be given for a scene without settings, got none")
    known = [Picture.of(scene, setting.sensor, setting.lights) for setting in scene.settings]
    if len(known) == 1:
        return known[0]
    return min(known, key=lambda picture: _difference(picture, shots, noise))


def _required(light: Any) -> Any:
    if light is None:
        raise InvalidInput("light must be given with sensor, got none")
    return several(light)


def _difference(picture: Picture, shots: Shots, noise: Noise) -> float:
    """Mean squared difference of smoothed images, once size, place and brightness are alike."""
    return aligned_difference(Parameters.of((picture,)), (shots,), noise)


def _fitted(parameters: Parameters, shots: tuple[Shots, ...], noise: Noise, estimated: bool, known: bool) -> Fit:
    if not all(shows_something(each, noise) for each in shots):
        return _nothing(parameters, shots)
    begin = near(parameters, shots, noise)
    found = _with_held(parameters, shots, begin, noise, estimated, known, parameters.start())
    if found.status != MISFIT or HELD not in found.statuses:
        return found
    other = _with_held(parameters, shots, begin, noise, estimated, known, None)
    return max(found, other, key=lambda each: each.p_value)


def _with_held(parameters, shots, values, noise, estimated, known, at: np.ndarray | None) -> Fit:
    """Fit with the parameters that the photographs do not determine held: at their values in ``at`` (q,), or at the
    most likely values given the others."""
    values, which, told = values.copy(), np.arange(values.size), None
    while True:
        values, noise, told, final = _solved(parameters, shots, values, noise, which, estimated)
        kept = are_told(parameters, which, final[1])
        if kept.all():
            break
        if at is not None:
            values[which[~kept]] = at[which[~kept]]
        which = which[kept]
    p = _goodness(values, noise, told, final)
    problem, white, variance = final
    flat = values if p < WORST else flatter_side(problem, values, noise, which, white, variance)
    if flat is not values:  # what that side does not tell is held where it is
        white = problem.jacobian(flat, noise, which) / np.sqrt(variance)[:, None]
        kept = are_told(parameters, which, white)
        which, white = which[kept], white[:, kept]
    alone = which[are_alone(problem, flat, noise, which, white, variance)]
    return _result(parameters, shots, values, noise, told, (which, covariance_of(white), alone), final, p, known)


def _solved(parameters, shots, values, noise, which, estimated):
    """Values, noise, its curve, and (problem, whitened Jacobian, variance) of the free parameters."""
    told = None
    for _ in range(_ROUNDS):
        pixels = tuple(Pixels.around(parameters.pictures_at(values, k)) for k in range(len(shots)))
        problem = Problem(parameters, shots, pixels)
        variance = problem.variance(values, noise)
        values = most_likely(problem, values, noise, which, variance)
        gross = np.mean((problem.observed() - problem.expected(values, noise)) ** 2 / variance) > _GROSS
        if estimated:
            told = _curve(problem, values, noise)
            noise = told.noise(noise)
        if gross:  # another round would change nothing of that
            break
    variance = problem.variance(values, noise)
    white = problem.jacobian(values, noise, which) / np.sqrt(variance)[:, None]
    return values, noise, told, (problem, white, variance)


def _are_repeated(shots: tuple[Shots, ...]) -> bool:
    """Whether of some pose there are several photographs."""
    return any(each.count > 1 for each in shots)


def _curve(problem: Problem, values: np.ndarray, noise: Noise) -> Curve:
    """Of repetitions where there are any, else of neighbours."""
    repeated = _are_repeated(problem.shots)
    found = []
    for k, shots in enumerate(problem.shots):
        signal = problem.signal(values, k)
        dark = problem.levels(values, noise, k) - signal
        if repeated and shots.count > 1:
            found.append(by_repetition(shots, problem.pixels[k], signal))
        elif not repeated:
            shifted = Shots(shots.mean - float(np.median(dark)), 1, None, shots.members)
            found.append(by_neighbours(shifted, problem.pixels[k], signal, noise.variance))
    signal, variance = (np.concatenate([each[i] for each in found]) for i in (0, 1))
    return curve(signal, variance, np.concatenate([np.full(each[0].size, each[2]) for each in found]))


def _goodness(values: np.ndarray, noise: Noise, told: Curve | None, final) -> float:
    """How likely residuals as large as these are."""
    (problem, white, variance), freedom = final, np.inf if told is None else told.freedom
    sigma, expected = np.sqrt(variance), problem.expected(values, noise)
    rest = (problem.observed() - expected) / sigma
    beside = tuple(each / sigma[:, None] for each in directions(problem, values, noise, expected))
    found = parts(rest, expected / sigma, expected, problem.pixels, white, covariance_of(white), beside)
    return p_value(found, freedom)


def _result(parameters, shots, values, noise, told, errors, final, p, known) -> Fit:
    (which, covariance, alone), (problem, white, variance) = errors, final
    sigma = np.sqrt(variance)
    expected = problem.expected(values, noise)
    rest = (problem.observed() - expected) / sigma
    tone = tone_curve(white * sigma[:, None], expected, rest * sigma, 1 / sigma, white.shape[1]).status(known)
    whole = np.zeros((values.size, values.size))
    whole[np.ix_(which, which)] = covariance
    statuses = tuple(OK if i in alone else HELD for i in range(values.size))
    start, (values, whole) = parameters.start(), parameters.settled(values, whole)
    scene, pictures = _scene(parameters, values, noise)
    names, units = parameters.names, tuple(each.unit for each in parameters.free)
    if told is not None:
        names, units = (*names, "noise.sigma", "noise.gain"), (*units, "levels", "levels/e")
        start, values = (
            np.append(start, [parameters.scene.noise.sigma, parameters.scene.noise.gain]),
            np.append(values, [noise.sigma, noise.gain]),
        )
        whole = _with_noise(whole, told, noise)
        statuses = (*statuses, OK, OK)
    status = MISFIT if p < WORST else worst(tone, HELD if HELD in statuses else OK)
    return Fit(
        names, units, start, values, whole, statuses, status, p, scene, pictures,
        tuple(each.members for each in shots), tuple(_pictures_of(problem, rest)),
        "given" if told is None else "repeated" if _are_repeated(shots) else "estimated",
    )  # fmt: skip


def _nothing(parameters: Parameters, shots: tuple[Shots, ...]) -> Fit:
    """Where a photograph shows nothing, everything is held."""
    start, count = parameters.start(), len(parameters.free)
    return Fit(
        parameters.names, tuple(each.unit for each in parameters.free), start, start, np.zeros((count, count)),
        (HELD,) * count, LOW_CONTRAST, float("nan"), parameters.scene, parameters.pictures,
        tuple(each.members for each in shots), tuple(np.zeros(each.mean.shape) for each in shots), "given",
    )  # fmt: skip


def _with_noise(covariance: np.ndarray, told: Curve, noise: Noise) -> np.ndarray:
    """The covariance with sigma and gain behind: independent of the rest, for normal noise."""
    turn = np.diag([1 / (2 * noise.sigma), 1.0])
    count = len(covariance)
    whole = np.zeros((count + 2, count + 2))
    whole[:count, :count], whole[count:, count:] = covariance, turn @ told.covariance @ turn
    return whole


def _scene(parameters: Parameters, values: np.ndarray, noise: Noise) -> tuple[Scene, tuple[Picture, ...]]:
    """The fitted scene, its settings the fitted poses, and its pictures."""
    bare = parameters.scene_at(values)
    told = bare.camera.model_copy(update={"focal_length_mm": None, "working_distance_mm": None})  # for the nominal pose
    bare = bare.model_copy(update={"camera": told})
    dark = bare.noise.dark_level
    pictures = [parameters.picture_at(values, k) for k in range(len(parameters.pictures))]
    settings = tuple(Setting(sensor=each.sensor, light=tuple(each.lights[i] for i in bare.free)) for each in pictures)
    scene = bare.model_copy(update={"noise": noise.model_copy(update={"dark_level": dark}), "settings": settings})
    return scene, tuple(each.with_scene(scene) for each in pictures)


def _pictures_of(problem: Problem, rest: np.ndarray) -> list[np.ndarray]:
    """The residuals at their places in whole images."""
    found, first = [], 0
    for shots, pixels in zip(problem.shots, problem.pixels, strict=True):
        image = np.zeros(shots.mean.shape)
        image[pixels.y, pixels.x] = rest[first : first + pixels.x.size]
        found.append(image)
        first += pixels.x.size
    return found
