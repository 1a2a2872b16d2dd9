"""Tables of brightness of uneven faces: on nodes that hold those of both, whatever is made at once."""

from types import SimpleNamespace

import numpy as np
import pytest

from render import texture


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
