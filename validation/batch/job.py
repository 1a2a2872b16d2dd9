"""The batch job: render every setting, measure it many times, judge the predictions."""

from __future__ import annotations

import logging
import math
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from itertools import islice
from pathlib import Path

import imaging
import measure
import planner
import render
import scenes
from render import EffectTolerance, Quality
from render import variant as variants
from scenes import InvalidInput, Scene
from validation import remeasured, simulation
from validation.batch import cluster, machine, photographs, work
from validation.batch import pool as pools
from validation.batch.campaign import Campaign
from validation.batch.options import RunOptions
from validation.batch.part_files import contents
from validation.batch.photographs import Photographs
from validation.batch.pool import Crew
from validation.batch.result import Validation, collect
from validation.batch.stages import Stages
from validation.batch.stopped import Stopped
from validation.batch.store import RunFile
from validation.batch.work import CHUNK, Chunks, Rendering, TaskResult
from validation.code_digest import digest
from validation.defaults import DEFAULT_SEED
from validation.versions import PROGRAM, version

log = logging.getLogger("validation")
_PACKAGES = (PROGRAM, "mitsuba", "drjit", "numpy", "scipy", "opencv-contrib-python-headless")
_PHOTOGRAPHS = "photographs"  # in the place of the renderer's variant
_MAX_CHUNKS = 4  # of a task: its results are lost if it is killed
_MOST_TASKS = 10_000  # of a run, which a scheduler keeps count of: beyond, whole settings are done together
_IMAGES = 64  # settings whose image is kept for the report
_BREAKS = 3  # deaths of workers without a finished task in between, before it is no accident
_CHECK_S = 5.0  # between looks at whether the workers are still there
Progress = Callable[[str, int, int], None]
More = Callable[[RunFile], Sequence[int] | None]


def run(
    scene: Scene | Campaign,
    renders: int = 1000,
    seed: int = DEFAULT_SEED,
    out: str | Path | None = None,
    workers: int | None = None,
    fresh: bool = False,
    progress: Progress | None = None,
    executor: Executor | None = None,
    dask: str | None = None,
    quality: Quality = Quality(),
    more: More | None = None,
    effects: str = "auto",
    tolerance: EffectTolerance = EffectTolerance(),
    photos: Photographs | None = None,
) -> Validation:
    """Validate all settings of a scene or a campaign.

    Parameters
    ----------
    scene : Scene or Campaign
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
    dask : str, optional
        Address of a Dask scheduler, whose workers are used instead.
    quality : Quality
        Of the noise-free images.
    more : callable, optional
        Asked as more(run file) whenever all images asked for are measured; answers how many each setting should have,
        or None when it is enough. Its answers are kept, so that a killed run continues with them.
    effects : str
        "auto", "all" or names with commas between: what is simulated (`render.image`).
    tolerance : EffectTolerance
        What ``auto`` may leave out.
    photos : Photographs, optional
        Measured instead of renders (`validation.batch.photographs.load`), with the settings that they are of; then
        ``scene`` and ``renders`` say nothing.

    Raises
    ------
    InvalidInput
        If a number is out of range, there are no settings, none of them can be worked on, or the directory holds
        another run.
    Stopped
        If workers keep dying, the scheduler goes away, or the run file cannot be written. The same call continues.
    """
    how = RunOptions(seed, out, workers, fresh, dask, executor, Rendering(quality, effects, tolerance))
    return run_by(how, scene, renders, progress, more, photos)


def run_by(
    options: RunOptions,
    scene: Scene | Campaign,
    renders: int = 1000,
    progress: Progress | None = None,
    more: More | None = None,
    photos: Photographs | None = None,
) -> Validation:
    """As `run`, by options in one record."""
    if renders < 2:
        raise InvalidInput(f"renders must be at least 2, got {renders}")
    if isinstance(scene, Scene) and not scene.settings:
        raise InvalidInput(f"{scene.name}: settings must be a list of at least one sensor and light, got none")
    campaign = photos.campaign if photos else Campaign.of(scene)
    variant = _PHOTOGRAPHS if photos else variants.choose()
    renders = max(photos.counts) if photos else renders
    identity = _identity(campaign, renders, options.seed, variant, options.rendering, photos)
    store = RunFile(options.directory(campaign.name), identity, options.fresh)
    try:
        _note_machine(store)
        if photos is None:
            told = {sample.name: work.effects(sample, options.rendering) for sample in campaign.samples()}
            store.note("effects", told)
        _finish(_Batch(campaign, options, renders, variant, store, progress or (lambda *_: None), more, photos))
        found = collect(campaign, store)
        log.info("finished", extra={"facts": {"verdict": found.verdict.text, "agrees": found.verdict.agrees}})
        return found
    finally:
        store.close()


def _finish(batch: _Batch) -> None:
    """Do what is left, and note the time that it took."""
    options, store, started = batch.options, batch.store, time.perf_counter()
    count, before, spent = options.workers or pools.cores(), batch.done, store.fact("wall", 0.0)
    facts = {"seed": options.seed, "variant": batch.variant, "done": batch.done, "total": batch.total}
    log.info("started", extra={"facts": facts})
    try:
        batch.finish(lambda: _crew(count, options.executor, options.dask))
    finally:
        if batch.done > before:
            with suppress(Stopped):
                store.note("wall", spent + time.perf_counter() - started)
                store.note("workers", count)


def _identity(
    campaign: Campaign, renders: int, seed: int, variant: str, how: Rendering, photos: Photographs | None
) -> dict:
    """All that the numbers depend on; a directory that holds other ones is refused."""
    document = campaign.model_dump(mode="json")
    return {
        "campaign": document,
        "files": contents(document),
        "seed": seed,
        "renders": renders,
        "chunk": CHUNK,
        "variant": variant,
        **asdict(how),
        "versions": {name: version(name) for name in _PACKAGES},
        "code": _code(),
        **({"photos": photos.identity()} if photos else {}),
    }


def _code() -> str:
    """Digest of the code that makes the numbers."""
    packages = scenes, imaging, planner, render, measure, simulation
    return digest(packages, (work, photographs, remeasured)).hex()[:16]


def _note_machine(store: RunFile) -> None:
    """Where the run was begun, and each other machine that it was continued on, in order."""
    before, here = store.fact("machines", []), machine.here()
    if any(machine.same(here, one) for one in before):
        return
    store.note("machines", [*before, here])
    if before:
        log.warning(
            f"begun on {machine.named(before[0])}; continued on {machine.named(here)}: the same but for rounding, "
            "not to the last bit"
        )


def _crew(workers: int, executor: Executor | None, dask: str | None) -> AbstractContextManager[Crew]:
    if executor is not None:
        return nullcontext(Crew(executor, lambda: workers))
    return cluster.dask(dask) if dask else pools.local(workers)


@dataclass
class _Batch:
    """The work of a run that is not yet done; each result is committed as it arrives."""

    campaign: Campaign
    options: RunOptions
    renders: int
    variant: str
    store: RunFile
    progress: Progress
    more: More | None = None
    photos: Photographs | None = None

    def __post_init__(self) -> None:
        wanted = self.photos.counts if self.photos else [self.renders] * len(self.campaign)
        self.settings = self.options.shard.settings(len(self.campaign))
        self.stages = Stages([wanted, *self.store.fact("stages", [])], self.settings)
        self.done = self.store.images(self.options.shard)

    @property
    def total(self) -> int:
        """Images asked for so far."""
        return self.stages.total

    def finish(self, open_crew: Callable[[], AbstractContextManager[Crew]]) -> None:
        """Work until all is done; after the death of a worker begin again with what is left."""
        self.progress("images", self.done, self.total)
        deaths = 0
        while True:
            before = self.done
            try:
                if next(self._settings(), None):  # else do not start workers for nothing
                    with open_crew() as crew:
                        self._work(crew)
                        while self._extend():
                            self._work(crew)
                elif self._extend():
                    continue
                return
            except (BrokenExecutor, CancelledError) as error:
                deaths = 1 if self.done > before else deaths + 1
                log.warning("workers lost", extra={"facts": {"deaths": deaths, "error": str(error)}})
                if deaths == _BREAKS:
                    raise Stopped(f"workers died {_BREAKS} times in a row; is there enough memory?") from None

    def _extend(self) -> bool:
        """Whether more images are wanted than there are."""
        wanted = self.more(self.store) if self.more else None
        if wanted is None or not self.stages.extend(wanted):
            return False
        self.store.note("stages", self.stages.later)
        return True

    def _work(self, crew: Crew) -> None:
        """Keep every worker busy, with no more tasks in flight than that needs: memory does not grow with the run."""
        pending: dict[Future, list[_Setting]] = {}
        opened: deque[_Setting] = deque()
        size = crew.size()
        together, group, fresh = self._together(), self._group(size), self._settings()
        while True:
            while len(pending) < size + 2:
                settings = [opened.popleft()] if opened else list(islice(fresh, together))
                if not settings:
                    break
                tasks = tuple(setting.next_task(group) for setting in settings)
                pending[crew.executor.submit(work.perform_all, tasks)] = settings
                opened.extendleft(setting for setting in settings if setting.task.image and setting.left)
            if not pending:
                return
            done = wait(pending, timeout=_CHECK_S, return_when=FIRST_COMPLETED).done
            if not done:
                crew.check(None)
                size = crew.size()
            for future in done:
                settings = pending.pop(future)
                for setting, found in zip(settings, self._results(future, crew), strict=True):
                    self._commit(setting.task.case.index, found)
                    if found.clean and setting.left:
                        setting.task = replace(setting.task, image=found.clean.image)
                        opened.append(setting)

    def _results(self, future: Future, crew: Crew) -> tuple[TaskResult, ...]:
        try:
            return future.result()
        except Exception as error:
            crew.check(error)  # says so if it is the crew that is gone, and not the work that is wrong
            raise

    def _commit(self, index: int, found: TaskResult) -> None:
        self.store.add(index, found)
        finished = len(self.store.chunks(index)) == len(self.stages.sizes(index))
        if index >= _IMAGES and finished and self.more is None:
            self.store.drop_image(index)
        sizes = self.stages.sizes(index)
        images = sum(sizes[chunk] for chunk in found.chunks)
        self.done += images
        self.progress("images", self.done, self.total)
        facts = {"setting": index, "images": images, "done": self.done, "total": self.total, "trouble": found.trouble}
        log.info("committed", extra={"facts": facts})

    def _settings(self) -> Iterator[_Setting]:
        """The settings that have work left, one at a time."""
        for index in self.settings:
            if self.photos and index in self.photos.troubles and not self.store.trouble(index):
                self._commit(index, TaskResult(None, {}, self.photos.troubles[index]))
            done = self.store.chunks(index)
            left = deque((chunk, size) for chunk, size in self.stages.sizes(index).items() if chunk not in done)
            if not left or self.store.trouble(index):
                continue
            try:
                case = self.campaign.case(index)
            except InvalidInput as error:
                self._commit(index, TaskResult(None, {}, str(error)))
                continue
            files = self.photos.files[index] if self.photos else ()
            how = self.options
            yield _Setting(
                Chunks(case, (), how.seed, self.variant, self.store.packed(index), how.rendering, files), left
            )

    def _group(self, size: int) -> int:
        """Chunks of a task: large enough that an image travels seldom, small enough that all finish together."""
        if self._together() > 1:
            return self.total  # all that a setting has
        return max(1, min(_MAX_CHUNKS, self.total // CHUNK // (16 * size)))

    def _together(self) -> int:
        """Settings of a task."""
        return math.ceil(len(self.settings) / _MOST_TASKS)


@dataclass
class _Setting:
    """A setting that has chunks left: its first task renders the image, which then goes with the others."""

    task: Chunks
    left: deque[tuple[int, int]]

    def next_task(self, group: int) -> Chunks:
        """Some of the chunks."""
        chunks = tuple(self.left.popleft() for _ in range(min(group, len(self.left))))
        return replace(self.task, chunks=chunks)
