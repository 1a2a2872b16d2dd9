"""``python -m tests.proofs splined``: are splined lenses proposed where they should be, and their covariances true?

Boards through a lens with waves of 1.5 px over the image, which no polynomial in the radius has, and through a plain
lens. Projections of each calibration are compared with the truth after the best rotation, by the largest modes of what
is told: pulls have to scatter by 1 within 10 %. Exit status 1 if not, or if a lens is proposed that should not be.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated

import numpy as np
import typer

import measure
from tests.boards import SMALL, poses
from tests.unit.test_splined import SHAPE, Wavy, boards, modes

_MODES, _MODEL = 20, "splined"
_WAVE_PX = 1.5


def splined(
    runs: Annotated[int, typer.Option(help="Sets of boards, measured in noise, for the pulls.")] = 20,
    choices: Annotated[int, typer.Option(help="Sets of boards of each lens, of which one is proposed.")] = 5,
    count: Annotated[int, typer.Option(help="Boards of a set.")] = 16,
) -> None:
    """Splined lenses: what is proposed, and pulls of projections; minutes."""
    seen = poses(SMALL, count, np.random.default_rng(5), 420.0)
    truth = SimpleNamespace(model=Wavy(_WAVE_PX), values=SMALL.values, covariance=np.zeros((0, 0)), image_shape=SHAPE)
    pulls, states = [], []
    for run in range(runs):
        given = boards(truth.model, seen, np.random.default_rng([run, 1]))
        found = measure.calibrate_camera(given, SMALL.square, SHAPE, _MODEL)
        states.append(found.status)
        pulls.append(modes(measure.projection_difference(found, truth, 0.2), _MODES))
    spread = float(np.sqrt((np.array(pulls) ** 2).mean()))
    error = spread / np.sqrt(2 * np.size(pulls))
    print(
        f"{runs} calibrations, {states.count('ok')} ok: pulls of {_MODES} modes spread by {spread:.3f} +- {error:.3f}, "
        f"mean {np.mean(pulls):+.3f} +- {1 / np.sqrt(np.size(pulls)):.3f}", flush=True,
    )  # fmt: skip
    good = abs(spread - 1) < 0.1
    for wave, wanted in ((_WAVE_PX, True), (0.0, False)):
        chosen = []
        for run in range(choices):
            given = boards(Wavy(wave), seen, np.random.default_rng([run, 2]))
            compared = measure.compare_models(given, SMALL.square, SHAPE)
            chosen.append(compared.proposed == _MODEL)
        print(
            f"waves of {wave:g} px: splines proposed in {sum(chosen)} of {choices} (the last: "
            f"{compared.rms_px[0]:.4f} px by coefficients, {compared.rms_px[1]:.4f} by splines, p = "
            f"{compared.p_value:.2g})", flush=True,
        )  # fmt: skip
        good &= all(each == wanted for each in chosen)
    raise typer.Exit(0 if good else 1)
