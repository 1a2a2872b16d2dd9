"""Pages of stations as they are met, in a browser: many requirements, many settings, a long campaign."""

import pytest

import scenes
import validation
from render import Quality
from tests.looking import NOTHING, WIDTHS, against_wcag, looked_at, lowest, needs_a_browser
from tests.parts import newcomers
from tests.proofs.large import fabricate
from validation.cli.main import app

pytestmark = [pytest.mark.render, needs_a_browser]

_RENDERS = 60
_QUICK = Quality(supersample=2, edge_samples=16, random_samples=16)
_LARGEST = 3_000_000  # bytes of a page


def write(name, folder):
    """Make a run and its page; the page."""
    if name == "campaign":
        fabricate(2000, folder)
    else:
        scene = newcomers(folder) if name == "newcomer" else scenes.load(name)
        scene = scene.with_(camera={"pixel_pitch_um": 4 * 3.45}) if name == "bracket_mm" else scene
        validation.run(scene, renders=_RENDERS, seed=1, out=folder, workers=1, quality=_QUICK)
    with pytest.raises(SystemExit) as ended:
        app(["report", str(folder)])
    assert ended.value.code == 0
    return folder / "report.html"


@pytest.fixture(scope="module", params=["bracket_mm", "newcomer", "task1", "campaign"])
def page(request, tmp_path_factory):
    return write(request.param, tmp_path_factory.mktemp(request.param))


def test_nothing_is_cut_off_covered_faint_or_against_wcag(page):
    """Labels, tables and text at the width of a telephone, a tablet and a window, folded and opened; axe-core. All
    requirements, ten at most, are seen without scrolling in a window of 1280 x 900 px."""
    for width in WIDTHS:
        first, opened, errors = looked_at(page, width)
        assert errors == []
        assert first == opened == NOTHING, width
    assert against_wcag(page) == []
    assert page.stat().st_size < _LARGEST
    assert 0 < lowest(page, ".requirements tbody tr", 1280) <= 900
