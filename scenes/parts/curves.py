"""Curved edges of a mesh: straight pieces that turn a little from one to the next."""

from __future__ import annotations

import numpy as np

from scenes.parts.chains import Chains, components, pairs_of

_CURVE = np.cos(np.radians(60))  # pieces of a curved edge turn by less
LONGER = 4.0  # than the piece of a curve that it continues: a straight edge
_FULL = 0.7  # of the turn before: where a straight edge begins it is half of it, at a last piece all
_LAST, _HALVED = 1.5, 2.2  # lengths of the piece before: a last piece; that of even pieces
_EVEN, _EQUAL = 0.05, 0.01  # of a length: even pieces; those of one length, as a straight edge is not by chance


def curved(shape: Chains, region: np.ndarray, open_: np.ndarray) -> np.ndarray:
    """Which chains are pieces of a curved edge; bool, shape (C,).

    They go on, turning a little, between the same surfaces, or through a vertex in which no other edge ends, for the
    surfaces on both sides are smooth there. A straight edge that continues a curve is much longer than its pieces; a
    last piece without a facet beside it turns as much as those before, and is about as long, or twice where these are
    even: files divide a curve in halves until it is flat enough.
    """
    pairs, ends, alone = meetings(shape, open_)
    cosine, turn, straight = turns_at(shape, pairs, ends)
    alike = _alike(shape, region, pairs)
    run = components(len(shape.bend), pairs[alike & straight])
    length = np.bincount(run, shape.length)[run][pairs]
    turns = (cosine >= _CURVE) & ~straight
    curved = (region[shape.faces[pairs]] >= 0).any(2)
    others = np.zeros((len(shape.bend), 2))  # turns at both ends of a piece, where no other edge ends
    others[pairs[alone], ends[alone]] = turn[alone, None]
    lengths = np.zeros((len(shape.bend), 2))  # of what meets it there
    lengths[pairs[alone], ends[alone]] = shape.length[pairs[alone][:, ::-1]]
    found = np.zeros(len(shape.bend), bool)
    for k in (0, 1):
        before = pairs[:, 1 - k], 1 - ends[:, 1 - k]
        full = curved[:, 1 - k] & (turn >= _FULL * others[before])
        uneven, unequal = (np.abs(each / length[:, 1 - k] - 1) for each in (lengths[before], length[:, k]))
        even, equal = uneven <= _EVEN, np.maximum(uneven, unequal) <= _EQUAL
        most = np.where(curved[:, k], LONGER, np.where(even, _HALVED, _LAST) * (full | equal & curved[:, 1 - k]))
        rows = turns & ((alike & curved[:, k]) | alone) & (length[:, k] <= most * length[:, 1 - k])
        found[pairs[rows, k]] = True
    return np.isin(run, run[found]) & open_


def turning(shape: Chains, region: np.ndarray, smooth: np.ndarray) -> np.ndarray:
    """Which of the other chains go on as smooth ones that turn a little, between the same surfaces; bool, shape (C,).

    Where a curved edge begins the surfaces on its sides may bend little; its last pieces are no straight edges.
    """
    between = ~smooth | (region[shape.faces[:, 0]] != region[shape.faces[:, 1]])
    pairs, ends, _ = meetings(shape, between)
    pairs, ends = (each[_alike(shape, region, pairs)] for each in (pairs, ends))
    cosine, _, straight = turns_at(shape, pairs, ends)
    found = np.zeros(len(shape.bend), bool)
    for here, other in (pairs.T, pairs.T[::-1]):
        near = shape.length[here] <= LONGER * shape.length[other]
        found[here[~smooth[here] & smooth[other] & ~straight & (cosine >= _CURVE) & near]] = True
    return found


def _alike(shape: Chains, region: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Which pairs (n, 2) of chains lie between the same two surfaces, of which one is curved; bool, shape (n,)."""
    sides = np.sort(np.where(region[shape.faces] >= 0, region[shape.faces], -2 - shape.faces), 1)
    return (sides[pairs[:, 0]] == sides[pairs[:, 1]]).all(1) & (region[shape.faces[pairs[:, 0]]] >= 0).any(1)


def turns_at(shape: Chains, pairs: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of pairs (n, 2) that meet with some of their ends: cosine of the turn, the turn, rad, and whether it is none."""
    away = shape.along[pairs] * np.where(ends == 0, 1.0, -1.0)[..., None]
    cosine = -(away[:, 0] * away[:, 1]).sum(1) / shape.length[pairs].prod(1)
    turn = np.arccos(np.clip(cosine, -1, 1))
    return cosine, turn, turn * shape.length[pairs].min(1) <= shape.unsure


def meetings(shape: Chains, open_: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs (n, 2) of chains that meet in a vertex, which of their ends meet there, and whether no other one does."""
    rows = np.flatnonzero(open_)
    vertex = shape.ends[rows].ravel()
    at = pairs_of(vertex)
    alone = np.bincount(vertex, minlength=1)[vertex[at[:, 0]]] == 2
    return rows[at // 2], at % 2, alone
