"""Two of the planner's models at 50 digits: the paper's (Fig. 8 of the paper), and the calibrated one.

Where nothing can be measured they are the reason, a text, instead of a number.
"""

from __future__ import annotations

from numpy.polynomial.legendre import leggauss

from validation.hard.precise import (
    CLEARANCE,
    FEWEST,
    MIN_CONTRAST,
    MIN_USABLE,
    SPACING,
    STEP,
    Inputs,
    View,
    contrast,
    dot,
    image_of,
    minus,
    mp,
    mpf,
)

_WORST_FIRST = ("not_visible", "short", "low_contrast", "ill_conditioned")
_NODES = [tuple(map(mpf, pair)) for pair in zip(*map(list, leggauss(8)), strict=True)]


def paper(scene, inputs: Inputs, points: int = 100, objective: str = "image"):
    """Variance of the distance in the image, px^2, or on the object, cm^2, by eq. 3-10, all moments formed plainly."""
    view, focal = View.of(scene, inputs), mpf(scene.camera.focal_px)

    def offset_variance(name, normal, corner):
        edge = scene.solid.edge(name)
        start, stop = (inputs.vertices[end] for end in edge.ends)
        weights, places = [], []
        for i in range(points):
            point = tuple(a + (b - a) * i / (points - 1) for a, b in zip(start, stop, strict=True))
            weights.append(contrast(scene, view, edge.faces, point, False) ** 2)
            places.append(image_of(point, inputs, focal))
        counted = sum(1 for w in weights if w)
        weights = [w / (mpf(8.697) * mpf(scene.noise.sigma) ** 2) for w in weights]
        total = sum(weights)
        if not total:
            return "low_contrast" if any(view.seen[f] for f in edge.faces) else "not_visible"
        mean = [sum(w * p[k] for w, p in zip(weights, places, strict=True)) / total for k in (0, 1)]
        squares = sum(w * dot(minus(p, mean), minus(p, mean)) for w, p in zip(weights, places, strict=True))
        bar = mpf(counted - 1) / counted * total
        spread = squares / bar
        tilt = (spread + counted / total) / (bar * spread**2)
        along = minus(corner, mean)
        s2 = dot(along, along) - dot(along, normal) ** 2
        return (s2 + 1 / total) * tilt + 1 / total

    return _distance_variance(scene, inputs, offset_variance, objective)


def _distance_variance(scene, inputs: Inputs, offset_variance, objective: str):
    """Eq. 5 and 6: corners from lines, the distance from corners; the four edges are different ones."""
    focal = mpf(scene.camera.focal_px)
    images = [image_of(v, inputs, focal) for v in inputs.vertices]
    corners, covariances, reasons = [], [], []
    for feature in scene.task.corners:
        here = images[scene.solid.vertex_names.index(feature.vertex)]
        lines = []
        for name in feature.edges:
            start, stop = (images[end] for end in scene.solid.edge(name).ends)
            along = minus(stop, start)
            size = mp.sqrt(dot(along, along))
            normal = (-along[1] / size, along[0] / size) if size else (mpf(0), mpf(0))
            variance = offset_variance(name, normal, here) if size else "short"
            lines.append((*normal, variance))
        (a1, b1, v1), (a2, b2, v2) = lines
        size = (a1 * b2 - a2 * b1) ** 2
        reasons += [v for v in (v1, v2) if isinstance(v, str)]
        if reasons or not size:
            reasons.append("ill_conditioned")
            continue
        corners.append(here)
        covariances.append((
            (b2 * b2 * v1 + b1 * b1 * v2) / size,
            (a2 * a2 * v1 + a1 * a1 * v2) / size,
            -(a2 * b2 * v1 + a1 * b1 * v2) / size,
        ))  # fmt: skip
    if reasons:
        return next(worst for worst in _WORST_FIRST if worst in reasons)
    if objective == "object":
        pulls = _pulls(scene, inputs)
    else:
        across = minus(*corners)
        size = mp.sqrt(dot(across, across))
        pulls = [(across[0] / size, across[1] / size)] * 2
    return sum(
        x * x * xx + y * y * yy + 2 * x * y * xy for (x, y), (xx, yy, xy) in zip(pulls, covariances, strict=True)
    )


def _pulls(scene, inputs: Inputs):
    """Derivative of the object's distance by each end's image, both ends moving in the face that they share."""
    step, focal = mpf(10) ** -20, mpf(scene.camera.focal_px)
    index = [scene.solid.vertex_names.index(feature.vertex) for feature in scene.task.corners]
    ends = [inputs.vertices[i] for i in index]
    across = minus(ends[1], ends[0])
    size = mp.sqrt(dot(across, across))
    (face,) = (face for face in scene.solid.faces if set(index) <= set(face))
    sides = [minus(inputs.vertices[face[k]], inputs.vertices[face[0]]) for k in (1, -1)]
    found = []
    for sign, end in zip((-1, 1), ends, strict=True):
        columns, longer = [], []
        for side in sides:
            ahead, behind = (
                image_of(tuple(x + s * step * d for x, d in zip(end, side, strict=True)), inputs, focal)
                for s in (1, -1)
            )
            columns.append(tuple(x / (2 * step) for x in minus(ahead, behind)))
            longer.append(sign * dot(across, side) / size)
        (a, c), (b, d) = columns  # the image moves by (a, c) and (b, d), the distance by longer
        size2 = a * d - b * c
        found.append(((d * longer[0] - c * longer[1]) / size2, (a * longer[1] - b * longer[0]) / size2))
    return found


def calibrated(scene, inputs: Inputs, adaptive: bool = True, objective: str = "image"):
    """The documented closed form of the calibrated model, its integrals by adaptive quadrature.

    For objects that lie within the image. Without ``adaptive`` 8 nodes an edge, good enough for a condition number.
    """
    view, focal = View.of(scene, inputs), mpf(scene.camera.focal_px)
    images = [image_of(v, inputs, focal) for v in inputs.vertices]
    scale = mpf(scene.locator.scale_px)
    noise = mpf(scene.noise.sigma) ** 2 + (0 if scene.noise.bits is None else mpf(1) / 12)
    blur2 = mpf(scene.camera.blur_px) ** 2 + mpf(1) / 12
    across = STEP**2 / (2 * (scale**2 + blur2))
    slope = (4 * mp.exp(-across) - mp.exp(-4 * across)) / 3  # of the cubic through a profile, over the exact one
    point_variance = mpf(3) / 8 * (1 + blur2 / scale**2) ** 3 / slope**2 * noise
    clear = CLEARANCE * mp.sqrt(scale**2 + blur2)
    out = tuple(x / inputs.distances[0] for x in view.eye)

    def offset_variance(name, _normal, corner):
        edge = scene.solid.edge(name)
        if not any(view.seen[f] for f in edge.faces):
            return "not_visible"
        first, last = images[edge.ends[0]], images[edge.ends[1]]
        length = mp.sqrt(dot(minus(last, first), minus(last, first)))
        low = _trim(scene, view, images, edge, 0, clear)
        used = length - low - _trim(scene, view, images, edge, 1, clear)
        if not used >= MIN_USABLE:
            return "short"
        middle = low + used / 2
        start, stop = (inputs.vertices[end] for end in edge.ends)
        near, far = (inputs.distances[0] - dot(v, out) for v in (start, stop))

        def squared(t):
            u = (middle + t) / length
            f = u * near / (far + u * (near - far))
            point = tuple(a + f * (b - a) for a, b in zip(start, stop, strict=True))
            return contrast(scene, view, edge.faces, point, True) ** 2

        def integral(function):
            if adaptive:
                return mp.quad(function, [-used / 2, used / 2])
            return sum(w * function(x * used / 2) for x, w in _NODES) * used / 2

        if integral(squared) / used < MIN_CONTRAST**2 * noise:
            return "low_contrast"
        lever = (length if corner == last else mpf(0)) - middle

        if used < 10 * scale:
            raise NotImplementedError("an edge shorter than 10 smoothing scales needs the sum over its points")
        spacing = used / max(mpf(FEWEST - 1), used / (SPACING * scale) + mpf(1) / 2)
        slope, step = 12 * lever / (used**3 + 2 * used * spacing**2), (spacing / scale) ** 2

        def g2(t):
            return (1 / used + slope * t) ** 2 * point_variance / squared(t)

        tilt = (mpf(8) / 3 - step * 2 / 3 + step**2 * 11 / 360) * scale**4
        tilted = (tilt / used + mp.sqrt(mp.pi) * scale * spacing**2 / 3) * slope**2
        tilted *= integral(lambda t: point_variance / squared(t))
        end = 2 + step / 6 - step**2 / 480 - step**3 / 8064
        ends = end * scale**2 * (g2(-used / 2) + g2(used / 2))
        return 2 * mp.sqrt(mp.pi) * scale * integral(g2) - ends + tilted

    return _distance_variance(scene, inputs, offset_variance, objective)


def _trim(scene, view: View, images, edge, end: int, clear):
    """Length left out at an end: until every other visible edge there is ``clear`` px away."""
    here, there = images[edge.ends[end]], images[edge.ends[1 - end]]
    along, found = minus(there, here), clear
    for other in scene.solid.edges:
        if other is edge or edge.ends[end] not in other.ends or not any(view.seen[f] for f in other.faces):
            continue
        aside = minus(images[other.ends[1 - other.ends.index(edge.ends[end])]], here)
        length, size = (mp.sqrt(dot(way, way)) for way in (along, aside))
        ahead, apart = dot(along, aside) / length, abs(along[0] * aside[1] - along[1] * aside[0]) / length
        if ahead > 0:
            past = clear * ahead > size * apart  # the nearest of the other edge is its far end
            found = max(found, ahead + mp.sqrt(clear**2 - apart**2) if past else clear * size / apart)
    return found
