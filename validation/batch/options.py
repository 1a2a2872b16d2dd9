"""How a run works: what its numbers depend on beside the scene, where they are kept, and who computes them."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from render.phenomena import named
from scenes import InvalidInput
from validation.batch import cluster
from validation.batch.shard import Shard
from validation.batch.work import Rendering
from validation.defaults import DEFAULT_SEED


@dataclass(frozen=True)
class RunOptions:
    """Options of a run, checked.

    Attributes
    ----------
    seed : int
        Root of all random numbers.
    out : str or Path, optional
        Run directory, ``runs/<scene>`` when not given.
    workers : int, optional
        Processes; all available cores when not given.
    fresh : bool
        Start anew even if the directory holds results.
    dask : str, optional
        Address of a Dask scheduler, whose workers are used instead of local processes.
    executor : concurrent.futures.Executor, optional
        Used instead of both.
    rendering : Rendering
        How noise-free images are made.
    shard : Shard
        Which settings are worked on; the numbers do not depend on it.

    Raises
    ------
    InvalidInput
        If one is out of range.
    """

    seed: int = DEFAULT_SEED
    out: str | Path | None = None
    workers: int | None = None
    fresh: bool = False
    dask: str | None = None
    executor: Executor | None = None
    rendering: Rendering = Rendering()
    shard: Shard = Shard()

    def __post_init__(self) -> None:
        if self.rendering.effects != "auto":
            named(self.rendering.effects)
        if self.seed < 0:
            raise InvalidInput(f"seed must be at least 0, got {self.seed}")
        if self.workers is not None and self.workers < 1:
            raise InvalidInput(f"workers must be at least 1, got {self.workers}")
        if self.dask:
            cluster.check_address(self.dask)

    def directory(self, name: str) -> Path:
        """Where a campaign's run is kept."""
        return Path(self.out or Path("runs") / name)
