"""Results that are rows show themselves: one line, a table in a notebook, a data frame."""

from __future__ import annotations

import html
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from scenes.errors import InvalidInput
from scenes.pose import several, shown

if TYPE_CHECKING:
    import pandas

_MOST = 50  # rows that a notebook shows
DRAW: list[Callable[[Any], str]] = []  # what draws results, HTML: `import validation` adds it


class Shown(ABC):
    """A result that can be told in one line and as rows; its dataclass needs ``repr=False``."""

    @abstractmethod
    def as_rows(self) -> list[dict[str, Any]]:
        """One record a row, for JSON, CSV or a data frame; None is not known or infinite."""

    @abstractmethod
    def _line(self) -> str:
        """The key numbers."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._line()})"

    def _repr_html_(self) -> str:
        return html_of(self, repr(self), self.as_rows())

    def to_frame(self) -> pandas.DataFrame:
        """The rows as a data frame of pandas, which is an optional extra (``frames``).

        Raises
        ------
        InvalidInput
            If pandas is not installed.
        """
        try:
            pandas = import_module("pandas")
        except ImportError:
            raise InvalidInput('pandas must be installed for to_frame ("ice-vision[frames]"), got none') from None
        found = pandas.DataFrame(self.as_rows())
        return found.astype(dict.fromkeys(found.columns[found.isna().all()], float))


def html_of(found: Any, line: str, rows: list[dict[str, Any]]) -> str:
    """What a notebook shows of a result: a line, its picture where `import validation` can draw it, and its rows."""
    more = f"<p>and {len(rows) - _MOST} rows more</p>" if len(rows) > _MOST else ""
    picture = "".join(draw(found) for draw in DRAW)
    return f"<p>{html.escape(line)}</p>{picture}{_table(rows[:_MOST])}{more}"


def poses(sensor: Any, light: Any) -> dict[str, Any]:
    """Sensor and light as columns of numbers; several lights are one text. (None, None) is a pose that is not known.

    >>> poses((30, 135), (15, 315))
    {'sensor_polar': 30.0, 'sensor_azimuth': 135.0, 'light_polar': 15.0, 'light_azimuth': 315.0}
    >>> poses((30, 135), ((15, 315), (60, 90)))["lights"]
    '(15, 315) (60, 90)'
    """
    found = dict(zip(("sensor_polar", "sensor_azimuth"), map(float, sensor), strict=True))
    lights = tuple(tuple(each) for each in several(light))
    if len(lights) != 1:
        return found | {"lights": None if (None, None) in lights else shown(lights)}
    known = (None if angle is None else float(angle) for angle in lights[0])
    return found | dict(zip(("light_polar", "light_azimuth"), known, strict=True))


def short(value: Any) -> str:
    """A value of a row in few characters.

    >>> short(0.000123456), short(None), short((30.0, 135.5)), short("ok")
    ('0.0001235', '-', '30, 135.5', 'ok')
    """
    if value is None:
        return "-"
    if isinstance(value, tuple | list):
        return ", ".join(short(each) for each in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def value(found: float, sigma: float | None, unit: str) -> str:
    """A value with two digits of its standard deviation.

    >>> value(8.061254, 0.00231, "cm"), value(12.5, None, "mm"), value(2.0, 0.0, "mm")
    ('8.0613 +- 0.0023 cm', '12.5 +- ? mm', '2 +- 0 mm')
    """
    if not sigma or not math.isfinite(sigma):
        return f"{found:.6g} +- {'?' if sigma is None or sigma else 0} {unit}"
    digits = min(max(1 - math.floor(math.log10(sigma)), 0), 12)
    return f"{found:.{digits}f} +- {sigma:.{digits}f} {unit}"


def picked(record: Any, *names: str) -> dict[str, Any]:
    """Some attributes of a record by their names.

    >>> picked(1 + 2j, "real", "imag")
    {'real': 1.0, 'imag': 2.0}
    """
    return {name: getattr(record, name) for name in names}


def finite(number: float | None) -> float | None:
    """The number as a plain one; None where it is not finite, or there is none.

    >>> finite(math.inf), finite(1), finite(None)
    (None, 1.0, None)
    """
    return float(number) if number is not None and math.isfinite(number) else None


def _table(rows: list[dict[str, Any]]) -> str:
    """Rows as a table of HTML, nothing in it taken for markup."""
    if not rows:
        return ""
    head = _cells(rows[0], "th")
    body = "".join(f"<tr>{_cells(map(short, row.values()), 'td')}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cells(texts: Iterable[str], tag: str) -> str:
    return "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in texts)
