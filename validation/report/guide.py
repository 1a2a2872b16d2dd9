"""What a run's tables say to a reader who sees them for the first time: their terms, and what to do next."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from scenes.status import MEANINGS, is_trusted, legend
from validation.batch.result import Validation
from validation.batch.rows import Row
from validation.report.cells import pose
from validation.statistics import LEVEL, Verdict

if TYPE_CHECKING:
    from validation.report.station import Station

_LOCATORS = {
    "gradient": "zero of the second derivative",
    "canny": "the classic pipeline, @ its threshold",
    "isophote": "where the smoothed image takes the mean of both sides' levels",
    "strip": "maximum likelihood along each edge",
    "arrangement": "maximum likelihood of all faces around the edges together",
}


def paper_terms(found: Validation) -> list[str]:
    """The columns of what the paper printed, one line each."""
    lines = []
    if found.overview.prints_predictions:
        lines.append(
            "paper ICE: variance predicted by the paper, px^2. ours ICE: its formula, with one free scale for all rows."
        )
    if found.overview.prints_measurements:
        lines.append(
            "paper real 12.0, 10.0: variance of the paper's photographs, px^2, by edge threshold. - : it prints none."
        )
    return lines


def variance_terms(methods: Iterable[str], images: int) -> list[str]:
    """The columns of predicted and measured variances, one line each."""
    return [
        "calibrated: predicted without any image. propagated: predicted from one noise-free picture. 1e-4 px^2 each.",
        f"measured: variance over {images} noisy pictures, 1e-4 px^2. {_locators(methods)}.",
        "Cramer-Rao bound: what no unbiased measurement of the picture can go below, 1e-4 px^2.",
    ]


def _locators(methods: Iterable[str]) -> str:
    known = dict.fromkeys(name.split("@")[0] for name in methods)
    return ". ".join(f"{name}: {_LOCATORS[name]}" for name in known if name in _LOCATORS)


def statuses(found: Iterable[str], reasons: Mapping[str, str]) -> list[str]:
    """What each status means that is not trusted, what decided it by ``reasons`` where they know it, and what to do."""
    states = list(found)
    return legend(states, (reasons.get(state, "") for state in states))


def ratio_terms(main: str, methods: int) -> list[str]:
    """The columns of ratios and errors, one line each."""
    none = " ".join(["0"] * methods)
    return [
        "* : 1 lies outside the interval, as it does by chance in one row of 20.",
        f'n: noisy pictures. failed: those without a value, one number a method ("{none}": none).' if methods > 1 else
        "n: noisy pictures. failed: those without a value.",
        "bias: what a simulation told and was taken off, and the mean error that is left; of photographs, what is",
        "predicted, and measured. rmse: root mean square error of what is left, sqrt(variance + bias^2).",
        f"The verdict is about {main}, as are bias and rmse.",
    ]  # fmt: skip


def unit_terms(judged: bool) -> list[str]:
    """The columns of the table in the scene's unit, one line each; ``judged``: whether the verdict is about them."""
    which = "all are judged" if judged else "that of the image is judged"
    return [
        "value: of the object itself. sigma: standard deviation of one picture's; compare it with your tolerance.",
        f"ratio: of variances, measured / propagated, with its 95 % interval; {which}. bias: mean less value,",
        "once what a simulation told is taken off; u(bias): standard uncertainty of that.",
    ]


def correlation_terms() -> list[str]:
    """What the correlations are of."""
    return ["1: the columns rank the settings alike. It says nothing of their size, of which the ratios above tell."]


def verdict_terms() -> list[str]:
    """What the last paragraph compares."""
    return [
        f"p-value: chance of so large a difference if the prediction is right. Each is compared with a limit that makes"
        f" a false alarm {100 * LEVEL:g} % likely over all rows (Sidak) and tests (Bonferroni).",
        "u: standard uncertainty of one value.",
    ]


EXPLAINED = f"""\
How to read this

  What is done. Each setting is a place of the camera (sensor) and of the lamp (light), as (polar angle, azimuth) in
  degrees. Its picture is rendered once without noise; then noisy pictures are made of it, each is measured, and the
  scatter of the measured values is compared with what was predicted.

  calibrated   Variance predicted from a formula of camera, light, surface and noise: no picture is needed. `ice plan`
               minimises it.
  propagated   Variance predicted from one noise-free picture, by what the measurement does to small errors of its
               pixels. The verdict compares with it.
  measured     Sample variance over the noisy pictures. Its 95 % interval (chi-square) is as wide as the number of
               pictures makes it: 9 % with 1000, 3 % with 10000.
  gradient     Finds an edge where the second derivative of the smoothed picture across it is zero.
  canny@12     The classic pipeline: pixels whose gradient is above 12 grey levels a pixel, thinned, each refined.
  Cramer-Rao   No unbiased measurement of the same picture can have less variance.
  ICE          The name that the paper (Yi, Haralick, Shapiro 1995) gives to its predicted variance. Its unit of
               intensity is not printed, so one scale is free for all rows of ours.
  paper real   What the paper measured on photographs, five a setting, with thresholds of 12.0 and 10.0; N/A is "-".
  failed       Pictures without a value, one number a method: "0 0 0" is none by any of three.
  bias, rmse   Mean error, and sqrt(variance + bias^2), once the bias that a render of other rays tells is taken off.
  status       ok: value and sigma can be relied on. Others say why not; each that occurs is explained below its table.
  *            1 lies outside the 95 % interval. One row of 20 has it by chance: count them, do not judge one.
  Sidak        With many rows a small p-value occurs by chance. The limit for the smallest of m rows is
               1 - (1 - a)^(1 / m). Three tests - each row's variance, all rows pooled, mean errors - have each an a;
               they add up to {100 * LEVEL:g} %, the chance of a false alarm (Bonferroni).
  proven       Rows whose status is ok. Only they are judged: of the others too little is known to agree or contradict.
  agree        No test found a difference. contradict: one did, most rows could not be measured, or none is proven.
"""


_WRONG = {
    "rows": "some values scatter differently",
    "pooled": "all values together scatter differently",
    "bias": "mean values are off by more than is allowed",
    "not measured": "most could not be measured",
    "not proven": "none is proven",
}


def plain_verdict(found: Validation, pictures: str = "noisy pictures") -> str:
    """What the verdict says, in plain words; ``pictures``: what they are called that were measured."""
    verdict = found.verdict
    if not verdict.agrees:
        reasons = ", and ".join(_WRONG.get(reason, reason) for reason in verdict.reasons) or "no test was passed"
        return f"No: {reasons} than was predicted." if "scatter" in reasons else f"No: {reasons}."
    each = f"of each of {len(found.rows)} settings " if len(found.rows) > 1 else ""
    return (
        f"Yes: {found.overview.images} {pictures} {each}were measured, and the values scatter as predicted: "
        f"{verdict.inside} of {verdict.rows} ratios of measured to predicted variance have 1 in their 95 % interval, "
        f"where chance alone leaves {_expected(verdict.rows)}.{_unjudged(verdict)}"
    )


def _unjudged(verdict: Verdict) -> str:
    """How many rows are not judged; empty where all are.

    >>> from validation.statistics import verdict
    >>> _unjudged(verdict([1.0, 1.0], [100, 90], lost=[0, 10], bias_px=None))
    ' 1 more is not judged: too many of its pictures gave no value.'
    """
    parts = []
    for count, why in (
        (verdict.not_measured, "too many of {} pictures gave no value"),
        (sum(verdict.not_proven.values()), "{} values are not proven"),
    ):
        if count:
            verb, whose = ("is", "its") if count == 1 else ("are", "their")
            parts.append(f" {count} more {verb} not judged: {why.format(whose)}.")
    return "".join(parts)


def checked(found: Validation, is_simulated: bool = True) -> str:
    """The same in short, of a run that agrees, of simulated pictures or of photographs."""
    what = "simulated pictures" if is_simulated else "photographs"
    each = " of each setting" if len(found.rows) > 1 else ""
    return f"Check: in {found.overview.images} {what}{each} the measured values scatter as predicted."


def tried(found: Validation, number: int | None) -> str:
    """How many settings there are, and which of them is shown."""
    return f"{len(found.rows)} settings of camera and lamp were tried; shown is the best, setting {number}"


def contradiction(found: Validation) -> str:
    """The same of a run that does not agree, as what is wrong."""
    told = plain_verdict(found).removeprefix("No: ")
    return f"The predicted uncertainties did not pass their check: {told}"


def why_not(found: Validation) -> str:
    """What to do to learn why a run does not agree; empty where what could not be measured is why."""
    if set(found.verdict.reasons) <= {"not measured", "not proven"}:
        return ""
    return "`ice effects SCENE --check` tells whether an effect that was left out is why the check fails."


def elsewhere(found: Validation, number: int | None) -> list[str]:
    """In how many of the settings that are not shown a requirement is not proven; empty where in none."""
    others = [row for row in found.rows if row.index + 1 != number]
    states = [_unproven(row) for row in others]
    doubtful = sum(map(bool, states))
    if not doubtful:
        return []
    which = "the other setting" if len(others) == 1 else f"{doubtful} of the {len(others)} other settings"
    told = Counter(state for each in states for state in each).most_common()
    why = "; ".join(f"{_meant(state)}, {_times(count)}" for state, count in told)
    shown = f"; this need not concern setting {number}, shown here" if number else ""
    return [f"In {which} not everything is proven ({why}){shown}."]


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _meant(state: str) -> str:
    """A status with what it means.

    >>> _meant("short"), _meant("not measured")
    ('too little of an edge is left in the image (status short)', 'not measured')
    """
    return f"{MEANINGS[state]} (status {state})" if state in MEANINGS else state


def _unproven(row: Row) -> list[str]:
    """Of the requirements of a setting that are not proven: their statuses, or that they were not measured."""
    doubtful = [each for each in row.measurands if each.ratio is None or not is_trusted(each.status)]
    return ["not measured" if is_trusted(each.status) else each.status for each in doubtful]


def _expected(rows: int) -> str:
    """How many of so many 95 % intervals hold the true value, about.

    >>> _expected(20), _expected(3)
    ('about 19', 'nearly all')
    """
    return f"about {0.95 * rows:.0f}" if 0.05 * rows >= 0.5 else "nearly all"


def station_title(found: Validation, station: Station) -> str:
    """Of the table of a run's best setting."""
    lights = station.picture.lights
    where = f"sensor {pose(station.picture.sensor)}" + (f", light {pose(lights)}" if lights else "")
    best = f", the best of {len(found.rows)}" if len(found.rows) > 1 else ""
    return f"\nHow well each requirement is measured in setting {station.number}{best}: {where}"


def directory_line(directory: Path) -> str:
    """Where a run's files are."""
    return f"Files: {directory} (report.html, report.md, table.csv, measurands.csv, result.json, figures/)"


def next_line(found: Validation, scene: str | None, directory: Path) -> str:
    """Where the page is, and what to try next, by the verdict; ``scene`` as the commands take it, None of several."""
    report = f"Next: look at {directory / 'report.html'}"
    if scene is None:
        return f"{report}."
    scene = shlex.quote(scene)
    if found.verdict.agrees:
        return f"{report}; `ice plan {scene}` looks for better places of sensor and light."
    if {"not measured", "not proven"} & set(found.verdict.reasons):
        return f"{report}; `ice plan {scene}` proposes settings that can be measured."
    return f"{report}; `ice effects {scene} --check` tells whether an effect that was left out is why."


def advice(agrees: bool) -> dict[str, str]:
    """How to read each table of the report and what to do next, by its name in `page_tables`."""
    wrong = "Rows with * that lie together (one place of camera or lamp) point to a cause: `ice effects SCENE --check`."
    right = "About one row in 20 has a * by chance; `ice validate SCENE --accuracy 0.02` narrows the intervals."
    return {
        "ratios": f"The prediction holds where the interval of a row contains 1. {right if agrees else wrong}",
        "variances": "In a row propagated and measured should be alike, the bound below both; where it is far below, "
        "`ice measure --estimator arrangement` comes near it.",
        "units": "Compare sigma, what one picture scatters by, with your tolerance; where it is too large, "
        "`ice plan SCENE` looks for better places of camera and lamp.",
        "estimators": "A method is as predicted where each p-value is above the limit beside it; use one that is.",
        "effects": "What is off was left out because it changes little; `ice effects SCENE --check` renders each.",
        "refused": "Mend the scene by the reason given; `ice validate` with the same options continues a stopped run.",
        "budget": "Improve the source with the largest share first; `ice budget SCENE --reach U` says by how much.",
        "facts": "The same scene, seed and versions give the same numbers; `ice compare A B` compares two runs.",
    }
