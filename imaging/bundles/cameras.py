"""What is not known of a camera as an unknown of the adjustment: focal lengths, principal point, distortion; errors of
a splined lens."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from scenes import Scene
from scenes.cameras.covariance import ORDER


def root(scene: Scene) -> np.ndarray:
    """Independent errors of variance 1 as errors of the parameters `ORDER`, and the m of a splined lens, (9 + m, k); k
    is 0 where all are exact."""
    said, columns = scene.uncertainty, []
    if said.covariance is not None:
        rows = np.zeros((len(ORDER), len(said.covariance.names)))
        rows[[ORDER.index(name) for name in said.covariance.names], np.arange(rows.shape[1])] = 1.0
        if "fy" not in said.covariance.names:
            rows[ORDER.index("fy")] = rows[ORDER.index("fx")]
        sizes, axes = np.linalg.eigh(said.covariance.correlation)
        half = said.covariance.sd[:, None] * axes * np.sqrt(np.maximum(sizes, 0.0))
        columns.append(rows @ half)
    if said.principal_point_px is not None:
        columns.append(said.principal_point_px.u * np.eye(len(ORDER))[:, [ORDER.index("cx"), ORDER.index("cy")]])
    whole = np.concatenate(columns, 1) if columns else np.zeros((len(ORDER), 0))
    return block_diag(whole[:, np.linalg.norm(whole, axis=0) > 0], np.eye(len(said.lens_modes)))
