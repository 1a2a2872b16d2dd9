"""Measurements in images that hardly show what is to be measured; references are exact polygon images."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np

import measure
from imaging.geometry.projection import project
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape
from scenes import InvalidInput, Scene
from validation.hard.case import Answer, Case, Reference
from validation.hard.polygon import polygon_image
from validation.hard.scenes_for import task1

SENSOR, LIGHT = (31.3, 137.1), (15, 315)
_TOP = ("v4", "v3", "v7", "v6")
_BY_ALL = (
    "black image",
    "saturated image",
    "noise 100 x the contrast, more than the scene says",
    "contrast of each edge's second half reversed",
)
_NOTHING = ("low_contrast", "not_visible", "short", "sign_change", "ill_conditioned", "clutter")


def cases() -> list[Case]:
    """All cases of the measurement."""
    return _levels() + _refused() + _noise() + _shapes()


def top_face(scene: Scene, sensor=SENSOR) -> np.ndarray:
    """Image of the block's top face, corners v4 v3 v7 v6, px."""
    return project(np.array([scene.solid.vertex(v) for v in _TOP]), np.array(sensor, float), scene.camera)


@lru_cache(maxsize=8)
def picture(scene: Scene, sensor=SENSOR, contrast: float = 150.0, background: float = 20.0) -> np.ndarray:
    """The top face alone on a background; not to be written to."""
    shape = scene.camera.height, scene.camera.width
    return polygon_image(top_face(scene, sensor), shape, scene.camera.blur_px, contrast, background)


def distance(name: str, scene: Scene, image: Callable[[], np.ndarray], estimator: str, right: bool, **how) -> Case:
    """The distance in an image; ``right``: whether it can be measured there."""
    sensor = how.pop("sensor", SENSOR)
    corners = top_face(scene, sensor)
    length = float(np.linalg.norm(corners[1] - corners[3]))
    exact = measure.ESTIMATORS[estimator].exact_px
    truth = Reference(length, "exact image", None, exact, scale=1.0) if right else Reference(None, "rule")

    def ours() -> Answer:
        try:
            found = measure.distance(image(), scene, sensor, estimator=estimator)
        except InvalidInput as error:
            return Answer(None, str(error))
        good = np.isfinite(found.value_px) and np.isfinite(found.variance_px2)
        return Answer(float(found.value_px) if good else None, str(found.status))

    return Case("measure", name, f"{estimator} px", ours, lambda: truth, **how)


def _levels() -> list[Case]:
    plain, quiet = task1(), task1(noise={"sigma": 0.0, "bits": None})
    found = []
    for estimator in measure.ESTIMATORS:
        found.append(distance("clean image", plain, partial(picture, plain), estimator, True))
        found.append(distance("noise 0", quiet, partial(picture, quiet), estimator, True))
        found.append(
            distance(
                "16 bit levels",
                task1(noise={"sigma": 200.0, "bits": 16}),
                lambda: 300 * picture(plain),
                estimator,
                True,
            )
        )
        found.append(distance("black background at 1e9", plain, lambda: picture(plain) + 1e9, estimator, True))
    return found


def _refused() -> list[Case]:
    plain = task1()
    size = plain.camera.height, plain.camera.width
    rng = np.random.default_rng(5)

    def corrupted(value: float) -> np.ndarray:
        image = picture(plain).copy()
        image[100, 100] = value
        return image

    images = {
        "black image": lambda: np.zeros(size),
        "saturated image": lambda: np.clip(picture(plain, background=400.0), 0, 255),
        "contrast 1e-12 of full": lambda: picture(plain, contrast=1.5e-10),
        "noise 100 x the contrast, more than the scene says": lambda: (
            picture(plain) + 15000 * rng.standard_normal(size)
        ),
        "NaN in the image": lambda: corrupted(np.nan),
        "infinity in the image": lambda: corrupted(np.inf),
        "image of 1 x 1 px": lambda: np.ones((1, 1)),
        "no image": lambda: np.ones((0, *size)),
        "contrast of each edge's second half reversed": lambda: _reversed(plain),
    }
    found = [
        distance(name, plain, image, estimator, False)
        for name, image in images.items()
        for estimator in (measure.ESTIMATORS if name in _BY_ALL else ("gradient", "arrangement"))
    ]
    one = task1(camera={"width": 1, "height": 1})
    found.append(distance("camera of 1 x 1 px", one, lambda: np.ones((1, 1)), "gradient", False))
    for sensor, name in (((180, 0), "south pole: the task's face is hidden"), ((88.57, 135), "face all but edge-on")):
        found.append(distance(name, plain, partial(picture, plain), "gradient", False, sensor=sensor))
    return found


def _reversed(scene: Scene) -> np.ndarray:
    """Brighter than the background on one side of the diagonal, darker on the other."""
    image = picture(scene, contrast=60.0, background=100.0)
    corners = top_face(scene)
    middle, along = corners.mean(0), corners[1] - corners[0]
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    flip = ((x - middle[0]) * along[0] + (y - middle[1]) * along[1]) > 0
    return np.where(flip, 200 - image, image)


def _noise() -> list[Case]:
    """Empirical variance of 1500 images against the one that the measurement itself states for its own noise."""
    plain, count = task1(noise={"sigma": 2.4, "bits": None}), 1500

    def stated(estimator: str) -> Answer:
        return Answer(float(measure.distance(picture(plain), plain, SENSOR, estimator=estimator).variance_px2))

    def drawn(estimator: str) -> Reference:
        rng = np.random.default_rng(6)
        clean, values = picture(plain), []
        for _ in range(count // 50):
            noisy = clean + 2.4 * rng.standard_normal((50, *clean.shape))
            values.append(measure.distance(noisy, plain, SENSOR, estimator=estimator).value_px)
        variance = np.concatenate(values).var(ddof=1)
        return Reference(float(variance), "Monte Carlo", None, 4 * np.sqrt(2 / (count - 1)))

    return [
        Case("measure", "stated variance", f"{name} px2", partial(stated, name), partial(drawn, name))
        for name in ("gradient", "canny")
    ]


def _shapes() -> list[Case]:
    """Polygons by themselves: thin corners, blunt corners, short sides. The measurand is the worst corner's error."""
    found = []
    for pixels in (1, 2, 4, 8):
        corners = _quadrilateral(60.0, pixels, 90.0)
        found += [_polygon(f"side of {pixels} px", corners, e, True) for e in ("gradient", "strip", "arrangement")]
    for degrees, right in ((30.0, True), (0.01, False)):
        corners = _quadrilateral(70.0, 40.0, degrees)
        found += [
            _polygon(f"corner of {degrees:g} deg", corners, e, right) for e in ("gradient", "strip", "arrangement")
        ]
    blunt = _blunt(179.99)
    found += [_polygon("corner of 179.99 deg", blunt, e, False) for e in ("gradient", "strip", "arrangement")]
    return found


def _quadrilateral(length: float, side: float, degrees: float) -> np.ndarray:
    a = np.radians(degrees)
    along, aside = np.array([length, 0.0]), side * np.array([np.cos(a), np.sin(a)])
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    ring = np.array([0 * along, along, along + aside, aside])
    return (ring - ring.mean(0)) @ turn.T + [80.3, 70.7]


def _blunt(degrees: float) -> np.ndarray:
    bulge = 30 / np.tan(np.radians(degrees) / 2)
    return np.array([[50.3, 50.2], [80.3, 50.2 - bulge], [110.3, 50.2], [110.3, 90.2], [50.3, 90.2]])


def _polygon(name: str, corners: np.ndarray, estimator: str, right: bool) -> Case:
    shape = (140, 160)
    truth = Reference(0.0, "exact image", None, 0.05, scale=1.0) if right else Reference(None, "rule")

    def ours() -> Answer:
        layout = polygon_layout(corners, Optics(shape, noise_variance=1.0))
        found = find_shape(polygon_image(corners, shape, 0.6)[None], layout, estimator)
        error = np.abs(found.corners[0] - corners).max()
        return Answer(float(error) if np.isfinite(error) else None, str(found.status[0]))

    return Case("measure", name, f"{estimator} worst px", ours, lambda: truth, _NOTHING if right else ())
