"""A 3MF package: one model, whose objects may be in other parts of it (production extension)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from functools import cache
from typing import Any

MODEL = "3D/3dmodel.model"
_SCHEMAS = "http://schemas.microsoft.com/3dmanufacturing/"
_PATH = f"{{{_SCHEMAS}production/2015/06}}path"  # of a component or an item: the part that its object is in
_UNDERSTOOD = {_SCHEMAS + each for each in ("production/2015/06", "material/2015/02", "trianglesets/2021/07")}
_SAFE = {"resolve_entities": False, "no_network": True, "load_dtd": False}


def in_one_model(data: bytes) -> bytes:
    """The package with all objects that it builds in its first part, under numbers of their own.

    A number of an object is one of its part alone, so that two parts may have the same.

    Raises
    ------
    ValueError
        If it requires an extension that says the shape otherwise than by triangles, or lacks what it refers to.
    """
    from lxml import etree

    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        names = {name.lower(): name for name in archive.namelist()}

        @cache
        def model(name: str) -> Any:
            if name not in names:
                raise ValueError(f"no part {name!r} in it")
            return etree.parse(archive.open(names[name]), etree.XMLParser(**_SAFE)).getroot()

        first = next((name for name in names if MODEL.lower() in name), MODEL.lower())
        _check_required(model(first))
        if not any(_PATH in each.attrib for each in model(first).iter("{*}item", "{*}component")):
            return data
        _gather(model, first)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as one:
            one.writestr(MODEL, etree.tostring(model(first)))
    return packed.getvalue()


def _check_required(model: Any) -> None:
    """Who does not know a required extension must not read the file: its triangles may be none of the part's."""
    required = (model.nsmap.get(prefix, prefix) for prefix in model.get("requiredextensions", "").split())
    if unknown := sorted(set(required) - _UNDERSTOOD):
        raise ValueError(f"it requires extensions that are not read: {', '.join(unknown)}")


def _gather(model: Callable[[str], Any], first: str) -> None:
    """Bring what the first model refers to among its own objects."""
    whole, numbers = model(first), dict[tuple[str, str], str]()
    own = whole.find("{*}resources")
    objects = own.makeelement(own.tag)

    def refer(reference: Any, part: str) -> None:
        part, number = reference.attrib.pop(_PATH, part).strip("/").lower(), reference.get("objectid")
        if (part, number) not in numbers:
            numbers[part, number] = str(len(numbers) + 1)
            found = _object(model(part), number)
            for component in found.iter("{*}component"):
                refer(component, part)
            found.set("id", numbers[part, number])
            objects.append(found)
        reference.set("objectid", numbers[part, number])

    for item in whole.iter("{*}item"):
        refer(item, first)
    whole.replace(own, objects)


def _object(model: Any, number: str) -> Any:
    for each in model.iter("{*}object"):
        if each.get("id") == number:
            return each
    raise ValueError(f"no object {number} in a part that is to have it")
