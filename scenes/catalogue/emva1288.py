"""Results of EMVA 1288's reference software as figures of a camera.

The standard's working group exchanges results as XML: a table of groups, each value an element with a name, ``Value``
and ``Unit`` (documentation of the package emva1288, "Results Comparison"). There is no JSON of it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.parsers import expat

from scenes.errors import InvalidInput
from scenes.files.door import MOST_TEXT, read_bytes

_KEYS = {
    "u_e_sat": ("saturation_capacity_e", 1.0), "sigma_d": ("temporal_dark_noise_e", 1.0),
    "u_e_min": ("absolute_sensitivity_threshold_e", 1.0), "QE": ("quantum_efficiency", 0.01),
    "K": ("system_gain_e", 1.0), "DR_dB": ("dynamic_range_db", 1.0), "SNR_max_dB": ("snr_max_db", 1.0),
    "DSNU1288": ("dsnu_e", 1.0), "PRNU1288": ("prnu_percent", 1.0),
}  # fmt: skip
_MOST_DEPTH = 8


def read(path: Path) -> dict[str, Any]:
    """Keys of a `scenes.catalogue.ListedSensor` from a result file.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is no XML of results, declares entities, or has none of the figures.
    """
    texts = _texts(path, read_bytes(path, MOST_TEXT))
    found = {}
    for name, (key, factor) in _KEYS.items():
        if name in texts:
            try:
                found[key] = factor * float(texts[name])
            except ValueError:
                raise InvalidInput(f"{path}: {name} must be a number, got {texts[name]!r}") from None
    if not found:
        raise InvalidInput(f"{path} must hold results of EMVA 1288 ({', '.join(_KEYS)}), got none of them")
    return found


def _texts(path: Path, data: bytes) -> dict[str, str]:
    """What ``Value`` says in each element, by the element's name."""
    parser, at, found = expat.ParserCreate(), [], {}

    def begins(name: str, _: Any) -> None:
        at.append(name)
        if len(at) > _MOST_DEPTH:
            raise InvalidInput(f"{path} must be at most {_MOST_DEPTH} elements deep, got more")

    def ends(_: str) -> None:
        at.pop()

    def says(text: str) -> None:
        if len(at) > 1 and at[-1] == "Value":
            found[at[-2]] = found.get(at[-2], "") + text.strip()

    def declares(*_: Any) -> None:
        raise InvalidInput(f"{path} must be XML without declarations of entities, got some")

    parser.StartElementHandler, parser.EndElementHandler = begins, ends
    parser.CharacterDataHandler, parser.EntityDeclHandler = says, declares
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise InvalidInput(f"{path} must be valid XML, got {error}") from None
    return found
