"""Catalogues: what is read, what contradicts itself, brightness in every unit."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from scenes import InvalidInput
from scenes.catalogue import Catalogue, ListedLens, ListedLight, ListedSensor, emva1288, load
from scenes.catalogue.photometry import efficacy, photons_per_joule

SENSOR = {
    "name": "S", "resolution": (2448, 2048), "pixel_pitch_um": 3.45, "sensor_size_mm": (8.45, 7.07), "bits": 12,
    "saturation_capacity_e": 10400.0, "temporal_dark_noise_e": 2.1, "absolute_sensitivity_threshold_e": 2.7,
    "dynamic_range_db": 72.0, "quantum_efficiency": 0.64, "mount": ("C",), "exposure_min_us": 20.0,
    "exposure_max_us": 1e6,
}  # fmt: skip
LENS = {
    "name": "L", "kind": "bi-telecentric", "magnification": 0.25, "working_distance_mm": 230.0, "f_number": 6.0,
    "numerical_aperture": 0.021, "format": '1.1"', "field_diameter_mm": 69.0, "resolution_um": 12.64,
    "depth_of_field_mm": 4.3, "mount": "C",
}  # fmt: skip
RING = {"name": "R", "kind": "ring", "outer_diameter_mm": 100.0, "inner_diameter_mm": 60.0, "wavelength_nm": 625.0}


def test_the_sample_has_no_contradictions_and_names_its_sources() -> None:
    found = load("sample")
    assert found.is_sample
    assert not found.contradictions()
    assert all(each.source and not each.missing for each in found.entries)
    assert sum(each.is_telecentric for each in found.lenses) >= len(found.lenses) / 2


@pytest.mark.parametrize(
    ("kind", "good", "wrong", "text"),
    [
        # a maker's data sheet states ten times the electrons: 94.3 dB where it says 74
        (ListedSensor, SENSOR, {"saturation_capacity_e": 104000.0, "dynamic_range_db": 72.0},
         "dynamic_range_db must be 91.71 .* got 72"),
        (ListedSensor, SENSOR, {"absolute_sensitivity_threshold_e": None, "dynamic_range_db": 65.0},
         r"dynamic_range_db must be 72.0 to 73.9 by .*10400.* 2.1, got 65"),
        (ListedSensor, SENSOR, {"absolute_sensitivity_threshold_e": 12.0, "dynamic_range_db": 58.8},
         "absolute_sensitivity_threshold_e must be 2.6 .* got 12"),
        (ListedSensor, SENSOR, {"sensor_size_mm": (8.45, 7.5)},
         "sensor_size_mm must have a height of 7.066 .* got 7.5"),
        (ListedSensor, SENSOR, {"diagonal_mm": 10.4}, "diagonal_mm must be 11.01 .* got 10.4"),
        (ListedSensor, SENSOR, {"pixel_pitch_um": 0.0}, "pixel_pitch_um must be left out .* got 0"),
        (ListedSensor, SENSOR, {"snr_max_db": 60.0}, "snr_max_db must be 40.17 .* got 60"),
        (ListedSensor, SENSOR, {"system_gain_e": 1.0}, "system_gain_e must keep 10400 e- within 12 bits, got 1"),
        (ListedSensor, SENSOR, {"quantum_efficiency": 64.0}, "quantum_efficiency must be a ratio of at most 1, got 64"),
        (ListedSensor, SENSOR, {"exposure_min_us": 2e6}, "exposure_min_us must be less than exposure_max_us"),
        (ListedLens, LENS, {"numerical_aperture": 0.05, "resolution_um": None, "depth_of_field_mm": None},
         "numerical_aperture must be 0.02083 .* got 0.05"),
        # a maker's table: 224 mm of field at a magnification of 0.007 are 1.6 mm of image
        (ListedLens, LENS, {"magnification": 0.007, "field_diameter_mm": 224.03, "numerical_aperture": None},
         "magnification x field_diameter_mm must be at least 17.6 mm .* got 1.57"),
        (ListedLens, LENS, {"image_circle_mm": 11.0, "field_diameter_mm": 44.0},
         'image_circle_mm must be at least 17.6 for format 1.1", got 11'),
        (ListedLens, LENS, {"image_circle_mm": 17.6, "for_diagonals_mm": (22.5,)},
         "image_circle_mm must be at least 22.5 for a sensor .* got 17.6"),
        (ListedLens, LENS, {"depth_of_field_mm": 0.2}, "depth_of_field_mm must be at least 0.6.* got 0.2"),
        (ListedLens, LENS, {"resolution_um": 2.0}, "resolution_um must be .* got 2"),
        (ListedLens, LENS, {"f_number_max": 4.0}, "f_number must be at most f_number_max 4, got 6"),
        (ListedLens, LENS, {"focal_length_mm": 25.0}, "focal_length_mm must be left out of a bi-telecentric lens"),
        (ListedLens, LENS, {"format": '5/3"'}, "format must be one of"),
        (ListedLight, RING, {"inner_diameter_mm": 120.0}, "inner_diameter_mm must be less than 100"),
        (ListedLight, RING, {"irradiance": 10.0}, "at_distance_mm must be given"),
        (ListedLight, RING, {"radiance": 10.0, "luminance": 9000.0}, "luminance must be .* by radiance and 625 nm"),
        (ListedLight, RING, {"working_distance_mm": (300.0, 100.0)}, "working_distance_mm must rise"),
    ],
)  # fmt: skip
def test_contradictions_have_their_numbers(kind: type, good: dict, wrong: dict, text: str) -> None:
    assert not kind.model_validate(good).contradictions()
    found = kind.model_validate({**good, **wrong}).contradictions()
    assert len(found) == 1
    with pytest.raises(AssertionError, match=text):
        raise AssertionError(found[0].text)


def test_a_name_stands_once() -> None:
    found = Catalogue(sensors=(ListedSensor(**SENSOR), ListedSensor(**SENSOR))).contradictions()
    assert [each.text for each in found] == ["name must be of one entry, got 2 of it"]


def test_toml_and_csv_say_the_same(tmp_path) -> None:
    toml, table = tmp_path / "parts.toml", tmp_path / "parts.csv"
    toml.write_text(
        '[[sensors]]\nname = "S"\nresolution = [640, 480]\nmount = ["C", "CS"]\ncolour = true\n'
        '[[lights]]\nname = "B"\nkind = "backlight"\nsize_mm = [50, 100]\nprice = 90.5\n'
    )
    table.write_text(
        "table,name,resolution,mount,colour,kind,size_mm,price\n"
        "sensors,S,640 x 480,C;CS,true,,,\nlights,B,,,,backlight,50x100,90.5\n"
    )
    assert load(toml).model_dump() == load(table).model_dump()


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ('[[sensors]]\nname = "S"\npitch = 3', r'sensors\[0\] "S": pitch must be a known key, got 3'),
        ('[[lenses]]\nname = "L"\nkind = "fisheye"', r'lenses\[0\] "L": kind must be one of'),
        ('[[lights]]\nkind = "ring"', r"lights\[0\]: name must be given, got nothing"),
        ("sensors = 3", "sensors must be a list of at most 100000 tables, got 3"),
        ('title = "none"', "must have sensors, lenses or lights, got none"),
        ('[[sensors]]\nname = "S"\nbits = -1', r"bits must be at least 0, got -1"),
    ],
)
def test_errors_name_file_entry_and_key(tmp_path, text: str, match: str) -> None:
    path = tmp_path / "parts.toml"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=match) as caught:
        load(path)
    assert str(path) in str(caught.value)


def test_emva_1288_results_fill_in_what_is_not_given(tmp_path) -> None:
    group = "".join(
        f"<{name}><Short>x</Short><Value>{value}</Value><Unit></Unit></{name}>"
        for name, value in (("u_e_sat", 14000), ("sigma_d", 6.5), ("QE", 45.0), ("K", 0.28), ("PRNU1288", 0.5))
    )
    (tmp_path / "result.xml").write_text(f"<results><sensitivity>{group}</sensitivity></results>")
    (tmp_path / "parts.toml").write_text('[[sensors]]\nname = "S"\nemva1288 = "result.xml"\nsystem_gain_e = 0.3\n')
    found = load(tmp_path / "parts.toml").sensors[0]
    assert (found.saturation_capacity_e, found.temporal_dark_noise_e, found.prnu_percent) == (14000, 6.5, 0.5)
    assert (found.quantum_efficiency, found.system_gain_e) == (pytest.approx(0.45), 0.3)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ('<!DOCTYPE r [<!ENTITY a "b">]><r>&a;</r>', "without declarations of entities"),
        ("<r><Value>", "must be valid XML"),
        ("<r/>", "must hold results of EMVA 1288"),
        ("<r><QE><Value>half</Value></QE></r>", "QE must be a number, got 'half'"),
        ("<a>" * 20, "at most 8 elements deep"),
    ],
)
def test_hostile_results_are_refused(tmp_path, text: str, match: str) -> None:
    path = tmp_path / "result.xml"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=match):
        emva1288.read(path)


def test_brightness_is_the_same_in_every_unit() -> None:
    """A Lambertian ring of radiance L gives pi L d^2 (1 / (d^2 + a^2) - 1 / (d^2 + b^2)) on its axis."""
    distance, per_watt = 150.0, efficacy(625.0)
    inside, outside = (distance**2 / (distance**2 + radius**2) for radius in (30.0, 50.0))
    wanted = math.pi * 80.0 * (inside - outside)
    area = math.pi * (50.0**2 - 30.0**2) * 1e-6
    for stated in (
        {"radiance": 80.0}, {"luminance": 80.0 * per_watt}, {"radiant_power": 80.0 * math.pi * area},
        {"irradiance": wanted, "at_distance_mm": distance},
        {"illuminance": wanted * per_watt, "at_distance_mm": distance},
        {"irradiance": 80.0 * math.pi, "at_distance_mm": 0.0},
    ):  # fmt: skip
        assert ListedLight(**RING, **stated).irradiance_at(distance) == pytest.approx(wanted, rel=1e-6)
    assert ListedLight(**RING).irradiance_at(distance) is None


def test_photometry() -> None:
    assert efficacy(555.0) == pytest.approx(683.0, abs=6.83)  # the fit is within 1 % of the peak
    assert efficacy(625.0) == pytest.approx(683.0 * 0.321, abs=6.83)  # CIE 1924: V(625 nm) = 0.321
    assert photons_per_joule(500.0) == pytest.approx(2.517e18, rel=1e-3)


def test_an_mtf_is_a_blur() -> None:
    """A Gaussian of 3 um has the contrast exp(-2 pi^2 sigma^2 f^2) at 50 line pairs a millimetre."""
    contrast = float(np.exp(-2 * np.pi**2 * 0.003**2 * 50**2))
    lens = ListedLens(name="L", kind="entocentric", focal_length_mm=25.0, f_number=2.0, mtf=((50.0, contrast),))
    assert lens.aberrations_um(500.0, 1e-6) == pytest.approx(3.0, rel=1e-9)
    assert lens.aberrations_um(500.0, 2.0) < 3.0


def test_the_page_tells_of_every_key() -> None:
    page = (Path(__file__).parents[2] / "docs" / "catalogue.md").read_text()
    for kind in (ListedSensor, ListedLens, ListedLight):
        section = page.split(f"## `[[{kind.table}]]`")[1].split("\n## ")[0]
        told = re.findall(r"^\| `(\w+)`\*? \|", section, re.M)
        assert sorted(told) == sorted(kind.model_fields)


def test_binning_of_charge_and_of_digital_numbers_makes_the_sensor_that_it_is(rng) -> None:
    """Sums of 2 x 2 pixels of 12 e-, 0.25 grey levels an electron, drawn: their noise in darkness and in light."""
    gain, dark, full = 0.25, 12.0, 10400.0
    wide = SENSOR | {"temporal_dark_noise_e": dark, "absolute_sensitivity_threshold_e": None, "dynamic_range_db": None}
    kinds = [{"kind": "charge"}, {"kind": "sum"}, {"kind": "mean"}]
    sensor = ListedSensor(**wide, system_gain_e=gain, dsnu_e=1.0, prnu_percent=0.4, binning=kinds)
    itself, charge, summed, mean = sensor.modes
    assert itself is sensor
    for each in (charge, summed, mean):
        assert each.resolution == (1224, 1024)
        assert each.size_mm == pytest.approx(sensor.size_mm)
        assert each.pixel_pitch_um == 6.9
        assert (each.dsnu_e, each.prnu_percent) == (2.0, 0.2)
    assert (charge.temporal_dark_noise_e, charge.saturation_capacity_e, charge.bits) == (dark, full, 12)
    assert (summed.saturation_capacity_e, summed.bits, summed.system_gain_e) == (4 * full, 14, gain)
    assert (mean.saturation_capacity_e, mean.bits, mean.system_gain_e) == (4 * full, 12, gain / 4)
    for mode, made in ((summed, lambda levels: levels.sum(-1)), (mean, lambda levels: np.rint(levels.mean(-1)))):
        drawn = made(np.rint(100.3 + gain * dark * rng.standard_normal((40_000, 4))))
        told = (mode.system_gain_e * mode.temporal_dark_noise_e) ** 2 + (1 / 12 if mode is not mean else 0.0)
        told = told if mode is not mean else told + 1 / 12
        assert drawn.var() == pytest.approx(told, rel=4 * math.sqrt(2 / 40_000))
        assert drawn.var() != pytest.approx(1.1 * told, rel=4 * math.sqrt(2 / 40_000))


def test_a_colour_sensor_is_planned_with_by_its_efficiencies() -> None:
    plain = ListedSensor(**SENSOR, colour=True)
    told = ListedSensor(**SENSOR, colour="RGGB", quantum_efficiency_rgb=(0.3, 0.6, 0.45))
    assert plain.filters is None
    assert told.filters.response == (0.5, 1.0, 0.75)
    assert told.best_efficiency == 0.6
    wrong = ListedSensor(**SENSOR, colour=True, quantum_efficiency_rgb=(0.3, 0.6, 0.45), binning=[{"kind": "sum"}])
    texts = [each.text for each in wrong.contradictions()]
    assert any(re.match(r"colour must be a pattern .* got True", text) for text in texts)
    assert any(re.match(r"binning must be of a monochrome sensor, got one with colour filters", text) for text in texts)
