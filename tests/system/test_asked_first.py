"""What a command would refuse after its work is refused before it."""

import pytest

import measure
import planner
import scenes.photograph
from tests.commands import ice
from validation.batch.store import RunFile
from validation.report import export


def _work(*_, **__):
    raise AssertionError("work must not begin")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ("measure a.png --mtf a.jpg", "--mtf must end in .png, got 'a.jpg'"),
        ("measure a.png --mtf no/a.png", "--mtf must be a writable file, got no/a.png (no such directory)"),
        ("measure a.png --mtf a.png --kind circle", "--kind must hold quadrilateral or tag with --mtf, got circle"),
        ("measure a.png -o a.gif", "--output must end in .png, .pdf, .svg, got 'a.gif'"),
        ("measure a.png --estimator nobody", "--estimator must be one of canny, gradient,"),
        ("plan two_lights --tolerance noise=0.1", "tolerances must be left out but for one light that is free, got 2"),
        ("plan task1 --map no/a.png", "--map must be a writable file, got no/a.png (no such directory)"),
        ("calibrate-camera a.png a.png a.png --square 25 --scene nosuch", "scene must be a TOML file or one of"),
        ("report . --parquet", "--parquet must be used with the extra 'parquet' installed, got no package pyarrow"),
        ("cost task1 --budget soon", "--budget must be a duration as 60s, 2min or 1h, got 'soon'"),
    ],
)
def test_options_are_looked_at_before_the_work(arguments, line, tmp_path, monkeypatch):
    monkeypatch.setattr(scenes.photograph, "read", _work)
    monkeypatch.setattr(planner, "plan", _work)
    monkeypatch.setattr(measure, "chessboard", _work)
    monkeypatch.setattr(RunFile, "reopen", _work)
    monkeypatch.setattr(export, "find_spec", lambda _: None)
    done = ice(*arguments.split(), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(line)
    assert done.stderr.count("\n") == 1
