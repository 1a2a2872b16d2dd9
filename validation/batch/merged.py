"""One run of the parts that machines made of it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path

from validation.batch.campaign import Campaign
from validation.batch.result import Validation, collect
from validation.batch.store import RunFile


def merged(parts: Sequence[Path], out: Path, fresh: bool = False) -> tuple[Campaign, Validation]:
    """Put run directories together: what one machine would have found, to the bit if all round alike.

    Parameters
    ----------
    parts : sequence of Path
        Directories of runs with the same scene, options and seed, each of other settings (`Shard`).
    out : Path
        Run directory that is made. `validation.run` goes on there with what no part holds.
    fresh : bool
        Start anew even if ``out`` holds results.

    Raises
    ------
    InvalidInput
        If a part is no run, is of another run than the first, or holds a setting of another part.
    """
    with ExitStack() as opened:
        stores = [opened.enter_context(closing(RunFile.reopen(part))) for part in parts]
        campaign = stores[0].campaign()
        whole = opened.enter_context(closing(RunFile(out, stores[0].identity(), fresh)))
        for store in stores:
            whole.take(store)
        machines = [machine for store in stores for machine in store.fact("machines", [])]
        whole.note("machines", [one for i, one in enumerate(machines) if one not in machines[:i]])
        whole.note("effects", stores[0].fact("effects", {}))
        for key in ("wall", "workers"):  # of all machines together
            whole.note(key, sum(store.fact(key, 0) for store in stores))
        whole.note("directory", stores[0].fact("directory", ""))
        return campaign, collect(campaign, whole)
