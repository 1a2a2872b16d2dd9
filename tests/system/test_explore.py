"""The page of `ice explore`, driven in a headless browser as a visitor would."""

import asyncio
import logging

import pytest

import planner
import scenes
from tests.chromium import PROGRAM, chromium
from tests.exploring import drag_lamp, first_answer, served, settled, told

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="needs Chromium, which is not installed here")


async def state(page):
    return await page.value("window.explore.state")


async def sigma(page):
    return float(await page.value("document.getElementById('sigma').dataset.sigma"))


def predicted(scene, poses):
    return planner.predict(scene, poses["sensor"], poses["lights"][0]).measurands[0].variance_object ** 0.5


def test_a_visit(task1, tmp_path):
    """Drag, keys, proof, save; nothing leaves this machine; another visitor's state stays as it was."""

    async def visit():
        async with served("task1", tmp_path) as url, chromium() as page:
            await first_answer(page, url)
            before = await sigma(page)
            assert before == pytest.approx(predicted(task1, await state(page)), rel=1e-9)

            times = await drag_lamp(page, (-70.0, 10.0), 12, 0.04)
            logging.getLogger("tests").info("task1: %s", told(times))
            there = await state(page)
            assert there["sensor"] == [30, 90]
            assert there["lights"] != [[15, 270]]
            assert await sigma(page) != pytest.approx(before, rel=0.02)
            assert await sigma(page) == pytest.approx(predicted(task1, there), rel=1e-9)

            await page.press("ArrowDown", shift=True)
            await page.press("c")
            await page.press("ArrowDown")
            await settled(page)
            moved = await state(page)
            assert moved["lights"][0][0] == pytest.approx(there["lights"][0][0] + 5)
            assert moved["sensor"] == [31, 90]
            assert await sigma(page) == pytest.approx(predicted(task1, moved), rel=1e-9)

            await page.press("p")
            ratio = float(await page.until("document.getElementById('proof').dataset.ratio", 60))
            assert 0.8 < ratio < 1.25  # 5 standard errors of 1000 images
            await page.press("s")
            await page.until("document.getElementById('said').textContent.startsWith('Saved')")
            await page.press("s")
            await page.until("document.getElementById('said').textContent.includes('must be a new file')")

            async with chromium(390, 844) as other:
                await first_answer(other, url)
                assert (await state(other))["sensor"] == [30, 90]
                assert await other.value("document.documentElement.scrollWidth") <= 390
                assert not other.errors
            assert await state(page) == moved
            assert not page.errors
            outside = [each for each in page.requests if not each.startswith((url, url.replace("http", "ws"), "data:"))]
            assert outside == []
            return moved

    moved = asyncio.run(visit())
    saved = scenes.load(tmp_path / "task1-explored.toml")
    assert saved.settings[:-1] == task1.settings
    assert list(saved.settings[-1].sensor) == moved["sensor"]
    assert list(saved.settings[-1].light) == moved["lights"][0]
