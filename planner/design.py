"""What a plan may choose beside poses: the angles of two polarisers, a lamp and a filter; and what light they cost.

The one place that turns a choice into a scene. A polarised light is a lamp behind an ideal polariser, which passes half
of it; an analyser passes half of unpolarised light (`scenes.Brdf`); a lamp brings its power, a filter
passes what the lamp's spectrum, the lens and the sensor leave of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Literal, get_args

import numpy as np

from scenes import Filter, InvalidInput, Lamp, Material, Pose, Scene

Vary = Literal["analyser", "polarisation", "band"]
Hold = Literal["time", "white"]
DEFAULT_HOLD: Hold = "time"
_WHITE = Material()


@dataclass(frozen=True)
class Choice:
    """What stands before lens and lamp.

    Attributes
    ----------
    analyser_deg, polarisation_deg : float or None
        As `Camera.analyser_deg` and `Light.polarisation_deg`, degrees; None without a polariser.
    lamp, filter : str or None
        Names from the scene's lists; None for its own lamp, and for no filter beside its own.
    """

    analyser_deg: float | None
    polarisation_deg: float | None
    lamp: str | None = None
    filter: str | None = None

    @property
    def band(self) -> str:
        """Lamp and filter in words.

        >>> Choice(None, None, "red").band, Choice(None, None, filter="550 nm").band
        ('red', 'own lamp, 550 nm')
        """
        lamp = self.lamp or "own lamp"
        return lamp if self.filter is None else f"{lamp}, {self.filter}"


def own_choice(scene: Scene) -> Choice:
    """The scene's own."""
    return Choice(scene.camera.analyser_deg, scene.lights[0].polarisation_deg)


def check_vary(scene: Scene, vary: tuple[str, ...], hold: str) -> None:
    """See that what is to be varied is known, and that the scene says what it needs.

    Raises
    ------
    InvalidInput
        If it is not.
    """
    known = get_args(Vary)
    if not vary or len(set(vary)) < len(vary) or not set(vary) <= set(known):
        raise InvalidInput(f"vary must be some of {', '.join(known)}, each once, got {','.join(vary)!r}")
    if hold not in get_args(Hold):
        raise InvalidInput(f"hold must be one of {', '.join(get_args(Hold))}, got {hold!r}")
    if len(scene.lights) != 1 or not scene.free:
        raise InvalidInput(f"vary must be left out but for one light that is free, got {len(scene.lights)} light(s)")
    if "band" in vary:
        _check_bands(scene)


def _check_bands(scene: Scene) -> None:
    if not scene.lamps and not scene.filters:
        raise InvalidInput(f"{scene.name}: lamps or filters must be given to vary the band, got none")
    if not scene.material.dispersion:
        raise InvalidInput(
            f"{scene.name}: material.index_table must be given to vary the band (else nothing but the amount of light"
            " depends on it), got none"
        )
    if len(bands_of(scene)) < 2:
        table = scene.material.dispersion
        raise InvalidInput(
            f"{scene.name}: lamps and filters must let some light pass within material.index_table"
            f" ({table[0][0]:g} to {table[-1][0]:g} nm), got none"
        )


def bands_of(scene: Scene) -> list[tuple[str | None, str | None]]:
    """All pairs of a lamp and a filter that pass any light; the scene's own first."""
    lamps = [None, *(lamp.name for lamp in scene.lamps)]
    filters = [None, *(filter_.name for filter_ in scene.filters)]
    own = own_choice(scene)
    pairs = list(product(lamps, filters))
    return [
        pair for pair in pairs
        if pair == (None, None) or throughput(scene, Choice(own.analyser_deg, own.polarisation_deg, *pair)) > 0
    ]  # fmt: skip


def angles_of(scene: Scene, vary: tuple[str, ...], step_deg: float) -> list[Choice]:
    """The scene's own choice first, then a grid of the angles that are varied, each also none, in its own band."""
    own, grid = own_choice(scene), [None, *np.arange(0.0, 180.0, step_deg).tolist()]
    analysers = grid if "analyser" in vary else [own.analyser_deg]
    polarisations = grid if "polarisation" in vary else [own.polarisation_deg]
    found = [Choice(*pair) for pair in product(analysers, polarisations)]
    return [own, *(choice for choice in found if choice != own)]


def throughput(scene: Scene, choice: Choice) -> float:
    """Light that reaches a white surface and the sensor in the same time, over the scene's own; without the analyser.

    Examples
    --------
    >>> import scenes
    >>> throughput(scenes.load("task1"), Choice(None, 30.0))  # the polariser keeps half
    0.5
    """
    polarisers = [0.5 if c.polarisation_deg is not None else 1.0 for c in (choice, own_choice(scene))]
    return polarisers[0] / polarisers[1] * _band_throughput(scene, choice)


def exposure_time(scene: Scene, choice: Choice, hold: Hold) -> float:
    """How much longer is exposed than with the scene's own choice: 1 for ``time``.

    For ``white`` what makes up for polarisers and filters, so that a white diffuse surface keeps its grey level.
    """
    if hold == "time":
        return 1.0
    passed = [_WHITE.diffuse(c.analyser_deg is not None) for c in (own_choice(scene), choice)]
    return passed[0] / passed[1] / throughput(scene, choice)


def with_choice(scene: Scene, choice: Choice, hold: Hold = DEFAULT_HOLD) -> Scene:
    """The scene with other polarisers, lamp and filter; itself for its own choice.

    Parameters
    ----------
    scene : Scene
    choice : Choice
    hold : {"time", "white"}
        What stays: the exposure time, or the grey level of a white diffuse surface.
    """
    if choice == own_choice(scene):
        return scene
    lamp, filter_ = _lamp(scene, choice), _filter(scene, choice)
    camera = {
        "analyser_deg": choice.analyser_deg,
        "exposure": scene.camera.exposure * throughput(scene, choice) * exposure_time(scene, choice, hold),
    }
    light: dict = {"polarisation_deg": choice.polarisation_deg}
    update: dict = {}
    if lamp or filter_:
        wavelengths = _wavelengths(scene, lamp, filter_)
        update["material"] = scene.material.with_dispersion(_resampled(scene, wavelengths))
        if lamp:
            light["spectrum"] = lamp.spectrum
        if filter_:
            passed = _at(wavelengths, scene.camera.transmission) * _at(wavelengths, filter_.transmission)
            camera["transmission"] = _rows(wavelengths, passed)
    update["camera"] = scene.camera.model_copy(update=camera)
    if light != {"polarisation_deg": own_choice(scene).polarisation_deg}:
        scene = scene.lit_by(scene.lights[0].model_copy(update=light))
    return scene.model_copy(update=update)


def _band_throughput(scene: Scene, choice: Choice) -> float:
    """Power of the lamp times the part that the filter leaves of what the sensor would have counted of it."""
    lamp, filter_ = _lamp(scene, choice), _filter(scene, choice)
    if lamp is None and filter_ is None:
        return 1.0
    wavelengths = _wavelengths(scene, lamp, filter_)
    counted = _at(wavelengths, lamp.spectrum if lamp else scene.lights[0].spectrum)
    counted = counted * _at(wavelengths, scene.camera.transmission) * _at(wavelengths, scene.camera.responsivity)
    whole = np.trapezoid(counted, wavelengths)
    if not whole > 0:
        return 0.0
    left = counted * _at(wavelengths, filter_.transmission if filter_ else ())
    return (lamp.power if lamp else 1.0) * float(np.trapezoid(left, wavelengths) / whole)


def _lamp(scene: Scene, choice: Choice) -> Lamp | None:
    return next((lamp for lamp in scene.lamps if lamp.name == choice.lamp), None)


def _filter(scene: Scene, choice: Choice) -> Filter | None:
    return next((filter_ for filter_ in scene.filters if filter_.name == choice.filter), None)


def _wavelengths(scene: Scene, lamp: Lamp | None, filter_: Filter | None) -> np.ndarray:
    """Those of the material's table, and within it of all curves, so that none falls between two, nm."""
    table = [row[0] for row in scene.material.dispersion]
    curves = scene.camera.transmission, scene.camera.responsivity
    own = lamp.spectrum if lamp else scene.lights[0].spectrum
    rows = [row[0] for curve in (*curves, own, filter_.transmission if filter_ else ()) for row in curve]
    return np.array(sorted({*table, *(w for w in rows if table[0] <= w <= table[-1])}))


def _at(wavelengths: np.ndarray, curve: tuple) -> np.ndarray:
    return np.interp(wavelengths, *np.asarray(curve).T) if len(curve) else np.ones(len(wavelengths))


def _resampled(scene: Scene, wavelengths: np.ndarray) -> tuple:
    table = np.array(scene.material.dispersion)
    return _rows(wavelengths, *(_at(wavelengths, table[:, [0, i]]) for i in (1, 2)))


def _rows(*columns: np.ndarray) -> tuple:
    return tuple(map(tuple, np.column_stack(columns).tolist()))


@dataclass(frozen=True)
class Chosen:
    """A setting with its choice.

    Attributes
    ----------
    choice : Choice
    scene : Scene
        With that choice: ready to predict, render and measure.
    sensor, light : Pose
    variance : float
        What is minimised, as `Plan.variance`.
    status : str
        The worst of the measurands.
    exposure_time : float
        Over that of the scene's own choice.
    """

    choice: Choice
    scene: Scene
    sensor: Pose
    light: Pose
    variance: float
    status: str
    exposure_time: float


@dataclass(frozen=True)
class Varied:
    """What varying more than the poses gains.

    Attributes
    ----------
    vary : tuple of str
    hold : {"time", "white"}
        What is equal: exposure time, or the grey level of a white diffuse surface.
    fixed : Chosen
        The scene's own choice at its best poses: the plan's, after the same descent.
    same_poses : Chosen
        The best choice at those poses.
    best : Chosen
        Poses and choice together.
    evaluated : int
        Settings evaluated.
    guarantee : str
        What is known about the optimum.
    """

    vary: tuple[str, ...]
    hold: str
    fixed: Chosen
    same_poses: Chosen
    best: Chosen
    evaluated: int
    guarantee: str

    @property
    def gain(self) -> float:
        """Variance of the fixed choice over that of the best one, each at its own poses; never below 1."""
        return self.fixed.variance / self.best.variance

    @property
    def gain_same_poses(self) -> float:
        """The same at the poses of the fixed choice."""
        return self.fixed.variance / self.same_poses.variance
