"""Nodes and weights along straight pieces, for integrals of a Gaussian blur that moves along them."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

_PANEL = 128  # nodes of one rule at most
_MORE = 5  # nodes beside one for each standard deviation of the blur
_END = 1e-7  # relative error that the map of a rule's nodes makes at its ends


class PieceNodes(NamedTuple):
    """Quadrature nodes on all pieces, n of them, piece after piece: piece, fraction of its length, weight."""

    piece: np.ndarray
    t: np.ndarray
    weight: np.ndarray

    @classmethod
    def on(cls, lengths: np.ndarray, blur: float) -> PieceNodes:
        """On pieces so many px long (N,), close enough for a blur of so many px: 3e-7 of a step."""
        parts = [rule(float(length), blur) for length in lengths]
        piece = np.repeat(np.arange(len(parts)), [t.size for t, _ in parts])
        t, weight = (np.concatenate(part) if parts else np.empty(0) for part in zip(*parts, strict=True))
        return cls(piece, t, weight)


@lru_cache(maxsize=4096)
def rule(length: float, blur: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights on (0, 1) for a piece so many px long: panels of at most `_PANEL` nodes.

    >>> t, weight = rule(30.0, 1.0)
    >>> bool(abs(weight @ np.exp(t) - np.expm1(1.0)) < 1e-12)
    True
    """
    wanted = min(length, 1e5) / blur + _MORE
    panels = int(np.ceil(wanted / _PANEL))
    nodes, weights = _even(int(np.ceil(wanted / panels)))
    t = (np.arange(panels)[:, None] + (1 + nodes) / 2).ravel() / panels
    return t, np.tile(weights / 2, panels) / panels


@lru_cache(maxsize=_PANEL)
def _even(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights on (-1, 1): those of Gauss and Legendre, moved apart by an arcsine where they crowd.

    They become all but equally spaced, so that pi / 2 times fewer do (Kosloff and Tal-Ezer 1993; Hale and Trefethen
    2008).
    """
    nodes, weights = np.polynomial.legendre.leggauss(count)
    most = 1 / np.cosh(np.log(_END) / count)
    scale = np.arcsin(most)
    return np.arcsin(most * nodes) / scale, weights * most / scale / np.sqrt(1 - (most * nodes) ** 2)
