"""``python -m tests.proofs emva``: does EMVA 1288's evaluation give back what went into our sensor?

A bench is simulated: pairs of evenly lit frames from darkness to beyond saturation, and stacks of dark and half bright
ones, exposed by `render.expose`. It is evaluated by the reference implementation (the package emva1288, where it is
installed) and by the standard's formulas written here (release 3.0, sections 6 and 8), which share no code with either.
The mean of several benches, each with another fixed pattern, has to be what went in, within its own standard error.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated
from unittest import mock

import numpy as np
import typer
from scipy import stats

from render import expose
from scenes import Noise

QUANTUM_EFFICIENCY = 0.5
SENSOR = Noise(sigma=2.0, gain=0.3, dark_level=60.0, prnu=0.008, dsnu=1.2, bits=12)
_LEVEL = 0.001  # of the whole table (Sidak)


@dataclass(frozen=True, eq=False)
class Bench:
    """Frames by photons a pixel: pairs (2, height, width), and stacks (n, height, width) of darkness and half light."""

    pairs: dict[float, np.ndarray]
    stacks: dict[float, np.ndarray]


def bench(noise: Noise, rng: np.random.Generator, size: tuple[int, int], steps: int, frames: int) -> Bench:
    """A simulated bench: so many steps from darkness to 1.1 times saturation, stacks of so many frames."""
    noise = noise.model_copy(update={"pattern_seed": int(rng.integers(2**31))})
    full = 2**noise.bits - 1 - noise.dark_level
    photons = np.linspace(0, 1.1 * full / (noise.gain * QUANTUM_EFFICIENCY), steps)

    def frame(light: float, count: int) -> np.ndarray:
        level = noise.dark_level + noise.gain * QUANTUM_EFFICIENCY * light
        return expose(np.full(size, level), noise, rng, count).astype(np.uint16)

    half = float(photons[np.argmin(np.abs(photons - photons[-1] / 2.2))])
    return Bench({float(p): frame(p, 2) for p in photons}, {p: frame(p, frames) for p in (0.0, half)})


def by_formulas(made: Bench) -> dict[str, float]:
    """By the standard's formulas: gain and responsivity as slopes through the origin up to 70 % of saturation."""
    photons = np.array(sorted(made.pairs))
    pairs = [made.pairs[p].astype(float) for p in photons]
    means = np.array([pair.mean() for pair in pairs])
    variances = np.array([((a - b) ** 2).mean() / 2 - (a.mean() - b.mean()) ** 2 / 2 for a, b in pairs])
    signal, noise = means - means[0], variances - variances[0]
    some = signal <= 0.7 * signal[np.argmax(variances)]
    dark, half = (made.stacks[p].astype(float) for p in sorted(made.stacks))
    spread = [stack.mean(0).var(ddof=1) - stack.var(0, ddof=1).mean() / len(stack) for stack in (dark, half)]
    return {
        "K": float(signal[some] @ noise[some] / (signal[some] @ signal[some])),
        "R": float(photons[some] @ signal[some] / (photons[some] @ photons[some])),
        "sigma_y_dark": float(np.sqrt(variances[0])),
        "DSNU": float(np.sqrt(max(spread[0], 0.0))),
        "PRNU": float(np.sqrt(max(spread[1] - spread[0], 0.0)) / (half.mean() - dark.mean())),
    }


def by_package(made: Bench) -> dict[str, float]:
    """By the reference implementation; ImportError where it is not installed."""
    from emva1288.process.data import Data1288
    from emva1288.process.loader import LoadImageData
    from emva1288.process.results import Results1288

    with tempfile.TemporaryDirectory() as folder:
        names = {}
        for kind, known in (("temporal", made.pairs), ("spatial", made.stacks)):
            for which, (photons, frames) in enumerate(known.items()):
                for i, frame in enumerate(frames):
                    file = Path(folder) / f"{kind}{which}-{i}.npy"
                    np.save(file, frame)
                    names.setdefault(kind, {1.0: {}})[1.0].setdefault(photons, []).append(str(file))
        # its release 1.0.2 still calls what NumPy 2 has no longer
        with mock.patch.object(np, "asfarray", lambda values: np.asarray(values, float), create=True):
            found = Results1288(Data1288(LoadImageData(names, fload=np.load).data).data)
            return {
                "K": float(found.K), "R": float(found.R), "sigma_y_dark": float(found.sigma_y_dark),
                "DSNU": float(found.DSNU1288_DN()), "PRNU": float(found.PRNU1288) / 100,
            }  # fmt: skip


def truth(noise: Noise) -> dict[str, float]:
    """What an evaluation has to give back: dark noise with the variance of rounding in it."""
    return {
        "K": noise.gain, "R": noise.gain * QUANTUM_EFFICIENCY, "sigma_y_dark": noise.variance**0.5, "DSNU": noise.dsnu,
        "PRNU": noise.prnu,
    }  # fmt: skip


def returned(evaluate: Callable[[Bench], dict[str, float]], benches: list[Bench], noise: Noise) -> dict[str, dict]:
    """Of each parameter what went in, the mean over benches, its standard error, and the p of their difference."""
    rows, told = [evaluate(made) for made in benches], {}
    for name, wanted in truth(noise).items():
        values = np.array([row[name] for row in rows])
        told[name] = {
            "in": wanted, "out": float(values.mean()), "error": float(values.std(ddof=1) / np.sqrt(len(values))),
            "p": float(stats.ttest_1samp(values, wanted).pvalue),
        }  # fmt: skip
    return told


def agrees(told: dict[str, dict]) -> bool:
    """Whether no difference is beyond chance."""
    return min(row["p"] for row in told.values()) > 1 - (1 - _LEVEL) ** (1 / len(told))


def emva(
    benches: Annotated[int, typer.Option()] = 20,
    size: Annotated[int, typer.Option(help="Pixels along each side.")] = 256,
    steps: Annotated[int, typer.Option()] = 30,
    frames: Annotated[int, typer.Option()] = 16,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Parameters of a simulated EMVA 1288 bench, given back by its evaluation; 1 minute."""
    rng = np.random.default_rng(seed)
    made = [bench(SENSOR, rng, (size, size), steps, frames) for _ in range(benches)]
    ways = {"formulas": by_formulas} | ({"package emva1288": by_package} if find_spec("emva1288") else {})
    found = {name: returned(way, made, SENSOR) for name, way in ways.items()}
    print(json.dumps({"benches": benches, "size": size, "steps": steps, "frames": frames, **found}, indent=1))
    if len(ways) == 1:
        print("The package emva1288 is not installed, so its evaluation was left out.")
    raise typer.Exit(0 if all(map(agrees, found.values())) else 1)
