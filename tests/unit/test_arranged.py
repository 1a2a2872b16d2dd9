"""What is predicted of lines as `arrangement` finds them is what it has of them in an exact image."""

import numpy as np
import pytest

import measure
import scenes
from imaging.blurred.whole import image
from imaging.models.arranged import arranged
from imaging.pictures import Pictures
from scenes import Picture
from tests import placements as parts

KNOWN = {"from": "known", "datums": [], "datum_sd": None}


def _pictures(folder):
    """A roof, edges beside others within 32 px, of which those of two widths are seen; a block, one of its edges not
    seen; corners whose images are asked for; a dim picture, whose noise changes with the level."""
    roof = parts.scene(folder, "roof", placement=KNOWN)
    hidden = [{"name": n, "kind": "width", "features": [{"edge": a}, {"edge": b}]}
              for n, a, b in (("breadth", "e8", "e5"), ("depth", "e1", "e6"))]  # fmt: skip
    block = parts.scene(folder, "block", placement=KNOWN).with_(measurands=hidden)
    return [
        Picture.of(roof, (28.0, 300.0), (22.0, 60.0)),
        Picture.of(block, (28.0, 300.0), (22.0, 60.0)),
        Picture.of(scenes.load("task1"), (60, 255), (60, 255)),
        Picture.of(scenes.load("low_light"), (30, 135), (15, 315)),
    ]


@pytest.mark.parametrize("number", range(4))
def test_lines_are_known_as_the_estimator_knows_them(tmp_path, number):
    """Joint covariance of all lines, propagated through the estimator: 1e-8 of variances is found."""
    picture = _pictures(tmp_path)[number]
    pictures = Pictures.of(picture)
    found = measure.propagate(image(picture), picture, estimator="arrangement").measurands.of_features
    seen = np.isfinite(np.diag(found))
    np.testing.assert_array_equal(np.isfinite(np.diag(arranged(pictures))), seen)
    assert seen.sum() == (4 if number == 1 else 8)
    unit = np.outer(*(2 * [np.sqrt(np.diag(found)[seen])]))
    told, own = (each[np.ix_(seen, seen)] / unit for each in (arranged(pictures), found))
    np.testing.assert_allclose(told, own, atol=1e-6)
    alone = np.kron(np.eye(len(own) // 2), np.ones((2, 2)))
    assert np.abs(own * (1 - alone)).max() > 0.02  # control: edges by themselves are not what is found
