"""The paper's VarianceEvaluate (its Fig. 8), one point at a time: the reference for values and for speed."""

import math


def variance_evaluate(scene, sensor, light, *, points=100, kappa2=8.697):
    """Variance of the distance in the image, px^2, of a diffuse convex solid; infinite where it cannot be measured."""
    solid, camera = scene.solid, scene.camera
    corners, covariances = [], []
    for corner in scene.task.corners:
        where = project(solid.vertex(corner.vertex).tolist(), sensor, camera)
        lines = []
        for name in corner.edges:
            places, weights = weighted_points(scene, solid.edge(name), sensor, light, points=points, kappa2=kappa2)
            if sum(weights) == 0:
                return math.inf
            lines.append(line(places, weights, where))
        (a1, b1, v1), (a2, b2, v2) = lines
        size = (a1 * b2 - a2 * b1) ** 2
        if size == 0:
            return math.inf
        corners.append(where)
        covariances.append((
            (b2 * b2 * v1 + b1 * b1 * v2) / size,
            (a2 * a2 * v1 + a1 * a1 * v2) / size,
            (-a2 * b2 * v1 - a1 * b1 * v2) / size,
        ))  # fmt: skip
    (r1, c1), (r2, c2) = corners
    rr, cc, rc = (a + b for a, b in zip(*covariances, strict=True))
    return ((r1 - r2) ** 2 * rr + (c1 - c2) ** 2 * cc + 2 * (r1 - r2) * (c1 - c2) * rc) / (
        (r1 - r2) ** 2 + (c1 - c2) ** 2
    )


def weighted_points(scene, edge, sensor, light, *, points=100, kappa2=8.697):
    """The paper's edge points, equally spaced in space: images, px, and weights 1 / variance, px^-2 (eq. 7-10)."""
    solid, camera, material = scene.solid, scene.camera, scene.material
    eye, lamp = place(sensor, camera.distance), place(light, scene.light.distance)
    white = camera.exposure * (1 - material.specular_fraction) * material.diffuse_reflectance
    faces = [(solid.normals[face].tolist(), float(solid.offsets[face])) for face in edge.faces]
    start, stop = (solid.vertices[end].tolist() for end in edge.ends)
    places, weights = [], []
    for i in range(points):
        p = [a + (b - a) * i / (points - 1) for a, b in zip(start, stop, strict=True)]
        sides = []
        for n, offset in faces:
            away = [a - b for a, b in zip(lamp, p, strict=True)]
            seen = dot(n, eye) > offset
            sides.append(white * max(dot(n, away), 0.0) / math.sqrt(dot(away, away)) if seen else 0.0)
        contrast = abs(sides[0] - sides[1])
        weights.append(contrast**2 / (kappa2 * scene.noise.sigma**2))
        places.append(project(p, sensor, camera))
    return places, weights


def line(places, weights, at):
    """(alpha, beta) of the weighted line and the variance of its position at a point (eq. 3-5)."""
    count, total = len(places), sum(weights)
    mx = sum(w * x for w, (x, _) in zip(weights, places, strict=True)) / total
    my = sum(w * y for w, (_, y) in zip(weights, places, strict=True)) / total
    xx = sum(w * (x - mx) ** 2 for w, (x, _) in zip(weights, places, strict=True))
    yy = sum(w * (y - my) ** 2 for w, (_, y) in zip(weights, places, strict=True))
    xy = sum(w * (x - mx) * (y - my) for w, (x, y) in zip(weights, places, strict=True))
    angle = math.atan2(2 * xy, xx - yy) / 2
    alpha, beta = -math.sin(angle), math.cos(angle)
    bar = (count - 1) / count * total
    spread = (xx + yy) / bar
    tilt = (spread + count / total) / (bar * spread**2)
    along = (at[0] - mx) * beta - (at[1] - my) * alpha
    return alpha, beta, (along**2 + 1 / total) * tilt + 1 / total


def place(pose, radius):
    """Position on a sphere, cm."""
    polar, azimuth = (math.radians(angle) for angle in pose)
    return [
        radius * math.sin(polar) * math.cos(azimuth),
        radius * math.sin(polar) * math.sin(azimuth),
        radius * math.cos(polar),
    ]


def project(p, pose, camera):
    """Pinhole image of a point, px."""
    polar, azimuth = (math.radians(angle) for angle in pose)
    out = [math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)]
    down = [math.cos(polar) * math.cos(azimuth), math.cos(polar) * math.sin(azimuth), -math.sin(polar)]
    right = [-math.sin(azimuth), math.cos(azimuth), 0.0]
    depth = camera.distance - dot(p, out)
    return (
        (camera.width - 1) / 2 + camera.focal_px * dot(p, right) / depth,
        (camera.height - 1) / 2 + camera.focal_px * dot(p, down) / depth,
    )


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))
