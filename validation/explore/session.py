"""One visitor's connection: what the page says comes in, what it is to show goes out."""

from __future__ import annotations

import asyncio
import base64
import logging
import math
import time
from collections.abc import AsyncIterable, Awaitable, Callable
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from imaging.light.emitters import reach_of
from scenes import InvalidInput, Scene
from scenes.results import picked
from validation.batch import pool
from validation.batch.work import Chunks, TaskResult
from validation.explore import answers, best, budgets, effects, preview, prove, save, sphere
from validation.explore.messages import Message
from validation.explore.state import MOST_VIEWS, State
from validation.explore.tools import Tools

Send = Callable[[dict[str, Any]], Awaitable[None]]
Work = Callable[..., Awaitable[None]]
_LOG = logging.getLogger("validation.explore")
_MOST_STEPS = 32767  # of the corners of triangles, as far as they reach
_MOST_TOLD = 300  # characters of an error
_QUICK_PIXELS = 1 << 20  # of a picture that is rendered without being asked for
_LONG_S = 0.5  # of one core: a close look that takes longer is taken in a process
_CLOSE_S = 0.08  # of one core: an answer that takes longer follows one from a glance, when nothing is dragged


@dataclass(frozen=True)
class Place:
    """What is explored: the scene, the name or path it was given by, and the directory in which to save."""

    scene: Scene
    source: str
    directory: Path


def answered(scene: Scene, state: State, closely: bool) -> dict[str, Any]:
    """The message that answers a state: prediction, preview, and what is drawn over it."""
    began, worked = time.perf_counter(), time.thread_time()
    told = answers.answer(scene, state, closely=closely)
    message = {"type": "answer", **answers.to_message(told)}
    if told.prediction is not None:
        picture = state.picture(scene)
        part, draw = preview.window(scene, picture), preview.drawn if closely else preview.sketched
        message["picture"] = preview.to_message("preview", draw(scene, picture, part), part)
        message["overlay"] = preview.overlay(scene, picture, told)
    return message | {"ms": 1e3 * (time.perf_counter() - began), "core_s": time.thread_time() - worked}


class Session:
    """A visitor's state and the work that is under way for it.

    Of states that come faster than they can be answered the newest is taken and the others are left out. Where a close
    look takes long, or before that is known, an answer is a glance. When a state is the last for a while
    (``rest``) the close look, the sphere, the effects and the rendered picture follow, each of them given up as soon as
    another state comes.
    """

    def __init__(self, place: Place, tools: Tools, send: Send) -> None:
        self._place, self._scene, self._tools, self._send = place, place.scene, tools, send
        self.state = State.first(place.scene)
        self._newest: tuple[State, bool, int] | None = None
        self._wake = asyncio.Event()
        self._after: asyncio.Task | None = None
        self._job: asyncio.Task | None = None
        self._close_s = math.inf  # of the last one
        self._refused = False
        self._sphere: tuple[tuple, np.ndarray] | None = None
        self._clean: tuple[tuple, Any] | None = None

    async def run(self, messages: AsyncIterable[str]) -> None:
        """Serve until the messages, texts, end."""
        await self._send(scene_message(self._scene, self.state))
        answering = asyncio.create_task(self._answers())
        try:
            async for message in messages:
                try:
                    await self._take(Message.of(message))
                except InvalidInput as error:
                    await self._tell(str(error))
        finally:
            left = [task for task in (answering, self._after, self._job) if task is not None]
            for task in left:
                task.cancel()
            await asyncio.gather(*left, return_exceptions=True)

    async def _take(self, message: Message) -> None:
        if message.type == "state":
            self.state = State.of_message(self._scene, message.state).tolerable(self._scene)
            self._ask(message.rest, message.number)
        elif message.type == "restore":
            self.state = State.of_message(self._scene, message.state).tolerable(self._scene)
            await self._moved("What the address says is shown.")
        elif message.type == "cancel":
            if self._job is not None:
                self._job.cancel()
        elif message.type == "save":
            await self._save(message.replace)
        else:
            self._begin(message.type)

    def _ask(self, rest: bool, number: int) -> None:
        if self._after is not None:
            self._after.cancel()
        self._newest = self.state, rest, number
        self._wake.set()

    async def _answers(self) -> None:
        while True:
            await self._wake.wait()
            self._wake.clear()
            state, rest, number = self._newest
            closely = self._close_s < _CLOSE_S
            await self._guarded(self._answer, self._tools.quickly, state, closely, number)
            if rest and not self._wake.is_set():
                self._after = asyncio.create_task(self._guarded(self._rest, state, closely, number))

    async def _answer(self, where: Callable, state: State, closely: bool, number: int) -> None:
        message = await where(answered, self._scene, state, closely)
        self._refused = bool(message["refused"])
        if closely and not self._refused:
            self._close_s = message["core_s"]
        await self._send(message | {"number": number})

    async def _rest(self, state: State, closely: bool, number: int) -> None:
        """What follows when nothing moves; a close look beside the thread that answers, a long one in a process: a
        movement is answered meanwhile."""
        if not (closely or self._refused):
            is_long = self._close_s > _LONG_S if math.isfinite(self._close_s) else preview.is_large(self._scene)
            await self._answer(self._tools.slowly if is_long else self._tools.aside, state, True, number)
        await self._colour(state)
        if self._refused:
            return
        await self._send({"type": "budget", "rows": await self._tools.slowly(budgets.rows, self._scene, state)})
        await self._send({"type": "effects", "rows": await self._tools.slowly(effects.effects, self._scene, state)})
        if self._scene.camera.width * self._scene.camera.height <= _QUICK_PIXELS:
            await self._show(state)

    async def _colour(self, state: State) -> None:
        key = sphere.key(state)
        if self._sphere is None or self._sphere[0] != key:
            parts, places = [], sphere.cells(below=sphere.is_below(state)).poses
            pieces = sphere.values(self._scene, state, places)
            while (part := await self._tools.quickly(next, pieces, None)) is not None:
                parts.append(part)
                await self._send({"type": "colouring", "done": sum(map(len, parts)), "total": len(places)})
            self._sphere = key, np.concatenate(parts)
        await self._send({"type": "sphere", **sphere.to_message(self._scene, state, self._sphere[1])})

    async def _rendered(self, state: State) -> Any:
        """The noise-free picture of a state and what it says, kept until another is asked for."""
        key = state.sensor, state.lights
        if self._clean is None or self._clean[0] != key:
            found = await self._tools.perform(prove.rendering(self._scene, state, await self._tools.variant()))
            if found.trouble:
                raise InvalidInput(found.trouble)
            self._clean = key, found.clean
        return self._clean[1]

    async def _show(self, state: State) -> None:
        clean = await self._rendered(state)
        part = preview.window(self._scene, state.picture(self._scene))
        grey = preview.rendered(self._scene, clean.image.array(), part)
        await self._send({"type": "picture", "picture": preview.to_message("rendered", grey, part)})

    def _begin(self, kind: str) -> None:
        if self._job is not None and not self._job.done():
            raise InvalidInput("another work must be finished or stopped before this, got one under way")
        work = {"best": self._best, "prove": self._prove, "render": self._show}[kind]
        self._job = asyncio.create_task(self._working(kind, work, self.state))

    async def _working(self, kind: str, work: Work, state: State) -> None:
        await self._send({"type": "job", "kind": kind, "state": "begun"})
        ending = "stopped"
        try:
            await self._guarded(work, state)
            ending = "done"
        finally:
            await self._send({"type": "job", "kind": kind, "state": ending})

    async def _best(self, state: State) -> None:
        found = await self._tools.slowly(best.best_from, self._scene, state)
        self.state = replace(self.state, sensor=found.sensor, lights=found.lights)
        await self._moved("Moved to the nearest place from where this requirement is measured best.")

    async def _moved(self, text: str) -> None:
        await self._send({"type": "moved", "state": self.state.to_message(), "text": text})

    async def _prove(self, state: State) -> None:
        state.picture(self._scene)
        await self._send({"type": "progress", "done": 0, "total": prove.RENDERS})
        clean = await self._rendered(state)
        tasks = prove.measuring(self._scene, state, await self._tools.variant(), clean)
        found = await self._measured(tasks)
        proofs = prove.proofs(self._scene, clean, found)
        rows = [prove.to_message(each) for each in proofs]
        await self._send({"type": "proof", "state": state.to_message(), "rows": rows})

    async def _measured(self, tasks: list[Chunks]) -> list[TaskResult]:
        """What the pieces found; a few at a time, so that other visitors' work comes between."""
        few, done = asyncio.Semaphore(pool.cores()), 0

        async def one(task: Chunks) -> TaskResult:
            nonlocal done
            async with few:
                found = await self._tools.perform(task)
            done += sum(number for _, number in task.chunks)
            await self._send({"type": "progress", "done": done, "total": prove.RENDERS})
            return found

        async with asyncio.TaskGroup() as group:
            work = [group.create_task(one(task)) for task in tasks]
        return [each.result() for each in work]

    async def _save(self, replaced: bool) -> None:
        try:
            path = save.save(self._place.source, self.state, self._place.directory, replace=replaced)
        except save.Exists as error:
            await self._send({"type": "exists", "text": str(error)})
        else:
            await self._send({"type": "saved", "path": str(path)})

    async def _guarded(self, work: Work, *arguments: Any) -> None:
        """Every error is told on the page; one that is neither bad input nor the loss of a process is logged, too."""
        try:
            await work(*arguments)
        except ConnectionError:  # the visitor has left
            pass
        except Exception as error:
            first = error.exceptions[0] if isinstance(error, ExceptionGroup) else error  # of pieces measured at once
            if isinstance(first, InvalidInput | BrokenExecutor):
                await self._tell(str(first))
            else:
                _LOG.error("work for a page of ice explore failed", exc_info=first)
                await self._tell(" ".join(f"this failed by an error of the program, {first!r}"[:_MOST_TOLD].split()))

    async def _tell(self, text: str) -> None:
        await self._send({"type": "told", "text": text})


def scene_message(scene: Scene, state: State) -> dict[str, Any]:
    """What the page needs once: the object's triangles and needed edges, what is measured, and the first state.

    Numbers of ``corners`` (three of each triangle) are multiples of ``step``, those of ``normals`` of 1 / 127:
    integers' bytes, base64.
    """
    bodies, solid = scene.bodies, scene.solid
    middle = np.array(scene.camera.look_at)
    size = reach_of(scene)
    needed = {name for quantity in scene.quantities for name in quantity.edges}
    edges = [
        {"name": edge.name, "ends": ((solid.vertices[list(edge.ends)] - middle) / size).round(4).tolist()}
        for edge in solid.edges
        if edge.name in needed
    ]
    corners = (bodies.triangles - middle) / size
    step = float(np.abs(corners).max()) / _MOST_STEPS
    return {
        "type": "scene",
        **picked(scene, "name", "title", "units"),
        "corners": _packed(corners / step, "<i2"),
        "step": step,
        "normals": _packed(127 * bodies.normals[bodies.triangle_faces], "i1"),
        "edges": edges,
        "lights": [scene.lights[i].kind for i in scene.free],
        "camera": [scene.camera.width, scene.camera.height],
        "measurands": [
            {**picked(quantity, "name", "kind"), "tolerance": quantity.tolerance is not None}
            for quantity in scene.quantities
        ],
        "views": MOST_VIEWS,
        "renders": prove.RENDERS,
        "asks": scene.camera.width * scene.camera.height > _QUICK_PIXELS,
        "state": state.to_message(),
    }


def _packed(values: np.ndarray, kind: str) -> str:
    """Rounded to integers of that kind, base64."""
    return base64.b64encode(np.rint(values).astype(kind).tobytes()).decode()
