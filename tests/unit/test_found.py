"""Shapes put together from parts, and that of no line at all."""

import numpy as np
import pytest

from measure.features.found import gather, nothing
from scenes import status


def test_nothing():
    """An image without required lines is measured: no number, no complaint."""
    shape = nothing(3)
    sizes = {name: getattr(shape, name).shape for name in vars(shape)}
    assert sizes == {
        "corners": (3, 0, 2), "covariance": (3, 0, 0), "normals": (3, 0, 2), "points": (3, 0, 2), "lines": (3, 0, 0),
        "status": (3,), "whole": (3,), "edge_status": (3, 0), "counted": (3, 0), "edge_contrast": (3, 0),
        "used": (3, 0), "rejected": (3, 0), "p_value": (3,),
    }  # fmt: skip
    assert shape.status.tolist() == shape.whole.tolist() == [status.OK] * 3
    assert np.isnan(shape.p_value).all()


@pytest.mark.parametrize("source", [[0, 1, 2, 1, 0], [2, 2, 1, 1, 1], [0, 0, 0, 0, 0]])
def test_each_image_comes_from_its_part(source, rng):
    """Image i is row rows[i] of part source[i], texts of any length included."""
    parts, texts = [], ("ok", "sign_change", "ill_conditioned")
    for k, text in enumerate(texts):
        part = nothing(2)
        state = np.array([text, f"{text} too"])
        numbers = {"used": np.full((2, 1), k), "p_value": rng.random(2), "lines": rng.random((2, 4, 4))}
        parts.append(type(part)(**{**vars(part), **numbers, "status": state, "whole": state}))
    source, rows = np.array(source), np.array([1, 0, 0, 1, 0])
    whole = gather(parts, source, rows)
    for i, (k, row) in enumerate(zip(source, rows, strict=True)):
        assert whole.status[i] == whole.whole[i] == parts[k].status[row]
        assert whole.p_value[i] == parts[k].p_value[row]
        assert (whole.lines[i] == parts[k].lines[row]).all()
        assert whole.used[i].tolist() == [k]
