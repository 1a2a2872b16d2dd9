"""What the page of `ice explore` says, without a browser."""

import asyncio
import json
import logging
import math
import os
import re
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import cv2
import numpy as np
import pytest
from aiohttp import ClientSession, CookieJar, web
from aiohttp.http_exceptions import BadHttpMessage, BadStatusLine
from aiohttp.test_utils import TestServer
from yarl import URL

import planner
import scenes
from imaging.geometry import rays
from imaging.models import variance_model
from imaging.pictures import Pictures
from scenes import InvalidInput, Pose, Setting
from scenes.status import MEANINGS, REMEDIES
from validation.batch.work import Chunk, Clean, Packed, TaskResult
from validation.explore import answers, best, budgets, effects, preview, prove, save, server, session, sphere, tools
from validation.explore.gate import COOKIE, gate
from validation.explore.messages import Message
from validation.explore.server import serve
from validation.explore.state import SENSOR, State
from validation.report import source_words


@pytest.fixture(scope="module")
def plate():
    return scenes.load("plate")


def moved(state, light):
    return replace(state, lights=(Pose(*light),))


def test_states_of_messages(plate):
    state = replace(State.first(plate), measurand=2, shown="ratio", moving=0)
    assert State.of_message(plate, state.to_message()) == state


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("sensor", [200, 0], "polar_deg must be between 0 and 180"),
        ("sensor", "north", "pose must be a pair|polar_deg must be"),
        ("lights", [], "lights must be 1 pose"),
        ("measurand", 5, "measurand must be a whole number from 0 to 4, got 5"),
        ("measurand", True, "measurand must be a whole number"),
        ("shown", "colour", "shown must be one of sigma, ratio, worst, got 'colour'"),
        ("moving", 1, "moving must be a whole number from -1 to 0, got 1"),
        ("views", 3, "views must be a list of at most 4, got 3"),
        ("views", [{}] * 5, "views must be a list of at most 4, got"),
        ("views", [3], "view must be an object, got 3"),
        ("views", [{"sensor": [1, 2], "lights": []}], r"lights must be 1 pose\(s\), got \[\]"),
        ("views", [{"sensor": [500, 2], "lights": [[1, 2]]}], "polar_deg must be between 0 and 180"),
    ],
)
def test_messages_that_are_none(plate, key, value, message):
    with pytest.raises(InvalidInput, match=message):
        State.of_message(plate, State.first(plate).to_message() | {key: value})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "message must be JSON, got '{'"),
        ("[" * 9000, "message must be JSON"),
        ("9" * 5000, "message must be JSON"),
        ("[]", "message must be an object"),
        ('{"type": ["state"]}', "type must be one of 'state'"),
        ('{"type": "state", "number": "3"}', "number must be a whole number, got '3'"),
        ('{"type": "state", "number": NaN}', "number must be a whole number, got nan"),
        ('{"type": "save", "replace": "yes"}', "replace must be true or false, got 'yes'"),
        ('{"type": "save", "path": "/etc/passwd"}', "path must be a known key"),
    ],
)
def test_what_is_no_message_is_refused_in_one_line(text, message):
    with pytest.raises(InvalidInput, match=re.escape(message)):
        Message.of(text)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 10**400, -(10**5000)], ids="abcd")
def test_a_pose_of_no_number_or_one_too_large_is_refused_in_one_line(task1, value):
    with pytest.raises(InvalidInput, match="azimuth_deg must be a finite number of degrees"):
        State.of_message(task1, State.first(task1).to_message() | {"sensor": [30, value]})


def test_no_ratio_without_a_tolerance(task1, plate):
    assert replace(State.first(task1), shown="ratio").tolerable(task1).shown == "sigma"
    assert replace(State.first(plate), shown="ratio").tolerable(plate).shown == "ratio"


def test_answer_is_the_planners(plate):
    state = replace(State.first(plate), measurand=1)
    told = answers.answer(plate, state)
    expected = planner.predict(plate, state.sensor, state.lights[0])
    assert told.prediction.measurands == expected.measurands
    message = answers.to_message(told)
    assert message["measurands"][1]["sigma"] == math.sqrt(expected.measurands[1].variance_object)
    assert set(told.shares) == set(plate.quantities[1].edges)


def test_views_that_are_kept_count_by_inverse_variance(task1):
    """1 / variance adds up over the pictures in which the measurand is ok; a dark one adds nothing."""
    state = State.first(task1)
    other, dark = (Setting(sensor=Pose(30, 135), light=Pose(*light)) for light in ((60, 255), (90, 90)))
    told = answers.answer(task1, replace(state, views=(other, dark)))
    alone = [planner.predict(task1, each.sensor, each.light).variance_object for each in (state.setting, other)]
    row = answers.to_message(told)["measurands"][0]
    assert row["together"]["sigma"] == pytest.approx((1 / (1 / alone[0] + 1 / alone[1])) ** 0.5)
    assert (row["together"]["views"], row["together"]["status"]) == (2, "ok")
    assert row["sigma"] == pytest.approx(alone[0] ** 0.5)
    assert "together" not in answers.to_message(answers.answer(task1, state))["measurands"][0]
    within = replace(state, views=(Setting(sensor=Pose(30, 135), light=Pose(60, 255)),))
    assert State.of_message(task1, json.loads(json.dumps(within.to_message()))) == within


def test_a_budgets_bars_are_parts_of_u(plate):
    """U over half the zone, and shares of its square that add up to 1; what cannot be measured has neither."""
    rows, state = budgets.rows(plate, State.first(plate)), State.first(plate)
    for row, quantity, each in zip(rows, plate.quantities, planner.budget(state.picture(plate)), strict=True):
        largest = max(each.contributions, key=lambda c: c.contribution)
        assert row["ratio"] == pytest.approx(each.U / quantity.tolerance.half)
        assert row["unit"] == each.unit
        assert row["parts"][0] == [
            source_words.words(largest.source),
            pytest.approx((largest.contribution / each.u) ** 2),
        ]
        assert sum(share for _, share in row["parts"]) == pytest.approx(1, abs=0.01)  # margin: the least is left out
    task1 = scenes.load("task1")
    (alone,), sigma = budgets.rows(task1, State.first(task1)), planner.predict(State.first(task1).picture(task1))
    assert alone["U"] > 1.96 * sigma.measurands[0].variance_object ** 0.5  # of the same locator: U has noise and more
    (dark,) = budgets.rows(scenes.load("task1"), moved(State.first(scenes.load("task1")), (90, 90)))
    assert dark == {"name": "distance", "unit": "", "U": None, "ratio": None, "parts": []}


def test_shares_are_of_the_variance(plate):
    """Parts add up to the variance of every measurand, and without an edge's error its part is missing."""
    picture = State.first(plate).picture(plate)
    errors = variance_model("calibrated")(Pictures.of(picture))
    for number, quantity in enumerate(plate.quantities):
        parts = errors.parts(number)
        assert set(parts) == set(quantity.edges)
        assert sum(parts.values()) == pytest.approx(errors.variances_object[number], rel=1e-12)
    state = State.first(plate)
    assert sum(answers.answer(plate, state).shares.values()) == pytest.approx(1)


def test_refused_and_not_measurable(task1):
    low = State.first(task1)
    inside = task1.model_copy(update={"light": task1.light.model_copy(update={"distance": 1.0})})
    message = answers.to_message(answers.answer(inside, moved(low, (30, 45))))
    assert message["refused"].startswith("light must be outside the object, got (30, 45) at 1 cm")
    dark = answers.answer(task1, moved(low, (90, 90)))
    assert dark.shares == {}
    assert dark.limiting is None
    row = answers.to_message(dark)["measurands"][0]
    assert row["sigma"] is None
    assert row["why"] == MEANINGS[row["status"]]
    assert row["remedy"] == REMEDIES[row["status"]] != ""


def test_a_glance_at_a_block_is_a_close_look(task1):
    for closely in (False, True):
        told = answers.answer(task1, State.first(task1), closely=closely)
        assert told.prediction.variance_object == planner.predict(task1, (30, 90), (15, 270)).variance_object
        assert told.closely is closely


def test_nothing_is_ok_at_a_glance(plate):
    """Where a close look says ``ok`` or ``clutter`` a glance knows neither bias nor what all views tell together."""
    state = State.first(plate)
    state = replace(state, views=(state.setting,))
    close, glance = (answers.to_message(answers.answer(plate, state, closely=closely)) for closely in (True, False))
    assert "ok" in {row["status"] for row in close["measurands"]}
    for part in ("measurands", "edges"):
        assert {row["status"] for row in glance[part]} == {"glanced"}
    for row, before in zip(glance["measurands"], close["measurands"], strict=True):
        assert row["bias"] is None
        assert "together" not in row
        assert "together" in before
    lines = preview.overlay(plate, state.picture(plate), answers.answer(plate, state, closely=False))["lines"]
    assert {line["status"] for line in lines} == {"glanced"}
    dark = planner.predict(scenes.load("task1"), (30, 90), (90, 90), closely=False)
    assert dark.status in ("not_visible", "low_contrast")


def test_a_glance_for_the_bound_is_no_doubt(task1):
    """No unbiased estimator can beat it: there is no bias to look for."""
    told = planner.predict(task1, (30, 90), (15, 270), "bound", closely=False)
    assert (told.status, told.bias_image) == ("ok", 0.0)


@pytest.mark.parametrize("moving", [SENSOR, 0])
def test_sphere(task1, moving):
    """Patches cover the hemisphere, and each has the value that the planner gives for the pose of its middle."""
    known, state = sphere.cells(), replace(State.first(task1), moving=moving)
    low, high, start, stop = np.radians(known.borders).T
    assert ((np.cos(low) - np.cos(high)) * (stop - start)).sum() == pytest.approx(2 * np.pi)
    sigmas = np.concatenate(list(sphere.values(task1, state, known.poses)))
    assert sigmas.shape == (len(known.poses), 1)
    for i in range(0, len(known.poses), 37):
        pose = tuple(known.poses[i])
        pair = (pose, state.lights[0]) if moving == SENSOR else (state.sensor, pose)
        assert sigmas[i, 0] ** 2 == pytest.approx(planner.predict(task1, *pair).variance_object, rel=1e-9)
    message = sphere.to_message(task1, state, sigmas)
    assert len(message["values"]) == len(message["borders"])
    assert None in message["values"]
    assert sphere.key(state) == sphere.key(moved(state, (20, 20)) if moving == 0 else replace(state, sensor=Pose(1, 2)))
    assert sphere.key(state) != sphere.key(replace(state, moving=-1 - moving))


def test_preview_is_the_picture(task1):
    """Levels of the drawn picture are those of the rendered one but near edges."""
    from render import image

    state = State.first(task1)
    picture = state.picture(task1)
    part = preview.window(task1, picture)
    drawn = preview.drawn(task1, picture, part).astype(float)
    clean = preview.rendered(task1, image(picture, variant="scalar_rgb"), part).astype(float)
    assert drawn.shape == clean.shape
    apart = np.abs(drawn - clean)
    assert np.median(apart) < 2
    assert (apart > 12).mean() < 0.05  # margin: the share of pixels near edges, 3 %
    # margin: the order is said, against 2 grey levels
    assert np.abs(255 - drawn - clean).mean() > 50  # a picture of the wrong brightness is another one


@pytest.mark.skipif(not rays.has_embree(), reason="Embree has no wheel here")
@pytest.mark.parametrize(
    ("name", "lens", "most"),
    [("ball", {}, 40.0), ("bracket_mm", {}, 255.0), ("plate", {"distortion": [-0.2, 0.1]}, 255.0)],
)
def test_a_sketch_is_the_drawn_picture_with_fewer_pixels(name, lens, most, monkeypatch):
    """Levels, and places to a part of a pixel: shifted by one of the drawn picture's it fits less, either way alike.

    A ball by its outline, levels up to ``most``: its facets are shaded evenly in the drawn picture alone.
    """
    scene = scenes.load(name).with_(camera={"lens": lens}) if lens else scenes.load(name)
    assert scene.camera.lens.bends is bool(lens)
    picture = State.first(scene).picture(scene)
    part = preview.window(scene, picture)
    drawn = preview.drawn(scene, picture, part).astype(float)
    assert np.array_equal(preview.sketched(scene, picture, part), drawn)  # few triangles
    monkeypatch.setattr(preview, "_MANY", 0)
    sketch = preview.sketched(scene, picture, part).astype(float)
    assert all(abs(2 * n - m) <= 2 for n, m in zip(sketch.shape, drawn.shape, strict=True))
    large = cv2.resize(sketch, drawn.shape[::-1], interpolation=cv2.INTER_LINEAR)
    assert np.median(np.abs(large - drawn)) < 1
    large, drawn = np.minimum(large, most), np.minimum(drawn, most)
    one, here, other = (np.abs(np.roll(large, (by, by), (0, 1)) - drawn).mean() for by in (-1, 0, 1))
    assert here < 0.8 * min(one, other)  # margin: what a whole pixel makes
    assert abs(one - other) < 0.2 * here  # margin: what a tenth of a pixel makes


def test_overlay(plate):
    state = State.first(plate)
    drawn = preview.overlay(plate, state.picture(plate), answers.answer(plate, state))
    names = {line["name"] for line in drawn["lines"]}
    assert names == {name for quantity in plate.quantities for name in quantity.edges}
    assert all(np.linalg.eigvalsh(corner["covariance"]).min() > 0 for corner in drawn["corners"])


def test_best_from_here(task1):
    state = State.first(task1)
    found = best.best_from(task1, state)
    before, after = (answers.answer(task1, each).prediction.variance_object for each in (state, found))
    assert after < 0.9 * before  # margin: a tenth better, so that it is no rounding
    with pytest.raises(InvalidInput, match="descent must begin where the measurand can be measured"):
        best.best_from(task1, moved(state, (90, 90)))


def test_effects_are_those_of_the_place(task1):
    rows = effects.effects(task1, State.first(task1))
    assert {"fall_off", "lens_blur"} <= {row["name"] for row in rows if row["on"]}
    assert all(row["reason"] for row in rows)


def fake(task1, scale, rng, lost=0):
    """What 1000 images would have shown of the prediction, if sigma were ``scale`` times what it says."""
    forecast = planner.predict(task1, (30, 90), (15, 270)).measurands[0]
    values = forecast.value_object + scale * math.sqrt(forecast.variance_object) * rng.standard_normal(1000)
    values[:lost] = np.nan
    about = {
        "name": "distance", "unit": "cm", "value": forecast.value_object, "calibrated": forecast.variance_object,
        "predicted_bias": forecast.bias_object,
    }  # fmt: skip
    propagated = {"gradient:0": (forecast.variance_object, forecast.value_object, "ok")}
    clean = Clean(Packed.of(np.zeros((2, 2))), propagated, {"measurands": [about]}, {})
    pieces = np.split(values, 20)
    return clean, [TaskResult(None, {k: Chunk({"gradient:0": piece}, {}, {})}) for k, piece in enumerate(pieces)]


@pytest.mark.parametrize(("scale", "agrees"), [(1.0, True), (1.14, False), (0.88, False)])
def test_proof_tells_right_from_wrong(task1, rng, scale, agrees):
    (proof,) = prove.proofs(task1, *fake(task1, scale, rng))
    assert proof.agrees is agrees
    assert proof.ratio == pytest.approx(scale**2, rel=0.2)
    message = prove.to_message(proof)
    assert sum(message["counts"]) == 1000
    assert message["agrees"] is agrees


def test_proof_counts_what_is_lost(task1, rng):
    (proof,) = prove.proofs(task1, *fake(task1, 1.0, rng, lost=30))
    assert (proof.n, proof.failed) == (1000, 30)
    (none,) = prove.proofs(task1, *fake(task1, 1.0, rng, lost=1000))
    assert not prove.to_message(none)["counts"]
    assert prove.to_message(none)["ratio"] is None


def test_pieces_of_a_proof(task1):
    clean = Clean(Packed.of(np.zeros((2, 2))), {}, {}, {})
    tasks = prove.measuring(task1, State.first(task1), "scalar_rgb", clean, 120)
    assert [task.chunks for task in tasks] == [((0, 50),), ((1, 50),), ((2, 20),)]


@pytest.mark.parametrize("name", ["task1", "bracket_mm", "two_lights", "ring_light", "printed_label"])
def test_save(name, tmp_path):
    """All that the file said is there, and one setting more; files beside the scene are found from elsewhere."""
    scene = scenes.load(name)
    state = replace(State.first(scene), sensor=Pose(21.25, 3.5))
    path = save.save(name, state, tmp_path)
    again = scenes.load(path)
    assert path.name == f"{name}-explored.toml"
    assert again.settings[:-1] == scene.settings
    assert again.settings[-1].sensor == state.sensor
    assert again.settings[-1].lights == state.lights
    assert np.array_equal(again.solid.triangles, scene.solid.triangles)
    before = path.read_text()
    with pytest.raises(save.Exists, match="must be a new file"):
        save.save(name, state, tmp_path)
    assert path.read_text() == before
    other = save.save(name, replace(state, sensor=Pose(22, 3)), tmp_path, replace=True)
    assert scenes.load(other).settings[-1].sensor == Pose(22, 3)
    kept = replace(state, views=(Setting(sensor=Pose(23, 4), light=state.setting.light),))
    *_, view, last = scenes.load(save.save(name, kept, tmp_path, replace=True)).settings
    assert (view.sensor, view.lights, last.sensor) == (Pose(23, 4), state.lights, state.sensor)


@pytest.mark.parametrize("there", [True, False], ids=["a file", "nothing"])
def test_save_does_not_write_through_a_link_out_of_its_folder(tmp_path, task1, there):
    folder, outside = tmp_path / "folder", tmp_path / "outside"
    folder.mkdir()
    (folder / "task1-explored.toml").symlink_to(outside)
    if there:
        outside.write_text("theirs")
    with pytest.raises(save.Exists, match="must be a new file"):
        save.save("task1", State.first(task1), folder)
    with pytest.raises(InvalidInput, match="must be a file that can be written, got a link"):
        save.save("task1", State.first(task1), folder, replace=True)
    assert (outside.read_text() if there else outside.exists()) == ("theirs" if there else False)


def test_save_to_where_nothing_can_be(tmp_path, task1):
    with pytest.raises(InvalidInput, match="must be a file that can be written"):
        save.save("task1", State.first(task1), tmp_path / "none")


def statuses(token, asked):
    """Status of each request (path, headers) to a gate with that token."""

    async def run():
        async def inside(_):
            return web.Response(text="in")

        application = web.Application(middlewares=[gate(token)])
        application.add_routes([web.get("/", inside)])
        found = []
        async with TestServer(application) as server:
            for path, headers in asked:
                async with ClientSession(cookie_jar=CookieJar(unsafe=True)) as client:
                    host = f"127.0.0.1:{server.port}"
                    headers = {key: value.replace("HOST", host) for key, value in headers.items()}
                    async with client.get(server.make_url(path), headers=headers) as answer:
                        text = await answer.text()
                        assert text == "in" or text.count("\n") == 1
                        found.append(answer.status)
        return found

    return asyncio.run(run())


def test_gate_of_this_machine():
    asked = [
        ("/", {}), ("/", {"Host": "localhost:80"}), ("/", {"Host": "evil.example"}), ("/", {"Origin": "http://HOST"}),
        ("/", {"Origin": "http://evil.example"}), ("/", {"Origin": "null"}),
    ]  # fmt: skip
    assert statuses(None, asked) == [200, 200, 403, 200, 403, 403]


def first_line(port, request):
    with socket.create_connection(("127.0.0.1", port), timeout=5) as connection:
        connection.sendall(request)
        return connection.recv(4096).split(b"\r\n")[0].decode()


HOSTILE = {  # what is sent, and the status of the answer; without a token those of this machine come in
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1:99999\r\n\r\n": 403,
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1:\xb2\r\n\r\n": 403,
    b"GET / HTTP/1.1\r\nHost: \xff\r\n\r\n": 403,
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: \xff\r\n\r\n": 403,
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nCookie: ice_explore=\xff\xfe\r\n\r\n": 200,
    b"GET /?token=\xff HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n": 400,
    b"GET http://127.0.0.1:99999/ HTTP/1.1\r\n\r\n": 400,
    b"\x16\x03\x01 nonsense\r\n\r\n": 400,
}


@pytest.mark.parametrize("token", [None, "right"])
def test_hostile_requests_are_answered_without_a_traceback(task1, tmp_path, caplog, token):
    async def run():
        stop, address = asyncio.Event(), asyncio.get_running_loop().create_future()
        place = session.Place(task1, "task1", tmp_path)
        serving = asyncio.create_task(serve(place, "127.0.0.1", 0, token, address.set_result, stop))
        port = URL(await address).port
        found = [await asyncio.to_thread(first_line, port, request) for request in HOSTILE]
        stop.set()
        await serving
        return [int(line.split()[1]) for line in found]

    wanted = [403 if token and status == 200 else status for status in HOSTILE.values()]
    assert asyncio.run(run()) == wanted
    assert not caplog.records


def test_gate_with_a_token():
    asked = [
        ("/", {}), ("/?token=wrong", {}), ("/?token=right", {}), ("/", {"Cookie": f"{COOKIE}=right"}),
        ("/", {"Cookie": f"{COOKIE}=wrong"}), ("/?token=right", {"Origin": "http://evil.example"}),
    ]  # fmt: skip
    assert statuses("right", asked) == [403, 403, 200, 200, 403, 403]


def test_of_states_that_come_too_fast_the_newest_is_answered(task1):
    """A visitor's messages in one go: two answers at most, the last of them of the last state."""

    class Tools:
        async def quickly(self, work, *arguments):
            return await asyncio.to_thread(work, *arguments)

        aside = quickly

        async def slowly(self, work, *arguments):
            return []

    async def run():
        sent, ready = [], asyncio.Event()

        async def send(message):
            sent.append(message)
            if message.get("number") == 30:
                ready.set()

        async def messages():
            for number in range(1, 31):
                state = moved(State.first(task1), (15 + number, 270)).to_message()
                yield json.dumps({"type": "state", "state": state, "number": number})
            yield '{"type": "nonsense"}'
            await asyncio.wait_for(ready.wait(), 10)

        place = session.Place(task1, "task1", None)
        await session.Session(place, Tools(), send).run(messages())
        return sent

    sent = asyncio.run(run())
    answered = [message["number"] for message in sent if message["type"] == "answer"]
    assert answered[-1] == 30
    assert len(answered) <= 2
    assert sent[0]["type"] == "scene"
    assert any("type must be one of 'state', 'restore', 'best'" in message.get("text", "") for message in sent)


@pytest.mark.parametrize(
    ("error", "told", "logged"),
    [
        (InvalidInput("light must be a pose, got nothing"), "light must be a pose, got nothing", 0),
        (KeyError("two\nlines"), "this failed by an error of the program, KeyError('two\\nlines')", 1),
        (ExceptionGroup("g", [ValueError("x")]), "this failed by an error of the program, ValueError('x')", 1),
    ],
)
def test_every_error_of_work_is_told_in_one_line(task1, caplog, error, told, logged):
    """At rest, in an answer, and of what a button begins; one that is no bad input is logged with its traceback."""

    class Tools:
        async def quickly(self, work, *arguments):
            raise error

        slowly = aside = quickly

    async def run(text):
        sent = asyncio.Queue()

        async def messages():
            yield text
            while (message := await asyncio.wait_for(sent.get(), 5))["type"] != "told":
                pass
            found.append(message["text"])

        await session.Session(session.Place(task1, "task1", None), Tools(), sent.put).run(messages())

    found, state = [], State.first(task1).to_message()
    for message in ({"type": "state", "state": state, "rest": True}, {"type": "best"}):
        asyncio.run(run(json.dumps(message)))
    assert found == [told, told]
    assert len([record for record in caplog.records if record.exc_info]) >= 2 * logged
    assert bool(caplog.records) is bool(logged)


def test_a_close_look_that_takes_long_holds_nobody_up(task1):
    """It is taken in a process when nothing moves; answers to movements meanwhile are glances, and it is given up."""
    asked = []

    class Tools:
        async def quickly(self, work, *arguments):
            asked.append(("quickly", work, arguments[-1]))
            return work(*arguments) | {"core_s": 9.0} if work is session.answered else None

        async def aside(self, work, *arguments):
            asked.append(("aside", work, arguments[-1]))
            return work(*arguments) | {"core_s": 9.0}

        async def slowly(self, work, *arguments):
            asked.append(("slowly", work, arguments[-1]))
            await asyncio.sleep(60)

    async def run():
        sent, state = asyncio.Queue(), State.first(task1).to_message()

        async def answered():
            while (message := await asyncio.wait_for(sent.get(), 10))["type"] != "answer":
                pass
            return message["number"], message["closely"]

        async def messages():
            for number, (rest, count) in enumerate([(True, 2), (False, 1), (True, 1), (False, 1)], 1):
                yield json.dumps({"type": "state", "state": state, "rest": rest, "number": number})
                found.extend([await answered() for _ in range(count)])
                await asyncio.sleep(0.01)

        found = []
        await session.Session(session.Place(task1, "task1", None), Tools(), sent.put).run(messages())
        return found

    assert asyncio.run(run()) == [(1, False), (1, True), (2, False), (3, False), (4, False)]
    looks = [(where, closely) for where, work, closely in asked if work is session.answered]
    glance, close = ("quickly", False), ("slowly", True)
    assert looks == [
        glance,
        ("aside", True),
        glance,
        glance,
        close,
        glance,
    ]  # how long it takes is known from the first


def test_a_close_look_does_not_hold_up_an_answer():
    """One that waits in the other thread is over only when an answer in the first one lets it."""

    async def run():
        with tools.open_tools() as given:
            told = threading.Event()
            close = asyncio.create_task(given.aside(told.wait, 10))
            await asyncio.sleep(0)
            await given.quickly(told.set)
            return await close

    assert asyncio.run(run()) is True


def test_work_in_processes_leaves_the_cores_to_answers():
    """Ten steps of niceness more than here."""

    async def run():
        with tools.open_tools() as given:
            return await given.slowly(os.nice, 0)

    assert asyncio.run(run()) == min(os.nice(0) + 10, 19)


def test_below_the_horizon_the_lower_hemisphere_is_coloured(task1):
    """The mirrored patches, of what stands there; the values are others."""
    state = State.first(task1)
    low = replace(state, lights=(Pose(160, 20),), moving=0)
    assert [sphere.is_below(each) for each in (state, low, replace(low, moving=-1))] == [False, True, False]
    assert sphere.key(low) != sphere.key(replace(low, lights=(Pose(20, 20),)))
    above, below = sphere.cells(), sphere.cells(below=True)
    assert below.poses == pytest.approx(np.array([180, 0]) - above.poses * [1, -1])
    assert (below.borders[:, 0] < below.borders[:, 1]).all()
    message = sphere.to_message(task1, low, np.ones((len(below.poses), 1)))
    assert min(border[0] for border in message["borders"]) == 90


def test_work_in_processes_that_nobody_waits_for_never_begins():
    """What has begun is left to itself, its error too; what waits for a process is forgotten."""

    async def run():
        begun = []

        def work(number):
            begun.append(number)
            time.sleep(0.05)
            raise KeyError(number)

        with ThreadPoolExecutor(1) as crew:
            given = tools.Tools(crew, crew, asyncio.Semaphore(1), crew)
            one, two = (asyncio.create_task(given.slowly(work, number)) for number in (1, 2))
            await asyncio.sleep(0.01)
            one.cancel()
            two.cancel()
            for task in (one, two):
                with pytest.raises(asyncio.CancelledError):
                    await task
            with pytest.raises(KeyError, match="3"):
                await given.slowly(work, 3)
        return begun

    assert asyncio.run(run()) == [1, 3]


def test_work_can_be_stopped(task1):
    """A second one is refused while the first is under way; it ends as soon as it is told to."""

    class Tools:
        async def variant(self):
            return "scalar_rgb"

        async def perform(self, task):
            await asyncio.sleep(60)

    async def run():
        sent, told = [], asyncio.Queue()

        async def send(message):
            sent.append(message)
            await told.put(message)

        async def until(kind, **about):
            while (message := await asyncio.wait_for(told.get(), 5))[
                "type"
            ] != kind or not about.items() <= message.items():
                pass

        async def messages():
            yield '{"type": "prove"}'
            await until("job", state="begun")
            yield '{"type": "render"}'
            await until("told")
            yield '{"type": "cancel"}'
            await until("job", state="stopped")

        await session.Session(session.Place(task1, "task1", None), Tools(), send).run(messages())
        return sent

    sent = asyncio.run(asyncio.wait_for(run(), 20))
    assert [each["text"] for each in sent if each["type"] == "told"] == [
        "another work must be finished or stopped before this, got one under way"
    ]


@pytest.mark.parametrize("size", [(2500, 1), (2500, 7), (1, 1900), (1, 1), (1600, 900)])
def test_a_part_of_any_shape_is_as_large_as_its_scale_says(task1, size):
    """At least one pixel either way."""
    part = preview.Window(5, 7, *size)
    image = np.arange(3000.0 * 3000).reshape(3000, 3000) % 200
    wanted = [max(1, round(n * part.scale)) for n in (part.height, part.width)]
    assert list(preview.rendered(task1, image, part).shape) == wanted


def test_requests_that_are_no_http_are_not_logged_and_errors_of_ours_are():
    """The filter is set once, however often a page is served."""
    log = server._log()
    assert server._log() is log
    assert log.filters.count(server._is_ours) == 1

    def record(error):
        told = (type(error), error, None) if error else None
        return logging.LogRecord(log.name, logging.ERROR, "", 1, "said", None, told)

    kept = [
        bool(log.filter(record(error))) for error in (None, ValueError("ours"), BadStatusLine("x"), BadHttpMessage("x"))
    ]
    assert kept == [True, True, False, False]


@pytest.mark.parametrize(
    ("took", "large", "where", "size", "shown"),
    [
        (0.51, False, "slowly", (2048, 512), True), (0.49, True, "aside", (512, 2049), False),
        (math.inf, True, "slowly", (1024, 1024), True), (math.inf, False, "aside", (1024, 1025), False),
    ],
)  # fmt: skip
def test_what_follows_at_rest(task1, took, large, where, size, shown, monkeypatch):
    """A close look of more than half a second, or of a large part, in a process; a picture of up to 2^20 px."""
    camera = task1.camera.model_copy(update={"width": size[0], "height": size[1]})
    scene, said = task1.model_copy(update={"camera": camera}), []

    class Kept:
        async def aside(self, work, *arguments):
            return await self._done("aside", work, arguments)

        async def slowly(self, work, *arguments):
            return await self._done("slowly", work, arguments)

        async def _done(self, place, work, arguments):
            said.append((place, work.__name__))
            return {"refused": "", "core_s": 0.3} if work is session.answered else ["a row"]

    async def send(message):
        said.append(message)

    async def noted(state):
        said.append("coloured" if "coloured" not in said else "shown")

    visitor = session.Session(session.Place(scene, "task1", None), Kept(), send)
    visitor._close_s = took
    monkeypatch.setattr(visitor, "_colour", noted)
    monkeypatch.setattr(visitor, "_show", noted)
    monkeypatch.setattr(preview, "is_large", lambda given: large)
    asyncio.run(visitor._rest(State.first(scene), False, 7))
    assert said == [
        (where, "answered"), {"refused": "", "core_s": 0.3, "number": 7}, "coloured",
        ("slowly", "rows"), {"type": "budget", "rows": ["a row"]},
        ("slowly", "effects"), {"type": "effects", "rows": ["a row"]},
        *(["shown"] if shown else []),
    ]  # fmt: skip
    assert visitor._close_s == 0.3


@pytest.mark.parametrize(("width", "height"), [(420, 60), (1680, 240)])
def test_a_rendered_picture_is_shown_pixel_by_pixel_or_by_means(task1, width, height, rng):
    """Of one that is wider than what is sent each pixel is the mean of 4 x 4; else it is itself."""
    levels = rng.integers(0, 256, (height + 7, width + 5)).astype(float)
    part = preview.Window(3, 2, width, height)
    found = preview.rendered(task1, levels, part)
    cut, times = levels[2 : 2 + height, 3 : 3 + width], width // 420
    means = cut.reshape(height // times, times, width // times, times).mean((1, 3))
    if times == 1:
        assert found.shape == (60, 420)
    assert found.astype(float) == pytest.approx(np.floor(means + 1e-3), abs=1 if times > 1 else 0)
