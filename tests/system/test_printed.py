"""Names and titles are printed and drawn as they are, on whatever stream; who waits is told so."""

import io
import subprocess
import sys

import pytest

from scenes.load import BUNDLED
from tests.hard.fuzzing.uncertainties import printed
from validation.cli import common

ODD = "d [mm] [/x] [red] :smile: \u2603 \\ $\\foo$ {0} %s"


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    """A scene whose title and measurand have an odd name."""
    text = (BUNDLED / "calibrated_rig.toml").read_text().replace('"diagonal"', f"'{ODD}'")
    path = tmp_path_factory.mktemp("odd") / "odd.toml"
    path.write_text(text.replace('"The block', f"'{ODD}' # "))
    return path


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
@pytest.mark.parametrize("command", ["predict", "budget"])
def test_names_are_no_markup_and_need_no_letters(command, encoding, odd):
    status, out, err = printed([command, str(odd)], io.TextIOWrapper(io.BytesIO(), encoding))
    assert (status, err) == (0, "")
    assert (ODD if encoding == "utf-8" else ODD.replace("\u2603", "\\u2603")) in out


def test_names_are_no_formulas_in_pictures(odd, tmp_path):
    status, _, err = printed(["budget", str(odd), "--out", str(tmp_path)], io.TextIOWrapper(io.BytesIO(), "utf-8"))
    assert (status, err) == (0, "")
    assert (tmp_path / "budget.png").stat().st_size > 10_000


def test_a_closed_output_is_nobody_to_print_to(odd):
    assert printed(["predict", str(odd)], None) == (0, "", "")


@pytest.mark.parametrize(("asked", "status"), [("--version >&-", 0), ("nosuch >&- 2>&- <&-", 2)])
def test_closed_streams_of_a_process(asked, status):
    command = f'exec "{sys.executable}" -m validation.cli {asked}'
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, timeout=60)
    assert done.returncode == status
    assert done.stdout == ""
    assert "Traceback" not in done.stderr


def test_who_waits_for_the_first_step_is_told_in_the_first_second(monkeypatch, capsys):
    """And then every three seconds what is done; what is over before is not told of."""
    with common.progress("part.stl", "steps", at_once=True):
        pass
    now = [0.0]
    monkeypatch.setattr(common.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(common.threading, "Timer", _Over)
    with common.progress("part.stl", "steps", at_once=True) as shown:
        assert capsys.readouterr().err == "part.stl ...\n"
        for second in range(8):
            now[0] = float(second)
            shown("reading", second, 9)
    assert capsys.readouterr().err == "part.stl: reading, 3 of 9 steps\npart.stl: reading, 6 of 9 steps\n"


class _Over:
    """A timer whose time is over at once, if it is less than a second."""

    def __init__(self, seconds, tell):
        self.start = tell if seconds < 1 else list

    def cancel(self):
        pass
