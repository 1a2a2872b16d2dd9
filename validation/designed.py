"""What a design is worth in rendered pictures, and its station as a scene's file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import scenes
from planner.budgeting.budgets import SceneBudget
from planner.designing.alternatives import alternatives
from planner.designing.outcome import Design, Offer
from planner.designing.stations import station
from scenes import InvalidInput, Picture, Scene
from scenes.files.door import read_toml
from scenes.status import is_trusted
from scenes.uncertain import taken_out
from validation import copied_scene
from validation.budgets import budget_of

if TYPE_CHECKING:
    from validation.batch.result import Validation

_TRIED, _OTHERS = 3, 2  # pairs of camera and lens that are rendered, and other places and lights for each
_AS_TOLD = 1.05  # of U, where a station is said not to meet what is allowed: what its bias leaves open comes on top
_DERIVED = ("distance", "focal_px")  # of a camera's data sheet


@dataclass(frozen=True, eq=False)
class StationProof:
    """A station's budget with biases as renders tell them, and its noise in noisy pictures.

    Attributes
    ----------
    offer : Offer
        The station.
    budget : SceneBudget
    ratio : float
        Largest U over what is allowed.
    run : Validation or None
        Of the noisy pictures, where there are at least two.
    """

    offer: Offer
    budget: SceneBudget
    ratio: float
    run: Validation | None

    @property
    def trusted(self) -> bool:
        """Whether every value may be signed."""
        return all(map(is_trusted, self.budget.statuses))

    @property
    def holds(self) -> bool:
        """Whether every value may be signed, with the U that is allowed, and noise and means are as predicted.

        Of a station that is said not to meet what is allowed: with the U that is told.
        """
        most = 1.0 if self.offer.ratio <= 1 else _AS_TOLD * self.offer.ratio
        return self.trusted and self.ratio <= most and (self.run is None or bool(self.run.verdict.agrees))


def posed(design: Design, offer: Offer) -> Scene:
    """A station with its places as its one setting."""
    scene = station(design.problem.scene, offer.rated.settings)
    setting: dict[str, Any] = {"sensor": offer.rated.sensor}
    if scene.free:
        setting["light"] = offer.rated.light
    return scene.with_(settings=(setting,))


def prove(design: Design, offer: Offer, renders: int, report: Any = None) -> StationProof:
    """Render a station, take its biases off, and measure so many noisy pictures."""
    from validation.batch.job import run

    scene = posed(design, offer)
    picture = Picture.of(scene, offer.rated.sensor, offer.rated.light)
    found = budget_of(picture, design.problem.wishes.p, rendered=True)
    ratio = max(each.U / most for each, most in zip(found.measurands, design.problem.allowed, strict=True))
    made = None
    if renders > 1:
        with TemporaryDirectory() as directory:
            made = run(scene, renders, out=Path(directory) / "run", workers=1, fresh=True, progress=report)
    return StationProof(offer, found, float(ratio), made)


def proven(
    design: Design, renders: int, report: Any = None, wanted: int = 1
) -> tuple[Design, tuple[StationProof, ...]]:
    """The design with the first station that rendering bears out, and the proofs of as many as are wanted.

    The best, then the next of the front that meet all; where more than one is wanted and these are too few, those
    before them, the dearest first. Without any that meets all the design stays as it is, and its proofs say so.
    """
    proofs: list[StationProof] = []
    held: list[Offer] = []
    for offer in _members(design, wanted)[: _TRIED + wanted - 1]:
        proofs += _tried(design, offer, renders, report)
        held += [proofs[-1].offer] if proofs[-1].holds else []
        if len(held) == wanted:
            break
    best = next((each for each in held if each.ratio <= 1), design.best)
    return replace(design, best=best), tuple(proofs)


def _tried(design: Design, offer: Offer, renders: int, report: Any) -> list[StationProof]:
    """Proofs of one camera and lens, the last of which holds if any does.

    Where values cannot be signed, what lies beside their edges depends on light and place more than is known: other
    places and lights come then.
    """
    proofs = [prove(design, offer, renders, report)]
    others = iter(()) if proofs[0].trusted else islice(alternatives(design, offer), _OTHERS)
    while not proofs[-1].holds and (other := next(others, None)) is not None:
        proofs.append(prove(design, other, renders, report))
    return proofs


def _members(design: Design, wanted: int) -> list[Offer]:
    """The best, and the next of the front that meet all, by cost; where several are wanted then the others, the dearest
    first."""
    if design.best is None:
        return []
    others = [each for each in design.front if each.rated is not design.best.rated]
    dearer = [each for each in others if each.cost >= design.best.cost and each.ratio <= 1]
    more = [each for each in reversed(others) if each not in dearer] if wanted > 1 else []
    return [design.best, *dearer, *more]


def write(design: Design, source: str, path: Path) -> Scene:
    """Write the station that was found as a scene, the part and all that is asked of it as they were.

    Raises
    ------
    InvalidInput
        If nothing was found, or the file cannot be written.
    """
    if design.best is None:
        raise InvalidInput("--write must be given where a station was found, got none")
    origin, scene = scenes.find(source), posed(design, design.best)
    document = taken_out(read_toml(origin))
    names = " + ".join(design.best.rated.names)
    told = {
        "title": f"{design.problem.scene.title or design.problem.scene.name}: {names}",
        "camera": _camera(scene), "noise": scene.noise.model_dump(mode="json", exclude_unset=True, exclude_none=True),
        "settings": [each.model_dump(mode="json", exclude_none=True) for each in scene.settings],
        "uncertain": [each.model_dump(mode="json", exclude_unset=True, exclude_none=True) for each in scene.uncertain],
    }  # fmt: skip
    for name in ("light", "lights"):
        document.pop(name, None)
    told["lights"] = [each.model_dump(mode="json", exclude_unset=True) for each in scene.lights]
    if scene.uncertainty.covariance is not None:
        covariance = scene.uncertainty.covariance.model_dump(mode="json")
        document["uncertainty"] = {**document["uncertainty"], "covariance": covariance}
    document = {key: value for key, value in (document | told).items() if value not in ([], {})}
    return copied_scene.write(document, origin, path, "--write")


def _camera(scene: Scene) -> dict[str, Any]:
    table = scene.camera.model_dump(mode="json", exclude_unset=True)
    return {key: value for key, value in table.items() if key not in _DERIVED}
