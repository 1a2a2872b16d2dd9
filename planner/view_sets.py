"""What a plan of several pictures is: the pictures, what they tell together, and how good that is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from planner.combining import Combination
from planner.design import DEFAULT_HOLD, Choice, Hold, Vary, exposure_time, own_choice
from planner.prediction import Prediction
from scenes import Picture, Pose, Scene
from scenes.results import Shown, finite, poses


@dataclass(frozen=True, eq=False)
class View:
    """One picture of several.

    Attributes
    ----------
    sensor : Pose
    light : Pose or tuple of Pose
        Of the free light, or of each.
    prediction : Prediction
        Of this picture alone, looked at closely.
    choice : Choice or None
        What stands before lens and lamp, where it is not the scene's own.
    """

    sensor: Pose
    light: Pose | tuple[Pose, ...]
    prediction: Prediction
    choice: Choice | None = None

    @property
    def place(self) -> tuple[Pose, Pose | tuple[Pose, ...], Choice | None]:
        """What two pictures that are the same have in common."""
        return self.sensor, self.light, self.choice

    @property
    def picture(self) -> Picture:
        """Of the scene with its choice: ready to predict, render and measure."""
        return self.prediction.picture


@dataclass(frozen=True, eq=False)
class ViewSet:
    """The best K pictures that were found; one may be there several times.

    Attributes
    ----------
    views : tuple of View
    combination : Combination
        What they tell together.
    minimised : float
        Largest squared ratio of combined sigma to tolerance, or the weighted sum, of what is measured (of a single
        quantity its variance); what is ``clutter`` counts as four times its variance.
    lost : tuple of str
        Names of the quantities that none of the pictures measures.
    over_one, over_repeats : float or None
        How many times as large what is minimised is for the best single picture, and for that one taken K times, which
        takes as long; None where that picture does not measure as many quantities.
    exhaustive : float or None
        What is minimised by the best of all sets of K of the settings that were looked at; None where they are more
        than 200 000.
    bound : float or None
        What no K pictures of the grid can stay below, if a glance is right and nothing is clutter; None where some
        quantity cannot be measured anywhere, or what is shared is not free.
    hard : tuple of str
        Names of the quantities that every picture of the set that tells them cannot measure around its poses
        (`planner.search.candidates`): they are hard to set up.
    """

    views: tuple[View, ...]
    combination: Combination
    minimised: float
    lost: tuple[str, ...]
    over_one: float | None
    over_repeats: float | None
    exhaustive: float | None
    bound: float | None
    hard: tuple[str, ...] = ()

    def why(self, m: int) -> str:
        """What decided the status of the m-th quantity, of the first picture of which it is known; empty where not."""
        told = (view.prediction.measurands[m].why(self.combination.status[m]) for view in self.views)
        return next(filter(None, told), "")

    @property
    def worst_ratio(self) -> float | None:
        """Largest combined sigma over tolerance of what is measured; None without tolerances."""
        return self._worst[0]

    @property
    def limiting(self) -> str | None:
        """Name of that quantity."""
        return self._worst[1]

    @property
    def _worst(self) -> tuple[float, str] | tuple[None, None]:
        told = zip(self.views[0].prediction.measurands, self.combination.variances, strict=True)
        known = [(math.sqrt(v) / each.tolerance.half, each.name) for each, v in told if each.tolerance and v < math.inf]
        return max(known, default=(None, None))

    @property
    def gap(self) -> float | None:
        """``minimised`` over ``exhaustive``, less 1: what greedy search with exchange leaves."""
        return None if self.exhaustive is None else self.minimised / self.exhaustive - 1


@dataclass(frozen=True, eq=False, repr=False)
class Views(Shown):
    """For 1, 2, ... N pictures the best ones, and how they were found.

    Attributes
    ----------
    scene : Scene
    over, model : str
    share : str or None
        What all pictures of a set have in common: ``sensor`` or ``light``.
    sets : tuple of ViewSet
        One for each number of pictures.
    pairs : int
        Pairs of the grid.
    looked : int
        Settings looked at closely.
    guarantee : str
        What is known about the optimum.
    most_over_repeats : float or None
        What `ViewSet.over_repeats` can be at most, of the grid's best pair and however many pictures of the grid, if a
        glance is right and nothing is clutter; 1 where one picture sees all best. None as of `ViewSet.bound`, and
        where no picture measures all.
    vary : tuple of str or None
        What was chosen for each picture beside its poses.
    hold : {"time", "white"}
        What is equal then: exposure time, or the grey level of a white diffuse surface.
    own : tuple of ViewSet or None
        The best sets with the scene's own choice in all pictures, where others were tried.
    """

    scene: Scene
    over: str
    model: str
    share: str | None
    sets: tuple[ViewSet, ...]
    pairs: int
    looked: int
    guarantee: str
    most_over_repeats: float | None
    vary: tuple[Vary, ...] | None = None
    hold: Hold = DEFAULT_HOLD
    own: tuple[ViewSet, ...] | None = None

    def choice(self, view: View) -> tuple[Choice, float]:
        """What stands before lens and lamp in one of the pictures, and how much longer it is exposed for it."""
        choice = view.choice or own_choice(self.scene)
        return choice, exposure_time(self.scene, choice, self.hold)

    def over_own(self, index: int) -> float | None:
        """How many times as large what is minimised is by the scene's own choice, of the index-th set; None where that
        does not measure as many quantities, or no other was tried."""
        if self.own is None or len(self.own[index].lost) != len(self.sets[index].lost):
            return None
        return self.own[index].minimised / self.sets[index].minimised

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a set, picture and quantity: poses, what the picture alone tells, and what all of them do."""
        return [row for each in self.sets for row in self._rows(each)]

    def _rows(self, found: ViewSet) -> Iterator[dict[str, Any]]:
        both = found.combination
        for v, view in enumerate(found.views):
            for m, each in enumerate(view.prediction.measurands):
                yield {
                    "scene": self.scene.name, "pictures": len(found.views), "picture": v + 1,
                    **poses(view.sensor, view.light), "name": each.name, "unit": each.unit,
                    "sigma_alone": finite(math.sqrt(each.variance_object)), "status_alone": each.status,
                    "is_used": bool(both.used[v, m]), "sigma": finite(math.sqrt(both.variances[m])),
                    "status": both.status[m],
                }  # fmt: skip

    def _line(self) -> str:
        last = self.sets[-1]
        ratio = last.worst_ratio
        worst = "" if ratio is None else f", sigma up to {ratio:.3g} of its tolerance ({last.limiting})"
        return f"{self.scene.name}: {len(last.views)} pictures{worst}"
