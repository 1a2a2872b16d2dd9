"""Light between faces by random paths, which share nothing with patches but what a ray meets."""

import numpy as np

from imaging.geometry.rays import first_face


def traced(solid, white, light, points, normals, paths, rng):
    """Irradiance of points (n, 3), of normals (3,) or (n, 3), by light that met other faces, over that of a light of
    unit power at a distance of 1: random paths, each way by Lambert's cosine, with the light's own share wherever they
    meet a face; ``white`` is what all faces reflect, or each (F,)."""
    white = np.broadcast_to(white, len(solid.faces))
    at, normals = np.repeat(points, paths, 0), np.repeat(np.broadcast_to(normals, points.shape), paths, 0)
    found, weight, which = np.zeros(len(points)), np.ones(len(at)), np.repeat(np.arange(len(points)), paths)
    for _ in range(24):
        ways = rng.normal(size=at.shape)
        ways = normals + ways / np.linalg.norm(ways, axis=1, keepdims=True)
        start = at + 1e-6 * normals
        face, t = first_face(solid, start, ways, ())
        met = face >= 0
        at, normals, which = start[met] + t[met, None] * ways[met], solid.normals[face[met]], which[met]
        weight = weight[met] * white[face[met]]
        lit = light - at
        away = np.linalg.norm(lit, axis=1)
        cosine = np.maximum((lit * normals).sum(1) / away, 0)
        blocked = first_face(solid, at + 1e-6 * normals, lit, ())[0] >= 0
        found += np.bincount(which, weight * np.where(blocked, 0, cosine / away**2), len(points))
    return found / paths
