"""The page of `ice explore`, driven in a headless browser as a visitor would."""

import asyncio
import json
import logging
import os
import signal
import subprocess
import sys
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

import planner
import scenes
from scenes import InvalidInput
from tests.chromium import PROGRAM, chromium
from tests.exploring import drag_lamp, first_answer, served, settled, told
from validation.cli.application import app
from validation.explore import sphere
from validation.explore.gate import COOKIE

in_a_browser = pytest.mark.skipif(PROGRAM is None, reason="needs Chromium, which is not installed here")


async def state(page):
    return await page.value("window.explore.state")


async def sigma(page):
    return float(await page.value("document.getElementById('sigma').dataset.sigma"))


def predicted(scene, poses):
    return planner.predict(scene, poses["sensor"], poses["lights"][0]).measurands[0].variance_object ** 0.5


@in_a_browser
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
            assert 0.8 < ratio < 1.25  # 5 standard errors of 1000 images  # margin: 5 standard errors of 1000 images
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


@in_a_browser
def test_what_stands_below_the_horizon_is_seen_and_moved(tmp_path):
    """Camera and lamp are drawn within the sphere's canvas and follow the mouse; that half is coloured. The width of
    the lower side of task1's block is measured."""
    text = (scenes.load.__globals__["BUNDLED"] / "task1.toml").read_text().split("[task]")[0]
    asked = 'name = "low"\nkind = "width"\nfeatures = [{ edge = "e1" }, { edge = "e5" }]'
    setting = "sensor = [160, 10]\nlight = [140, 55]"
    file = tmp_path / "low.toml"
    file.write_text(f"{text}\n[[measurands]]\n{asked}\n[[settings]]\n{setting}\n")
    low = scenes.load(file)

    async def visit():
        async with served(str(file), tmp_path) as url, chromium() as page:
            await page.open(url)
            await page.until("window.explore?.view.map", 60)
            for which in (-1, 0):
                x, y = await page.value(f"explore.view.spot({which})")
                assert await page.value(f"document.elementFromPoint({x}, {y}).id") == "sphere"
            assert min(border[0] for border in await page.value("explore.view.map.borders")) == 90
            await drag_lamp(page, (-40.0, -10.0), 6, 0.04)
            there = await state(page)
            assert there["lights"][0] != [140, 55]
            assert there["lights"][0][0] > 90
            assert await sigma(page) == pytest.approx(predicted(low, there), rel=1e-9)

    asyncio.run(visit())


LABELS = """[explore.view, explore.picture].map(({ labels: { taken } }) => taken.flatMap((a, i) => taken.slice(i + 1)
  .filter(b => (a.name || b.name) && Math.min(a.x + a.width, b.x + b.width) - Math.max(a.x, b.x) > 0.01
    && Math.min(a.y + a.height, b.y + b.height) - Math.max(a.y, b.y) > 0.01).map(b => [a.name, b.name])))"""
NAMED = "[explore.view, explore.picture].map(({ labels }) => labels.taken.map(each => each.name).filter(Boolean))"


@in_a_browser
def test_no_label_lies_on_another(tmp_path):
    """With camera and lamp in one place, too; what limits is always named; the sphere tells how far it is coloured."""

    async def visit():
        async with served("plate", tmp_path) as url, chromium() as page:
            await page.open(url)
            await page.until("window.explore?.view.map", 60)
            assert await page.value("document.getElementById('coloured').value") == len(sphere.cells().poses)
            assert await page.value("document.getElementById('colouring').hidden")
            for keys in ("", "+", "c", "m", "m"):
                if "+" in keys:  # the lamp to where the camera is
                    for angle, value in enumerate(await page.value("window.explore.state.sensor")):
                        box = f"document.getElementById('pose0-{angle}')"
                        await page.value(f"({box}.value = {value}, {box}.onchange())")
                elif keys:
                    await page.press(keys)
                await settled(page)
                assert await page.value(LABELS) == [[], []]
                stage, picture = await page.value(NAMED)
                assert {"camera", "lamp", "0°"} <= set(stage)
                assert await page.value("explore.picture.limiting") in picture
            assert not page.errors

    asyncio.run(visit())


SAID = "document.getElementById('said').textContent"


@in_a_browser
def test_undo_and_an_address_that_restores(tmp_path):
    """Back and forth through where it rested; the address opens the same in another browser, or says why not."""

    async def visit():
        async with served("task1", tmp_path) as url, chromium() as page:
            await first_answer(page, url)
            first = await state(page)
            await page.press("ArrowDown", shift=True)
            await settled(page)
            await page.press("v")
            await page.press("ArrowDown")
            await settled(page)
            last, told = await state(page), await page.value("location.href")
            assert [view["lights"] for view in last["views"]] == [[[20, 270]]]
            assert last["lights"] == [[21, 270]]
            await page.until("document.getElementById('budget').textContent.includes('pixel noise')", 30)
            for key in "uuu":
                await page.press(key)
                await settled(page)
            assert await state(page) == first
            assert await page.value("document.getElementById('undo').disabled")
            for key in "yyy":
                await page.press(key)
                await settled(page)
            assert await state(page) == last
            async with chromium() as other:
                await first_answer(other, told)
                assert await state(other) == last
                for bad, why in HOSTILE:
                    await other.value(f"location.hash = {json.dumps(bad)}")
                    await other.until(f"{SAID}.includes({json.dumps(why)})")
                    assert await state(other) == last
                assert not other.errors
            assert not page.errors

    asyncio.run(visit())


HOSTILE = (
    ("camera=north&lamp=15,270", "pose must be a pair (polar, azimuth) in degrees"),
    ("camera=30,90&lamp=15,270&measurand=1e99", "measurand must be a whole number from 0 to 0"),
    ("camera=30,90&lamp=15,270&view=1,2;3", "pose must be a pair"),
    ("x" * 3000, "address must have at most 2000 characters"),
)


def test_from_the_command_line(tmp_path):
    """It tells its address, lets in who has the token, and ends by Ctrl-C in a second or so."""
    command = [sys.executable, "-m", "validation.cli", "explore", "task1", "--host", "0.0.0.0", "--json"]
    path = f"{Path(__file__).parents[2]}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    with subprocess.Popen(
        command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        try:
            url = json.loads(process.stdout.readline())["url"].replace("0.0.0.0", "127.0.0.1")
            token = url.split("token=")[1]
            with urlopen(Request(url.split("?")[0], headers={"Cookie": f"{COOKIE}={token}"})) as page:
                assert "Drag camera and lamp" in page.read().decode()
            with pytest.raises(HTTPError) as refused:
                urlopen(url.split("?")[0])
            assert refused.value.code == 403
            assert refused.value.read().decode().startswith("token must be the one that ice explore printed")
            refused.value.close()
            process.send_signal(signal.SIGINT)
            assert process.wait(30) == 130
            assert process.stderr.read().decode() == "stopped: interrupted\n"
        finally:
            process.kill()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--port", "65536"], "--port must be at most 65535, got 65536"),
        (["--host", "203.0.113.7"], "--host and --port must be free to listen at, got 203.0.113.7:0"),
    ],
)
def test_bad_addresses(options, message):
    with pytest.raises(InvalidInput, match=message):
        app(["explore", "task1", *options], standalone_mode=False)
