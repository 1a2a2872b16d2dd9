"""How long `ice explore` takes to show its page, and from a movement of the mouse to the answer on it.

    python -m tests.benchmarks.explore [SCENE or PART ...]

Default: task1 and bracket_mm. Of a part's file (STL, STEP) a scene is made, as by `ice new`. Seconds until the first
numbers, a glance of large parts, and until the close look; milliseconds to an answer while the camera is dragged, and
the lamp. Each as it passed, which other work on the machine makes longer, and in brackets of processors: the server's
and the page's (of an answer the server's median, and the page's mean).
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import scenes
from scenes.load import find
from tests.chromium import Page, chromium
from tests.commands import ice
from tests.exploring import drag, served, settled
from validation.explore.state import SENSOR

_STEPS, _PAUSE = 40, 0.1  # movements of a drag, and s between them
_MOST = 600.0  # s that a close look may take
_ROW = "{:26} {:>9} {:>15} {:>10} {:>24} {:>24}"


async def measured(name: str, directory: Path) -> str:
    """A row of the table."""
    triangles = len(scenes.load(name).bodies.triangles)
    async with served(name, directory) as url, chromium() as page:
        await page.call("Performance.enable", timeDomain="threadTicks")
        began, worked = time.perf_counter(), time.process_time()
        await page.open(url)
        await page.until("document.getElementById('sigma')?.dataset.sigma !== undefined", _MOST)
        first = f"{time.perf_counter() - began:.1f} ({time.process_time() - worked + await worked_for(page):.1f})"
        await settled(page, _MOST)
        close = f"{time.perf_counter() - began:.1f}"
        drags = [await dragged(page, which) for which in (SENSOR, 0)]
    return _ROW.format(Path(name).stem[:26], triangles, first, close, *drags)


async def dragged(page: Page, which: int) -> str:
    """The median until the answer, and processors' time of one."""
    before = await worked_for(page)
    times = await drag(page, which, (-60.0, 30.0), _STEPS, _PAUSE)
    if not times:
        return "no answer before rest"
    working = 1e3 * (await worked_for(page) - before) / len(times)
    served = 1e3 * float(np.median(await page.value("window.cores")))
    await settled(page, _MOST)
    return f"{np.median(times):.0f} ({served:.0f} + {working:.0f})"


async def worked_for(page: Page) -> float:
    """Seconds for which the page's thread has worked."""
    found = await page.call("Performance.getMetrics")
    return next(each["value"] for each in found["metrics"] if each["name"] == "TaskDuration")


def of_part(path: Path, directory: Path) -> str:
    """The scene of a part, in the directory."""
    done = ice("new", path.resolve(), "-o", f"{path.stem}.toml", cwd=directory)
    assert done.returncode == 0, done.stderr
    return str(directory / f"{path.stem}.toml")


def main(names: list[str]) -> None:
    """Print the table."""
    print(_ROW.format("", "triangles", "first s (proc.)", "close s", "camera ms (proc.)", "lamp ms (proc.)"))
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            is_part = Path(name).suffix.lower() in (".stl", ".step", ".stp")
            scene = of_part(Path(name), Path(folder)) if is_part else str(find(name))
            print(asyncio.run(measured(scene, Path(folder))), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or ["task1", "bracket_mm"])
