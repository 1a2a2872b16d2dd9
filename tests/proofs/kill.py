"""Does a run that is killed again and again end with the numbers of an unbroken one?"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Annotated, NoReturn

import numpy as np
import typer

from scenes import InvalidInput
from validation.batch.store import RunFile


def kill(
    times: Annotated[int, typer.Option(help="How often the run is killed.")] = 20,
    scene: Annotated[str, typer.Option(help="Scene or campaign.")] = "task1",
    renders: Annotated[int, typer.Option(help="Images a setting.")] = 1000,
    seed: Annotated[int, typer.Option(help="Of the run, and of the moments.")] = 1,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    dask: Annotated[int, typer.Option(help="Workers of a Dask cluster here, one of which is killed each time.")] = 0,
    out: Annotated[Path, typer.Option(metavar="DIR", help="For the two run directories.")] = Path("runs/proof"),
) -> None:
    """Run once unbroken, once killed with SIGKILL at random moments and continued; compare every stored number.

    On a Dask cluster the run goes on, and workers are killed.
    """
    directories = out / "unbroken", out / "killed"
    commands = [_command(scene, renders, seed, workers, directory) for directory in directories]
    for file in (file for directory in directories for file in directory.glob("run.*")):
        file.unlink()
    first, whole = _unbroken(commands[0], directories[0])
    print(f"unbroken: {whole:.1f} s, first result after {first:.1f} s")
    rng, before, landed = np.random.default_rng(seed), 0, 0
    quota = _images(directories[0]) / (times + 1)
    if dask:
        landed = _on_cluster(commands[1], directories[1], dask, quota * (np.arange(times) + rng.uniform(size=times)))
        _say(directories, landed, times, "workers")
    for number in range(times):
        # a random moment, or a random number of results if that comes first, so that the run is not over too soon
        delay, enough = first * rng.uniform(0.5, 2.0), before + quota * rng.uniform()
        ended, seconds = _killed(commands[1], directories[1], delay, enough)
        images = _images(directories[1])
        print(
            f"kill {number + 1}: after {seconds:.2f} s, {images - before} images committed, {images} in all", flush=True
        )
        before, landed = images, landed + (not ended)
    _run(commands[1])
    _say(directories, landed, times, "a running process")


def _say(directories: tuple[Path, Path], landed: int, times: int, hit: str) -> NoReturn:
    equal, what = same(*directories)
    print(f"{landed} of {times} kills hit {hit}; {what}")
    raise typer.Exit(0 if equal and landed == times else 1)


def _on_cluster(command: list[str], directory: Path, workers: int, moments: np.ndarray) -> int:
    """Run upon Dask workers of this machine, the next of which is killed after each of some numbers of images; how many
    were."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0", silence_logs=50
    ) as cluster:
        process, landed = (
            subprocess.Popen([*command, "--dask", cluster.scheduler_address], stdout=subprocess.DEVNULL),
            0,
        )
        nannies = list(cluster.workers.values())
        while process.poll() is None:
            images = _images(directory)
            if landed < len(moments) and images > moments[landed]:
                os.kill(nannies[landed % workers].pid, signal.SIGKILL)
                landed += 1
                print(f"kill {landed}: a worker, after {images} images", flush=True)
            time.sleep(0.05)
    _check(process.returncode)
    return landed


def same(first: Path, second: Path) -> tuple[bool, str]:
    """Whether two finished runs hold and print the same numbers, bit for bit, and how many, in words."""
    stores = [RunFile.reopen(directory) for directory in (first, second)]
    tables = [[_rows(store, query) for query in _QUERIES] for store in stores]
    images = stores[1].images()
    for store in stores:
        store.close()
    documents = [json.loads((directory / "result.json").read_text(encoding="utf-8")) for directory in (first, second)]
    final = [[document[key] for key in ("settings", "correlation", "verdict")] for document in documents]
    equal = tables[0] == tables[1] and final[0] == final[1]
    counts = ", ".join(f"{len(rows)} {name}" for name, rows in zip(_NAMES, tables[0], strict=True))
    return equal, f"final tables, {images} images, {counts}: {'all equal, bit for bit' if equal else 'DIFFERENT'}"


_NAMES = ("clean settings", "predictions", "arrays of distances", "runs of failures", "chunks")
_QUERIES = (
    "SELECT setting, image, predicted, trouble FROM setting ORDER BY setting",
    "SELECT * FROM propagated ORDER BY setting, method",
    "SELECT * FROM distance ORDER BY setting, chunk, method",
    "SELECT * FROM failure ORDER BY setting, chunk, method, image",
    "SELECT setting, chunk, count FROM chunk ORDER BY setting, chunk",
)


def _rows(store: RunFile, query: str) -> list[tuple]:
    return store._db.execute(query).fetchall()


def _command(scene: str, renders: int, seed: int, workers: int, out: Path) -> list[str]:
    options = {"--renders": renders, "--seed": seed, "--workers": workers, "--out": out}
    return [
        sys.executable,
        "-m",
        "validation.cli",
        "validate",
        scene,
        *(str(x) for pair in options.items() for x in pair),
    ]


def _unbroken(command: list[str], directory: Path) -> tuple[float, float]:
    """Seconds to the first result and to the end."""
    started, first = time.monotonic(), None
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    while process.poll() is None:
        if first is None and _images(directory):
            first = time.monotonic() - started
        time.sleep(0.05)
    whole = time.monotonic() - started
    _check(process.returncode)
    return first or whole, whole


def _killed(command: list[str], directory: Path, delay: float, enough: float) -> tuple[bool, float]:
    """Start, kill after ``delay`` seconds or with ``enough`` images; whether it had ended by itself, and when."""
    started = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None and time.monotonic() < started + delay and _images(directory) <= enough:
        time.sleep(0.03)
    ended = process.poll() is not None
    process.kill()
    process.wait()
    return ended, time.monotonic() - started


def _run(command: list[str]) -> None:
    _check(subprocess.run(command, stdout=subprocess.DEVNULL).returncode)


def _check(returncode: int) -> None:
    if returncode not in (0, 1):  # 1: the verdict, which is not what is proved here
        raise typer.Exit(returncode)


def _images(directory: Path) -> int:
    try:
        store = RunFile.reopen(directory)
    except InvalidInput:
        return 0
    try:
        return store.images()
    finally:
        store.close()
