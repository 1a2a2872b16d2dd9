"""How long an answer of `ice explore` takes while something is dragged, of a part of a hundred thousand triangles."""

import asyncio
import json
import logging
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import cv2
import numpy as np
import pytest
import trimesh

import planner.prediction
import scenes
from imaging.geometry import rays
from scenes import Pose
from scenes.measurands.proposed import proposed
from validation.explore.session import Place, Session, answered
from validation.explore.state import SENSOR, State
from validation.explore.tools import Tools

pytestmark = pytest.mark.skipif(not rays.has_embree(), reason="Embree has no wheel here")

_SCENE = """
title = "a knob and a block"
units = "mm"
object = { kind = "mesh", file = "part.stl", units = "mm" }
material = { diffuse_reflectance = 0.8 }
light = { distance = 300.0 }
noise = { dark_level = 16.0, sigma = 1.5, bits = 8 }
settings = [{ sensor = [20.0, 10.0], light = [40.0, 55.0] }]

[camera]
width = 1280
height = 1024
pixel_pitch_um = 4.8
focal_length_mm = 12.0
distance = 300.0
look_at = [14.0, 0.0, 5.0]
blur_px = 0.8
exposure = 180.0
"""


def made(folder, sections, rings):
    """A knob with a bore, rounded by so many rings of facets, beside a block: twice sections x rings triangles."""
    turn = np.linspace(0, np.pi / 2, rings)
    rounded = np.column_stack([14 + 6 * np.cos(turn), 4 + 6 * np.sin(turn)])
    knob = trimesh.creation.revolve([(6, 0), (20, 0), *rounded, (6, 10), (6, 0)], sections=sections)
    block = trimesh.creation.box((12, 30, 8))
    block.apply_translation((36, 0, 4))
    folder.mkdir()
    trimesh.util.concatenate([knob, block]).export(folder / "part.stl")
    (folder / "scene.toml").write_text(_SCENE)
    scene = scenes.load(folder / "scene.toml")
    return scene.model_copy(update={"measurands": proposed(scene.solid, "mm")[:4]})


def dragged(state, which, count):
    """The states of a drag of the camera or the lamp by some degrees."""
    for i in range(1, count + 1):
        if which == SENSOR:
            yield replace(state, sensor=Pose(state.sensor.polar_deg + 0.4 * i, state.sensor.azimuth_deg + i))
        else:
            lamp = state.lights[0]
            yield replace(state, lights=(Pose(lamp.polar_deg + 0.4 * i, lamp.azimuth_deg + i),), moving=which)


def answers(scene, states):
    """What a visitor is sent that waits for each answer before the next movement."""

    async def run():
        told = asyncio.Queue()

        async def messages():
            for number, state in enumerate(states, 1):
                yield json.dumps({"type": "state", "state": state.to_message(), "number": number})
                while (message := await told.get())["type"] != "answer":
                    assert message["type"] == "scene", message
                found.append(message)

        found = []
        with ThreadPoolExecutor(1) as quick:
            tools = Tools(quick, None, asyncio.Semaphore(1), quick)  # nothing rests, so nothing is done in a process
            await Session(Place(scene, "part", None), tools, told.put).run(messages())
        return found

    return asyncio.run(run())


def test_a_drag_costs_hardly_more_than_with_a_thirtieth_of_the_triangles(tmp_path, monkeypatch):
    """Nothing is looked at or drawn triangle by triangle; no value says ``ok`` before the close look.

    Seconds of the thread, so that other work on the machine does not count.
    """
    large, small = made(tmp_path / "large", 1250, 40), made(tmp_path / "small", 120, 10)
    triangles = [len(scene.bodies.triangles) for scene in (large, small)]
    assert triangles[0] > 1e5 > 30 * triangles[1]
    state = State.first(large)
    least = [answered(small, each, False)["core_s"] for which in (SENSOR, 0) for each in dragged(state, which, 9)]
    for module, name in ((planner.prediction, "_of_locator"), (cv2, "fillConvexPoly")):
        monkeypatch.setattr(module, name, lambda *_, **__: pytest.fail("this takes as long as there are triangles"))
    for which in (SENSOR, 0):
        found = answers(large, list(dragged(state, which, 15)))
        assert [each["number"] for each in found] == list(range(1, 16))
        assert not any(each["refused"] or each["closely"] for each in found)
        rows = [row for each in found for row in each["measurands"]]
        assert "ok" not in {row["status"] for row in rows}
        assert any(row["status"] == "glanced" and row["sigma"] > 0 for row in rows)
        assert all(row["bias"] is None for row in rows)
        took = float(np.median([each["core_s"] for each in found[1:]]))  # the first makes what is kept of a part
        moved = "camera" if which == SENSOR else "lamp"
        logging.getLogger("tests").info("%d triangles, %s: median %.0f ms", triangles[0], moved, 1e3 * took)
        assert took < 5 * np.median(least)  # margin: 5, for a time; 1.5 to 2 is measured
