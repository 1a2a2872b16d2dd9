"""What is free when a scene is fitted to photographs, and the scene and poses that numbers for it make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from imaging.geometry.lens import image_centre
from imaging.geometry.projection import Frame, camera_frame, project_ideal
from imaging.pictures import Pictures
from scenes import Camera, Picture, Pose, Scene, mounted
from scenes.numbers import number_at, with_number

Kind = Literal["number", "aim", "sensor", "light"]
OPTIONS = {"focal": "camera.focal_px", "k1": "camera.lens.distortion[0]"}
"""What may be freed besides, and its key in the scene."""
_SIZES = {"camera.magnification": 1, "camera.distance": -1}  # the image's size goes with which power of it
_SHIFT = 2e-3  # px: by so much a step for a derivative moves the image
_DEGREES = 0.01  # the same step of a light
_TURN = 45.0  # degrees that a pose may be away from the start
_LEAST_BLUR, _MOST_BLUR = 0.3, 4.0  # px: the sharpest image that the model knows, and one that is out of focus
_BLURS = 4.0  # of the scene's blur, as far as which it is sought


class Free(NamedTuple):
    """One free parameter.

    Attributes
    ----------
    name : str
        A key of the scene; ``aim.right``, ``aim.down``, ``aim.forward``; ``sensor.polar`` and the like, with the number
        of the pose behind it where there are several.
    unit : str
    kind : {"number", "aim", "sensor", "light"}
    where : tuple of int
        Axis of the aim; number of the pose and its component; of a light number of the pose, light, component.
    step : float
        For derivatives.
    low, high : float
        Between which it is sought, beside its start.
    known : float
        Standard error from which on it counts as not told.
    """

    name: str
    unit: str
    kind: Kind
    where: tuple[int, ...]
    step: float
    low: float
    high: float
    known: float


@dataclass(frozen=True, eq=False)
class Parameters:
    """All free parameters of a scene seen from K poses.

    Attributes
    ----------
    scene : Scene
        Where the fit starts.
    pictures : tuple of Picture
        One for each pose.
    free : tuple of Free
    axes : Frame
        Of the first picture's sensor, along which the aim is told.
    """

    scene: Scene
    pictures: tuple[Picture, ...]
    free: tuple[Free, ...]
    axes: Frame

    @classmethod
    def of(cls, pictures: tuple[Picture, ...], options: tuple[str, ...] = ()) -> Parameters:
        """Parameters of pictures of one scene; ``options`` of `OPTIONS` are free besides."""
        scene = pictures[0].scene
        axes = camera_frame(scene.camera, np.array(list(pictures[0].sensor)))
        return cls(scene, pictures, tuple(_free(scene, pictures, options)), axes)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(each.name for each in self.free)

    def start(self) -> np.ndarray:
        """Their values in the scene that the fit starts from, (q,)."""
        return np.array([self._start(each) for each in self.free])

    def _start(self, each: Free) -> float:
        if each.kind == "number":
            return number_at(self.scene, each.name)
        if each.kind == "aim":
            return 0.0
        picture, component = self.pictures[each.where[0]], each.where[-1]
        pose = picture.sensor if each.kind == "sensor" else picture.lights[each.where[1]]
        return list(pose)[component]

    def resized(self, values: np.ndarray, times: float) -> np.ndarray:
        """Values (q,) of which the image is so many times as large."""
        found, key = values.copy(), size_of(self.scene.camera)
        found[self.names.index(key)] *= times ** _SIZES[key]
        return found

    def scene_at(self, values: np.ndarray) -> Scene:
        """The scene of values (q,), unchecked."""
        scene, aim = self.scene, np.array(self.scene.camera.look_at)
        for each, value in zip(self.free, values.tolist(), strict=True):
            if each.kind == "number":
                scene = with_number(scene, each.name, value)
            elif each.kind == "aim":
                aim = aim + value * self.axes[each.where[0]]
        return scene.tried(camera=scene.camera.tried(look_at=tuple(aim.tolist())))

    def poses_at(self, values: np.ndarray, k: int) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
        """Sensor's pose (2,) and those of all lights of the k-th picture; polar angles may be beyond the pole."""
        sensor = np.array(list(self.pictures[k].sensor))
        lights = [np.array(list(pose)) for pose in self.pictures[k].lights]
        for each, value in zip(self.free, values.tolist(), strict=True):
            if each.kind in ("sensor", "light") and each.where[0] == k:
                (sensor if each.kind == "sensor" else lights[each.where[1]])[each.where[-1]] = value
        for i, light in enumerate(self.scene.lights):
            if light.mount != "free":
                lights[i] = mounted(light, sensor)
        return sensor, tuple(lights)

    def pictures_at(self, values: np.ndarray, k: int) -> Pictures:
        """The k-th picture of values (q,)."""
        return Pictures(self.scene_at(values), *self.poses_at(values, k), True)

    def settled(self, values: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same values and covariance with polar angles of 0 to 180, azimuths of 0 to 360, a roll of -180 to 180."""
        found, sign = values.copy(), np.ones(values.size)
        roll = self.names.index("camera.roll_deg")
        for i, each in enumerate(self.free):
            if each.kind in ("sensor", "light") and each.where[-1] == 0:
                if not 0 <= found[i] <= 180:
                    found[i], sign[i] = -found[i] % 360, -1.0
                    found[i + 1] += 180
                    found[roll] += 180 if each.kind == "sensor" else 0
                found[i + 1] %= 360
        found[roll] = (found[roll] + 180) % 360 - 180
        return found, covariance * sign[:, None] * sign

    def picture_at(self, values: np.ndarray, k: int) -> Picture:
        """The k-th picture of settled values, for whoever predicts or renders it."""
        sensor, lights = self.poses_at(values, k)
        return Picture(self.scene_at(values), Pose(*sensor.tolist()), tuple(Pose(*at.tolist()) for at in lights))


def size_of(camera: Camera) -> str:
    """Key of the number that tells how large a camera shows what it sees.

    >>> import scenes
    >>> size_of(scenes.load("task1").camera), size_of(scenes.load("telecentric_plate").camera)
    ('camera.distance', 'camera.magnification')
    """
    return next(key for key in _SIZES if hasattr(camera, key.removeprefix("camera.")))


def options_of(camera: Camera) -> tuple[str, ...]:
    """What of a camera may be freed besides: no focal length where the magnification says all of it."""
    return tuple(name for name in OPTIONS if name != "focal" or size_of(camera) == "camera.distance")


def radius_px(picture: Picture) -> float:
    """Distance of the object's farthest corner from the middle of its image, px."""
    corners = project_ideal(picture.scene.solid.vertices, np.array(list(picture.sensor)), picture.scene.camera)
    return float(np.linalg.norm(corners - corners.mean(0), axis=1).max())


def _free(scene: Scene, pictures: tuple[Picture, ...], options: tuple[str, ...]) -> list[Free]:
    camera, size = scene.camera, radius_px(pictures[0])
    turn = np.degrees(_SHIFT / size)
    part = _SHIFT / size
    pixel = camera.distance / camera.focal_px
    field = max(camera.width, camera.height) * pixel
    key = size_of(camera)
    start, unit = number_at(scene, key), scene.units if key == "camera.distance" else ""
    found = [
        Free(key, unit, "number", (), part * start, start / 2, start * 2, start / 5),
        Free("camera.roll_deg", "deg", "number", (), turn, -_TURN, _TURN, 10.0),
        Free("camera.exposure", "levels", "number", (), 1e-4 * camera.exposure, camera.exposure / 10,
             camera.exposure * 10, camera.exposure / 2),
        Free("noise.dark_level", "levels", "number", (), 1e-3, -np.inf, np.inf, np.inf),
        Free("camera.blur_px", "px", "number", (), 1e-4, _LEAST_BLUR, max(_BLURS * camera.blur_px, _MOST_BLUR), 2.0),
    ]  # fmt: skip
    if "focal" in options:
        f = camera.focal_px
        found.append(Free("camera.focal_px", "px", "number", (), part * f, f / 3, f * 3, f / 3))
    if "k1" in options:
        corner = float(np.linalg.norm(image_centre(camera)))
        step = _SHIFT * camera.focal_px**2 / corner**3
        found.append(Free(OPTIONS["k1"], "", "number", (), step, -2.0, 2.0, 1.0))
    ways = ("right", "down", "forward")[: 2 if len(pictures) == 1 else 3]
    found += [
        Free(f"aim.{way}", scene.units, "aim", (i,), _SHIFT * pixel, -field, field, field) for i, way in enumerate(ways)
    ]
    for k, picture in enumerate(pictures):
        found += _of_pose(scene, picture, k, f"[{k}]" if len(pictures) > 1 else "", turn)
    return found


def _of_pose(scene: Scene, picture: Picture, k: int, suffix: str, turn: float) -> list[Free]:
    found = [
        Free(f"sensor.{angle}{suffix}", "deg", "sensor", (k, c), turn, at - (_TURN, 2 * _TURN)[c],
             at + (_TURN, 2 * _TURN)[c], 20.0)
        for c, (angle, at) in enumerate(zip(("polar", "azimuth"), picture.sensor, strict=True))
    ]  # fmt: skip
    for i in scene.free:
        name = "light" if len(scene.lights) == 1 else f"lights[{i}]"
        found += [
            Free(f"{name}.{angle}{suffix}", "deg", "light", (k, i, c), _DEGREES, at - (_TURN, 180.0)[c],
                 at + (_TURN, 180.0)[c], 20.0)
            for c, (angle, at) in enumerate(zip(("polar", "azimuth"), picture.lights[i], strict=True))
        ]  # fmt: skip
    return found
