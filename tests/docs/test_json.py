"""Every command prints strict JSON, and docs/json.md tells of every key of it, and of none that it does not print."""

import json
import os
import signal

import cv2
import numpy as np
import pytest
import trimesh

from measure import calibration
from scenes.load import BUNDLED
from tests.boards import SMALL, poses
from tests.commands import ice
from tests.docs.pages import DOCS, keys, told
from tests.hard.fuzzing.doors import Room
from tests.rigs import small_rig
from validation.cli.commands import COMMANDS
from validation.explore import server

pytestmark = pytest.mark.render

OPEN = (
    "failures", "parameters", "correlation", "classic_verdicts", "seconds", "paper_real", "global", "guarded",
    "omitted", "quality", "status", "left_out[]", "pairs_left_out",
    "left_out", "lights[]", "circles[]", "cylinders[]", "surfaces[]", "run", "budget[]", "versions", "processor",
    "statuses",
)  # fmt: skip
POSES = ("--sensor", "30,135", "--light", "15,315")
ASKED = {  # the least work of each command; by the heading of docs/json.md where that has further words
    "validate": ("short.toml", "--renders", "60", "--workers", "1", "--out", "run"),
    "plan": ("small.toml", "--step", "15", "--check", "2"),
    "plan --views": ("small.toml", "--step", "30", "--views", "2", "--no-check"),
    "plan --views --together": ("small.toml", "--step", "30", "--views", "2", "--together", "known"),
    "plan --coverage": ("small.toml", "--coverage", "--step", "30"),
    "plan --objective capability": ("calibrated_rig", "--objective", "capability", "--step", "45"),
    "render": ("small.toml", *POSES, "-o", "b.png"),
    "measure": ("a.png", "small.toml", *POSES),
    "measure --together": ("a.png", "small.toml", *POSES, "--also", "a.png 30,135 15,315", "--together", "known"),
    "measure without a scene": ("a.png", "--mtf", "m.png"),
    "fit": ("small.toml", "a.png", *POSES),
    "predict": ("small.toml",),
    "new": ("box.stl",),
    "show": ("small.toml",),
    "scenes": (),
    "effects": ("small.toml",),
    "calibrate": ("small.toml", "--images", "10"),
    "calibrate-camera": ("0.png", "1.png", "2.png", "--square", "25", "--model", "k1,k2,p1,p2"),
    "budget": ("calibrated_rig", "--monte-carlo", "--reach", "0.005", "--box", "7.6"),
    "msa": ("calibrated_rig",),
    "catalogue": ("check", "parts.toml"),
    "design": ("calibrated_rig", "--catalogue", "parts.toml", "--own-light", "--lens-blur", "2"),
    "export": ("small.toml", *POSES, "-o", "recipe"),
    "dossier": ("rig.toml", "--renders", "20", "--stations", "50", "--tables", "100", "--exposures", "20", "--no-hard"),
    "cost": ("small.toml", "--budget", "1s", "--out", "cost"),
    "explore": ("small.toml",),
    "hard": ("--area", "reflectance"),
    "merge": ("finished", "-o", "whole"),
    "report": ("finished",),
    "compare": ("finished", "changed.json"),
}


PARTS = """title = "Two cameras and a lens"

[[sensors]]
name = "one"
resolution = [1280, 1024]
pixel_pitch_um = 4.5
bits = 12
saturation_capacity_e = 15000
temporal_dark_noise_e = 4
quantum_efficiency = 0.6
mount = ["C"]

[[sensors]]
name = "two"
quantum_efficiency = 60

[[lenses]]
name = "25 mm"
kind = "entocentric"
focal_length_mm = 25
f_number = 2
f_number_max = 16
format = '2/3"'
mount = "C"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Scenes of one setting (task1, and it at 64 x 60 px), a picture, boards, a part, a run, and its result changed."""
    made = tmp_path_factory.mktemp("json")
    head, _, settings = (BUNDLED / "task1.toml").read_text().partition("[[settings]]")
    (made / "short.toml").write_text(head + "[[settings]]" + settings.partition("[[settings]]")[0])
    room, rng = Room(made), np.random.default_rng(11)
    ice("render", room.scene.name, *POSES, "-o", "a.png", "--noise-seed", "1", cwd=made)
    for i, pose in enumerate(poses(SMALL, 3, rng, 420.0)):
        image = SMALL.image(pose, 2) + rng.normal(0, 2, SMALL.size[::-1])
        cv2.imwrite(str(made / f"{i}.png"), np.clip(np.rint(image), 0, 255).astype(np.uint8))
    trimesh.creation.box((30, 20, 10)).export(made / "box.stl")
    (made / "parts.toml").write_text(PARTS)
    small_rig(made)
    room.run.rename(made / "finished")
    result = json.loads((made / "finished/result.json").read_text())
    result["settings"][0]["empirical"] *= 100
    (made / "changed.json").write_text(json.dumps(result))
    return made


def document(name, folder, page=DOCS / "json.md"):
    """What a command prints, strictly read, and the keys that the page tells of: all, and those of some cases only."""
    done = ice(name.split()[0], *ASKED[name], "--json", cwd=folder)
    assert done.returncode in (0, 1, 130), done.stderr
    return json.loads(done.stdout, parse_constant=lambda word: pytest.fail(word)), *told(page, f"ice {name}")


def test_every_command_is_asked():
    assert {name.split()[0] for name in ASKED} == set(COMMANDS)


@pytest.mark.parametrize("name", ASKED)
def test_keys_are_those_of_the_page(name, folder, monkeypatch):
    monkeypatch.setattr(server, "serve", _served)
    monkeypatch.setattr(calibration, "ESTIMATORS", ("gradient",))  # all take 14 s: test_calibrate_tells_of_all
    found, every, some = document(name, folder)
    _compare(found, every, some)


def test_calibrate_tells_of_all(folder):
    found, *told_of = document("calibrate", folder)
    _compare(found, *told_of)
    assert [curve["name"] for curve in found["curves"]] == list(calibration.ESTIMATORS)


def _compare(found, every, some):
    there = {key for key in keys(found) if not any(part in OPEN for part in key.split(".")[:-1])}
    assert there - every == set(), "not told"
    missing = {key for key in every - some - there if _reached(key, found)}
    assert missing == set(), "told, but not there"


def _reached(key, document):
    """Whether the list or table that should hold a key is there and not empty."""
    for part in key.split(".")[:-1]:
        document = document.get(part.removesuffix("[]"))
        if not document:
            return False
        document = document[0] if part.endswith("[]") else document
    return True


async def _served(place, host, port, token, told, stop):
    """As `serve`, of a page that somebody ends at once."""
    told("http://127.0.0.1:1/")
    os.kill(os.getpid(), signal.SIGINT)
    await stop.wait()


def test_a_wrong_page_is_noticed(folder, tmp_path):
    """Negative control: a key more and a key less in the page."""
    page = tmp_path / "json.md"
    page.write_text((DOCS / "json.md").read_text().replace("| `file`, `measurands` |", "| `file`, `nothing` |"))
    found, every, some = document("measure", folder, page)
    there = set(keys(found))
    assert there - every == {"measurands"}
    assert every - some - there == {"nothing"}
