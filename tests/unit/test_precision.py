"""Error propagation against a 50-digit version of the paper's formulas, hard corners included."""

import mpmath as mp
import numpy as np
import pytest

import planner
from imaging.features.propagation import corner_covariance
from imaging.models.paper import paper
from imaging.pictures import Pictures
from planner.search.grid import ViewingSpace

mp.mp.dps = 50


def exact_line(points, weights, at):
    """(alpha, beta) and the variance of the line's place at a point on it (eq. 3 and 4, slips repaired)."""
    count, total = len(points), mp.fsum(weights)
    mx, my = (mp.fsum(w * p[i] for w, p in zip(weights, points, strict=True)) / total for i in (0, 1))
    moments = [
        mp.fsum(w * (p[0] - mx) ** i * (p[1] - my) ** j for w, p in zip(weights, points, strict=True))
        for i, j in ((2, 0), (0, 2), (1, 1))
    ]
    angle = mp.atan2(2 * moments[2], moments[0] - moments[1]) / 2
    alpha, beta = -mp.sin(angle), mp.cos(angle)
    bar = total * (count - 1) / count
    spread = (moments[0] + moments[1]) / bar
    tilt = (spread + count / total) / (bar * spread**2)
    along = (at[0] - mx) * beta - (at[1] - my) * alpha
    return alpha, beta, (along**2 + 1 / total) * tilt + 1 / total


def numbers(values):
    return [[mp.mpf(float(x)) for x in row] for row in values]


@pytest.mark.parametrize("sine", [1.0, 1e-2, 1e-6, 1e-9])
def test_corner_to_1e_12(rng, sine):
    """Nearly parallel edges: the normals' own rounding is magnified by 1 / sine, so they are taken as exact."""
    for _ in range(10):
        a = np.array([1.0, 0.0])
        b = np.array([np.sqrt((1 - sine) * (1 + sine)), sine])
        normals, variances = np.stack([a, b]), 10 ** rng.uniform(-8, 0, 2)
        (a1, b1), (a2, b2) = numbers(normals)
        v1, v2 = (mp.mpf(float(v)) for v in variances)
        size = (a1 * b2 - a2 * b1) ** 2
        exact = mp.matrix([
            [(b2**2 * v1 + b1**2 * v2) / size, (-a2 * b2 * v1 - a1 * b1 * v2) / size],
            [(-a2 * b2 * v1 - a1 * b1 * v2) / size, (a2**2 * v1 + a1**2 * v2) / size],
        ])  # fmt: skip
        ours = corner_covariance(normals, variances)
        for i in range(2):
            for j in range(2):
                assert abs(ours[i, j] - exact[i, j]) <= 1e-12 * mp.sqrt(exact[i, i] * exact[j, j])


def exact_model(scene, sensor, light):
    """The paper's model of a diffuse convex solid, all geometry in 50 digits."""
    solid, camera = scene.solid, scene.camera

    def axes(pose):
        p, a = (mp.mpf(float(x)) * mp.pi / 180 for x in pose)
        out = [mp.sin(p) * mp.cos(a), mp.sin(p) * mp.sin(a), mp.cos(p)]
        down = [mp.cos(p) * mp.cos(a), mp.cos(p) * mp.sin(a), -mp.sin(p)]
        return out, down, [-mp.sin(a), mp.cos(a), mp.mpf(0)]

    out, down, right = axes(sensor)
    lamp = [scene.light.distance * x for x in axes(light)[0]]

    def image(p):
        depth = camera.distance - mp.fdot(p, out)
        return [camera.focal_px * mp.fdot(p, axis) / depth for axis in (right, down)]

    white = camera.exposure * mp.mpf(1 - scene.material.specular_fraction)
    corners, covariance = [], [mp.mpf(0)] * 3
    for corner in scene.task.corners:
        where = image(numbers([solid.vertex(corner.vertex)])[0])
        lines = []
        for name in corner.edges:
            edge = solid.edge(name)
            start, stop = numbers(solid.vertices[list(edge.ends)])
            points = [[a + (b - a) * i / 99 for a, b in zip(start, stop, strict=True)] for i in range(100)]
            weights = []
            for p in points:
                away = [a - b for a, b in zip(lamp, p, strict=True)]
                sides = []
                for face in edge.faces:
                    n = numbers([solid.normals[face]])[0]
                    seen = camera.distance * mp.fdot(n, out) > mp.mpf(float(solid.offsets[face]))
                    sides.append(max(mp.fdot(n, away), 0) / mp.sqrt(mp.fdot(away, away)) if seen else 0)
                weights.append((white * (sides[0] - sides[1])) ** 2 / (mp.mpf(8.697) * mp.mpf(scene.noise.sigma) ** 2))
            lines.append(exact_line([image(p) for p in points], weights, where))
        (a1, b1, v1), (a2, b2, v2) = lines
        size = (a1 * b2 - a2 * b1) ** 2
        parts = (b2**2 * v1 + b1**2 * v2, a2**2 * v1 + a1**2 * v2, -a2 * b2 * v1 - a1 * b1 * v2)
        covariance = [c + part / size for c, part in zip(covariance, parts, strict=True)]
        corners.append(where)
    r, c = (corners[0][i] - corners[1][i] for i in (0, 1))
    return (r * r * covariance[0] + c * c * covariance[1] + 2 * r * c * covariance[2]) / (r * r + c * c)


@pytest.mark.parametrize(
    ("sensor", "light"),
    [((30, 135), (15, 315)), ((0, 0), (0, 0)), ((86, 333), (4, 28)), ((45, 41), (45, 41)), ((12, 48), (88, 200))],
)
def test_whole_model(task1, sensor, light):
    """Face-on, grazing sensor, grazing light, light = view direction."""
    exact = exact_model(task1, sensor, light)
    ours = paper(Pictures.of(task1, sensor, light)).variance
    assert abs(mp.mpf(float(ours)) / exact - 1) < 1e-12
    fixed = planner.variance_map(
        task1, sensor=sensor, space=_One(light), model="paper", objective="image"
    )  # the fast sums of the maps
    assert abs(mp.mpf(float(fixed[0])) / exact - 1) < 1e-12


class _One(ViewingSpace):
    """A viewing space of one direction."""

    def __init__(self, pose):
        object.__setattr__(self, "pose", pose)

    @property
    def poses(self):
        return np.array([self.pose], float)

    def __len__(self):
        return 1
