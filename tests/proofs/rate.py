"""What does the batch job cost beside the bare work, in time and memory?"""

from __future__ import annotations

import itertools
import os
import threading
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import scenes
from render import variant as variants
from validation import run
from validation.batch import pool, work
from validation.batch.campaign import Campaign, Grid
from validation.batch.work import CHUNK, Chunks


def rate(
    settings: Annotated[int, typer.Option(help="Settings of the run.")] = 1000,
    renders: Annotated[int, typer.Option(help="Images a setting.")] = 1000,
    workers: Annotated[int, typer.Option(help="Processes; default: one a core.")] = 0,
    sample: Annotated[int, typer.Option(help="Settings measured without the batch, in this process.")] = 10,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Run directory.")] = Path("runs/rate"),
) -> None:
    """Run a grid of poses; print the rate against (workers x the rate of one bare process), and the memory."""
    workers, grid = workers or pool.cores(), poses(settings)
    bare = [_bare(grid, renders, sample)]
    with _Memory() as memory:
        started, cpu = time.perf_counter(), _cpu()
        found = run(grid, renders, 1, out, workers, fresh=True)
        wall, cpu = time.perf_counter() - started, _cpu() - cpu
    bare.append(_bare(grid, renders, sample))  # before and after: the machine may be shared
    working = sum(value for key, value in found.seconds.items() if key not in ("wall", "workers"))
    images, single = renders * len(grid), float(np.mean([found[0] for found in bare]))
    print(f"{len(grid)} settings x {renders} images on {found.variant}, {workers} workers: {wall:.1f} s")
    print(f"rate {images / wall:.0f} images/s; one bare process {bare[0][0]:.0f} before, {bare[1][0]:.0f} after")
    print(f"rate / (workers x bare): {images / wall / workers / single:.3f}")
    print(f"overhead: workers were idle or starting for {workers * wall / working - 1:.1%} of their working time")
    alone = np.mean([found[1] for found in bare])
    print(
        f"processor time, which a shared machine changes least: {1e3 * cpu / images:.2f} ms an image, "
        f"bare {1e3 * alone:.2f}: overhead {cpu / images / alone - 1:.1%}"
    )
    print(f"peak memory of all processes: {memory.peak / 2**20:.0f} MiB (run file {_size(out) / 2**20:.0f} MiB)")


def poses(settings: int) -> Campaign:
    """Task1 under a grid of about as many poses from where the top of the block is well seen and lit."""
    side = max(1, round(settings**0.25))
    rest = max(1, round(settings / side**3))
    angles = np.linspace(0, 360, rest, endpoint=False)
    grid = Grid(
        sensor_polar=tuple(np.linspace(20, 50, side)),
        sensor_azimuth=tuple(np.linspace(100, 160, side)),
        light_polar=tuple(np.linspace(10, 40, side)),
        light_azimuth=tuple(angles),
    )
    return Campaign(name="rate", scenes=(scenes.load("task1"),), grid=grid)


def _cpu() -> float:
    """Processor seconds of this process and its ended children."""
    return sum(os.times()[:4])


def _bare(campaign: Campaign, renders: int, sample: int) -> tuple[float, float]:
    """Images a second, and processor seconds an image, of one process that does the same work and stores nothing."""
    chunks = tuple((i, min(CHUNK, renders - first)) for i, first in enumerate(range(0, renders, CHUNK)))
    picked = np.unique(np.linspace(0, len(campaign) - 1, sample).astype(int)).tolist()
    tasks = [Chunks(campaign.case(i), chunks, 1, variants.choose()) for i in picked]
    work.perform(Chunks(tasks[0].case, ((0, 1),), 1, variants.choose()))  # loads the renderer
    started, cpu = time.perf_counter(), _cpu()
    for task in tasks:
        work.perform(task)
    images = renders * len(tasks)
    return images / (time.perf_counter() - started), (_cpu() - cpu) / images


def _size(directory: Path) -> int:
    return sum(file.stat().st_size for file in directory.glob("run.sqlite*"))


class _Memory:
    """Greatest memory of this process and its children together, bytes; shared pages counted once (PSS)."""

    def __init__(self) -> None:
        self.peak, self._stop = 0, threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> _Memory:
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._stop.set()
        self._thread.join()

    def _watch(self) -> None:
        import psutil  # comes with the extra dask

        me = psutil.Process()
        for _ in itertools.count():
            total = 0
            for process in (me, *me.children(recursive=True)):
                try:
                    total += process.memory_full_info().pss
                except psutil.Error:
                    continue
            self.peak = max(self.peak, total)
            if self._stop.wait(0.5):
                return
