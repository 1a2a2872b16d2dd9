"""Images made without the renderer: convex polygons, exactly blurred and exactly averaged over square pixels.

Projection and shading are written out here: nothing is shared with the model of the image that they are to judge.
"""

import numpy as np
from scipy.special import ndtr

from validation.hard.polygon import polygon_image, scan_lines, spans

__all__ = ["axes", "block_image", "pinhole", "polygon_image", "shaded_image", "torrance_sparrow"]

_FEW, _FEW_WEIGHTS = np.polynomial.legendre.leggauss(4)


def shaded_image(faces, shape, blur):
    """Grey levels (height, width) of plane convex faces with shading of their own, under a Gaussian blur.

    Parameters
    ----------
    faces : list of (corners, shade)
        Corners (k, 2) in px, and a function of x and y (arrays, px) that gives the level there. Faces do not overlap.
    shape : tuple of int
    blur : float

    Gauss-Legendre quadrature of both integrals on panels of at most half a pixel that end at the face's outline, so
    that the integrand is smooth: about 1e-6 of the contrast. Along x the panels that are whole lie at the same places
    in each line, so that what they send to the pixels is one matrix.
    """
    picture = np.zeros(shape)
    for corners, shade in faces:
        corners = np.asarray(corners, float)
        lines, weights = scan_lines(corners, _FEW, _FEW_WEIGHTS)
        left, right = spans(corners, lines)
        rows = _whole_panels(left, right, lines, shade, shape[1], blur)
        first, last = np.ceil(2 * left) / 2, np.floor(2 * right) / 2  # of the whole panels, where there are any
        narrow = first > last
        rows += _one_panel(left, np.where(narrow, right, first), lines, shade, shape[1], blur)
        rows += _one_panel(np.where(narrow, right, last), right, lines, shade, shape[1], blur)
        away = lines - np.arange(shape[0])[:, None]
        picture += (ndtr((away + 0.5) / blur) - ndtr((away - 0.5) / blur)) * weights @ rows
    return picture


def _whole_panels(left, right, lines, shade, width, blur):
    """What the panels between half pixels send to each line's pixels, (lines, width)."""
    ends = np.arange(np.ceil(2 * left.min()), np.floor(2 * right.max()) + 1) / 2
    if ends.size < 2:
        return np.zeros((lines.size, width))
    x = (ends[:-1, None] + (1 + _FEW) / 4).ravel()
    inside = (ends[:-1] >= left[:, None]) & (ends[1:] <= right[:, None])
    level = shade(np.broadcast_to(x, (lines.size, x.size)), lines[:, None])
    value = np.where(np.repeat(inside, _FEW.size, 1), level, 0)
    return value * np.tile(_FEW_WEIGHTS / 4, ends.size - 1) @ _sent(x, width, blur)


def _sent(x, width, blur):
    """The share of light at x (n,) that each pixel gets, (n, width)."""
    edges = ndtr((np.arange(width + 1) - 0.5 - x[:, None]) / blur)
    return edges[:, 1:] - edges[:, :-1]


def _one_panel(left, right, lines, shade, width, blur):
    """The same of one panel a line, which may begin and end anywhere within a pixel."""
    x = left[:, None] + (right - left)[:, None] * (1 + _FEW) / 2
    value = shade(x, lines[:, None]) * (right - left)[:, None] * _FEW_WEIGHTS / 2
    reach, nearest, rows = int(np.ceil(7 * blur)) + 1, np.rint(x).astype(int), np.zeros((lines.size, width + 1))
    lower = ndtr((nearest - reach - 0.5 - x) / blur)
    for step in range(-reach, reach + 1):
        pixel, upper = nearest + step, ndtr((nearest + step + 0.5 - x) / blur)
        place = np.where((pixel >= 0) & (pixel < width), pixel, width)  # one pixel more for what falls outside
        np.add.at(rows, (np.arange(lines.size)[:, None], place), value * (upper - lower))
        lower = upper
    return rows[:, :-1]


def pinhole(points, pose, camera):
    """Images (n, 2) of points (n, 3), px, of a camera without distortion that looks at the origin; z axis up."""
    out, right, down = axes(pose)
    depth = camera.distance - points @ out
    middle = np.array([camera.width - 1, camera.height - 1]) / 2
    return middle + camera.focal_px * np.stack([points @ right, points @ down], -1) / depth[:, None]


def axes(pose):
    """Unit vectors of a pose in degrees: from the origin to it, to the right in its image, and down."""
    polar, azimuth = np.radians(list(pose))
    sine, cosine = np.sin(azimuth), np.cos(azimuth)
    out = np.array([np.sin(polar) * cosine, np.sin(polar) * sine, np.cos(polar)])
    down = np.array([np.cos(polar) * cosine, np.cos(polar) * sine, -np.sin(polar)])
    return out, np.array([-sine, cosine, 0.0]), down


def block_image(scene, sensor, light, gloss=None):
    """Exact image of the scene's convex solid before darkness: N.L / r^2 behind a pinhole.

    For what is not diffuse ``gloss(normal, to_light, to_sensor)`` gives N.L times the reflectance.
    """
    camera, solid, material = scene.camera, scene.solid, scene.material
    assert material.is_diffuse or gloss
    assert camera.look_at == (0, 0, 0)
    out, right, down = axes(sensor)
    eye, lamp = camera.distance * out, scene.light.distance * axes(light)[0]
    white = camera.exposure * (1 - material.specular_fraction) * material.diffuse_reflectance

    def shading(normal, corner):
        def shade(x, y):
            u, v = ((p - (n - 1) / 2) / camera.focal_px for p, n in ((x, camera.width), (y, camera.height)))
            if not gloss:  # the same, a component at a time
                depth = (corner - eye) @ normal / (u * (right @ normal) + v * (down @ normal) - out @ normal)
                way = u * (right @ (lamp - eye)) + v * (down @ (lamp - eye)) - out @ (lamp - eye)
                distance2 = (lamp - eye) @ (lamp - eye) - 2 * depth * way + depth**2 * (1 + u**2 + v**2)
                return white * max((lamp - corner) @ normal, 0) * scene.light.distance**2 / distance2**1.5
            ray = -out + u[..., None] * right + (v + 0 * u)[..., None] * down
            point = eye + ray * ((corner - eye) @ normal / (ray @ normal))[..., None]
            away, back = lamp - point, eye - point
            distance = np.linalg.norm(away, axis=-1)
            back = back / np.linalg.norm(back, axis=-1, keepdims=True)
            fall_off = (scene.light.distance / distance) ** 2
            return camera.exposure * fall_off * gloss(normal, away / distance[..., None], back)

        return shade

    faces = []
    for face in solid.faces:
        corners = solid.vertices[list(face)]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        normal = normal / np.linalg.norm(normal)
        if normal @ (eye - corners[0]) > 0:
            faces.append((pinhole(corners, sensor, camera), shading(normal, corners[0])))
    return scene.noise.dark_level + shaded_image(faces, (camera.height, camera.width), camera.blur_px)


def torrance_sparrow(material):
    """N.L times the paper's reflectance for unpolarised light, as printed; ``gloss`` of `block_image`."""
    index, m = complex(material.refractive_index, -material.extinction), material.roughness

    def gloss(normal, to_light, to_sensor):
        nl, nv, half = to_light @ normal, to_sensor @ normal, to_light + to_sensor
        half = half / np.linalg.norm(half, axis=-1, keepdims=True)
        nh, vh = half @ normal, (to_sensor * half).sum(-1)
        inside = np.sqrt(1 - (1 - vh**2) / index**2 + 0j)
        amplitudes = (index * vh - inside) / (index * vh + inside), (vh - index * inside) / (vh + index * inside)
        fresnel = sum(np.abs(amplitude) ** 2 for amplitude in amplitudes) / 2
        facets = np.exp(-(1 / nh**2 - 1) / m**2) / (m**2 * nh**4)
        facets = facets * np.minimum(1, 2 * nh * np.minimum(nv, nl) / vh)
        diffuse = (1 - material.specular_fraction) * material.diffuse_reflectance
        return np.where(nl > 0, material.specular_fraction * facets * fresnel / (np.pi * nv) + diffuse * nl, 0.0)

    return gloss
