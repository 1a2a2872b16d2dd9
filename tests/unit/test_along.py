"""What is known along an edge's image, by central differences of where the lens records its points."""

import numpy as np
import pytest

from imaging.features.measurand import measurands, normals
from imaging.geometry.lens import recorded
from imaging.models.along import place_nodes, used_trims
from planner import Pictures
from scenes import Lens

SENSORS, LIGHTS = np.array([[30.0, 135.0], [50.0, 60.0]]), np.array([[15.0, 315.0], [30.0, 200.0]])
STEP = 1e-4


@pytest.fixture
def bent(task1):
    lens = Lens(distortion=(-0.3, 0.2, 0.01, -0.02, 0.05))
    return task1.model_copy(update={"camera": task1.camera.model_copy(update={"lens": lens})})


def test_magnification_at_the_nodes(bent):
    """A step along the image is recorded ``along`` times as long; its two neighbours' lines 1 / ``across`` apart."""
    pictures = Pictures.of(bent, SENSORS, LIGHTS)
    view = measurands(pictures).view
    nodes = place_nodes(pictures, view, used_trims(pictures, view, trimmed=True))
    tangent = view.along / np.linalg.norm(view.along, axis=-1, keepdims=True)
    places = view.ends[..., :1, :] + (nodes.middle + nodes.t)[..., None] * tangent[..., None, :]

    def moved(step):
        return (recorded(places + step, bent.camera) - recorded(places - step, bent.camera)) / (2 * STEP)

    ahead, aside = moved(STEP * tangent[..., None, :]), moved(STEP * normals(view)[..., None, :])
    size = np.linalg.norm(ahead, axis=-1)
    area = np.abs(ahead[..., 0] * aside[..., 1] - ahead[..., 1] * aside[..., 0])
    assert nodes.along == pytest.approx(size, rel=1e-7)
    assert nodes.across == pytest.approx(size / area, rel=1e-7)
    assert np.ptp(nodes.along) > 1e-3
    assert np.ptp(nodes.across) > 1e-3


def test_nodes_fill_what_the_trims_leave(task1):
    """From the first end on: trim, half of what is left to its middle; its weights add up to its length."""
    pictures = Pictures.of(task1, SENSORS, LIGHTS)
    view = measurands(pictures).view
    trims = np.broadcast_to([3.0, 7.0], (*view.lengths.shape, 2))
    nodes = place_nodes(pictures, view, trims)
    places = nodes.middle + nodes.t
    assert nodes.length[..., 0] == pytest.approx(view.lengths - 10)
    assert places[..., 0] == pytest.approx(np.full(view.lengths.shape, 3.0))
    assert places[..., -1] == pytest.approx(view.lengths - 7)
    for e, name in enumerate(view.names):
        start, stop = task1.solid.vertices[list(task1.solid.edge(name).ends)]
        for i, sensor in enumerate(pictures.sensor_at):
            out = sensor / np.linalg.norm(sensor)  # the camera looks at the origin
            depth = np.array([task1.camera.distance - end @ out for end in (start, stop)])
            shown = nodes.spatial[i, e] * depth[1] / (depth[0] + nodes.spatial[i, e] * (depth[1] - depth[0]))
            assert places[i, e] == pytest.approx(shown * view.lengths[i, e])
