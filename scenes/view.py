"""Whether camera and object fit together: a mesh in another unit than it is taken for, a camera that looks past it."""

from __future__ import annotations

import numpy as np

from scenes.cameras.pinhole import Camera
from scenes.parts.solid import Solid
from scenes.units import UNITS, Unit, in_unit, times_apart

_LARGE, _SMALL = 4.0, 0.1  # times the field of view: then a unit that fits better is likely meant
_ANY_LARGE, _ANY_SMALL = 500.0, 1e-4  # the same where the file's unit is stated: beyond any task
_FITS = 0.05, 1.6  # a part that a camera is set up for
_TINY_MM = 1.0  # a part that is smaller is likely one in another unit
_COMMON_MM = 5.0, 2000.0  # of parts


def units_meant(solid: Solid, unit: Unit) -> tuple[Unit, ...]:
    """Units that the numbers of a file may be in, where the part, taken for ``unit``, is less than a millimetre large.

    Examples
    --------
    >>> from scenes.parts.solid import block
    >>> units_meant(block((0.06, 0.04, 0.02)), "mm"), units_meant(block((60, 40, 20)), "mm")
    (('m',), ())
    """
    size = float(np.ptp(solid.vertices, axis=0).max())
    if in_unit(size, unit, "mm") >= _TINY_MM:
        return ()
    least, most = _COMMON_MM
    return tuple(other for other in UNITS if least <= in_unit(size, other, "mm") <= most)


def check_view(solid: Solid, camera: Camera, unit: Unit, file_unit: Unit | None, is_mesh: bool) -> None:
    """See that the object is as large as what the camera sees, and where it looks.

    Raises
    ------
    ValueError
        If a mesh, taken for ``unit``, is 4 times the field of view or a tenth of it, and another unit would fit; 500
        times or a ten thousandth where the file's unit is stated. If the camera looks past the object.
    """
    low, high = solid.vertices.min(0), solid.vertices.max(0)
    if is_mesh:
        _check_size(float((high - low).max()), max(camera.field_of_view), unit, file_unit)
    at = np.array(camera.look_at)
    past = float(np.linalg.norm(np.maximum(np.maximum(low - at, at - high), 0)))
    reach = float(np.hypot(*camera.field_of_view)) / 2 + float(np.linalg.norm(high - low))
    if past > reach:
        raise ValueError(
            f"camera.look_at must be within {reach:.4g} {unit} of the object, which lies from {_point(low)} to"
            f" {_point(high)}, got {_point(at)}"
        )


def _check_size(size: float, view: float, unit: Unit, stated: Unit | None) -> None:
    small, large = (_SMALL, _LARGE) if stated is None else (_ANY_SMALL, _ANY_LARGE)
    if small < size / view < large:
        return
    so = f"the mesh is {size:.4g} {unit} large and the field of view {view:.4g} {unit}"
    if stated is not None:
        raise ValueError(f'object.units must be the unit of the mesh: {so}, got "{stated}"')
    ratios = {other: in_unit(size, other, unit) / view for other in UNITS}
    fitting = [other for other in UNITS if _FITS[0] < ratios[other] < _FITS[1]]
    hint = min(fitting, key=lambda other: times_apart(2 * ratios[other]), default=unit)  # a detail of a large part?
    raise ValueError(f'object.units must be stated (units = "{hint}" perhaps): {so}, got nothing')


def _point(at: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in at) + ")"
