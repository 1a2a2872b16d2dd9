"""What a fit gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scenes import Picture, Scene

HELD = "ill_conditioned"
"""Status of a parameter that photographs do not tell."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A scene fitted to photographs.

    Attributes
    ----------
    names, units : tuple of str
        Of q parameters: keys of the scene; ``aim.right`` and ``aim.down`` [length], how far ``camera.look_at`` has
        moved along the first sensor's axes at the start; ``sensor.polar``, ``light.azimuth`` [degrees], with the number
        of the pose behind them where there are several; ``noise.sigma`` and ``noise.gain`` where they are estimated.
    start, values : ndarray, shape (q,)
    covariance : ndarray, shape (q, q)
        Inverse Fisher information: variances, not standard errors; 0 for what is held, on whose value rests that of
        what goes with it.
    statuses : tuple of str
        "ok", or "ill_conditioned": the photographs do not tell it, and it is held at its start, or where it is
        likeliest if its start leaves a misfit or that is a bound (a light just behind a dark face), or it goes with
        something that is held.
    status : str
        "ok"; "misfit" where the photographs are not what the model says, and neither values nor standard errors are to
        be trusted, a tone curve that was not undone among that; "ill_conditioned" where something is held;
        "tone_unknown" where neither files nor photographs tell whether levels are linear in the light, and a value
        would move by more than 0.3 standard errors; "low_contrast" where nothing stands out of the noise.
    p_value : float
        Goodness of fit.
    scene : Scene
        The fitted scene; its settings are the fitted poses.
    pictures : tuple of Picture
        One for each pose.
    members : tuple of tuple of int
        Which photographs are of each pose.
    residuals : tuple of ndarray, shape (height, width)
        Mean photograph less model over the noise's standard deviation, 0 beside the pixels that count.
    noise : {"estimated", "repeated", "given"}
        Whence the noise is known: from differences of neighbours, from repetitions (photon transfer), or the scene.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    start: np.ndarray
    values: np.ndarray
    covariance: np.ndarray
    statuses: tuple[str, ...]
    status: str
    p_value: float
    scene: Scene
    pictures: tuple[Picture, ...]
    members: tuple[tuple[int, ...], ...]
    residuals: tuple[np.ndarray, ...]
    noise: Literal["estimated", "repeated", "given"]

    @property
    def standard_errors(self) -> np.ndarray:
        """Square roots of the variances, (q,)."""
        return np.sqrt(np.diag(self.covariance))

    def value(self, name: str) -> float:
        """A parameter's value."""
        return float(self.values[self.names.index(name)])
