"""What larger jobs would cost, from the measured constants: on one machine and on a cluster."""

from __future__ import annotations

from validation.cost.model import CostModel
from validation.cost.parameter import Parameter

_SETTINGS = (16, 1_000, 100_000, 1_000_000)
_IMAGES = (200, 1000)
_CLUSTER = 1000  # cores


def scaling_parameter(model: CostModel) -> Parameter:
    """Hours for settings like the trial's: start + settings (render + predictions + n image) / workers."""
    rendered, rows = model.rendered[0], []
    for settings in _SETTINGS:
        for n in _IMAGES:
            core = settings * (rendered.seconds + model.setting + n * model.image) / 3600
            rows.append((settings, n, core, core / model.workers, core / _CLUSTER, settings * n * 24 / 1e9))
    return Parameter(
        name="scaling",
        title=f"Larger jobs, extrapolated: one machine ({model.workers} workers, {model.variant}) and {_CLUSTER} cores",
        columns=("settings", "images", "core hours", "hours, this machine", "hours, cluster", "run file GB"),
        rows=tuple(rows),
        x="settings",
        y="hours, this machine",
        series="images",
        note="On paper: linear in settings and images; start-up and transfers are left out. Three distances of 8 bytes "
        "an image in the run file, pictures of the first 64 settings only.",
    )
