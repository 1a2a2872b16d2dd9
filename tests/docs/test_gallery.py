"""The gallery: every bundled scene with its picture, made by `python -m validation.report.gallery docs`."""

import re

import pytest

import scenes
from tests.docs.pages import DOCS
from validation.report import gallery, station

_ENTRY = re.compile(r"^## (\w+)\n.*?^\*\*.*?\*\* (.*?)$", re.M | re.S)  # its name, and how well it is measured
_NUMBER = re.compile(r"[0-9.]*[0-9]")


def stored():
    """By a scene's name how well the page says that it is measured."""
    return dict(_ENTRY.findall((DOCS / "gallery.md").read_text()))


def texts(drawing):
    """What is written in a picture, in its order."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", drawing)


def test_every_bundled_scene_has_its_place_and_its_picture():
    page = (DOCS / "gallery.md").read_text()
    assert re.findall(r"^## (\w+)$", page, re.M) == list(scenes.names()) == sorted(gallery.TEACHES)
    for name in scenes.names():
        scene, drawing = scenes.load(name), (DOCS / "gallery" / f"{name}.svg").read_text()
        assert f"{scene.title}." in page
        assert texts(drawing) == [str(k + 1) for k in range(len(scene.quantities))]


@pytest.mark.render
@pytest.mark.parametrize("name", scenes.names())
def test_an_entry_says_what_the_program_says(name):
    """Its words, and its numbers to the noise of a simulation, which is another on other processors."""
    said, made = stored()[name], gallery.told(scenes.load(name))
    assert _NUMBER.sub("#", said) == _NUMBER.sub("#", made)
    assert [float(each) for each in _NUMBER.findall(said)] == pytest.approx(
        [float(each) for each in _NUMBER.findall(made)], rel=0.1
    )


def test_the_page_is_up_to_date():
    assert (DOCS / "gallery.md").read_text() == gallery.page(lambda scene: stored()[scene.name])


@pytest.mark.render
def test_the_command_renders_a_scene_with_its_requirements(tmp_path):
    drawing = gallery.image(scenes.load("task1_part1"), tmp_path)
    stored = (DOCS / "gallery" / "task1_part1.svg").read_text()
    assert drawing.name == "task1_part1.svg"
    assert texts(drawing.read_text()) == texts(stored) == ["1"]
    assert abs(len(stored) - drawing.stat().st_size) < 0.2 * len(stored)  # margin: the picture's noise by the machine


@pytest.mark.parametrize("name", [name for name in scenes.names() if name not in ("bracket_station", "flange")])
def test_a_station_of_every_scene_can_be_drawn(name):
    """Lines, rims, limbs, lights of all kinds: nothing is left out."""
    from validation.report import page

    scene = scenes.load(name)
    picture = scenes.Picture.of(scene, scene.settings[0].sensor, scene.settings[0].lights)
    drawn = page.first_screen(station.of_picture(picture))
    assert len(texts(drawn["view"])) == len(scene.quantities)
    assert "camera" in texts(drawn["sketch"])
