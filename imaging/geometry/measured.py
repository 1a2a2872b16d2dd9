"""Where what is measured lies on a part."""

from __future__ import annotations

import numpy as np

from scenes import Scene


def measured_pieces(scene: Scene) -> np.ndarray:
    """Ends of the straight edges, and of the pieces of rims, that a scene's numbers need, (n, 2, 3); of limbs none."""
    solid = scene.solid
    pieces = {circle.name: circle.edges for circle in solid.rims}
    pieces |= {each.name: () for each in solid.curved}
    names = [piece for name in scene.required for piece in pieces.get(name, (name,))]
    return solid.vertices[np.array([solid.edge(name).ends for name in names], int).reshape(-1, 2)]
