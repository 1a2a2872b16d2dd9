"""Tiles that are rendered again, put together from a renderer that knows each pixel's value."""

import threading
from types import SimpleNamespace

import numpy as np
import pytest

from render import mosaic as module
from render.mosaic import Tiles, _held, _side

FRAME = (70, 90)  # fine pixels of the sensor's whole frame


def value(y, x):
    return 1000.0 * y + x


@pytest.fixture
def tiles(monkeypatch):
    """The corners in the whole frame, with the side, of every tile that was asked for."""
    asked = []

    def side_by_side(mitsuba, view, corners, side, samples, placed):
        asked.extend((y, x, side) for y, x in corners)
        return corners, side

    monkeypatch.setattr(module, "_side_by_side", side_by_side)
    return asked


def render(scene, sensor, seed):
    corners, side = sensor
    rows, columns = np.mgrid[:side, :side]
    return np.concatenate([value(y + rows, x + columns) for y, x in corners], 1)[..., None]


@pytest.mark.parametrize("kind", ["perspective", "thinlens"])
@pytest.mark.parametrize(("start", "size"), [((0, 0), FRAME), ((11, 23), (41, 37)), ((35, 60), (35, 30))])
def test_marked_pixels_are_rendered_again(kind, start, size, tiles, rng):
    """Every marked pixel has the new value, no tile without one is rendered; with a lens none leaves the frame."""
    view = {"type": kind, "film": {"height": FRAME[0], "width": FRAME[1]}}
    marked = rng.random(size) < 0.01
    marked[-9:, -7:] = marked[0, 0] = True  # together, so that large tiles pay, up to the frame's border
    fine = np.full(size, -1.0)
    found = Tiles(SimpleNamespace(render=render), None, view, start).rendered(fine, marked, 16, (5, 0))
    y, x = np.mgrid[: size[0], : size[1]]
    truth = value(y + start[0], x + start[1])
    assert found is fine
    assert (found[marked] == truth[marked]).all()
    assert ((found == truth) | (found == -1)).all()
    for top, left, side in tiles:
        rows, columns = y + start[0] - top, x + start[1] - left
        inside = (rows >= 0) & (rows < side) & (columns >= 0) & (columns < side)
        assert marked[inside].any()
        if kind == "thinlens":
            assert 0 <= top <= FRAME[0] - side
            assert 0 <= left <= FRAME[1] - side
    assert len(set(tiles)) == len(tiles)


def test_side_of_the_least_time():
    """Making a sensor takes as long as so many rays: few marked pixels want small tiles, costly sensors large ones."""
    alone, full = np.zeros((64, 64), bool), np.ones((64, 64), bool)
    alone[5, 5] = True

    def time(marked, side, samples, sensor):
        return _held(marked, side).sum() * (sensor + side**2 * samples)

    for marked in (alone, full):
        for samples, sensor in ((1, 0), (16, 0), (16, 10**7), (1, 500)):
            for most in (8, 64):
                sides = [side for side in module._SIDES if side <= most]
                found = _side(marked, samples, sensor, most)
                assert found in sides
                assert time(marked, found, samples, sensor) == min(time(marked, s, samples, sensor) for s in sides)
    assert _side(alone, 16, 0, 64) == min(module._SIDES)


def test_the_next_sensor_is_made_while_rays_are_traced_and_never_two_renders_at_once():
    """A render waits until the sensor after its own is there; the last has none after it. A mistake ends all."""
    there, running, most = [threading.Event() for _ in range(5)], [], []

    def sensors():
        for number, event in enumerate(there):
            event.set()
            yield (number,)

    def traced(number):
        running.append(number)
        most.append(len(running))
        waited = there[min(number + 1, 4)].wait(timeout=10)
        running.pop()
        return number if waited else None

    assert list(module._meanwhile(traced, sensors())) == [0, 1, 2, 3, 4]
    assert most == [1] * 5
    with pytest.raises(ZeroDivisionError):
        list(module._meanwhile(lambda number: 1 / (3 - number), sensors()))
