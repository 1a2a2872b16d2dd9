"""The results of an inspection as a document of QIF 3.0 (ISO 23952), for those who collect and analyse them.

What each characteristic is, its limits, the measured value with its combined standard uncertainty, and the decision.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from importlib.metadata import version
from itertools import count
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from scenes.measurands.kinds import MEASURANDS
from scenes.status import is_trusted
from scenes.units import Unit, in_unit
from validation.inspection import Inspected, Inspection

_NAMESPACE = "http://qifstandards.org/xsd/qif3"
_DEGREE = 0.017453292519943295
_DECIDED = {"pass": "PASS", "fail": "FAIL", "undecided": "INDETERMINATE", None: "NOT_ANALYZED"}
_OF_PART = {"pass": "PASS", "fail": "FAIL", "undecided": "UNKNOWN", None: "NOT_CALCULATED"}
_MODES = {"DistanceBetween": "TWODIMENSIONAL", "AngleBetween": "TWODIMENSIONAL"}


def document(found: Inspection, serial: str = "") -> bytes:
    """An XML document, UTF-8; the same inspection gives the same bytes.

    Parameters
    ----------
    serial : str
        Of the part; left out where empty.
    """
    ids, scene = count(1), found.taken[0].found.picture.scene
    root = Element("QIFDocument", {"xmlns": _NAMESPACE, "versionQIF": "3.0.0", "idMax": "0"})
    identity = _child(root, "QPId")
    header = _child(_child(root, "Header"), "Application")
    _child(header, "Name", f"ice-vision {version('ice-vision')}")
    standard = next(ids)
    _standard(root, standard)
    _units(root, scene.units)
    part = _child(_child(_child(root, "Product"), "PartSet", n="1"), "Part", id=str(next(ids)), label=scene.name)
    items = _characteristics(root, found, standard, ids)
    _results(root, found, items, serial, ids)
    root.set("idMax", str(next(ids) - 1))
    _child(part, "ModelNumber", scene.title or scene.name)
    identity.text = str(uuid.uuid5(uuid.NAMESPACE_URL, tostring(root, encoding="unicode")))
    indent(root)
    return tostring(root, encoding="utf-8", xml_declaration=True)


def _child(parent: Element, tag: str, text: str | None = None, /, **attributes: str) -> Element:
    made = SubElement(parent, tag, attributes)
    made.text = text
    return made


def _units(root: Element, length: Unit) -> None:
    """Of lengths and angles."""
    units = _child(_child(root, "FileUnits"), "PrimaryUnits")
    for tag, base, name, factor in (
        ("AngularUnit", "radian", "degree", _DEGREE),
        ("LinearUnit", "meter", length, in_unit(1.0, length, "m")),
    ):
        unit = _child(units, tag)
        _child(unit, "SIUnitName", base)
        _child(unit, "UnitName", name)
        _child(_child(unit, "UnitConversion"), "Factor", _number(factor))


def _standard(root: Element, number: int) -> None:
    """By which the limits are read: ISO 8015, the fundamentals of geometrical product specifications."""
    standard = _child(_child(root, "StandardsDefinitions", n="1"), "Standard", id=str(number))
    _child(_child(standard, "Organization"), "StandardsOrganizationEnum", "ISO")
    _child(standard, "Designator", "8015")
    _child(standard, "Year", "2011")


def _characteristics(root: Element, found: Inspection, standard: int, ids: Iterator[int]) -> list[int]:
    """Definitions, nominals and items, three of each characteristic; the identifiers of the items."""
    parent, many = _child(root, "Characteristics"), str(len(found.rows))
    _child(parent, "FormalStandardId", str(standard))
    definitions = _child(parent, "CharacteristicDefinitions", n=many)
    nominals = _child(parent, "CharacteristicNominals", n=many)
    items = _child(parent, "CharacteristicItems", n=many)
    every = []
    for row in found.rows:
        kind, definition, nominal, item = _class(row), next(ids), next(ids), next(ids)
        _defined(_child(definitions, f"{kind}CharacteristicDefinition", id=str(definition)), row)
        target = _child(nominals, f"{kind}CharacteristicNominal", id=str(nominal))
        _child(target, "CharacteristicDefinitionId", str(definition))
        _child(target, "TargetValue", _number(row.requirement.nominal))
        if kind in _MODES:
            _child(target, "AnalysisMode", _MODES[kind])
        said = _child(items, f"{kind}CharacteristicItem", id=str(item))
        _child(said, "Name", row.requirement.name)
        _child(_child(said, "CharacteristicDesignator"), "Designator", str(row.requirement.number))
        _child(said, "CharacteristicNominalId", str(nominal))
        every.append(item)
    return every


def _defined(definition: Element, row: Inspected) -> None:
    """Limits, and in words what it is where QIF has no class of its own for it."""
    zone = row.requirement.tolerance
    if zone is None:
        _child(definition, "NonTolerance", "MEASURED")
    else:
        tolerance = _child(definition, "Tolerance")
        _child(tolerance, "MaxValue", _number(zone.plus))
        _child(tolerance, "MinValue", _number(-zone.minus))
        _child(tolerance, "DefinedAsLimit", "false")
    if _class(row).startswith("UserDefined"):
        _child(definition, "WhatToMeasure", row.requirement.kind)


def _results(root: Element, found: Inspection, items: list[int], serial: str, ids: Iterator[int]) -> None:
    """What was measured of one part."""
    results = _child(root, "Results")
    one = _child(_child(results, "MeasurementResultsSet", n="1"), "MeasurementResults", id=str(next(ids)))
    measured = _child(_child(one, "MeasuredCharacteristics"), "CharacteristicMeasurements", n=str(len(items)))
    part = next(ids)
    for row, item in zip(found.rows, items, strict=True):
        _measured(_child(measured, f"{_class(row)}CharacteristicMeasurement", id=str(next(ids))), row, item, part)
    _child(_child(one, "InspectionStatus"), "InspectionStatusEnum", _OF_PART[found.decision])
    _child(_child(one, "ActualComponentIds", n="1"), "Id", str(part))
    component = _child(_child(_child(results, "ActualComponentSets", n="1"), "ActualComponentSet", n="1"),
                       "ActualComponent", id=str(part))  # fmt: skip
    if serial:
        _child(component, "SerialNumber", serial)
    _child(_child(component, "Status"), "InspectionStatusEnum", _OF_PART[found.decision])


def _measured(measurement: Element, row: Inspected, item: int, part: int) -> None:
    """The value with its combined standard uncertainty; without that where its status is not to be trusted."""
    told, signed = row.requirement, row.value is not None and is_trusted(row.requirement.status)
    facts = {"status": told.status} | ({"expanded uncertainty U (95 %)": _number(told.U)} if signed and told.U else {})
    attributes = _child(measurement, "Attributes", n=str(len(facts)))
    for name, value in facts.items():
        _child(attributes, "AttributeStr", name=name, value=value)
    if told.reason:
        _child(measurement, "Description", told.reason)
    state = "NOT_ANALYZED" if row.value is None else _DECIDED[row.decision]
    _child(_child(measurement, "Status"), "CharacteristicStatusEnum", state)
    _child(measurement, "CharacteristicItemId", str(item))
    _child(measurement, "ActualComponentId", str(part))
    if row.value is not None:
        doubt = {"combinedUncertainty": _number(row.u), "meanError": "0"} if signed and row.u is not None else {}
        _child(measurement, "Value", _number(row.value), **doubt)


def _class(row: Inspected) -> str:
    """QIF's name of a kind of characteristic."""
    kind = MEASURANDS[row.requirement.kind]
    return kind.qif or ("UserDefinedAngular" if kind.is_angle else "UserDefinedLinear")


def _number(value: float) -> str:
    """A decimal without an exponent, which the schema's decimals do not have."""
    return np.format_float_positional(value, trim="-")
