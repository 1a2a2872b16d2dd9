"""The scripts of `examples/`, with small settings, and the library example of the README."""

import sys

import pytest

from tests.docs.pages import ROOT, blocks

pytestmark = pytest.mark.render


@pytest.fixture
def example(monkeypatch):
    """Import a script of the folder by its name."""
    import importlib.util

    def load(name):
        spec = importlib.util.spec_from_file_location(f"example_{name}", ROOT / "examples" / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, spec.name, module)
        spec.loader.exec_module(module)
        return module

    return load


def test_predict_and_plan(example, capsys):
    now, best = example("predict_and_plan").main(step_deg=20)
    # margin: the order is what is said: the plan is better than where one stands
    assert best.prediction.variance_object < now.variance_object
    assert "distance         sigma 0.00" in capsys.readouterr().out


def test_render_and_compare(example):
    """The seed's interval holds 1; a variance 1.3 times too large would not be held by it."""
    ratio, (low, high) = example("render_and_compare").main(count=500)
    assert low < ratio < high
    assert low < 1 < high  # margin: an interval of 95 % of one seeded run; of the same images each time
    assert not low < 1.3 < high  # margin: 4.7 standard errors of 500 images from 1


def test_uncertainty_budget(example, capsys):
    bore = example("uncertainty_budget").main()
    assert sum(row.share for row in bore.contributions) == pytest.approx(1)
    largest = max(bore.contributions, key=lambda row: row.share)
    assert f"halving {largest.source}" in capsys.readouterr().out


def test_height_error(example):
    """Through a pinhole 11.7 mm x 2 mm over the depth of the rims, as they are told (first order) and as they are."""
    found = example("height_error").main(supersample=2)
    for told, seen in (found["telecentric"], found["telecentricity 0.1 degrees"]):
        assert seen == pytest.approx(told, abs=2e-4)
    assert found["telecentric"][0] < 1e-6
    assert found["telecentricity 0.1 degrees"][0] == pytest.approx(2.48e-3, rel=0.01)
    told, seen = found["pinhole"]
    assert told == pytest.approx(11.7047 * 2 / 108.5, rel=1e-3)
    assert seen == pytest.approx(11.7047 * 2 / 106.5, rel=0.01)


def test_colour_sensor(example):
    """As planned, and through the linear filter; a red lamp is seen by every fourth pixel: sigma x 2 at most."""
    found = example("colour_sensor").main(supersample=2)
    assert found["monochrome"] == (1.0, 1.0)
    for planned, propagated in found.values():
        assert planned == pytest.approx(propagated, rel=0.05)
    assert found["white light, raw mosaic"][0] == pytest.approx(1.31, abs=0.02)
    assert found["red lamp, red pixels"][1] == pytest.approx(1.73, abs=0.05)
    assert found["red lamp, raw mosaic"][1] == pytest.approx(4.2, abs=0.1)


def test_every_example_is_tested():
    names = {path.stem for path in (ROOT / "examples").glob("*.py")}
    assert names == {"colour_sensor", "height_error", "predict_and_plan", "render_and_compare", "uncertainty_budget"}


def test_the_readmes_library_example(capsys):
    (block,) = (block for block in blocks(ROOT / "README.md") if "planner.predict(scene, sensor" in block.text)
    exec(compile(block.text, "README.md", "exec"), {})
    assert "ok" in capsys.readouterr().out
