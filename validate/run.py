"""The batch job: render every setting, measure it many times, judge the predictions."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from importlib.metadata import version
from pathlib import Path

from render import variant as variants
from scenes import InvalidInput, Scene
from validate.result import Validation, collect
from validate.store import RunFile
from validate.work import CHUNK, measure_chunk, render_setting

_PACKAGES = ("mitsuba", "drjit", "numpy", "scipy", "opencv-contrib-python-headless")
Progress = Callable[[str, int, int], None]


def run(
    scene: Scene,
    renders: int = 1000,
    seed: int = 1,
    out: str | Path | None = None,
    workers: int | None = None,
    fresh: bool = False,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> Validation:
    """Validate all settings of a scene.

    Parameters
    ----------
    scene : Scene
        At least one setting.
    renders : int
        Noisy images a setting, at least 2.
    seed : int
        Root of all random numbers; the result does not depend on the number of workers.
    out : str or Path, optional
        Run directory, ``runs/<scene>`` when not given. A killed run continues there.
    workers : int, optional
        Processes; all available cores when not given. 1 works in this process.
    fresh : bool
        Start anew even if the directory holds results.
    progress : callable, optional
        Called as progress(what, done, total).
    executor : concurrent.futures.Executor, optional
        Used instead of local processes.

    Raises
    ------
    InvalidInput
        If a number is out of range, the scene has no settings, or the directory holds another run.
    """
    _check(scene, renders, seed, workers)
    started = time.perf_counter()
    variant = variants.choose()
    identity = {
        "scene": scene.model_dump(mode="json"),
        "seed": seed,
        "variant": variant,
        "chunk": CHUNK,
        "renders": renders,
    }
    store = RunFile(Path(out or Path("runs") / scene.name), identity, fresh)
    try:
        store.note("versions", {name: version(name) for name in _PACKAGES})
        workers = (
            workers or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else workers or os.cpu_count()
        )
        pool = executor or _local(workers)
        try:
            _work(scene, renders, seed, variant, store, pool, progress or (lambda *_: None))
        finally:
            if executor is None:
                pool.shutdown(cancel_futures=True)
        seconds = {"wall": time.perf_counter() - started, "workers": workers, **store.seconds()}
        return collect(scene, seed, variant, store, seconds)
    finally:
        store.close()


def _check(scene: Scene, renders: int, seed: int, workers: int | None) -> None:
    if renders < 2:
        raise InvalidInput(f"renders must be at least 2, got {renders}")
    if seed < 0:
        raise InvalidInput(f"seed must be at least 0, got {seed}")
    if workers is not None and workers < 1:
        raise InvalidInput(f"workers must be at least 1, got {workers}")
    if not scene.settings:
        raise InvalidInput(f"{scene.name}: settings must be a list of at least one sensor and light, got none")


def _local(workers: int) -> Executor:
    if workers == 1:
        return ThreadPoolExecutor(1)
    return ProcessPoolExecutor(
        workers, mp_context=multiprocessing.get_context("spawn")
    )  # the renderer's threads do not survive a fork


def _work(
    scene: Scene, renders: int, seed: int, variant: str, store: RunFile, pool: Executor, progress: Progress
) -> None:
    """Submit what is not yet done; each result is committed as it arrives."""
    sizes = {chunk: min(CHUNK, renders - CHUNK * chunk) for chunk in range(-(-renders // CHUNK))}
    done = store.chunks()
    pending: dict[Future, tuple[int, int | None]] = {}

    def submit_chunks(setting: int) -> None:
        image = store.image(setting)
        for chunk, size in sizes.items():
            if (setting, chunk) not in done:
                pending[pool.submit(measure_chunk, scene, setting, image, seed, chunk, size)] = setting, chunk

    for setting in range(len(scene.settings)):
        if store.image(setting) is None:
            pending[pool.submit(render_setting, scene, setting, variant)] = setting, None
        else:
            submit_chunks(setting)
    images, total = sum(done.values()), renders * len(scene.settings)
    progress("images", images, total)
    while pending:
        for future in wait(pending, return_when=FIRST_COMPLETED).done:
            setting, chunk = pending.pop(future)
            if chunk is None:
                store.add_clean(setting, future.result())
                submit_chunks(setting)
            else:
                store.add_chunk(setting, chunk, sizes[chunk], future.result())
                images += sizes[chunk]
                progress("images", images, total)
