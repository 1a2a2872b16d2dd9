"""How much memory does the report of a run of a million settings take?"""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import scenes
from validation.batch.campaign import Campaign, Grid
from validation.batch.job import _identity
from validation.batch.measurands import column
from validation.batch.store import RunFile
from validation.batch.work import Rendering, methods

_IMAGES = 20
_SIGMA_PX = 0.02


def large(
    settings: Annotated[int, typer.Option(help="Settings of the run.")] = 1_000_000,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Run directory.")] = Path("runs/large"),
) -> None:
    """Fabricate a finished run of so many settings, report it, and print the peak memory of the command."""
    made = fabricate(settings, out)
    started = time.perf_counter()
    command = [sys.executable, "-m", "validation.cli", "report", str(out), "--out", str(out / "report")]
    done = subprocess.run(command, capture_output=True, text=True)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(done.stderr or done.stdout)
    sizes = {file.name: file.stat().st_size / 2**20 for file in sorted((out / "report").iterdir())}
    print(", ".join(f"{name} {size:.0f} MiB" for name, size in sizes.items()))
    print(f"{made} settings: peak memory {peak:.0f} MiB, {time.perf_counter() - started:.0f} s")
    sys.exit(done.returncode)


def grid(settings: int) -> Campaign:
    """Task1 under about so many poses."""
    side = max(1, round(settings**0.25))
    rest = max(1, round(settings / side**3))
    polar, azimuth = np.linspace(20, 50, side), np.linspace(100, 160, side)
    axes = Grid(
        sensor_polar=tuple(polar), sensor_azimuth=tuple(azimuth), light_polar=tuple(polar / 2),
        light_azimuth=tuple(np.linspace(0, 359, rest)),
    )  # fmt: skip
    return Campaign(name="large", scenes=(scenes.load("task1"),), grid=axes)


def fabricate(settings: int, directory: Path) -> int:
    """A run file as of a finished run whose distances are as predicted, but for one image in a hundred settings, of
    which there is no value in pixels nor in the scene's unit."""
    campaign, rng = grid(settings), np.random.default_rng(1)
    names = [method.name for method in methods(campaign.scenes[0])]
    store = RunFile(directory, _identity(campaign, _IMAGES, 1, "scalar_rgb", Rendering(), None), fresh=True)
    store.note("effects", {})
    every = range(len(campaign))
    predicted = {"paper": 0.1, "calibrated": _SIGMA_PX**2, "bound": _SIGMA_PX**2 / 2, "value_px": 60.0}
    about = {"name": "distance", "kind": "distance", "unit": "cm", "value": 60.0, "predicted_bias": 0.0}
    about |= {name: predicted[name] for name in ("paper", "calibrated", "bound")}
    facts = predicted | {"predicted_bias": 0.0, "measurands": [about]}
    texts = json.dumps(facts), json.dumps({"predict": 0.01, "render": 0.1})
    names.append(column(names[0], 0))

    def distances() -> Iterator[tuple]:
        for index in every:
            drawn = 60 + _SIGMA_PX * rng.standard_normal((len(names), _IMAGES))
            if index % 100 == 0:
                drawn[[0, -1], 0] = math.nan
            yield from ((index, 0, name, row.astype("<f8").tobytes()) for name, row in zip(names, drawn, strict=True))

    with store._transaction():
        add = store._db.executemany
        add("INSERT INTO setting VALUES (?, 60, 64, NULL, ?, ?, NULL)", ((index, *texts) for index in every))
        rows = ((index, name, _SIGMA_PX**2, 60.0, "ok") for index in every for name in names)
        add("INSERT INTO propagated VALUES (?, ?, ?, ?, ?)", rows)
        add("INSERT INTO chunk VALUES (?, 0, ?, '{\"expose\": 0.1}')", ((index, _IMAGES) for index in every))
        add("INSERT INTO distance VALUES (?, ?, ?, ?)", distances())
        lost = (names[0], names[-1])
        failed = ((index, 0, name, 0, 1, "short") for index in every if index % 100 == 0 for name in lost)
        add("INSERT INTO failure VALUES (?, ?, ?, ?, ?, ?)", failed)
    store.close()
    return len(campaign)
