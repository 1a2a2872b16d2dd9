"""What a page of `ice explore` may say, with hostile things in it, and who asks for the page."""

from __future__ import annotations

import asyncio
import functools
import json
import shutil
import subprocess
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import numpy as np
from aiohttp.test_utils import make_mocked_request

import scenes
from scenes import InvalidInput
from tests.hard.fuzzing.documents import changed
from tests.hard.fuzzing.mutations import spoilt
from validation.explore import gate, save
from validation.explore.messages import Message
from validation.explore.server import PAGE
from validation.explore.session import Place, Session, answered
from validation.explore.state import State

_ODD = (
    "1e999", "NaN", "-Infinity", "9" * 400, "9" * 5000, '"3"', "null", "true", "[]", "{}", '"\\ud800"', "-0.0", "1e308",
    "5e-324", "[[1, 2], [3]]", '["a", "b"]', '{"a": 1, "b": 2}', "[" * 5000 + "]" * 5000, '"' + "x" * 9000 + '"',
)  # fmt: skip
_ODD_PARTS = (
    "=", "view=", "lamp=,;", "camera=1e999,NaN", "moving=0x1", "view=%ff", "__proto__=1,2", "measurand=-0", "&&",
    "shown=%00", "view=1,2;3,4;5,6",
)  # fmt: skip
_NO_RENDERER = "renderer must be there, got none"
_HOSTS = ("127.0.0.1", "127.0.0.1:99999", "127.0.0.1:x", "[::1", "]", "a b", "", "\xff", "evil.example", "localhost:-1")
_WORDS = ("right", "", '"\\377\\000"', "é", "\x80", "=;;=", "x" * 5000, "\x00")


def message(rng: np.random.Generator, folder: Path) -> str:
    """A message that is read, answered and saved as `Session` does, a whole visit, or a request at the gate."""
    which = rng.random()
    if which < 0.2:
        return _request(rng)
    if which < 0.4:
        return _visit(rng, folder)
    told = Message.of(_text(rng))
    if told.type not in ("state", "restore"):
        return told.type
    name = str(rng.choice(["task1", "ball", "two_lights"]))
    scene = _scene(name)
    state = State.of_message(scene, told.state).tolerable(scene)
    found = answered(scene, state, told.rest)
    json.dumps(found | {"number": told.number}, allow_nan=False)
    if not found["refused"]:
        save.save(name, state, folder, replace=True)
    return "refused in place" if found["refused"] else "answered"


@functools.cache
def _scene(name: str) -> scenes.Scene:
    return scenes.load(name)


def _text(rng: np.random.Generator) -> str:
    state = {"sensor": [30, 135], "lights": [[15, 315]], "measurand": 0, "shown": "sigma", "moving": -1}
    whole: Any = {"type": "state", "state": state, "rest": True, "number": 3}
    if rng.random() < 0.3:
        whole["type"], state["views"] = "restore", [{"sensor": [20, 10], "lights": [[3, 270]]}]
    what = rng.integers(4)
    if what == 0:
        whole = changed(rng, whole)
    if what == 1:
        state["sensor"] = rng.uniform([-20, -1e3], [200, 1e3]).tolist()
        whole["type"] = str(rng.choice(["state", "state", "best", "save", "nonsense"]))
    text = json.dumps(whole)
    if what == 2:
        for part in rng.choice(["30", "135", "[15, 315]", '"sigma"', "-1", "true", "3", "0"], 2):
            text = text.replace(str(part), _ODD[rng.integers(len(_ODD))], 1)
    return spoilt(rng, text.encode()).decode(errors="replace") if what == 3 else text


def _visit(rng: np.random.Generator, folder: Path) -> str:
    """Some messages to one session, with an address to restore among them; what was there before comes back (undo)."""
    name = str(rng.choice(["task1", "ball", "two_lights"]))
    texts = [_text(rng) for _ in range(rng.integers(1, 4))] + [_restored(rng)]
    texts = [texts[i] for i in rng.integers(len(texts), size=len(texts) + 1)]
    sent = asyncio.run(_sent(Place(_scene(name), name, folder), texts))
    json.dumps(sent, allow_nan=False)
    told = [message["text"] for message in sent if message["type"] == "told"]
    assert not any(text.startswith("this failed by an error") or "\n" in text for text in told), told
    return "told" if set(told) - {_NO_RENDERER} else "visited"


async def _sent(place: Place, texts: list[str]) -> list[dict[str, Any]]:
    """What a visitor is sent who says that."""
    sent: list[dict[str, Any]] = []

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    async def messages() -> AsyncIterator[str]:
        for text in texts:
            yield text
            for _ in range(rounds):
                await asyncio.sleep(0)

    rounds = 8  # of the loop, in which all that is done at once is done
    await Session(place, _AtOnce(), send).run(messages())
    return sent


class _AtOnce:
    """Tools that do all work at once, but render nothing."""

    async def quickly(self, work: Callable, *arguments: Any) -> Any:
        return work(*arguments)

    slowly = quickly

    async def perform(self, _: Any) -> Any:
        raise InvalidInput(_NO_RENDERER)

    async def variant(self) -> str:
        return "scalar_rgb"


def _restored(rng: np.random.Generator) -> str:
    """The message with which a page asks for what its address says, as its own script reads it where there is Node."""
    shown = "camera=30,135&lamp=15,315&measurand=0&shown=sigma&moving=-1&view=20,10;3,270"
    parts = [str(part) for part in rng.permutation(shown.split("&"))]
    for _ in range(rng.integers(3)):
        parts[rng.integers(len(parts))] = _ODD_PARTS[rng.integers(len(_ODD_PARTS))]
    text = "#" + spoilt(rng, "&".join(parts).encode(errors="replace")).decode(errors="replace")
    return json.dumps({"type": "restore", "state": _read(text)})


def _read(text: str) -> Any:
    """What the page's script makes of an address's part behind #; a plain state without Node."""
    node = shutil.which("node")
    if node is None:
        return {"sensor": [30, 135], "lights": [[15, 315]], "shown": "sigma", "measurand": 0, "moving": -1}
    script = f"import {{ read }} from {json.dumps((PAGE / 'address.js').as_uri())};"
    script += f"console.log(JSON.stringify(read({json.dumps(text)})));"
    command = [node, "--no-warnings", "--experimental-default-type=module", "--input-type=module", "-e", script]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, (text, done.stderr)
    return json.loads(done.stdout)


def _request(rng: np.random.Generator) -> str:
    host, word, origin = _HOSTS[rng.integers(len(_HOSTS))], _WORDS[rng.integers(len(_WORDS))], rng.random() < 0.2
    headers = {"Host": host, "Cookie": f"{gate.COOKIE}={word}"} | ({"Origin": f"http://{word}"} if origin else {})
    refused = gate.refusal(make_mocked_request("GET", "/", headers), "right" if rng.random() < 0.5 else None)
    if refused:
        refused.encode()
        raise InvalidInput(refused)
    return "let in"
