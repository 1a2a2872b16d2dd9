"""Images of a stack that differ by far more than noise: each as if it were alone."""

from functools import partial

import numpy as np

import scenes
from measure.estimators.stack import find
from measure.features.layout import layout_of
from measure.features.locating import locate
from measure.features.shape import prepared
from scenes import Picture


def test_images_of_other_brightness_are_measured_each_by_itself():
    """Levels hundreds of standard deviations from the first image's take more steps than there are, and the corners
    stood, up to 1 sigma off, before these had arrived. Stacks agree with themselves to a fiftieth of sigma."""
    scene = scenes.load("anodised")
    layout = layout_of(Picture.of(scene, (15.9, 334.2), (12.8, 46.7)))
    tool = prepared(layout, "arrangement", 1.0)
    state, stack = tool.model.start(), np.zeros((2, *tool.shape))
    for image, brightness in zip(stack, (1.0, 1.06), strict=True):
        bright = state._replace(levels=brightness * state.levels)
        image.ravel()[tool.pixels] = tool.expected(bright, derivatives=False)[0]
    together, alone = (find(tool, images, partial(locate, tool, layout)) for images in (stack, stack[1:]))
    index = tool.index(tool.arrangement.corners)
    sigma = np.sqrt(np.diag(alone.centres[0].covariance)[index]).reshape(-1, 2)
    apart = (together.vertices[1] - alone.vertices[0])[tool.arrangement.corners]
    assert (np.abs(apart) <= 0.02 * sigma).all()
    assert together.settled.all()
