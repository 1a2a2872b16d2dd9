"""Which lights reach all of a plane face: no shadow falls on it where none falls on its border.

Between the face and the light lies a cone. What shades a place inside of the face reaches into the cone, and is joined
to the rest of the body by a way that leaves the cone: through its mantle, and then a place of the border is hidden, or
along an inner edge of the face, and then the other face there is turned away from the light. So of a body in one piece
all of the face is lit if no edge of it is hidden and the light is over both faces of its inner edges.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from imaging.geometry.projection import above
from imaging.geometry.visibility import hidden_spans
from scenes import Edge, Solid
from scenes.parts.chains import components

_MOST_SIDES = 24  # of a face that is asked about: those with bores have many


def all_lit(bodies: Solid, face: int, at: np.ndarray) -> np.ndarray:
    """Whether all of a face is lit by lights at places (L, 3), bool (L,); False where it is not known."""
    lit = above(at, bodies.normals[[face]], bodies.offsets[[face]])[:, 0]
    if bodies.outer[face]:  # nothing stands over it
        return lit
    border = _border(bodies, face)
    if not border or not _is_one(bodies):
        return np.zeros(len(at), bool)
    for edge in border:
        some = np.flatnonzero(lit)
        over = above(at[some], bodies.normals[list(edge.faces)], bodies.offsets[list(edge.faces)]).all(-1)
        spans = hidden_spans(bodies, edge, at[some])
        hidden = (spans[..., 0] < spans[..., 1]).any(-1)
        lit[some] = ~hidden & (over | edge.convex)
    return lit


@lru_cache(maxsize=256)
def _border(bodies: Solid, face: int) -> tuple[Edge, ...]:
    """The edges of a plane face; none where they are many, or not all of its border."""
    edges = tuple(edge for edge in bodies.edges if face in edge.faces)
    sides = len(bodies.faces[face]) + sum(map(len, bodies.holes[face] if bodies.holes else ()))
    return edges if bodies.plane[face] and len(edges) == sides <= _MOST_SIDES else ()


@lru_cache(maxsize=8)
def _is_one(bodies: Solid) -> bool:
    """Whether all faces are joined by edges."""
    return bool(components(len(bodies.faces), np.array([edge.faces for edge in bodies.edges])).max() == 0)
