"""How long a page takes a browser: ``python -m tests.benchmarks.pages runs/task1/report.html ...``"""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

import numpy as np

from tests.chromium import chromium

_TIMES = 5
_WHEN = "['domContentLoadedEventEnd', 'loadEventEnd'].map(name => performance.getEntriesByType('navigation')[0][name])"


async def _loaded(page: Path) -> list[float]:
    """Milliseconds from the address to the content read, and to all of it loaded."""
    async with chromium(1280, 800) as window:
        await window.open(page.as_uri())
        await window.until("performance.getEntriesByType('navigation')[0].loadEventEnd > 0")
        return await window.value(_WHEN)


def measured(page: Path) -> str:
    """A line: size, and medians over new browsers."""
    content, load = np.median([asyncio.run(_loaded(page)) for _ in range(_TIMES)], axis=0)
    return f"{page}: {page.stat().st_size / 1e6:.2f} MB, content after {content:.0f} ms, loaded after {load:.0f} ms"


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(measured(Path(name).resolve()), flush=True)
