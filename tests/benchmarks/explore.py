"""How long `ice explore` takes from a movement of the mouse to the answer on the page.

    python -m tests.benchmarks.explore [SCENE ...]

Default: task1 and bracket_mm.
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
from pathlib import Path

from tests.chromium import chromium
from tests.exploring import drag_lamp, first_answer, served, told


async def measured(name: str) -> str:
    """A drag of the lamp over 120 px in 40 steps."""
    with tempfile.TemporaryDirectory() as directory:
        async with served(name, Path(directory)) as url, chromium() as page:
            await first_answer(page, url)
            return told(await drag_lamp(page, (-110.0, 50.0), 40, 0.1))


if __name__ == "__main__":
    for scene in sys.argv[1:] or ("task1", "bracket_mm"):
        print(f"{scene}: {asyncio.run(measured(scene))}", flush=True)
