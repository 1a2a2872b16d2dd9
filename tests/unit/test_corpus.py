"""The table of `python -m tests.proofs corpus`, and what it asks of each part."""

from pathlib import Path

from tests.proofs import corpus
from validation.cli.common import MOST_SEED


def measured(part, *values):
    """A row of the log: (name, status, value, sigma, u_bias) of each value, all of 1 mm."""
    keys = "name", "status", "value", "sigma", "u_bias"
    rows = [dict(zip(keys, each, strict=True), nominal=1.0) for each in values]
    step = {"command": "measure", "status": 0, "seconds": 1.0, "mebibytes": 1.0, "told": "", "rows": rows}
    return {"part": part, "steps": [step]}


def test_errors_are_told_in_u_of_what_is_ok():
    """1.2 u and -1.6 u by sigma and u(bias) of 3 and 4 um or sigma alone; what is not ok does not count: rms 2^0.5."""
    rows = [
        measured("lid", ("width", "ok", 1.006, 0.003, 0.004), ("length", "clutter", 2.0, 0.001, 0.001)),
        measured("knob", ("bore", "ok", 0.992, 0.005, None)),
    ]
    told = corpus.table(rows).splitlines()[-1]
    assert told == "2 values ok: errors of 1.41 u (rms), -1.6 u at most (knob, bore)"


def test_each_part_has_noise_of_its_own(tmp_path, monkeypatch):
    """A rare draw of noise is in the picture of one part alone; the same part has the same one again."""

    def seed(part):
        asked = {}

        def run(_, command, *arguments):
            asked[command] = list(arguments)
            planned = {"sensor": [1.0, 2.0], "light": [3.0, 4.0], "measurands": []}
            facts = {"new": {"measurands": [{"status": "ok"}]}, "plan": planned}
            return corpus.Step(command, 0, 0.0, 0.0, ""), facts.get(command, {})

        monkeypatch.setattr(corpus, "run", run)
        list(corpus._upto("measure", corpus.steps(Path(part), tmp_path, corpus.Asked())))
        return asked["render"][asked["render"].index("--noise-seed") + 1]

    seeds = [seed(part) for part in ("a/lid.stl", "a/knob.stl", "b/lid.stl")]
    assert seeds[0] == seeds[2] != seeds[1]
    assert all(0 <= each <= MOST_SEED for each in seeds)
