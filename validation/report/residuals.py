"""What a fit leaves of photographs: beside each its residual, in standard deviations of the noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from measure.fitting.result import Fit
from validation.report.canvas import plt

_MOST = 4  # poses that are drawn
_RANGE = 5.0  # standard deviations


def draw(found: Fit, images: list[np.ndarray], path: Path) -> Path:
    """Photograph, residual and the residuals' distribution beside the normal one, a row for each pose; a PNG file."""
    poses = range(min(len(found.pictures), _MOST))
    figure, axes = plt.subplots(
        len(poses), 3, figsize=(15, 4.6 * len(poses)), layout="constrained", squeeze=False,
        width_ratios=(1, 1.15, 0.8),
    )  # fmt: skip
    for k, (photograph, rest, spread) in zip(poses, axes, strict=True):
        residual = found.residuals[k]
        y, x = np.nonzero(residual) if residual.any() else np.indices(residual.shape).reshape(2, -1)
        mean = np.mean([images[i] for i in found.members[k]], axis=0)
        photograph.imshow(mean, cmap="gray")
        sensor = "({:.2f}, {:.2f})".format(*found.pictures[k].sensor)
        photograph.set_title(f"{len(found.members[k])} photograph(s), sensor {sensor}", fontsize=10)
        drawn = rest.imshow(residual, cmap="RdBu_r", vmin=-_RANGE, vmax=_RANGE)
        figure.colorbar(drawn, ax=rest, label="standard deviations")
        rest.set_title(f"photograph - model: {found.status}, p = {found.p_value:.2g}", fontsize=10)
        for axis in (photograph, rest):
            axis.set(
                xlim=(x.min() - 0.5, x.max() + 0.5), ylim=(y.max() + 0.5, y.min() - 0.5), xlabel="x, px", ylabel="y, px"
            )
        _distribution(spread, residual[residual != 0])
    figure.savefig(path, dpi=100)
    plt.close(figure)
    return path


def _distribution(axis, values: np.ndarray) -> None:
    axis.hist(np.clip(values, -_RANGE, _RANGE), np.linspace(-_RANGE, _RANGE, 26), density=True, color="0.7")
    at = np.linspace(-_RANGE, _RANGE, 201)
    axis.plot(at, np.exp(-(at**2) / 2) / np.sqrt(2 * np.pi), color="tab:red", lw=1)
    axis.set(yscale="log", ylim=(1e-5, 1), xlabel="standard deviations")
    axis.set_title(f"all {values.size} pixels, standard deviation {values.std():.3f}", fontsize=10)
