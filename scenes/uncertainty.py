"""What is not exactly as a scene says and is no number of it: poses as they are set, temperature, rounding."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Tag, ValidationInfo, model_validator

from scenes.cameras import lens_modes
from scenes.cameras.covariance import ORDER, Covariance, of_document
from scenes.cameras.lens_modes import LensMode
from scenes.carriers import Carrier, HandEye, Stage, Turntable
from scenes.errors import KIND
from scenes.influences import AnyInfluence
from scenes.model import Model
from scenes.ranges import Rounding, Spread
from scenes.uncertain import Uncertain, UncertainNumber


def _or_sd(value: Any) -> Any:
    """A number alone is a standard uncertainty."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return {"sd": value} if number else value


def _read(value: Any, info: ValidationInfo) -> Any:
    return value if value is None else of_document(value, (info.context or {}).get("directory", Path()))


def _read_modes(value: Any, info: ValidationInfo) -> Any:
    return lens_modes.of_file(value, (info.context or {}).get("directory", Path()))


Deviation = Annotated[
    Uncertain | None, BeforeValidator(_or_sd, json_schema_input_type=float | Uncertain | None)
]  # 0 is expected, or what its value says
_Each = Annotated[Uncertain, BeforeValidator(_or_sd, json_schema_input_type=float | Uncertain)]
Deviations = Annotated[
    Annotated[Deviation, Tag(KIND + "one")] | Annotated[tuple[_Each, _Each, _Each], Tag(KIND + "each")],
    Discriminator(lambda value: KIND + ("each" if isinstance(value, list | tuple) else "one")),
]
"""Of x, y and z alike, or of each its own."""

_SAME = {
    "camera.focal_px": ("fx", "fy"), "camera.focal_length_mm": ("fx", "fy"), "camera.pixel_pitch_um": ("fx", "fy"),
    "camera.magnification": ("fx", "fy"),
    **{f"camera.lens.distortion[{i}]": (name,) for i, name in enumerate(ORDER[4:])},
}  # fmt: skip
_WITH_VALUE = ("temperature_K", "expansion_per_K")


def _of_axes(*both: Uncertain | tuple[Uncertain, ...] | None) -> tuple[Uncertain | None, ...]:
    """Of shifts along x, y and z, and of turns about them."""
    return tuple(each for told in both for each in (told if isinstance(told, tuple) else (told,) * 3))


class Uncertainty(Model):
    """Standard uncertainties of what is no number of the scene; a number alone is one, a table says more.

    Each is a deviation from what the scene says, whose expectation is 0.
    """

    sensor_deg: Deviation = None
    """Of the sensor's place on its sphere, along the meridian and, independently, along the circle of latitude; that of
    ``jitter`` where not given [degrees]."""
    sensor_roll_deg: Deviation = None
    """Of the sensor's turn about its own axis [degrees]."""
    sensor_distance: Deviation = None
    """Of the sensor's distance from ``look_at`` [length]."""
    light_deg: Deviation = None
    """Of every free light's place, in both directions as the sensor's; that of ``jitter`` where not given [degrees]."""
    part_shift: Deviations = None
    """Of the part's place, along x, y and z independently; of each its own in a list of three [length]."""
    part_tilt_deg: Deviations = None
    """Of its turns about axes through ``look_at`` along x, y and z, independently; of each in a list [degrees]."""
    board_shift: Deviations = None
    """Of the place of ``placement.board`` relative to the part, along x, y and z, as ``part_shift`` [length]."""
    board_tilt_deg: Deviations = None
    """Of its turns relative to the part about axes through ``look_at``, as ``part_tilt_deg`` [degrees]."""
    principal_point_px: Deviation = None
    """Of the place at which the optical axis meets the sensor, along x and y independently [px]."""
    temperature_K: Deviation = None  # noqa: N815 - the unit
    """Of the part less 20 degrees Celsius; its value is corrected for [K]."""
    expansion_per_K: Deviation = None  # noqa: N815
    """Coefficient of linear thermal expansion of the part; give its value too [1/K]."""
    fixed_pattern: bool = True
    """Whether the fixed pattern that ``noise.prnu`` and ``noise.dsnu`` tell of counts."""
    rounding: Rounding = 0.0
    """Step to which lengths are rounded when they are reported [length]."""
    rounding_deg: Rounding = 0.0
    """Step to which angles are rounded [degrees]."""
    process_sd: Spread | None = None
    """Standard deviation with which the manufacture scatters, for risks [length]."""
    covariance: Annotated[Covariance | None, BeforeValidator(_read, json_schema_input_type=str | Covariance | None)] = (
        None
    )
    """Of a camera calibration: a file's name, relative to the scene's file, or names and matrix."""
    lens_modes: Annotated[
        tuple[LensMode, ...], BeforeValidator(_read_modes, json_schema_input_type=str | tuple[LensMode, ...])
    ] = ()
    """Of a splined lens: independent errors of variance 1, or the name of a JSON file with ``modes``, as `ice
    calibrate-camera` writes them, relative to the scene's file."""
    reflectance: Deviation = Uncertain(half_width=0.1)
    """Of what each surface reflects, as a part of it: what light between faces, and so the correction of biases, is not
    sure of; known to within 10 % where not given [ratio]."""
    light_place: Deviation = Uncertain(half_width=0.01)
    """Of each light's place as a part of its distance, in all directions independently: what the correction of biases
    is not sure of; known to within 1 % where not given [ratio]."""
    hand_eye: HandEye | None = None
    """Of where the camera sits on a robot's hand, the same in all pictures."""
    stage: Stage | None = None
    """Of a linear stage between pictures."""
    turntable: Turntable | None = None
    """Of a turntable between pictures."""
    influences: tuple[AnyInfluence, ...] = ()
    """Influence quantities of kinds that a module of your own adds (`ice --plugin MODULE`)."""

    @property
    def of_part(self) -> tuple[Uncertain | None, ...]:
        """How well the part's place is known: shifts along x, y and z, and turns about them; None: it is exact."""
        return _of_axes(self.part_shift, self.part_tilt_deg)

    @property
    def carriers(self) -> tuple[Carrier, ...]:
        """What carries sensor or part from picture to picture."""
        return tuple(each for each in (self.hand_eye, self.stage, self.turntable) if each is not None)

    @property
    def of_board(self) -> tuple[Uncertain | None, ...]:
        """The same of the board's place relative to the part."""
        return _of_axes(self.board_shift, self.board_tilt_deg)

    @model_validator(mode="after")
    def _deviations(self) -> Uncertainty:
        for name in type(self).model_fields:
            given = getattr(self, name)
            for each in given if isinstance(given, tuple) else (given,):
                if isinstance(each, Uncertain) and each.value and name not in _WITH_VALUE:
                    raise ValueError(f"{name}.value must be 0, as of every deviation, got {each.value:g}")
        names = [each.kind for each in self.influences]
        if len(set(names)) < len(names):
            raise ValueError(f"uncertainty.influences must be of different kinds, got {', '.join(names)}")
        if self.expansion_per_K is not None and self.expansion_per_K.value is None:
            raise ValueError("expansion_per_K.value must be given, got nothing")
        return self

    def check_once(self, numbers: tuple[UncertainNumber, ...]) -> None:
        """See that the calibration's covariance and the other uncertainties are about different things.

        Raises
        ------
        ValueError
            If not.
        """
        if self.covariance is not None and self.lens_modes:
            raise ValueError("uncertainty.covariance must be left out with lens_modes, got both")
        names = () if self.covariance is None else self.covariance.names
        names = ("fx",) if self.lens_modes else names
        for each in numbers:
            twice = [name for name in _SAME.get(each.key, ()) if name in names]
            if twice:
                raise ValueError(
                    f"{each.key} must be without an uncertainty where the covariance has {twice[0]}, got one"
                )
        if self.principal_point_px is not None and {"cx", "cy"} & set(names):
            raise ValueError(
                "uncertainty.principal_point_px must be left out where the covariance has cx or cy, got it"
            )
