"""``ice calibrate-camera`` from pictures to the files that other commands read."""

import json

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import measure
import planner
import scenes
from scenes.load import BUNDLED
from tests.boards import SMALL, poses
from validation.cli.application import app
from validation.cli.main import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Five boards, one of them twice as bright, a picture of nothing and a file that is none."""
    made, rng = tmp_path_factory.mktemp("boards"), np.random.default_rng(11)
    for i, pose in enumerate(poses(SMALL, 5, rng, 420.0)):
        image = SMALL.image(pose, 4) + rng.normal(0, 2, SMALL.size[::-1])
        cv2.imwrite(str(made / f"{i}.png"), np.clip(np.rint(image), 0, 255).astype(np.uint8))
    cv2.imwrite(str(made / "nothing.png"), np.full(SMALL.size[::-1], 99, np.uint8))
    (made / "broken.png").write_bytes(b"no image")
    return made


def files(folder):
    return sorted(map(str, folder.glob("*.png")))


def refused(monkeypatch, capsys, *arguments):
    """Exit status and the one line."""
    monkeypatch.setattr("sys.argv", ["ice", "calibrate-camera", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    lines = capsys.readouterr().err.strip().splitlines()
    return ended.value.code, lines[-1]


def test_from_pictures_to_a_lens_and_a_budget(folder, tmp_path):
    scene = tmp_path / "scene.toml"
    text = (BUNDLED / "task1.toml").read_text()
    scene.write_text(text.replace("width = 256", "width = 320"))
    out, picture = tmp_path / "lens.toml", tmp_path / "residuals.png"
    done = CliRunner().invoke(app, [
        "calibrate-camera", *files(folder), "--square", "25", "--model", "k1,k2,p1,p2", "-o", str(out),
        "--scene", str(scene), "--residuals", str(picture), "--next", "distance", "--json",
    ])  # fmt: skip
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    away = (np.array(told["values"]) - SMALL.values[:8]) / told["sd"]
    assert np.abs(away).max() < 4  # margin: 4 standard deviations
    assert told["status"] == "ok"
    assert 0 < told["next"]["U_then"] < told["next"]["U"]
    assert [len(told["boards"]), len(told["left_out"])] == [5, 2]
    assert all("must" in each["reason"] for each in told["left_out"])
    assert "nothing.png" in done.stderr
    assert measure.load_lens(out).fx == told["lens"]["fx"]
    assert picture.stat().st_size > 10_000

    lines = told["scene"].split("\n\n")
    focal, lens = lines[0].splitlines()[1:3]
    kept = [line for line in scene.read_text().splitlines() if not line.startswith("focal_px")]
    at = kept.index(next(line for line in kept if line.startswith("[camera]")))
    scene.write_text("\n".join([*kept[: at + 1], focal, lens, *kept[at + 1 :], lines[1]]))
    calibrated = scenes.load(scene)
    assert calibrated.camera.focal_px == pytest.approx(np.sqrt(told["values"][0] * told["values"][1]))
    assert calibrated.uncertainty.covariance.sd == pytest.approx(told["sd"])
    rows = planner.budget(calibrated, (30, 135), (15, 315)).measurands[0].contributions
    assert any("calibration" in row.source and row.contribution > 0 for row in rows)


def test_what_cannot_be_is_one_line(folder, monkeypatch, capsys, tmp_path):
    some = files(folder)
    assert refused(monkeypatch, capsys, *some[:2], "--square", 25) == (
        2, "BOARD must be 3 to 1000 photographs, got 2"
    )  # fmt: skip
    status, line = refused(monkeypatch, capsys, some[0], *some[-2:], "--square", 25)
    assert (status, line.startswith("BOARD must be at least 3 photographs that show the board, got 1 of 3;")) == (
        2,
        True,
    )
    assert refused(monkeypatch, capsys, *some, "--square", 25, "--shape", "9-6")[1].startswith(
        "--shape must be columns"
    )
    assert refused(monkeypatch, capsys, *some, "--square", 0)[1] == "--square must be at least 1e-09, got 0.0"
    assert refused(monkeypatch, capsys, *some, "--square", 25, "--units", "ell")[0] == 2
    assert refused(monkeypatch, capsys, *some, "--square", 25, "--model", "k4")[1].startswith(
        "model must be none, splined, or"
    )
    assert refused(monkeypatch, capsys, *some[:3], "--square", 25, "--next", "distance")[1].endswith(
        "--next must be used with --scene, got 'distance' alone"
    )
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((60, 80), np.uint8))
    assert (
        "must be 320 x 240 px"
        in refused(monkeypatch, capsys, some[0], tmp_path / "small.png", some[1], "--square", 25)[1]
    )
    assert refused(monkeypatch, capsys, *some[:3], "--square", 25, "--scene", "task1")[1].endswith(
        "must be 256 x 240 px as task1, got 320 x 240"
    )
