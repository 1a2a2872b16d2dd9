"""The report as its reader meets it: in a browser, on a phone, as text."""

import base64
import csv
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import cv2
import numpy as np
import pytest

import scenes
import validation
from validation.batch.campaign import Campaign
from validation.cli.main import app

pytestmark = pytest.mark.render

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--enable-logging=stderr",
]  # fmt: skip


class Page(HTMLParser):
    """What a reader without eyes gets: the verdict's text, pictures with their alternatives, outside addresses."""

    def __init__(self, text):
        super().__init__()
        self.verdict, self.pictures, self.outside, self._inside = "", [], [], False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self._inside = given.get("id") == "verdict"
        if tag == "img":
            self.pictures.append(given)
        self.outside += [v for k in ("src", "href") if (v := given.get(k)) and not v.startswith("data:")]

    def handle_endtag(self, tag):
        self._inside = False

    def handle_data(self, data):
        self.verdict += data if self._inside else ""


@pytest.fixture(scope="module")
def campaign(small_toml):
    """Two settings under two kinds of noise, one of them named so that it would break a careless page."""
    small = scenes.load(small_toml)
    scene = small.model_copy(update={"title": 'a < b & "c" | d', "settings": small.settings[:2]})
    return Campaign(name="sweep", title=scene.title, scenes=(scene,), sweep={"noise.sigma": (2.4, 4.8)})


@pytest.fixture(scope="module")
def found(campaign, tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    return validation.run(campaign, renders=250, seed=1, out=out, workers=1), out


@pytest.fixture(scope="module")
def page(found):
    with pytest.raises(SystemExit) as ended:
        app(["report", str(found[1])])
    assert ended.value.code == 0
    return found[1] / "report.html"


def test_verdict_pictures_and_no_network(found, page):
    read = Page(page.read_text())
    assert read.verdict == found[0].verdict.text
    assert read.outside == []
    assert len(read.pictures) == 4 + 2 * 4  # four plots; images and edges of two sensors under two kinds of noise
    for picture in read.pictures:
        assert len(picture["alt"]) > 20
        data = base64.b64decode(picture["src"].removeprefix("data:image/png;base64,"))
        assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).size > 0


def test_table_has_the_numbers_of_the_run(found, page):
    text = page.read_text()
    for row in found[0].rows:
        assert f"{row.main.ratio:.3f} [{row.main.ratio_interval[0]:.3f}, " in text
    assert "a &lt; b &amp; &#34;c&#34; | d" in text


def test_markdown_has_the_same_tables(found, page):
    lines = page.with_suffix(".md").read_text().splitlines()
    assert f"**{found[0].verdict.text}**" in lines
    rows = [line for line in lines if re.match(r"\| [1-4] \| (2.4|4.8) \|", line)]
    assert len(rows) == 3 * 4
    widths = {line.count("|") for line in lines if line.startswith("|")}
    assert max(widths) > 8


def test_csv_and_parquet_hold_every_setting(found, page):
    with (page.parent / "table.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert [float(line["gradient_empirical"]) for line in lines] == [row.main.empirical for row in found[0].rows]
    assert [float(line["noise.sigma"]) for line in lines] == [2.4, 2.4, 4.8, 4.8]
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra 'parquet' is not installed")
    with pytest.raises(SystemExit):
        app(["report", str(found[1]), "--parquet"])
    table = parquet.read_table(page.parent / "table.parquet")
    assert table["gradient_empirical"].to_pylist() == [row.main.empirical for row in found[0].rows]


def browse(tmp_path, page, width, *flags):
    command = [CHROMIUM, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900", *flags]
    return subprocess.run([*command, page.as_uri()], capture_output=True, text=True, timeout=60)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_in_a_browser(found, page, tmp_path):
    """Screenshot at a phone's width; no message on the console; the verdict from the rendered page; nothing cut off."""
    probe = tmp_path / "probe.html"
    script = "<script>document.title = [document.documentElement.scrollWidth, innerWidth, document.images.length, "
    script += "[...document.images].filter(i => i.naturalWidth > 0).length]</script>"
    probe.write_text(page.read_text().replace("</body>", script + "</body>"))
    shot = browse(tmp_path, page, 500, f"--screenshot={tmp_path / 'page.png'}")
    assert "CONSOLE" not in shot.stderr
    picture = cv2.imread(str(tmp_path / "page.png"))
    assert picture.shape[1] == 500
    assert picture.std() > 10
    dom = browse(tmp_path, probe, 500, "--dump-dom")
    width, inner, images, loaded = map(int, re.search("<title>([0-9,]+)</title>", dom.stdout)[1].split(","))
    assert width <= inner <= 500
    assert images == loaded == 12
    assert Page(dom.stdout).verdict == found[0].verdict.text


LOOK = """
const d = this.contentDocument, wide = d.documentElement.clientWidth;
const free = [...d.body.querySelectorAll('*')].filter(e => !e.closest('.wide') || e.matches('.wide'));
const boxes = [...d.querySelectorAll('.wide')];
const size = e => parseFloat(d.defaultView.getComputedStyle(e).fontSize);
document.title = [
  d.documentElement.scrollWidth, wide,
  free.filter(e => e.getBoundingClientRect().right > wide + 0.5).length,
  [...d.body.querySelectorAll('*')].filter(e => e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0
    && d.defaultView.getComputedStyle(e).overflowX != 'auto').length,
  boxes.filter(e => !(e.nextElementSibling?.textContent.length > 40)).length,
  [...d.querySelectorAll('.name')].filter(e => e.offsetHeight > 2 * size(e) && e.offsetWidth < wide / 3).length,
  boxes.length,
]
"""


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("broken", [False, True])
def test_nothing_is_cut_off(page, tmp_path, width, broken):
    """In a frame, for no window is as narrow as a phone: wide tables scroll in their own box, all else fits.

    The negative control has a line that fits nowhere.
    """
    text = page.read_text()
    bad = '<p style="white-space: nowrap">' + 300 * "wide " + "</p></main>"
    (tmp_path / "page.html").write_text(text.replace("</main>", bad) if broken else text)
    frame = (
        f"<title></title><iframe src='page.html' width={width} height=800 style='border:0' onload=\"{LOOK}\"></iframe>"
    )
    (tmp_path / "frame.html").write_text(frame)
    dom = browse(tmp_path, tmp_path / "frame.html", 1400, "--allow-file-access-from-files", "--dump-dom")
    found = list(map(int, re.search("<title>([0-9,]+)</title>", dom.stdout)[1].split(",")))
    whole, window, outside, clipped, unexplained, split, tables = found
    assert window <= width
    assert (whole <= window and not clipped) == (not broken)
    assert (outside, unexplained, split) == (0, 0, 0) or broken
    assert tables >= 5


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_the_console_check_sees_an_error(tmp_path):
    """Negative control."""
    bad = tmp_path / "bad.html"
    bad.write_text("<script>console.error('wrong')</script>")
    assert "CONSOLE" in browse(tmp_path, bad, 500, "--dump-dom").stderr


def test_report_as_json(found, capsys):
    with pytest.raises(SystemExit):
        app(["report", str(found[1]), "--json"])
    document = json.loads(capsys.readouterr().out)
    assert document["verdict"] == found[0].verdict.text
    assert len(document["files"]) == 4


def test_not_a_run_directory(tmp_path):
    with pytest.raises(scenes.InvalidInput, match="DIR must be a run directory of `ice validate`, got"):
        app(["report", str(tmp_path)], standalone_mode=False)
