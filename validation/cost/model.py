"""Errors and seconds of a run as functions of its parameters, with constants that a trial has measured."""

from __future__ import annotations

import math
from dataclasses import dataclass

from render import Quality
from scenes import InvalidInput
from validation.cost.interval import LEAST, half_width, images

_NORMAL = 1.96  # standard deviations to each side hold 95 %


@dataclass(frozen=True)
class Rendered:
    """A quality of the noise-free image: seconds a setting, relative sigma of the predicted variance over seeds."""

    quality: Quality
    seconds: float
    sigma: float


@dataclass(frozen=True)
class CostModel:
    """What a trial has measured; errors are relative to the variance ratio.

    Attributes
    ----------
    settings, workers : int
    variant : str
    rendered : tuple of Rendered
        From cheap to dear.
    phase : float
        Sigma of the predicted variance over the object's place within a pixel.
    model : float
        Root mean square difference of the measured variance from the linear prediction for the same noise.
    start, setting, image, finish : float
        Seconds until the workers work; of each setting besides its render; of each noisy image with all methods, one
        worker; and after the last image.
    seconds : float
        What the trial took.
    """

    settings: int
    workers: int
    variant: str
    rendered: tuple[Rendered, ...]
    phase: float
    model: float
    start: float
    setting: float
    image: float
    finish: float
    seconds: float

    def errors(self, rendered: Rendered, n: int) -> dict[str, float]:
        """95 % half-widths of all sources, relative to the ratio, with n images a setting."""
        return {
            "sampling": half_width(n),
            "render": _NORMAL * rendered.sigma,
            "phase": _NORMAL * self.phase,
            "model": self.model,
        }

    def total(self, rendered: Rendered, n: int) -> float:
        """All sources together: the random ones are independent, the model's error is added to them."""
        return combined(self.errors(rendered, n))

    def run_seconds(self, rendered: Rendered, n: float) -> float:
        """Duration of a run."""
        work = self.settings * (rendered.seconds + self.setting + n * self.image)
        return self.start + work / min(self.workers, self.settings) + self.finish

    def sampling_for(self, rendered: Rendered, accuracy: float) -> float:
        """Half-width that the sampling may take, so that the total is the accuracy; 0 if there is nothing left."""
        others = self.total(rendered, 10**8)
        if others >= accuracy:
            return 0.0
        rest = (accuracy - self.model) ** 2 - (_NORMAL**2) * (rendered.sigma**2 + self.phase**2)
        return math.sqrt(rest)

    def for_accuracy(self, accuracy: float) -> Proposal:
        """The cheapest parameters that reach an accuracy.

        Raises
        ------
        InvalidInput
            If none do: render noise, pixel phase and model alone are larger.
        """
        widths = {rendered: self.sampling_for(rendered, accuracy) for rendered in self.rendered}
        options = [Proposal.of(self, rendered, images(width)) for rendered, width in widths.items() if width > 0]
        if not options:
            least = min(self.total(rendered, 10**8) for rendered in self.rendered)
            raise InvalidInput(
                f"--accuracy must be larger than {least:.2g} (render noise, pixel phase and prediction model of this "
                f"scene), got {accuracy:g}"
            )
        return min(options, key=lambda choice: choice.seconds)

    def for_budget(self, seconds: float) -> Proposal:
        """The parameters of least error for a duration, the trial's excluded.

        Raises
        ------
        InvalidInput
            If it is too short for `LEAST` images a setting.
        """
        options = []
        for rendered in self.rendered:
            per_image = self.run_seconds(rendered, 1) - self.run_seconds(rendered, 0)
            n = int((seconds - self.run_seconds(rendered, 0)) / per_image)
            if n >= LEAST:
                options.append(Proposal.of(self, rendered, n))
        if not options:
            least = self.seconds + min(self.run_seconds(rendered, LEAST) for rendered in self.rendered)
            raise InvalidInput(f"--budget must be at least {least:.0f} s here, got {seconds + self.seconds:.0f} s")
        return min(options, key=lambda choice: choice.total)


def combined(errors: dict[str, float]) -> float:
    """Root of the sum of squares of the random sources, plus the model's error."""
    return math.hypot(errors["sampling"], errors["render"], errors["phase"]) + errors["model"]


@dataclass(frozen=True)
class Proposal:
    """Parameters of a run, with what they are expected to give."""

    rendered: Rendered
    renders: int
    errors: dict[str, float]
    total: float
    seconds: float

    @classmethod
    def of(cls, model: CostModel, rendered: Rendered, n: int) -> Proposal:
        errors = model.errors(rendered, n)
        return cls(rendered, n, errors, combined(errors), model.run_seconds(rendered, n))

    @property
    def text(self) -> str:
        """One line."""
        rays = quality_name(self.rendered.quality)
        parts = ", ".join(f"{name} {value:.2g}" for name, value in self.errors.items())
        return (
            f"Chosen: {self.renders} images a setting, {rays}; about {self.seconds:.0f} s for a half-width of "
            f"{self.total:.3g} ({parts})"
        )


def qualities(*samples: int) -> tuple[Quality, ...]:
    """Qualities by rays a fine pixel (at an edge)."""
    return tuple(Quality(edge_samples=count) for count in samples)


def rays(quality: Quality) -> int:
    """Rays of a pixel at an edge."""
    return quality.supersample**2 * quality.edge_samples


def quality_name(quality: Quality) -> str:
    k = quality.supersample
    return f"{k} x {k} x {quality.edge_samples} rays a pixel"
