"""The proof of boards, reduced; and photographs of chessboards, where somebody has put some into ``ICE_PHOTOS``."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.boards import SMALL
from tests.proofs.boards import CHARUCO, ENOUGH, FALSE_ALARM, TAGS, photographed, through_corners, through_images


def test_calibrations_are_nearer_than_with_corner_sub_pix_and_as_exact_as_they_say():
    rng = np.random.default_rng(3)
    compared, found = through_images(SMALL, 3, 1, 2.0, rng, 420.0)
    # margin: what the proof claims of errors over the other's; one draw of them is 0.27
    assert max(compared.ratios) <= ENOUGH
    assert found.p_value > FALSE_ALARM / 2
    cornered = through_corners(SMALL, 3, 25, rng, 420.0)
    assert cornered.p_value > FALSE_ALARM / 2


@pytest.mark.parametrize("kind", [CHARUCO, TAGS])
def test_boards_with_markers_calibrate_as_exactly_as_they_say(kind):
    """Intrinsics of one calibration, and the pulls of some hundred corners or more."""
    rig = replace(SMALL, board=kind.shape, square=kind.square)
    compared, found = through_images(rig, 3, 1, 2.0, np.random.default_rng(3), 420.0, kind)
    assert max(compared.ratios) <= ENOUGH
    assert found.p_value > FALSE_ALARM / 2
    assert abs(found.corners.std() - 1) < 4 / np.sqrt(2 * found.corners.size)


@pytest.mark.skipif(not os.environ.get("ICE_PHOTOS"), reason="ICE_PHOTOS names no folder of chessboard photographs")
def test_photographs_are_told_better_than_by_corner_sub_pix():
    found = photographed(Path(os.environ["ICE_PHOTOS"]))
    assert found["ours"].rms_px <= found["theirs"].rms_px
