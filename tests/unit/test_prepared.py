"""Estimators are made once for a layout, and go with it."""

import gc

import numpy as np

from measure.features import shape
from measure.features.layout import polygon_layout
from measure.features.optics import Optics


def layout():
    return polygon_layout(np.array([[10.0, 10], [60, 12], [58, 50], [12, 48]]), Optics((70, 80), 0.7, 1.0))


def test_made_once_and_forgotten_with_their_layout():
    before, one = len(shape._TOOLS), layout()
    tools = [shape.prepared(one, name, 12.0) for name in ("gradient", "strip")]
    assert shape.prepared(one, "gradient", 12.0) is tools[0]
    assert shape.prepared(layout(), "gradient", 12.0) is not tools[0]
    del one, tools
    gc.collect()
    assert len(shape._TOOLS) <= before


def test_only_the_last_are_kept():
    layouts = [layout() for _ in range(shape._KEPT + 3)]
    tools = [shape.prepared(one, "strip", 12.0) for one in layouts]
    assert len(shape._TOOLS) == shape._KEPT
    assert shape.prepared(layouts[-1], "strip", 12.0) is tools[-1]
    assert shape.prepared(layouts[0], "strip", 12.0) is not tools[0]
