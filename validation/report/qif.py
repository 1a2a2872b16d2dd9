"""The results of an inspection as a document of QIF 3.0 (ISO 23952), for those who collect and analyse them.

What each characteristic is, its limits, the measured value with its combined standard uncertainty, and the decision.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from scenes.measurands.kinds import MEASURANDS
from scenes.measurands.zone import joint_parts
from scenes.status import is_trusted
from scenes.units import Unit, in_unit
from validation.inspection import Inspection
from validation.versions import version

_NAMESPACE = "http://qifstandards.org/xsd/qif3"
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
    _child(header, "Name", f"ice-vision {version()}")
    standard = next(ids)
    _standard(root, standard)
    _units(root, scene.units)
    part = _child(_child(_child(root, "Product"), "PartSet", n="1"), "Part", id=str(next(ids)), label=scene.name)
    rows = _rows(found)
    items = _characteristics(root, rows, standard, ids)
    _results(root, list(zip(rows, items, strict=True)), _OF_PART[found.decision], serial, ids)
    root.set("idMax", str(next(ids) - 1))
    _child(part, "ModelNumber", scene.title or scene.name)
    identity.text = str(uuid.uuid5(uuid.NAMESPACE_URL, tostring(root, encoding="unicode")))
    indent(root)
    return tostring(root, encoding="utf-8", xml_declaration=True)


@dataclass(frozen=True)
class _Row:
    """A characteristic as the document says it: ``of`` is QIF's name of its kind, ``limits`` of deviations."""

    of: str
    number: str
    name: str
    kind: str
    nominal: float
    limits: tuple[float, float] | None
    value: float | None
    u: float | None
    U: float | None
    decision: str | None
    status: str
    reason: str = ""


def _rows(found: Inspection) -> list[_Row]:
    """Every number, and every zone that several of them keep together; a form's number with its zone's limits."""
    joint = joint_parts(each.zone for each in found.zones)
    rows = []
    for row in found.rows:
        told = row.requirement
        kind, zone = MEASURANDS[told.kind], None if told.name in joint else told.tolerance
        of = kind.qif or ("UserDefinedAngular" if kind.is_angle else "UserDefinedLinear")
        limits = None if zone is None else (-zone.minus, zone.plus)
        decision, form = row.decision, found.forms.get(told.name)
        if form is not None:
            limits, decision = form.zone.size and (0.0, form.zone.size), form.decision
        rows.append(_Row(of, str(told.number), told.name, told.kind, told.nominal, limits, row.value, row.u, told.U,
                         decision, told.status, told.reason))  # fmt: skip
    for each in (each for each in found.zones if not each.zone.is_form):
        told = each.facts
        limits = None if told["size"] is None else (0.0, told["size"])
        rows.append(_Row("UserDefinedLinear", "", told["name"], told["kind"], 0.0, limits, told["value"], told["u"],
                         None, each.decision, each.status))  # fmt: skip
    return rows


def _child(parent: Element, tag: str, text: str | None = None, /, **attributes: str) -> Element:
    made = SubElement(parent, tag, attributes)
    made.text = text
    return made


def _units(root: Element, length: Unit) -> None:
    """Of lengths and angles."""
    units = _child(_child(root, "FileUnits"), "PrimaryUnits")
    for tag, base, name, factor in (
        ("AngularUnit", "radian", "degree", math.radians(1)),
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


def _characteristics(root: Element, rows: list[_Row], standard: int, ids: Iterator[int]) -> list[int]:
    """Definitions, nominals and items, three of each characteristic; the identifiers of the items."""
    parent, many = _child(root, "Characteristics"), str(len(rows))
    _child(parent, "FormalStandardId", str(standard))
    definitions = _child(parent, "CharacteristicDefinitions", n=many)
    nominals = _child(parent, "CharacteristicNominals", n=many)
    items = _child(parent, "CharacteristicItems", n=many)
    every = []
    for row in rows:
        definition, nominal, item = next(ids), next(ids), next(ids)
        _defined(_child(definitions, f"{row.of}CharacteristicDefinition", id=str(definition)), row)
        target = _child(nominals, f"{row.of}CharacteristicNominal", id=str(nominal))
        _child(target, "CharacteristicDefinitionId", str(definition))
        _child(target, "TargetValue", _number(row.nominal))
        if row.of in _MODES:
            _child(target, "AnalysisMode", _MODES[row.of])
        said = _child(items, f"{row.of}CharacteristicItem", id=str(item))
        _child(said, "Name", row.name)
        if row.number:
            _child(_child(said, "CharacteristicDesignator"), "Designator", row.number)
        _child(said, "CharacteristicNominalId", str(nominal))
        every.append(item)
    return every


def _defined(definition: Element, row: _Row) -> None:
    """Limits, and in words what it is where QIF has no class of its own for it."""
    if row.limits is None:
        _child(definition, "NonTolerance", "MEASURED")
    else:
        tolerance = _child(definition, "Tolerance")
        _child(tolerance, "MaxValue", _number(row.limits[1]))
        _child(tolerance, "MinValue", _number(row.limits[0]))
        _child(tolerance, "DefinedAsLimit", "false")
    if row.of.startswith("UserDefined"):
        _child(definition, "WhatToMeasure", row.kind)


def _results(root: Element, rows: list[tuple[_Row, int]], state: str, serial: str, ids: Iterator[int]) -> None:
    """What was measured of one part."""
    results = _child(root, "Results")
    one = _child(_child(results, "MeasurementResultsSet", n="1"), "MeasurementResults", id=str(next(ids)))
    measured = _child(_child(one, "MeasuredCharacteristics"), "CharacteristicMeasurements", n=str(len(rows)))
    part = next(ids)
    for row, item in rows:
        _measured(_child(measured, f"{row.of}CharacteristicMeasurement", id=str(next(ids))), row, item, part)
    _child(_child(one, "InspectionStatus"), "InspectionStatusEnum", state)
    _child(_child(one, "ActualComponentIds", n="1"), "Id", str(part))
    component = _child(_child(_child(results, "ActualComponentSets", n="1"), "ActualComponentSet", n="1"),
                       "ActualComponent", id=str(part))  # fmt: skip
    if serial:
        _child(component, "SerialNumber", serial)
    _child(_child(component, "Status"), "InspectionStatusEnum", state)


def _measured(measurement: Element, row: _Row, item: int, part: int) -> None:
    """The value with its combined standard uncertainty; without that where its status is not to be trusted."""
    signed = row.value is not None and is_trusted(row.status)
    facts = {"status": row.status} | ({"expanded uncertainty U (95 %)": _number(row.U)} if signed and row.U else {})
    attributes = _child(measurement, "Attributes", n=str(len(facts)))
    for name, value in facts.items():
        _child(attributes, "AttributeStr", name=name, value=value)
    if row.reason:
        _child(measurement, "Description", row.reason)
    state = "NOT_ANALYZED" if row.value is None else _DECIDED[row.decision]
    _child(_child(measurement, "Status"), "CharacteristicStatusEnum", state)
    _child(measurement, "CharacteristicItemId", str(item))
    _child(measurement, "ActualComponentId", str(part))
    if row.value is not None:
        doubt = {"combinedUncertainty": _number(row.u), "meanError": "0"} if signed and row.u is not None else {}
        _child(measurement, "Value", _number(row.value), **doubt)


def _number(value: float) -> str:
    """A decimal without an exponent, which the schema's decimals do not have."""
    return np.format_float_positional(value, trim="-")
