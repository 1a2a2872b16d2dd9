"""The part of the picture that shows the object: drawn at once from the model, and what is drawn over it."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from imaging.features.projected_edges import projected_edges
from imaging.geometry.blur import blur_in_focus
from imaging.geometry.lens import image_centre, undistorted
from imaging.geometry.projection import depth, facing, project, ray_origins, rays
from imaging.geometry.rays import first_face, has_embree
from imaging.light.appearance import face_signal
from imaging.light.behind import seen_at
from imaging.pictures import Pictures
from imaging.sensor import full_scale
from planner.prediction import glanced
from scenes import Camera, Circle, Picture, Scene
from scenes.results import finite
from scenes.status import GLANCED, OK
from validation.explore.answers import Answer

WIDE = 420  # px, at most, of what is sent
_MARGIN = 0.12  # of the object's image, around it
_FINE = 2  # drawn this many times finer, then averaged
_COARSE = 2  # times fewer pixels each way of what is sketched
_MANY = 5000  # triangles from which on rays are quicker
_CHORDS = 48
_BLURS = 5  # that are drawn of a blur that varies


@dataclass(frozen=True)
class Window:
    """The part of the image that is shown: its least x and y, width and height, px, pixels' borders at half numbers."""

    left: int
    top: int
    width: int
    height: int

    @property
    def scale(self) -> float:
        """Pixels of what is sent over pixels of the image."""
        return min(1.0 if self.width > WIDE else _FINE, WIDE / self.width)


def window(scene: Scene, picture: Picture) -> Window:
    """What holds the object's image, of at least a few pixels, within the camera's image."""
    points = project(scene.solid.vertices, np.array(list(picture.sensor)), scene.camera)
    size = np.array([scene.camera.width, scene.camera.height])
    points = points[np.isfinite(points).all(-1)]
    if not len(points):
        return Window(0, 0, *map(int, size))
    low, high = points.min(0), points.max(0)
    margin = _MARGIN * max(high - low) + 4
    low = np.clip(np.floor(low - margin), 0, size - 8).astype(int)
    high = np.clip(np.ceil(high + margin), low + 8, size).astype(int)
    return Window(*map(int, low), *map(int, high - low))


def drawn(scene: Scene, picture: Picture, part: Window) -> np.ndarray:
    """Grey levels, uint8: faces of one level each triangle, blurred; no shadows, no light between surfaces."""
    pictures, bodies = glanced(picture), scene.bodies
    pose, scale = np.array(list(picture.sensor)), part.scale * _FINE
    shape = (round(part.height * scale), round(part.width * scale))
    corners = bodies.triangles.reshape(-1, 3)
    image = (project(corners, pose, scene.camera) - [part.left - 0.5, part.top - 0.5]) * scale - 0.5
    away = depth(corners, pose, scene.camera).reshape(-1, 3).mean(1)
    seen = facing(bodies, pictures.viewpoint)[bodies.triangle_faces] & np.isfinite(image.reshape(-1, 6)).all(1)
    order = np.argsort(-away)
    order = order[seen[order]]
    levels = np.full(len(away), 0.0)
    levels[order] = face_signal(pictures, bodies.triangles[order].mean(1), bodies.triangle_faces[order], 1)
    canvas = np.full(shape, _beside(pictures, scene), np.float32)
    places = np.rint(np.clip(image.reshape(-1, 3, 2), -8191, 8191) * 4).astype(np.int32)
    for t in order:
        cv2.fillConvexPoly(canvas, places[t], float(levels[t]), shift=2)
    canvas = _blurred(canvas, scene.camera, part)
    small = cv2.resize(canvas, (shape[1] // _FINE, shape[0] // _FINE), interpolation=cv2.INTER_AREA)
    return shades(scene, small + scene.noise.dark_level)


def is_large(scene: Scene) -> bool:
    """Whether there are so many triangles that drawing all of them takes longer than casting rays."""
    return len(scene.bodies.triangles) >= _MANY


def sketched(scene: Scene, picture: Picture, part: Window) -> np.ndarray:
    """The same, of a part of many triangles with fewer pixels and by rays, whose cost hardly grows with triangles."""
    if not is_large(scene) or not has_embree():
        return drawn(scene, picture, part)
    pictures, scale = glanced(picture), part.scale / _COARSE
    shape = max(1, round(part.height * scale)), max(1, round(part.width * scale))
    image = _seen(pictures, part, shape)
    start, seen = (make(image, pictures.sensors, scene.camera) for make in (ray_origins, rays))
    face, away = first_face(scene.bodies, start, seen, ())
    met = face >= 0
    canvas = np.full(shape, _beside(pictures, scene), np.float32)
    canvas[met] = face_signal(pictures, start[met] + away[met][:, None] * seen[met], face[met], 1)
    return shades(scene, _blurred(canvas, scene.camera, part) + scene.noise.dark_level)


def _seen(pictures: Pictures, part: Window, shape: tuple[int, int]) -> np.ndarray:
    """Where one picture's sensor looks through pixels of so many rows and columns: ideal px from the image's middle,
    shape (h, w, 2)."""
    camera = pictures.scene.camera
    y, x = ((np.arange(n) + 0.5) * size / n - 0.5 for n, size in zip(shape, (part.height, part.width), strict=True))
    places = np.stack(np.meshgrid(part.left + x, part.top + y), -1)
    return undistorted(places, camera) - image_centre(camera)


def _blurred(canvas: np.ndarray, camera: Camera, part: Window) -> np.ndarray:
    """By the lens; where its blur varies over the field, between the next of some that are drawn."""
    scale = canvas.shape[1] / part.width
    if camera.blur_field is None:
        return _spread(canvas, camera.blur_px * scale)
    y, x = ((np.arange(n) + 0.5) / scale - 0.5 for n in canvas.shape)
    sigma = blur_in_focus(camera, np.stack(np.meshgrid(part.left + x, part.top + y), -1)) * scale
    drawn = np.linspace(sigma.min(), sigma.max(), _BLURS)
    at = np.interp(sigma, drawn, np.arange(_BLURS)).astype(np.float32)
    return sum(np.maximum(0, 1 - np.abs(at - k)) * _spread(canvas, float(each)) for k, each in enumerate(drawn))


def _spread(canvas: np.ndarray, sigma: float) -> np.ndarray:
    """By a Gaussian of so many pixels of the canvas."""
    return cv2.GaussianBlur(canvas, (0, 0), sigma) if sigma > 0.3 else canvas


def _beside(pictures: Pictures, scene: Scene) -> float:
    """Signal of what lies beside the object: that of the image's first corner."""
    return float(seen_at(pictures, -0.5 - image_centre(scene.camera)[None])[0])


def rendered(scene: Scene, image: np.ndarray, part: Window) -> np.ndarray:
    """The same part of a rendered image (grey levels, float), uint8."""
    cut = image[part.top : part.top + part.height, part.left : part.left + part.width].astype(np.float32)
    size = round(part.width * part.scale), max(1, round(part.height * part.scale))
    how = cv2.INTER_AREA if part.scale < 1 else cv2.INTER_NEAREST
    return shades(scene, cv2.resize(cut, size, interpolation=how))


def shades(scene: Scene, levels: np.ndarray) -> np.ndarray:
    """Grey levels as 8 bits: from 0 to the end of the sensor's scale, or to twice a white surface's level."""
    full = full_scale(scene.noise)
    full = full if np.isfinite(full) else scene.noise.dark_level + 2 * scene.camera.exposure
    return np.clip(levels * (255.0 / full), 0, 255).astype(np.uint8)


def to_message(kind: str, grey: np.ndarray, part: Window) -> dict[str, Any]:
    """A picture as the page takes it, PNG."""
    _, data = cv2.imencode(".png", grey, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    where = [part.left, part.top, part.width, part.height]
    return {"kind": kind, "window": where, "png": base64.b64encode(data).decode()}


def overlay(scene: Scene, picture: Picture, told: Answer) -> dict[str, Any]:
    """Required edges and rims as lines, px, and the corners' covariances, px^2; only the chosen measurand's ones."""
    pose, view = np.array(list(picture.sensor)), projected_edges(glanced(picture))
    states = {edge.name: edge.status for edge in told.prediction.edges}
    lines = [
        {"name": name, "status": states[name], "points": view.recorded[e].round(2).tolist()}
        for e, name in enumerate(view.names)
        if np.isfinite(view.recorded[e]).all()
    ]
    for name in told.prediction.measurands and _circles(scene):
        points = project(ring(scene.solid.circle(name), _CHORDS), pose, scene.camera)
        if np.isfinite(points).all():
            lines.append({"name": name, "status": OK if told.closely else GLANCED, "points": points.round(2).tolist()})
    corners = [
        {"at": at.tolist(), "covariance": covariance.tolist()}
        for at, covariance in zip(told.corners, told.covariances, strict=True)
        if finite(float(np.sum(covariance))) is not None and np.isfinite(at).all()
    ]
    return {"lines": lines, "corners": corners}


def _circles(scene: Scene) -> list[str]:
    needed = {name for quantity in scene.quantities for name in quantity.edges}
    return [circle.name for circle in scene.solid.rims if circle.name in needed]


def ring(circle: Circle, chords: int) -> np.ndarray:
    """The ends of so many chords of a circle or an arc, shape (chords + 1, 3)."""
    if circle.ends is not None:
        return circle.around(chords + 1)
    one = np.cross(circle.axis, np.eye(3)[np.argmin(np.abs(np.round(circle.axis, 9)))])
    one /= np.linalg.norm(one)
    turn = np.linspace(0, 2 * np.pi, chords + 1)[:, None]
    return circle.centre + circle.radius * (np.cos(turn) * one + np.sin(turn) * np.cross(circle.axis, one))
