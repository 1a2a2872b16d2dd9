"""Tables of brightness of uneven faces: on nodes that hold those of both, whatever is made at once."""

from types import SimpleNamespace

import numpy as np
import pytest

from render import texture
from scenes.viewpoint import Viewpoint


def shade(_, normal, points, material):
    """Quadratic in the place; of the matt part a third of it."""
    return (points @ [1.0, 0.3, 0.0] + points[..., 0] * points[..., 1] + normal[2]) * material.part


@pytest.mark.parametrize("at_once", [1, 7, 1 << 13])
@pytest.mark.parametrize(
    ("table", "sheet", "nodes"),
    [
        ((17, 33), (5, 9), (17, 33)),
        ((17, 33), (4, 11), (19, 41)),
        ((17, 33), (17, 70), (17, 70)),
        ((2, 2), (4, 3), (4, 3)),
    ],
)
def test_nodes_are_those_of_the_texture_and_enough_for_the_brightness(monkeypatch, at_once, table, sheet, nodes):
    """So many times the intervals of the texture that there are no fewer than those of the table."""
    monkeypatch.setattr(texture, "shade", shade)
    monkeypatch.setattr(texture, "_AT_ONCE", at_once)
    normal, kept = np.array([0.0, 0.0, 0.5]), SimpleNamespace(part=1.0, matt=lambda: SimpleNamespace(part=1 / 3))
    factors = np.random.default_rng(2).uniform(0.5, 1.5, sheet)
    corner, sides = np.array([1.0, 2.0, 3.0]), np.array([[4.0, 0, 0], [0, 2.0, 0]])

    def at(across, down):
        return corner + across[:, None] * sides[0] + down[:, None, None] * sides[1]

    def factor(points):
        rows, columns = factors.shape
        row = (points[..., 1] - 2) / 2 * (rows - 1)
        column = (points[..., 0] - 1) / 4 * (columns - 1)
        i, j = np.minimum(row.astype(int), rows - 2), np.minimum(column.astype(int), columns - 2)
        v, u = row - i, column - j
        return (1 - v) * ((1 - u) * factors[i, j] + u * factors[i, j + 1]) + v * (
            (1 - u) * factors[i + 1, j] + u * factors[i + 1, j + 1]
        )

    found = texture._uneven(np.zeros(table), at, normal, None, kept, SimpleNamespace(values=factors, at=factor))
    assert found.shape == nodes
    points = at(np.linspace(0, 1, nodes[1]), np.linspace(0, 1, nodes[0]))
    whole = shade(None, normal, points, SimpleNamespace(part=1.0))
    np.testing.assert_allclose(found, whole * (1 + (factor(points) - 1) / 3), rtol=1e-12)
    assert (
        texture._uneven(np.zeros((2, 3000)), at, normal, None, kept, SimpleNamespace(values=np.ones((1500, 9)))) is None
    )


@pytest.mark.parametrize("shape", [(17, 33), (33, 9), (65, 17)])
def test_what_every_other_node_misses(shape):
    """Its largest over 1e-4, or its largest mean over an eighth by an eighth over 4e-5, twice; by loops."""
    values = np.random.default_rng(5).uniform(1, 2, shape)
    missed = {
        (i, j): abs(values[i, j] - (values[i - 1, j] + values[i + 1, j]) / 2)
        for i in range(1, shape[0], 2)
        for j in range(shape[1])
    }
    high, wide = (shape[0] - 1) // 8, (shape[1] - 1) // 8  # the first column of all is in no part
    means = [
        np.mean([v for (i, j), v in missed.items() if i // high == a and (j - 1) // wide == b and j > 0])
        for a in range(8)
        for b in range(8)
    ]
    assert texture._excess(values) == pytest.approx(2 * max(max(missed.values()) / 1e-4, max(means) / 4e-5))
    lone = np.ones(shape)
    lone[3, 0] = 1.5  # seen at one node alone
    assert texture._excess(lone) == pytest.approx(2 * 0.5 / 1e-4)


@pytest.mark.parametrize("at_once", [50, 1 << 13])
@pytest.mark.parametrize(("bend", "turn", "nodes"), [(1.5, 0, (17, 257)), (0.3, 1, (129, 17)), (1e-3, 0, (17, 17))])
def test_a_table_is_as_fine_as_it_has_to_be(monkeypatch, at_once, bend, turn, nodes):
    """Of 1 + c u^2 a node between two others misses c h^2: on average 2e-5 of the largest at most.

    For c of 1.5 h = 1 / 256, which is more than the least value would allow.
    """
    calls = []

    def curved(pictures, normal, points, material):
        calls.append(points.shape)
        assert len(calls) < 500  # it ends
        return 1 + bend * points[..., turn] ** 2

    monkeypatch.setattr(texture, "shade", curved)
    monkeypatch.setattr(texture, "_AT_ONCE", at_once)
    monkeypatch.setattr(texture, "_first_counts", lambda *_: [16, 16])

    def at(across, down):
        return np.stack(np.meshgrid(across, down), -1)

    found = texture._table(at, np.array([0.0, 0, 1]), None, SimpleNamespace(lobe_slope=1.0))
    assert found.shape == nodes
    u = np.linspace(0, 1, nodes[1 - turn])
    np.testing.assert_allclose(found, np.broadcast_to(1 + bend * (u[:, None] if turn else u) ** 2, nodes))


def test_a_table_that_would_be_too_large_is_none(monkeypatch):
    monkeypatch.setattr(texture, "_first_counts", lambda *_: [16, 16])
    at = lambda across, down: np.stack(np.meshgrid(across, down), -1)  # noqa: E731
    for level in (
        lambda points: 1 + 1e3 * np.sin(1e5 * points.sum(-1)),
        lambda points: np.full(points.shape[:-1], np.nan),
    ):
        monkeypatch.setattr(texture, "shade", lambda *given, level=level: level(given[2]))
        assert texture._table(at, np.array([0.0, 0, 1]), None, SimpleNamespace(lobe_slope=1.0)) is None


@pytest.mark.parametrize(("roughness", "counts"), [(0.5, [16, 16]), (0.05, [64, 32]), (0.02, [128, 64])])
def test_no_lobe_falls_between_two_nodes(roughness, counts):
    """A mirroring facet's tilt changes by no more than half a roughness from a node to the next, in powers of two.

    Light and sensor at 10 over the face, 4 apart: the slope is that of the half vector, by brute force.
    """
    pictures = SimpleNamespace(lights_at=[np.array([2.0, 1.0, 10.0])], viewpoint=Viewpoint(np.array([-2.0, 1.0, 10.0])))
    corner, sides = np.array([-6.0, -3.0, 0.0]), np.array([[12.0, 0, 0], [0, 6.0, 0]])

    def at(across, down):
        return corner + across[:, None] * sides[0] + down[:, None, None] * sides[1]

    found = texture._first_counts(at, np.array([0.0, 0, 1]), pictures, roughness)
    u = np.linspace(0, 1, 17)
    points = at(u, u)
    half = sum((p - points) / np.linalg.norm(p - points, axis=-1, keepdims=True) for p in
               (pictures.lights_at[0], pictures.viewpoint.at))  # fmt: skip
    slope = half[..., :2] / half[..., 2:]
    steps = [np.linalg.norm(np.diff(slope, axis=axis), axis=-1).max() for axis in (1, 0)]
    assert found == [16 * 2 ** max(int(np.ceil(np.log2(step / (roughness / 2)))), 0) for step in steps]
    assert found == counts
