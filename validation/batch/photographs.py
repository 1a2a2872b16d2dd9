"""Repeated photographs of a scene's settings, in the place of renders: a folder of them, and one after another.

A folder either holds ``photos.toml``, a list ``[[settings]]`` of ``sensor``, ``light`` and ``files`` (names or patterns
like ``"a/*.png"``, relative to it), or one sub-folder a setting, named as ``sensor_30_90_light_15_270``: polar angles
and azimuths, one light after another, none where no light is free. Photographs are taken in the order of their names.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationError

from scenes import InvalidInput, Pose, Scene, photograph
from scenes.errors import describe
from scenes.files.door import read_toml
from scenes.files.image import Size
from scenes.model import Model
from scenes.scene import Setting
from validation.batch.campaign import Campaign

SUFFIXES = (".png", ".tif", ".tiff", ".npy", ".jpg", ".jpeg", ".bmp")
MOST = 1_000_000  # photographs in all
FEWEST = 2  # of a setting: less has no variance
_INDEX = "photos.toml"
_NUMBER = r"-?\d+(?:\.\d+)?"
_NAME = re.compile(rf"sensor_({_NUMBER})_({_NUMBER})((?:_light_{_NUMBER}_{_NUMBER})*)")
_LIGHT = re.compile(rf"_light_({_NUMBER})_({_NUMBER})")


@dataclass(frozen=True)
class Photographs:
    """Photographs of settings.

    Attributes
    ----------
    campaign : Campaign
        The scene with those settings.
    files : tuple of tuple of str
        Of each setting, all of which can be read and have the camera's size.
    troubles : dict
        By number of a setting why it cannot be judged, in one line.
    left_out : tuple of str
        Of each photograph that is in none of ``files`` why, in one line.
    exact_poses : bool
        Whether the scene says exactly where sensor and part are, so that the mean error is judged, too.
    """

    campaign: Campaign
    files: tuple[tuple[str, ...], ...]
    troubles: dict[int, str]
    left_out: tuple[str, ...]
    exact_poses: bool = False

    @property
    def counts(self) -> list[int]:
        """Photographs of each setting; 0 where it cannot be judged."""
        return [0 if i in self.troubles else len(each) for i, each in enumerate(self.files)]

    def identity(self) -> dict[str, Any]:
        """What a run's numbers depend on: names, sizes and times of the files."""
        digest = hashlib.sha256()
        for i, each in enumerate(self.files):
            for name in each:
                about = Path(name).stat()
                digest.update(f"{i} {Path(name).name} {about.st_size} {about.st_mtime_ns}\n".encode())
        return {"files": digest.hexdigest()[:16], "exact_poses": self.exact_poses}


class _Entry(Model):
    """A setting of ``photos.toml``."""

    sensor: Any
    light: Any = ()
    files: Annotated[tuple[str, ...], Field(min_length=1, max_length=100_000)]


def load(
    campaign: Campaign, folder: Path, exact_poses: bool = False, progress: Callable[[str, int, int], None] | None = None
) -> Photographs:
    """The photographs of a folder, each of which is read once.

    Raises
    ------
    InvalidInput
        If the campaign is more than a scene, the folder holds no setting of it, or its index or a sub-folder's name is
        bad.
    """
    if len(campaign.scenes) != 1 or campaign.grid or campaign.sweep:
        raise InvalidInput(f"SCENE must be one scene, without grid and sweep, for --photos, got {campaign.name}")
    scene = campaign.scenes[0]
    found = list(_listed(folder) if (folder / _INDEX).exists() else _sub_folders(folder))
    if not found:
        raise InvalidInput(
            f"--photos must be a folder with {_INDEX} or sub-folders named as sensor_30_90_light_15_270, got {folder}"
        )
    if sum(len(files) for _, _, files in found) > MOST:
        raise InvalidInput(f"--photos must hold at most {MOST} photographs, got more in {folder}")
    ours = _with_settings(scene, [(where, setting) for where, setting, _ in found])
    good, lost = _readable(ours, [files for _, _, files in found], progress)
    troubles = {
        i: f"{found[i][0]} must hold at least {FEWEST} photographs of {scene.camera.width} x {scene.camera.height} px, "
        f"got {len(files)}"
        for i, files in enumerate(good)
        if len(files) < FEWEST
    }
    if len(troubles) == len(found):
        raise InvalidInput(troubles[0] + (f"; {lost[0]}" if lost else ""))
    return Photographs(Campaign.of(ours), tuple(good), troubles, tuple(lost), exact_poses)


def _sub_folders(folder: Path) -> Iterator[tuple[str, Setting, list[Path]]]:
    """Where, the setting, and its files."""
    try:
        inside = sorted(each for each in folder.iterdir() if each.is_dir() and not each.name.startswith("."))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidInput(f"--photos must be a readable folder, got {str(folder)!r} ({reason})") from None
    for each in inside:
        named = _NAME.fullmatch(each.name)
        if not named:
            raise InvalidInput(f"{each} must be named as sensor_30_90_light_15_270, got {each.name!r}")
        lights = [tuple(map(float, pair)) for pair in _LIGHT.findall(named[3])]
        yield str(each), _setting(str(each), tuple(map(float, named.group(1, 2))), lights), _images(each.iterdir())


def _listed(folder: Path) -> Iterator[tuple[str, Setting, list[Path]]]:
    """The same of ``photos.toml``."""
    index = folder / _INDEX
    document = read_toml(index)
    entries = document.get("settings")
    if set(document) != {"settings"} or not isinstance(entries, list):
        raise InvalidInput(f"{index}: settings must be a list of tables, and all that there is, got {list(document)}")
    for i, table in enumerate(entries):
        where = f"{index}: settings[{i}]"
        try:
            entry = _Entry.model_validate(table)
        except ValidationError as error:
            raise InvalidInput(f"{where}.{describe(error)}") from None
        found: list[Path] = []
        for pattern in entry.files:
            if Path(pattern).is_absolute() or ".." in Path(pattern).parts or not pattern.strip():
                raise InvalidInput(f"{where}.files must be names inside the folder, got {pattern!r}")
            try:
                matched = _images(folder.glob(pattern))
            except (ValueError, NotImplementedError, OSError):
                matched = []
            found += [path for path in matched or [folder / pattern] if path not in found]
        yield where, _setting(where, entry.sensor, entry.light), found


def _images(paths: Iterator[Path]) -> list[Path]:
    return sorted(path for path in paths if path.suffix.lower() in SUFFIXES and not path.name.startswith("."))


def _setting(where: str, sensor: Any, lights: Any) -> Setting:
    one = isinstance(lights, list | tuple) and len(lights) == 1
    try:
        return Setting(sensor=Pose.of(sensor), light=lights[0] if one else lights)
    except ValidationError as error:
        raise InvalidInput(f"{where}: {describe(error)}") from None
    except InvalidInput as error:
        raise InvalidInput(f"{where}: {error}") from None


def _with_settings(scene: Scene, named: Sequence[tuple[str, Setting]]) -> Scene:
    """The scene with those settings, each as the scene has it where it does: with what the paper printed."""
    settings: list[Setting] = []
    for where, setting in named:
        try:
            scene.check_pose("sensor", setting.sensor)
            scene.check_lights(setting.lights)
        except InvalidInput as error:
            raise InvalidInput(f"{where}: {error}") from None
        same = [known for known in scene.settings if (known.sensor, known.lights) == (setting.sensor, setting.lights)]
        settings.append(same[0] if same else setting)
    return scene.model_copy(update={"settings": tuple(settings)})


def _readable(scene: Scene, wanted: list[list[Path]], progress) -> tuple[list[tuple[str, ...]], list[str]]:
    """Those files of each setting that are images of the camera's size; of the others why not."""
    size, total, done = Size.of_camera(scene.camera), sum(map(len, wanted)), 0
    good, lost = [], []
    for files in wanted:
        kept: list[str] = []
        for path in files:
            try:
                _read(path, size)
                kept.append(str(path.absolute()))
            except InvalidInput as error:
                lost.append(str(error))
            done += 1
            if progress:
                progress("photographs", done, total)
        good.append(tuple(kept))
    return good, lost


def _read(path: Path, size: Size) -> np.ndarray:
    image = photograph.read(path, size=size).levels
    if not np.isfinite(image).all():
        raise InvalidInput(f"{path} must be of finite grey levels, got NaN or infinity")
    return image


def mean(scene: Scene, files: Sequence[str]) -> np.ndarray:
    """Mean photograph, grey levels (height, width): what there is in the place of a noise-free image."""
    size = Size.of_camera(scene.camera)
    total = np.zeros(size[:2])
    for name in files:
        total += _read(Path(name), size)
    return total / len(files)


def exposures(scene: Scene, files: Sequence[str]) -> Callable[[np.random.Generator, int], np.ndarray]:
    """Takes photographs one after another: called as (rng, count), without making use of the first."""
    left, size = iter(files), Size.of_camera(scene.camera)

    def take(_rng: np.random.Generator, count: int) -> np.ndarray:
        return np.stack([_read(Path(next(left)), size) for _ in range(count)])

    return take
