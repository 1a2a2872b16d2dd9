"""A sensor's noise by pairs of evenly lit frames: EMVA 1288's photon transfer, with what rows and columns share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenes import InvalidInput, Noise, status
from scenes.arrays import picture

_LINEAR = 0.7  # of the signal whose variance is greatest: up to there the slope is told (EMVA 1288, 6.6)
_BENT = 0.05  # part of a step's variance by which the line may miss it
_TRACE = 1e-6  # of variance, where frames tell none
_SURE = 3.0  # standard errors beyond which rows, columns or a bend are told from chance
_FEWEST = 3  # steps


@dataclass(frozen=True)
class FramePair:
    """What two frames of the same light tell.

    Attributes
    ----------
    level : float
        Mean, grey levels.
    variance : float
        Of a pixel over frames, grey levels^2.
    rows, columns : float
        Part of it that all pixels of a row, of a column share; below 0 by chance.
    pixels : int
    """

    level: float
    variance: float
    rows: float
    columns: float
    pixels: int

    @classmethod
    def of(cls, first: Any, second: Any) -> FramePair:
        """Of two frames (height, width), grey levels.

        Means of neighbouring rows are compared, so that light which changes smoothly between the frames is no noise of
        rows.

        Raises
        ------
        InvalidInput
            If the frames are no images of the same size, of at least 16 x 16 px.

        Examples
        --------
        >>> rng = np.random.default_rng(1)
        >>> frames = 50 + rng.normal(0, 2, (2, 300, 300)) + rng.normal(0, 0.5, (2, 300, 1))
        >>> pair = FramePair.of(*frames)
        >>> bool(abs(pair.variance - 4.25) < 0.1), bool(abs(pair.rows - 0.25) < 0.06), bool(abs(pair.columns) < 0.02)
        (True, True, True)
        """
        first, second = picture(first), picture(second)
        if first.shape != second.shape or min(first.shape) < 16:
            raise InvalidInput(
                f"frames must be of one size, 16 x 16 px or more, got {first.shape[1]} x {first.shape[0]} and "
                f"{second.shape[1]} x {second.shape[0]} px"
            )
        away = (np.asarray(first, float) - second) / np.sqrt(2)
        away -= away.mean()
        variance = float((away**2).mean())
        shares = [np.square(np.diff(away.mean(axis))).mean() / 2 - variance / away.shape[axis] for axis in (1, 0)]
        return cls(float((first.mean() + second.mean()) / 2), variance, *map(float, shares), away.size)


@dataclass(frozen=True)
class PhotonTransfer:
    """The noise of a sensor, how far its variances are from a line, and the noise that follows them.

    Attributes
    ----------
    noise : Noise
        ``sigma``, ``gain``, ``dark_level``, ``bits``, and ``row_sigma`` and ``column_sigma`` where rows or columns
        share more than chance has them share.
    bend : float
        The largest part of a step's variance by which the line misses it.
    status : str
        ``misfit`` where that is beyond chance and more than 5 %: the sensor is not linear, and variances at some
        levels are as much off.
    followed : Noise
        The same with the ``excess`` by which each step's variance differs from the line: for a sensor that is not
        linear.
    """

    noise: Noise
    bend: float
    status: str
    followed: Noise


def photon_transfer(lit: Sequence[FramePair], dark: Sequence[FramePair], bits: int | None = None) -> PhotonTransfer:
    """The noise that pairs of frames tell: the slope of variance over signal, through the origin, is the gain.

    Parameters
    ----------
    lit, dark : sequence of FramePair
        Of each exposure the pair with light and the one without, three exposures or more.
    bits : int, optional
        Of the frames' whole grey levels: their rounding is taken out of ``sigma``.

    Raises
    ------
    InvalidInput
        If there are fewer than three, or not as many dark pairs as lit ones.
    """
    if len(lit) != len(dark) or len(lit) < _FEWEST:
        raise InvalidInput(f"lit and dark must be as many pairs, {_FEWEST} or more, got {len(lit)} and {len(dark)}")
    level, base = (np.array([pair.level for pair in pairs]) for pairs in (lit, dark))
    variance, dark_variance = (np.array([pair.variance for pair in pairs]) for pairs in (lit, dark))
    signal, extra = level - base, variance - dark_variance
    used = signal <= _LINEAR * signal[np.argmax(variance)]
    if used.sum() < _FEWEST or not (signal[used] ** 2).sum() > 0:
        raise InvalidInput(f"lit must have {_FEWEST} steps or more below saturation, got {int(used.sum())}")
    gain = max(float(signal[used] @ extra[used] / (signal[used] @ signal[used])), 0.0)
    rows, columns = (_shared([getattr(pair, name) for pair in dark]) for name in ("rows", "columns"))
    white = float(dark_variance.mean()) - rows - columns - (0.0 if bits is None else 1 / 12)
    noise = Noise(
        sigma=float(np.sqrt(max(white, _TRACE))), gain=gain, dark_level=float(base.mean()), bits=bits,
        row_sigma=float(np.sqrt(rows)), column_sigma=float(np.sqrt(columns)),
    )  # fmt: skip
    missed = np.abs((variance / (dark_variance.mean() + gain * np.maximum(signal, 0.0)))[used] - 1)
    chance = _SURE * np.sqrt(2 / np.array([pair.pixels for pair in lit])[used])
    bent = bool((missed > np.maximum(chance, _BENT)).any())
    told = status.MISFIT if bent else status.OK
    return PhotonTransfer(noise, float(missed.max()), told, _followed(noise, signal[used], extra[used]))


def _followed(noise: Noise, signal: np.ndarray, extra: np.ndarray) -> Noise:
    """The noise with what steps (n,) have beside gain x signal; as it is where light adds none.

    Steps of one signal are one, and light that seems to take noise away leaves a trace of it: few pixels may say so.
    """
    if not noise.gain > 0:
        return noise
    steps = np.unique(signal[signal > 0])
    more = np.array([extra[signal == step].mean() for step in steps])
    beside = np.maximum(more, _TRACE - noise.sigma**2) - noise.gain * steps
    return noise.tried(excess=((0.0, 0.0), *zip(steps.tolist(), beside.tolist(), strict=True)))


def _shared(parts: list[float]) -> float:
    """Mean of what pairs tell of rows or columns, 0 where it may be chance."""
    mean, error = float(np.mean(parts)), float(np.std(parts, ddof=1) / np.sqrt(len(parts)))
    return mean if mean > _SURE * error else 0.0
