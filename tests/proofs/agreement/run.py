"""All settings, shared out to processes."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import as_completed

from render import variant as variants
from tests.proofs.agreement.rows import Row, rows_of
from tests.proofs.agreement.settings import Place
from validation.batch.pool import local


def measure_all(
    places: list[Place],
    renders: int,
    seed: int,
    workers: int = 2,
    report: Callable[[Place, int, int], None] = lambda *_: None,
) -> list[Row]:
    """The rows of all settings, in the order of the settings; the numbers do not depend on the workers."""
    variant, rows = variants.choose(), {}
    with local(workers) as crew:
        waiting = {crew.executor.submit(rows_of, place, renders, seed, variant): place for place in places}
        for done, future in enumerate(as_completed(waiting), 1):
            rows[waiting[future]] = future.result()
            report(waiting[future], done, len(places))
    return [row for place in places for row in rows[place]]
