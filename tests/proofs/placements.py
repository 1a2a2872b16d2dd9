"""``python -m tests.proofs placements``: parts that lie anywhere are found, and place and values are known as told.

Three convex parts at random places (shifts to 5 mm, heights to 2 mm, turns and tilts to 3 degrees), each exposed once
by the image model (`imaging.blurred.whole`), or with ``--rendered`` by the renderer, with noise drawn anew. Each is
found without a start, its place adjusted from its edges, its values measured. With ``--board`` a board behind it tells
the place, shifts to 3 mm; where it lies beside the part, how large it is and where its points are is as uncertain as
the scene says, and drawn anew each time. Pulls of place and values (error over told standard deviation) must have a
spread of 1 within 5 % and a mean within 0.1, the variance of each value's the told one within chance (1 % for all
values together, Sidak). Controls must fail: values with the variance of a known place, and variances 1.3 times too
large. With ``--camera focal`` each picture is taken by a camera of another focal length, which is known to 1 % before
and estimated with the place; the control is a measurement by who takes the focal length for what the scene says.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import measure
import render
from imaging.blurred.whole import image
from imaging.features.kinds import on_plane
from imaging.placed import difference, placed
from measure.quantities import find, values
from scenes import Picture
from scenes.status import is_trusted
from tests import placements as placed_parts
from tests import printed
from tests.proofs.bundles import Row, inside

_CONTROLS = ("at_known", "elsewhere")
FOUND, SPREAD, MEAN = 0.99, 0.05, 0.1


@dataclass
class Pulls:
    """Of one part's places at random.

    Attributes
    ----------
    tried, refused, wrong : int
        Places that were drawn, that were refused, and that were found elsewhere (by more than six of their standard
        deviations).
    place, values : list of ndarray
        Pulls of shift, rotation and camera, and of the values.
    at_known, elsewhere : list of ndarray
        Of the values with the variance of a known place; of values and of shift and rotation by who takes the camera
        for what the scene says.
    names, numbers : tuple of str
        Of the values; of what is estimated of the camera.
    """

    tried: int = 0
    refused: int = 0
    wrong: int = 0
    place: list[np.ndarray] = field(default_factory=list)
    values: list[np.ndarray] = field(default_factory=list)
    at_known: list[np.ndarray] = field(default_factory=list)
    elsewhere: list[np.ndarray] = field(default_factory=list)
    names: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()

    def __add__(self, other: Pulls) -> Pulls:
        """Those of both."""
        counts = (getattr(self, each) + getattr(other, each) for each in ("tried", "refused", "wrong"))
        lists = (getattr(self, each) + getattr(other, each) for each in ("place", "values", "at_known", "elsewhere"))
        return Pulls(*counts, *lists, names=self.names or other.names, numbers=self.numbers or other.numbers)


def one(picture: Picture, rng: np.random.Generator, found: Pulls, made: Callable[[Picture], np.ndarray]) -> None:
    """One place at random, of which ``made`` makes a noise-free image."""
    there = printed.place(picture, rng)
    (shot,) = render.expose(made(placed(printed.drawn(picture, rng), there)), picture.scene.noise, rng, 1)
    found.tried += 1
    where = measure.locate(shot, picture)
    if where.status != "ok":
        found.refused += 1
        return
    pull = difference(there, where.placement) / np.sqrt(np.diag(where.covariance))
    if np.abs(pull).max() > 6:
        found.wrong += 1
        return
    told = measure.measure(shot, where.picture)
    if not is_trusted(told.status).all():
        found.refused += 1
        return
    found.place.append(pull)
    off = told.value - told.nominal
    found.values.append(off / np.hypot(told.sigma, told.u_placed))
    if picture.scene.placement.camera:
        values, place = _as_said(shot, picture, there)
        found.at_known.append(values)
        found.elsewhere.append(place)
    else:
        found.at_known.append(off / _at_known(shot, where.picture))


def _as_said(shot: np.ndarray, picture: Picture, there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pulls of values (M,) and of the place (6,) by who takes the camera for what the scene says; NaN where that finds
    nothing."""
    where = measure.locate(shot, printed.as_said(picture))
    told = measure.measure(shot, where.picture)
    place = difference(there[:6], where.placement) / np.sqrt(np.diag(where.covariance))
    return (told.value - told.nominal) / np.hypot(told.sigma, told.u_placed), place


def _at_known(shot: np.ndarray, picture: Picture) -> np.ndarray:
    """Standard deviations (M,) of the values by noise, were the place known."""
    told = find(shot[None], picture, measure.best_estimator(picture.scene))
    return np.sqrt(np.diag(values(told.seen, told.known.quantities, on_plane, told.errors).covariance[0]))


def summary(name: str, found: Pulls) -> bool:
    """Printed, and whether it is as told."""
    good = found.tried - found.refused - found.wrong
    print(f"{name}: {good} of {found.tried} found, {found.refused} refused, {found.wrong} wrong")
    place, of_values = np.array(found.place), np.array(found.values)
    rows = [*zip(("x", "y", "z", "rx", "ry", "rz", *found.numbers), place.T, strict=True),
            *zip(found.names, of_values.T, strict=True)]  # fmt: skip
    for label, pull in rows:
        print(f"  {label:8} mean {pull.mean():+.3f}  spread {pull.std(ddof=1):.3f}")
    control = [np.nanstd(np.array(getattr(found, name)), axis=0, ddof=1) for name in _CONTROLS if getattr(found, name)]
    control = np.concatenate(control)
    print(f"  as of a known place or camera (must not be 1): {', '.join(f'{each:.2f}' for each in control)}")
    return not found.wrong


def held(every: list[Pulls]) -> bool:
    """Whether all pulls together are as told, and the controls are not; printed."""
    tried = sum(each.tried for each in every)
    found = sum(len(each.place) for each in every)
    place = np.concatenate([np.array(each.place) for each in every])
    of_values = [pull for each in every for pull in np.array(each.values).T]
    known = [np.concatenate([np.array(getattr(each, name)).ravel() for each in every]) for name in _CONTROLS]
    rows = [("place", place.ravel()), ("values", np.concatenate(of_values))]
    for label, pull in rows:
        chance = 1 / np.sqrt(2 * pull.size)
        told = f"mean {pull.mean():+.3f}, spread {pull.std():.3f}"
        print(f"{label}: {pull.size} pulls, {told} (chance {chance:.3f}, were they independent)")
    single = [Row(name, pull) for part in every for name, pull in zip(part.names, np.array(part.values).T, strict=True)]
    by_chance, ratios = inside(single), [row.ratio for row in single]
    told = f"{min(ratios):.2f} to {max(ratios):.2f}, {sum(by_chance)} inside chance"
    print(f"measured / told variances of {len(single)} values: {told}")
    print(f"found {found} of {tried}")
    good = found >= FOUND * tried and not sum(each.wrong for each in every)
    good &= all(by_chance) and all(is_as_told(pull) for _, pull in rows)
    controls = [is_as_told(pull / np.sqrt(1.3)) for _, pull in rows]
    controls += [is_as_told(pull[np.isfinite(pull)]) for pull in known if np.isfinite(pull).any()]
    print(f"controls that pass and must not: {sum(controls)} of {len(controls)}")
    return good and not any(controls)


def is_as_told(pull: np.ndarray) -> bool:
    """Whether pulls have a spread of 1 within 5 % and no mean beyond 0.1."""
    return bool(abs(pull.std() - 1) < SPREAD and abs(pull.mean()) < MEAN)


def of_places(name: str, board: str, numbers: tuple[str, ...], seed: int, rendered: bool, places: range) -> Pulls:
    """Of one part's places of these numbers; each has a generator of its own."""
    found, k = Pulls(), list(placed_parts.CORNERS).index(name)
    with tempfile.TemporaryDirectory() as folder:
        scene = printed.scene(Path(folder), name, board) if board else placed_parts.scene(Path(folder), name)
        scene = printed.lenient(printed.estimated(scene, *numbers)) if numbers else scene
        picture = Picture.of(scene, placed_parts.SENSOR, placed_parts.LIGHT)
        for i in places:
            one(picture, np.random.default_rng((seed, k, i)), found, render.image if rendered else image)
        found.names, found.numbers = tuple(each.name for each in scene.quantities), numbers
    return found


def placements(
    places: Annotated[int, typer.Option(help="Places of each part.")] = 334,
    seed: Annotated[int, typer.Option()] = 1,
    only: Annotated[str, typer.Option(help="Parts whose names begin so.")] = "",
    board: Annotated[str, typer.Option(help="chessboard, dots or markers: they tell the place.")] = "",
    camera: Annotated[str, typer.Option(help="What is estimated of the camera: focal, or with a board focal,k1.")] = "",
    rendered: Annotated[bool, typer.Option(help="Pictures by the renderer, not by the image model.")] = False,
    jobs: Annotated[int, typer.Option(help="Processes.")] = 1,
) -> None:
    """Three parts at 1000 random places: found, and place and values as well known as told; an hour of a processor."""
    every, good, numbers = [], True, tuple(filter(None, camera.split(",")))
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        for name in [each for each in placed_parts.CORNERS if each.startswith(only)]:
            shares = [range(at, places, 4 * jobs) for at in range(min(4 * jobs, places))]
            found = sum(pool.map(partial(of_places, name, board, numbers, seed, rendered), shares), Pulls())
            good &= summary(name, found)
            every.append(found)
    raise typer.Exit(0 if held(every) and good else 1)
