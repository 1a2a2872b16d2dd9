"""How the part's place is known: from a fixture alone, or found in the same picture by features of the part or a
board."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import ConfigDict, Field

from scenes.board import PITCH, Board
from scenes.cameras import estimated
from scenes.cameras.estimated import Estimated
from scenes.measurands.features import Centre, Side, Wall
from scenes.measurands.form import forms_of
from scenes.measurands.kinds import MEASURANDS
from scenes.model import Model, Name
from scenes.ranges import Coordinate, Spread

if TYPE_CHECKING:
    from scenes.scene import Scene
    from scenes.uncertainty import Uncertainty

COMPONENTS = (
    *(f"part_shift.{axis}" for axis in "xyz"),
    *(f"part_tilt_deg.{axis}" for axis in "xyz"),
)
"""What a placement is made of: a shift [length] and a rotation vector about ``camera.look_at`` [degrees]."""
_RIDGE = 1e-18  # of deviations' variance: of some that a calibration knows to be one
MOST_TILT = 15.0
"""Degrees that the part's place may be off to either side about all axes but one, where it is found in a picture."""


class Placement(Model):
    """How it is known where the part lies, beside where the scene says.

    How well that is known without the picture is said by ``uncertainty.part_shift`` and ``uncertainty.part_tilt_deg``.
    """

    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True, serialize_by_alias=True)

    source: Literal["known", "uncertain", "datums", "board"] = Field("known", alias="from")
    """known: it lies as the scene says, and what that is not sure of is a source of the budget. uncertain: the same,
    and plans and measurements count it too. datums: shift and tilt are estimated in the picture, together with the
    measurands, from features of the part of which the model tells the places. board: the same from a board that is
    seen beside the part and lies as it does."""
    datums: tuple[Name, ...] = ()
    """Names of the part's straight edges and circles that tell where it lies; measurands may use them too."""
    datum_sd: Spread | None = None
    """Standard uncertainty of their places and radii on the part, each end and each direction independently: what the
    manufacture leaves open [length]."""
    board: Board | None = None
    """What stands beside the part; ``uncertainty.board_shift`` and ``board_tilt_deg`` say how exactly."""
    camera: tuple[Estimated, ...] = ()
    """What of the camera is estimated in the same picture, with datums or a board: focal, its focal length or
    magnification; with a board also k1, the first coefficient of its lens' distortion. How well that is known before
    is what the scene says of the camera's numbers, or of their covariance; where it says nothing, to a tenth
    (1 sigma) of the focal length, and to 0.1 of k1."""
    expected: tuple[Coordinate, ...] = (0.0,) * 6
    """Shift along x, y, z [length] and rotation vector [degrees] that are expected, beside where the scene says; then
    of each of ``camera`` the deviation, of the focal length its logarithm."""

    @property
    def is_known(self) -> bool:
        """Whether it counts as where the scene says."""
        return self.source == "known"

    @property
    def is_estimated(self) -> bool:
        """Whether the picture tells it."""
        return self.source in ("datums", "board")

    @property
    def mean(self) -> np.ndarray:
        """What is expected of shift, rotation vector and the camera's deviations, (6 + c,)."""
        return np.array([*self.expected, *[0.0] * (6 + len(self.camera) - len(self.expected))])

    @property
    def features(self) -> tuple[str, ...]:
        """Names of the datums, each once."""
        return tuple(dict.fromkeys(self.datums))

    @property
    def told_by(self) -> tuple[str, ...]:
        """Names of what tells the place in the picture: the datums, or the board."""
        return self.features if self.board is None else ("board",)


def prior(uncertainty: Uncertainty) -> np.ndarray:
    """Standard uncertainties of a placement's six `COMPONENTS` before a picture is seen, shape (6,); 0: it is exact.

    >>> from scenes.uncertainty import Uncertainty
    >>> prior(Uncertainty(part_shift=[1, 2, 3])).tolist()
    [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]
    """
    return np.array([0.0 if told is None else told.u for told in uncertainty.of_part])


def root(scene: Scene) -> np.ndarray:
    """Deviations of variance 1 that are independent as those of a placement and the camera, (6 + c, k).

    Of the placement's `COMPONENTS`, k of which are not exact, and of what is estimated of the camera.
    """
    u = prior(scene.uncertainty)
    camera = np.linalg.cholesky(estimated.covariance(scene) + _RIDGE * np.eye(len(scene.placement.camera)))
    whole = np.zeros((len(u) + len(camera),) * 2)
    whole[:6, :6], whole[6:, 6:] = np.diag(u), camera
    return whole[:, whole.any(0)]


def components(scene: Scene) -> tuple[str, ...]:
    """Names of the k deviations of `root`."""
    known = zip(COMPONENTS, prior(scene.uncertainty) == 0, strict=True)
    return (*(name for name, exact in known if not exact), *estimated.names(scene.placement.camera))


def of_board(uncertainty: Uncertainty) -> np.ndarray:
    """Standard uncertainties (6,) of the board's place relative to the part, in the same components."""
    return np.array([0.0 if told is None else told.u for told in uncertainty.of_board])


def pitch_u(scene: Scene) -> float:
    """Standard uncertainty of the pitch of the board, the scene's unit; 0: it is exact."""
    return next((each.u for each in scene.uncertain if each.key == PITCH), 0.0)


def limits(uncertainty: Uncertainty) -> np.ndarray:
    """How far a placement's components may plausibly be off, (6,): half widths, or three standard uncertainties."""
    told = uncertainty.of_part
    return np.array([0.0 if each is None else each.half_width or 3 * each.u for each in told])


def check_placement(scene: Scene) -> None:
    """See that a scene's placement can be what it says.

    Raises
    ------
    ValueError
        If not.
    """
    placement = scene.placement
    for key, source in (("datums", "datums"), ("datum_sd", "datums"), ("board", "board")):
        if getattr(placement, key) and placement.source != source:
            raise ValueError(f"placement.{key} must be left out unless placement.from is {source}, got it")
    told = [each.key for each in scene.uncertain if each.key.startswith("placement.") and each.key != PITCH]
    if told:
        raise ValueError(f"uncertain.key must be {PITCH} of a placement, got {told[0]!r}")
    if placement.source != "board" and of_board(scene.uncertainty).any():
        raise ValueError(
            "uncertainty.board_shift and board_tilt_deg must be left out unless placement.from is board, got some"
        )
    if placement.is_known:
        if any(placement.expected):
            raise ValueError(f"placement.expected must be 0 where it is known, got {list(placement.expected)}")
        _check_camera(scene)
        return
    if not prior(scene.uncertainty).any():
        raise ValueError(
            f"uncertainty.part_shift or part_tilt_deg must be more than 0 with placement.from = {placement.source!r}"
            ", got none"
        )
    _check_scene(scene)
    _check_camera(scene)
    if placement.is_estimated:
        _check_tilts(scene)
    if placement.source == "datums":
        _check_datums(scene)
    if placement.source == "board":
        _check_board(scene)


def _check_scene(scene: Scene) -> None:
    """What the part's place is not estimated with."""
    wrong = f"with placement.from = {scene.placement.source!r}"
    if scene.task is not None:
        raise ValueError(f"task must be left out {wrong}, and measurands listed, got one")
    if scene.floor is not None or scene.obstacles:
        raise ValueError(f"floor and obstacles must be left out {wrong}, which moves the part alone, got some")
    if scene.textures:
        raise ValueError(f"textures must be left out {wrong}, got {len(scene.textures)}")
    for each in scene.quantities if scene.measurands else ():
        curved = any(isinstance(feature, Wall) for feature in each.basic)
        if curved or MEASURANDS[each.kind].extreme or each in forms_of((each,)):
            raise ValueError(f"measurands must be of straight edges and circles {wrong}, got {each.name}")


def _check_camera(scene: Scene) -> None:
    placement = scene.placement
    if placement.camera and not placement.is_estimated:
        raise ValueError(
            f"placement.camera must be left out unless placement.from is datums or board, got {list(placement.camera)}"
        )
    if len(set(placement.camera)) < len(placement.camera):
        raise ValueError(f"placement.camera must have each once, got {list(placement.camera)}")
    if "k1" in placement.camera and placement.source != "board":
        raise ValueError("placement.camera must be without k1 unless placement.from is board, got it")
    if "k1" in placement.camera and scene.camera.lens.kind != "brown_conrady":
        raise ValueError(f"placement.camera must be without k1 of a {scene.camera.lens.kind} lens, got it")
    if len(placement.expected) not in (6, len(placement.mean)):
        raise ValueError(
            f"placement.expected must be 6 numbers, and one of each of camera, got {len(placement.expected)}"
        )


def _check_datums(scene: Scene) -> None:
    placement, solid = scene.placement, scene.solid
    if not placement.datums:
        raise ValueError("placement.datums must be at least one edge or circle, got none")
    if placement.datum_sd is None:
        raise ValueError("placement.datum_sd must be given with datums, got nothing")
    edges, rims = [edge.name for edge in solid.sharp], [each.name for each in solid.rims]
    for name in placement.datums:
        if name not in edges and name not in rims:
            raise ValueError(f"placement.datums must be edges or circles of the part, got {name!r}")


def _check_tilts(scene: Scene) -> None:
    if np.sort(limits(scene.uncertainty)[3:])[1] > MOST_TILT:
        raise ValueError(
            f"uncertainty.part_tilt_deg must be limited to {MOST_TILT:g} degrees about two axes for "
            f"{scene.placement.source}, got more"
        )


def _check_board(scene: Scene) -> None:
    board, noise = scene.placement.board, scene.noise
    if board is None:
        raise ValueError("placement.board must be given with placement.from = 'board', got nothing")
    if limits(scene.uncertainty)[3:].max() > MOST_TILT:
        raise ValueError(f"uncertainty.part_tilt_deg must be limited to {MOST_TILT:g} degrees for a board, got more")
    if noise.is_shared or noise.colour is not None:
        raise ValueError("noise must be without row_sigma, column_sigma and colour with a board, got some")
    inside = [scene.solid.height_above(point) <= 0 for point in board.outline]
    if any(inside):
        raise ValueError("placement.board must be outside the object, got it within")


def datums_of(scene: Scene) -> tuple[Side | Centre, ...]:
    """The features that tell where the part lies."""
    rims = {each.name for each in scene.solid.circles} if scene.placement.datums else set()
    return tuple(Centre(circle=name) if name in rims else Side(edge=name) for name in scene.placement.features)
