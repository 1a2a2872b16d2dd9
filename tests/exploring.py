"""The page of `ice explore` in a browser, and how long it takes to answer.

``python -m tests.exploring SCENE FILE`` takes the page's picture when all is computed (docs/explore.md has one).
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
from PIL import Image

import scenes
from tests.chromium import Page, chromium
from validation.explore.server import serve
from validation.explore.session import Place

# Milliseconds from each state that was sent while something was dragged to its answer on the page, by number, and
# seconds of the server's core for it; the newest state is always answered, those between may be left out.
_WATCH = """(() => {
  window.asked = {}; window.took = []; window.cores = [];
  if (window.watched) return true;
  window.watched = true;
  const send = WebSocket.prototype.send;
  let moved = 0;
  addEventListener("pointermove", () => { moved = performance.now(); }, true);
  addEventListener("keydown", () => { moved = performance.now(); }, true);
  WebSocket.prototype.send = function (text) {
    const told = JSON.parse(text);
    if (told.type === "state" && !told.rest) asked[told.number] = moved;
    return send.call(this, text);
  };
  new MutationObserver(() => {
    const number = explore.answered;
    if (!asked[number]) return;
    took.push(performance.now() - asked[number]);
    cores.push(explore.core_s);
    delete asked[number];
  }).observe(document.getElementById("answer"), { subtree: true, childList: true, characterData: true });
  return true;
})()"""


@asynccontextmanager
async def served(name: str, directory: Path) -> AsyncIterator[str]:
    """The address at which a scene's page is served, with a free port."""
    stop, address = asyncio.Event(), asyncio.get_running_loop().create_future()
    place = Place(scenes.load(name), name, directory)
    serving = asyncio.create_task(serve(place, "127.0.0.1", 0, None, address.set_result, stop))
    try:
        await asyncio.wait([serving, address], return_when=asyncio.FIRST_COMPLETED)
        yield address.result()
    finally:
        stop.set()
        await serving


async def first_answer(page: Page, url: str) -> None:
    """Go there and wait for what the page says first, for the sphere and for the effects."""
    await page.open(url)
    await page.until("document.getElementById('sigma')?.dataset.sigma")
    await page.until("window.explore.view.map !== null", 60)
    await page.until("document.getElementById('effects').children.length > 0", 60)


async def drag_lamp(page: Page, by: tuple[float, float], steps: int, pause: float) -> list[float]:
    """Drag the lamp with the mouse and wait; the milliseconds from each movement to its answer on the page."""
    times = await drag(page, 0, by, steps, pause)
    await settled(page)
    return times


async def drag(page: Page, which: int, by: tuple[float, float], steps: int, pause: float) -> list[float]:
    """The same of the camera or a lamp, until the last answer; the server's seconds are left in the page."""
    await page.value(_WATCH)
    x, y = await page.value(f"window.explore.view.spot({which})")
    await page.drag((x, y), by, steps, pause)
    await page.until("window.explore.answered === window.explore.number", 60)
    return await page.value("window.took")


async def settled(page: Page, seconds: float = 30) -> None:
    """Wait until the last state that was sent is answered from a close look."""
    await asyncio.sleep(0.35)  # longer than the page waits before it says that nothing moves
    await page.until("window.explore.answered === window.explore.number", seconds)
    await page.until("document.getElementById('sigma').dataset.closely !== 'false'", seconds)


def told(times: list[float]) -> str:
    """One line about them."""
    part = np.percentile(times, [50, 90, 100])
    return f"{len(times)} answers, ms: median {part[0]:.0f}, 90 % {part[1]:.0f}, longest {part[2]:.0f}"


async def pictured(name: str, file: Path) -> None:
    """Write the page's picture, of 256 colours."""
    async with served(name, file.parent) as url, chromium(1280, 900) as page:
        await first_answer(page, url)
        await settled(page, 120)
        await page.until("document.getElementById('budget').children.length > 0", 120)
        await page.screenshot(file)
    with Image.open(file) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(file, optimize=True)


if __name__ == "__main__":
    asyncio.run(pictured(sys.argv[1], Path(sys.argv[2])))
