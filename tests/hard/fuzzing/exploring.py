"""What a page of `ice explore` may say, with hostile things in it, and who asks for the page."""

from __future__ import annotations

import functools
import json
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
from validation.explore.session import answered
from validation.explore.state import State

_ODD = (
    "1e999", "NaN", "-Infinity", "9" * 400, "9" * 5000, '"3"', "null", "true", "[]", "{}", '"\\ud800"', "-0.0", "1e308",
    "5e-324", "[[1, 2], [3]]", '["a", "b"]', '{"a": 1, "b": 2}', "[" * 5000 + "]" * 5000, '"' + "x" * 9000 + '"',
)  # fmt: skip
_HOSTS = ("127.0.0.1", "127.0.0.1:99999", "127.0.0.1:x", "[::1", "]", "a b", "", "\xff", "evil.example", "localhost:-1")
_WORDS = ("right", "", '"\\377\\000"', "é", "\x80", "=;;=", "x" * 5000, "\x00")


def message(rng: np.random.Generator, folder: Path) -> str:
    """A message that is read, answered and saved as `Session` does, or a request at the gate."""
    if rng.random() < 0.2:
        return _request(rng)
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


def _request(rng: np.random.Generator) -> str:
    host, word, origin = _HOSTS[rng.integers(len(_HOSTS))], _WORDS[rng.integers(len(_WORDS))], rng.random() < 0.2
    headers = {"Host": host, "Cookie": f"{gate.COOKIE}={word}"} | ({"Origin": f"http://{word}"} if origin else {})
    refused = gate.refusal(make_mocked_request("GET", "/", headers), "right" if rng.random() < 0.5 else None)
    if refused:
        refused.encode()
        raise InvalidInput(refused)
    return "let in"
