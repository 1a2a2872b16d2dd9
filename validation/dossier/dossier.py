"""All that a dossier tells: made by one call, the same from the same versions, inputs and seed."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import measure
import render
import scenes
from scenes import InvalidInput, Scene
from scenes.status import is_trusted
from validation import budgets, coverage, hard
from validation.batch.campaign import Campaign
from validation.batch.job import run_by
from validation.batch.options import RunOptions
from validation.batch.result import Validation
from validation.batch.store import RunFile
from validation.coverage import Coverage
from validation.dossier import alarms, controls, inputs
from validation.dossier.alarms import Alarms
from validation.dossier.controls import Control, Judge
from validation.dossier.inputs import InputFile
from validation.report.station import Station, of_budget, of_run

Progress = Callable[[str, int, int], None]
RUN = "run"  # the run's directory, within the dossier's


@dataclass(frozen=True)
class Size:
    """How much is simulated: noisy pictures a setting, stations whose inputs are drawn, tables of true predictions that
    the verdict is tried on, exposures of each negative control; and whether the hard cases are answered."""

    renders: int = 1000
    stations: int = 500
    tables: int = 2000
    exposures: int = 300
    hard: bool = True


@dataclass(frozen=True)
class Claim:
    """Something that the dossier claims: what was found, whether it holds (None: nothing could be shown), under which
    heading (by key), and the command that shows it."""

    name: str
    says: str
    holds: bool | None
    heading: str
    command: str


@dataclass(frozen=True, eq=False)
class Dossier:
    """Of one scene.

    Attributes
    ----------
    source : str
        The scene as the command was given it.
    station : Station
        The best setting of the run, its requirements, and its budget as `ice budget` tells it.
    chain : str
        By what stations were simulated.
    """

    source: str
    scene: Scene
    seed: int
    size: Size
    versions: dict[str, str]
    processor: dict[str, str]
    files: tuple[InputFile, ...]
    run: Validation
    campaign: Campaign
    station: Station
    controls: tuple[Control, ...]
    drawn: Alarms
    blocks: Alarms
    chain: str
    coverage: tuple[Coverage, ...]
    hard: tuple[hard.Row, ...]

    @property
    def holds(self) -> bool:
        """Whether all that is claimed was shown."""
        return all(each.holds for each in self.claims)

    @property
    def claims(self) -> tuple[Claim, ...]:
        return (
            _agreement(self), _false_alarms(self), _negative_controls(self), _held(self), _hard_cases(self),
        )  # fmt: skip

    def command(self, name: str, *more: str) -> str:
        """One that shows something of this scene with this seed."""
        return " ".join(["ice", name, shlex.quote(self.source), *more])

    @property
    def estimator(self) -> str:
        """By which is measured what the budget, the verdict, the controls and the stations tell of."""
        return self.campaign.scenes[0].locator.estimators[0]

    @property
    def again(self) -> str:
        """What makes the same dossier again."""
        size = self.size
        return self.command(
            "dossier", f"--renders {size.renders} --stations {size.stations} --tables {size.tables}",
            f"--exposures {size.exposures} --seed {self.seed}" + " --no-hard" * (not size.hard),
        )  # fmt: skip

    @property
    def at_station(self) -> str:
        """Options for the station's poses."""
        picture = self.station.picture
        light = " ".join("{:.12g},{:.12g}".format(*pose) for pose in picture.free_lights)
        return "--sensor {:.12g},{:.12g}".format(*picture.sensor) + f" --light {shlex.quote(light)}" * bool(light)


def make(
    source: str,
    directory: Path,
    size: Size = Size(),
    seed: int = 1995,
    workers: int | None = None,
    fresh: bool = False,
    report: Progress = lambda what, done, total: None,
) -> Dossier:
    """Run all that a dossier tells of; the run itself is kept in ``directory`` / `RUN` and is continued there.

    Parameters
    ----------
    fresh : bool
        Start the run anew even if there is one.
    report : callable
        Called as report(what, done, total).

    Raises
    ------
    InvalidInput
        If the scene cannot be read, has no settings, or none of them can be worked on.
    """
    scene = scenes.load(source)
    options, campaign = RunOptions(seed, directory / RUN, workers, fresh), _measured(scene)
    run = run_by(options, campaign, size.renders, partial(_told, report, "pictures"))
    store = RunFile.reopen(directory / RUN)
    try:
        station = _station(campaign, run, store)
        blocks = alarms.in_blocks(run, store)
        judge = _judge(campaign, run, store, station, size, seed)
    finally:
        store.close()
    report("false alarms", 0, 1)
    drawn = alarms.drawn([each for row in run.rows for each in row.measurands], size.tables, seed)
    planted = controls.controls(judge, lambda done, of: report("controls", done, of))
    chain, covered = _covered(station, size, seed, report)
    return Dossier(
        source, scene, seed, size, inputs.versions(run.variant), inputs.processor(), inputs.files(source, scene), run,
        campaign, station, planted, drawn, blocks, chain, covered, _hard(report) if size.hard else (),
    )  # fmt: skip


def _measured(scene: Scene) -> Campaign:
    """The scene's settings, measured by what `ice measure` takes for it, of which its budget tells; beside it by what
    the scene names."""
    if not scene.settings:
        raise InvalidInput(f"{scene.name}: settings must be a list of at least one sensor and light, got none")
    best = measure.best_estimator(scene)
    return Campaign.of(scene).measured_by(tuple(dict.fromkeys((best, *scene.locator.estimators))))


def _told(report: Progress, what: str, _: str, done: int, total: int) -> None:
    report(what, done, total)


def _station(campaign: Campaign, run: Validation, store: RunFile) -> Station:
    """The best setting, with the budget of `ice budget`; where that has none, with the run's."""
    shown = of_run(campaign, run, store)
    with suppress(InvalidInput):
        return replace(of_budget(budgets.budget_of(shown.picture)), image=shown.image, number=shown.number)
    return shown


def _judge(campaign: Campaign, run: Validation, store: RunFile, station: Station, size: Size, seed: int) -> Judge:
    row = next(row for row in run.rows if row.index + 1 == station.number)
    image = store.image(row.index) if store.has_image(row.index) else render.image(station.picture, variant=run.variant)
    return Judge(campaign.case(row.index).picture, row, image, size.exposures, seed)


def _covered(station: Station, size: Size, seed: int, report: Progress) -> tuple[str, tuple[Coverage, ...]]:
    if station.budget is None:
        return "", ()
    return coverage.simulated(station.budget, size.stations, seed, lambda done: report("stations", done, size.stations))


def _hard(report: Progress) -> tuple[hard.Row, ...]:
    cases, rows = hard.catalogue(), []
    for case in cases:
        rows.append(replace(hard.run(case), seconds=0.0))  # what a clock says is no part of a dossier
        report("hard cases", len(rows), len(cases))
    return tuple(rows)


def _agreement(found: Dossier) -> Claim:
    verdict, run = found.run.verdict, found.run
    says = verdict.text.split(";")[0]
    if verdict.pooled:
        low, high = verdict.pooled.interval
        says = (
            f"{verdict.inside} of {verdict.rows} ratios of measured to predicted variance have 1 in their 95 % "
            f"interval; pooled {verdict.pooled.ratio:.3f} [{low:.3f}, {high:.3f}]"
        )
    names = ",".join(found.campaign.scenes[0].locator.estimators)
    command = found.command("validate", f"--estimators {names} --renders {found.size.renders} --seed {run.seed}")
    return Claim("Predicted scatter and mean errors are those of rendered pictures", says, verdict.agrees, "agreement",
                 command)  # fmt: skip


def _false_alarms(found: Dossier) -> Claim:
    told = found.drawn
    says = (
        f"{told.alarms} of {told.tables} true tables contradicted, {100 * told.rate:.2g} % [{100 * told.low:.2g}, "
        f"{100 * told.high:.2g}] %, where {100 * told.stated:g} % are stated"
        if told.tables
        else "nothing could be drawn: no value of the run may be relied on"
    )
    name = "The verdict contradicts a prediction that is right no more often than stated"
    return Claim(name, says, told.holds if told.tables else None, "alarms", found.again)


def _negative_controls(found: Dossier) -> Claim:
    rows = [each for each in found.controls if each.wanted]
    good = sum(each.holds for each in rows)
    says = f"{good} of {len(rows)} wrong parameters found by their test"
    if found.controls and not found.controls[0].holds:
        says += "; pictures as the scene says were contradicted, too"
    holds = all(each.holds for each in found.controls) if found.controls else None
    return Claim("A wrong parameter is found", says if rows else "no value may be relied on, so nothing can be found",
                 holds, "controls", found.again)  # fmt: skip


def _held(found: Dossier) -> Claim:
    some = [each for each in found.coverage if is_trusted(each.status) and each.n]
    name = "Stated intervals hold the true value as often as stated"
    command = (
        found.command("budget", found.at_station, f"--stations {found.size.stations} --seed {found.seed}")
        if found.chain == coverage.PICTURES
        else found.again
    )
    if not some:
        return Claim(name, "no interval may be stated here", None, "coverage", command)
    worst = min(some, key=lambda each: (each.held, each.name))
    says = (
        f"{100 * worst.held:.1f} % [{100 * worst.low:.1f}, {100 * worst.high:.1f}] % of {worst.n} stations,"
        f" where {100 * worst.stated:g} % are stated" + (f" (the least of {len(some)} requirements)" * (len(some) > 1))
    )
    return Claim(name, says, all(each.holds for each in some), "coverage", command)


def _hard_cases(found: Dossier) -> Claim:
    name = "Numbers keep their digits where they are ill-conditioned"
    if not found.hard:
        return Claim(name, "left out of this dossier", None, "hard", "ice hard")
    wrong, refused = (sum(row.verdict == verdict for row in found.hard) for verdict in ("WRONG", "refused"))
    right = len(found.hard) - wrong - refused
    says = f"{right} of {len(found.hard)} right within their tolerance, {refused} refused with a reason, {wrong} wrong"
    return Claim(name, says, wrong == 0, "hard", "ice hard")
