"""The interactive page: a visitor's whole conversation, with work done at once in this process; who may come in."""

import asyncio
import base64
import json
import tempfile
from concurrent.futures import BrokenExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np
from aiohttp import ClientSession, CookieJar
from aiohttp.test_utils import TestClient, TestServer

from scenes import InvalidInput, Pose
from tests.regression.numbers.parts import small
from tests.regression.numbers.poses import load, uneven, without_error
from tests.regression.stored import CLOSED, RENDERED, SEARCHED
from validation.batch.work import perform
from validation.explore import best, effects, gate, preview, prove, server, session
from validation.explore.state import State

_RENDERS = 30
_HOSTS = ("127.0.0.1", "localhost", "::1", "0.0.0.0", "127.9.8.7", "example.org", "", "10.0.0.1")


class Tools:
    """Work done at once, but for what is told to fail."""

    def __init__(self, broken=None):
        self.broken = broken

    async def quickly(self, work, *arguments):
        return work(*arguments)

    slowly = aside = quickly

    async def variant(self):
        return "scalar_rgb"

    async def perform(self, task):
        if self.broken is not None:
            raise self.broken
        return perform(task)


def _scene(name):
    return small(name, 1.4)


def _state(scene, **how):
    sensor, lights = uneven(scene)
    lights = tuple(Pose.of(each) for each in (lights if isinstance(lights, tuple) else (lights,)))
    return replace(State.first(scene), sensor=Pose.of(sensor), lights=lights, **how)


def _conversation(scene, *messages, broken=None, slow=0.0, source="task1"):
    """What is sent for messages, each of which waits for the work of the one before; without pictures."""

    async def run():
        sent = []

        async def send(message):
            sent.append(message)

        async def said():
            for text in messages:
                yield text if isinstance(text, str) else json.dumps(text)
                for _ in range(400):
                    await asyncio.sleep(0)
                while visitor._job is not None and not visitor._job.done():
                    await asyncio.sleep(0)

        with tempfile.TemporaryDirectory() as folder:
            visitor = session.Session(session.Place(scene, source, Path(folder)), Tools(broken), send)
            visitor._close_s = slow
            await visitor.run(said())
        return sent

    with mock.patch.object(prove, "RENDERS", _RENDERS), mock.patch.object(prove, "CHUNK", 12):
        return [_shorter(message) for message in asyncio.run(run())]


def _shorter(message):
    kept = {key: value for key, value in message.items() if key not in ("ms", "core_s", "path", "picture", "text")}
    if "picture" in message:
        kept["picture"] = {
            key: value for key, value in message["picture"].items() if key not in ("png", "data", "image")
        }
    if "text" in message:
        kept["text"] = message["text"].split("/")[-1]
    if kept["type"] == "sphere":
        kept |= {
            key: np.array([np.nan if v is None else v for v in value], float)
            for key, value in kept.items()
            if isinstance(value, list) and value and not isinstance(value[0], list | dict | str)
        }
    if kept["type"] == "scene":
        kept["corners"] = kept["step"] * _integers(kept["corners"], "<i2")
        kept["normals"] = _integers(kept["normals"], "i1") / 127
    if kept["type"] == "proof":  # a histogram's counts are ties of rounding
        kept["rows"] = [
            {key: value for key, value in row.items() if key not in ("counts", "edges")} for row in kept["rows"]
        ]
    return kept


def _integers(packed, kind):
    """Rows of three that a page unpacks."""
    return np.frombuffer(base64.b64decode(packed), kind).reshape(-1, 3).astype(float)


def _moved(name, rest, **how):
    scene = _scene(name)
    return {"type": "state", "state": _state(scene, **how).to_message(), "rest": rest, "number": 7}


def _visit(name, *more, rest=False, **how):
    return _conversation(_scene(name), _moved(name, rest), *more, source=name, **how)


def _jobs():
    return {
        "best": _visit("task1", {"type": "best"}),
        "prove": _visit("task1", {"type": "prove"}),
        "broken": _visit("task1", {"type": "prove"}, broken=BrokenExecutor("a worker has ended")),
        "refused": _visit("task1", {"type": "render"}, broken=InvalidInput("the picture must be one, got none")),
        "save": _visit(
            "task1",
            {"type": "save", "replace": False},
            {"type": "save", "replace": False},
            {"type": "save", "replace": True},
        ),
        "cancel": _visit("task1", {"type": "cancel"}, "nonsense", {"type": "render"}),
        "slow": _visit("task1", _moved("task1", True), slow=1.0),
    }


def _bests():
    scene = load("two_lights")
    hidden = replace(State.first(load("task1")), sensor=Pose(89.9, 135.0))
    return {
        "task1": without_error(lambda: best.best_from(load("task1"), _state(load("task1")))),
        "second": without_error(lambda: best.best_from(scene, replace(_state(scene), measurand=1))),
        "hidden": without_error(lambda: best.best_from(load("task1"), hidden)),
        "effects": effects.effects(scene, _state(scene)),
    }


def _states():
    scene = load("two_lights")
    good = _state(scene).to_message()
    asked = [
        good,
        [],
        {},
        good | {"lights": good["lights"][:1]},
        good | {"lights": None},
        good | {"measurand": -1},
        good | {"measurand": len(scene.quantities) - 1},
        good | {"measurand": len(scene.quantities)},
        good | {"measurand": True},
        good | {"shown": "ratio"},
        good | {"shown": "x"},
        good | {"moving": -1},
        good | {"moving": len(scene.free) - 1},
        good | {"moving": len(scene.free)},
        good | {"moving": -2},
        good | {"sensor": [1]},
    ]
    bare = scene.model_copy(update={"settings": ()})
    return [without_error(lambda a=a: State.of_message(scene, a).tolerable(scene)) for a in asked] + [State.first(bare)]


def _previews():
    found = {}
    for name in ("plate", "backlight_plate", "ball"):
        scene = load(name)
        picture = _state(scene).picture(scene)
        part = preview.window(scene, picture)
        levels = np.add.outer(np.linspace(-5, 300, scene.camera.height), np.linspace(0, 40, scene.camera.width))
        found[name] = [
            part,
            part.scale,
            preview.rendered(scene, levels, part).astype(float),
            preview.shades(scene, np.linspace(-9.0, 400.0, 11)).astype(float),
        ]
    return found


def _proved():
    """Pieces of a proof that were made up: lost images, few of them, none."""
    scene = load("plate")
    state = _state(scene)
    rng = np.random.default_rng(2)
    names = [each.name for each in scene.quantities]
    from validation.batch.measurands import column

    propagated, columns = {}, {}
    about = []
    for k, name in enumerate(names):
        key = column("gradient", k)
        propagated[key] = (1e-4 * (k + 1), 3.0 + k, "ok" if k != 1 else "clutter")
        columns[key] = 3.0 + k + rng.normal(0, 0.01, 25)
        columns[key][: 5 * k] = np.nan
        about.append({"name": name, "unit": "cm", "value": 3.01 + k, "calibrated": 2e-4, "predicted_bias": 0.01})
    from validation.batch.work import Chunk, Clean, Packed, TaskResult

    clean = Clean(Packed.of(np.zeros((2, 2))), propagated, {"measurands": about}, {})
    pieces = [
        TaskResult(None, {k: Chunk({name: v[5 * k : 5 * k + 5] for name, v in columns.items()}, {}, {})})
        for k in range(5)
    ]
    made = prove.proofs(scene, clean, pieces)
    sizes = [[task.chunks for task in prove.measuring(scene, state, "scalar_rgb", clean, n)] for n in (49, 50, 51, 120)]
    return {
        "proofs": made,
        "agree": [each.agrees for each in made],
        "told": [prove.to_message(each) for each in made],
        "sizes": sizes,
    }


def _gates():
    asked = {
        "plain": ("/", {}),
        "evil host": ("/", {"Host": "evil.example"}),
        "own": ("/", {"Origin": "http://HOST"}),
        "evil": ("/", {"Origin": "http://evil.example"}),
        "wrong": ("/?token=wrong", {}),
        "right": ("/?token=right", {}),
        "cookie": ("/", {"Cookie": f"{gate.COOKIE}=right"}),
        "style": ("/page.css", {"Cookie": f"{gate.COOKIE}=right"}),
        "none": ("/no", {"Cookie": f"{gate.COOKIE}=right"}),
    }

    async def run(token):
        place, found = session.Place(_scene("task1"), "task1", Path()), {}
        made = server.application(place, Tools(), token)
        async with TestServer(made) as serving:
            for name, (path, headers) in asked.items():
                async with ClientSession(cookie_jar=CookieJar(unsafe=True)) as client:
                    host = f"127.0.0.1:{serving.port}"
                    told = {key: value.replace("HOST", host) for key, value in headers.items()}
                    answer = await client.get(serving.make_url(path), headers=told, allow_redirects=False)
                    kept = {key: answer.headers.get(key) for key in gate._HEADERS}
                    cookie = answer.headers.get("Set-Cookie", "")
                    text = await answer.text()
                    found[name] = [answer.status, kept, cookie, text if len(text) < 200 else len(text.splitlines())]
        return found

    return {
        "hosts": [gate.is_loopback(host) for host in _HOSTS],
        "long": [len(gate.new_token()) > 20],
        "open": asyncio.run(run(None)),
        "by token": asyncio.run(run("right")),
    }


def _sockets():
    """Two visitors where one is the most; messages that are too long; one that leaves."""

    async def run():
        place = session.Place(_scene("task1"), "task1", Path())
        async with TestServer(server.application(place, Tools())) as serving, TestClient(serving) as client:
            first = await client.ws_connect("/socket")
            found = [(await first.receive_json())["type"]]
            await first.send_str("[1]")
            found.append(await first.receive_json())
            answer = await client.get("/socket")
            found += [answer.status, await answer.text()]
            await first.send_str(" " * (server._MOST - 16))
            found.append(await first.receive_json())
            await first.send_str(" " * (server._MOST + 16))
            found.append((await first.receive()).data)
            await first.close()
            again = await client.ws_connect("/socket")
            found.append((await again.receive_json())["type"])
            await again.close()
        return found

    with mock.patch.object(server, "_MOST_VISITORS", 1):
        return asyncio.run(run())


def cases():
    """By name: relative tolerance, and what makes the result."""
    made = {
        "visit task1": (RENDERED, partial(_visit, "task1", rest=True)),
        "visit two_lights": (RENDERED, partial(_visit, "two_lights")),
        "visit wedge": (RENDERED, partial(_visit, "wedge", {"type": "prove"}, rest=True)),
        "jobs": (RENDERED, _jobs),
        "best": (SEARCHED, _bests),
        "states": (CLOSED, _states),
        "previews": (CLOSED, _previews),
        "proofs": (CLOSED, _proved),
        "gates": (CLOSED, _gates),
        "sockets": (CLOSED, _sockets),
    }
    return {f"page {name}": case for name, case in made.items()}
