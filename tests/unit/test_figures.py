"""The pictures show what was measured."""

from dataclasses import replace
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import LogNorm, Normalize
from matplotlib.text import Text

import measure
import planner
from imaging.geometry.projection import project
from tests.oracle import polygon_image
from validation.report import camera_figure
from validation.report.canvas import WIDTH
from validation.report.figures import edge_pixels
from validation.report.map_figure import COLOURS, Chart, draw_map

SENSOR = (30, 135)
RING = ("v4", "v3", "v7", "v6")


def away_from(points: np.ndarray, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Distance of points from the segment, px."""
    along = stop - start
    t = np.clip((points - start) @ along / (along @ along), 0, 1)
    return np.linalg.norm(points - start - t[:, None] * along, axis=1)


@pytest.mark.parametrize("noise", [0.0, 2.4])
def test_edge_pixels_are_those_that_canny_measures_by(task1, noise, rng):
    """As many at each required edge as the measurement counts, all within a pixel of it, away from its corners."""
    corners = project(np.array([task1.solid.vertex(v) for v in RING]), np.array(SENSOR, float), task1.camera)
    picture = polygon_image(corners, (240, 256), task1.camera.blur_px, 150.0)
    picture = picture + noise * rng.standard_normal(picture.shape)
    drawn = np.argwhere(edge_pixels(task1, SENSOR, picture))[:, ::-1]
    found = measure.distance(picture, task1, SENSOR, estimator="canny")
    ring = zip(corners, np.roll(corners, -1, 0), strict=True)
    apart = np.stack([away_from(drawn, *side) for side in ring])
    assert sorted(np.bincount(apart.argmin(0), minlength=4)) == sorted(found.used)
    assert apart.min(0).max() < 1  # margin: half a pixel's diagonal, 0.71, and the edge's noise
    # margin: at corners pixels are left out, by its kind
    assert np.linalg.norm(drawn[:, None] - corners, axis=-1).min() > 2


@pytest.fixture(scope="module")
def drawn(task1, tmp_path_factory):
    """The map of a plan's sensor as figure, with its axes, and what it shows."""
    plan = planner.plan(task1, step_deg=15)
    space = planner.ViewingSpace(6, (0, 90))
    found = planner.pose_map(task1, light=plan.light, space=space)
    figure, (axis, below) = plt.subplots(2, 1, figsize=(WIDTH, 7))
    chart = Chart(plan, found, True, plan.sensor, "Where the sensor may stand")
    draw_map(figure, axis, below, chart)
    yield figure, axis, below, chart
    plt.close(figure)


def texts(drawn):
    figure = drawn[0]
    return [each for each in figure.findobj(Text) if each.get_text()]


def test_a_map_numbers_rings_and_azimuths_and_names_its_unit(drawn):
    words = {each.get_text() for each in texts(drawn)}
    assert {"30", "60", "90", "0 (x)", "90 (y)", "180", "270"} <= words
    assert "sigma of distance, cm" in words
    # margin: the size that is asked of print
    assert min(each.get_fontsize() for each in texts(drawn)) * 390 / (72 * WIDTH) >= 9


def test_a_map_explains_each_status_that_occurs_and_no_other(drawn):
    labels = " ".join(each.get_text() for each in drawn[2].get_legend().get_texts())
    found = drawn[3].found
    lost = set(found.status[~np.isfinite(found.variance)])
    for status in ("not_visible", "short", "low_contrast", "ill_conditioned"):
        assert (f"({status})" in labels) == (status in lost)
    assert ("clutter" in labels) == ("clutter" in found.status)


def test_a_map_has_azimuth_0_to_the_right_and_90_up(drawn):
    places = {each.get_text(): each.get_position() for each in drawn[1].texts}
    assert places["0 (x)"][0] > 90 > abs(places["0 (x)"][1])  # margin: where a label stands, beyond the outermost ring
    assert places["90 (y)"][1] > 90  # margin: where a label stands, beyond the outermost ring
    best, chart = drawn[1].lines[-1].get_xydata()[0], drawn[3]
    assert np.hypot(*best) == pytest.approx(chart.best.polar_deg)
    assert np.degrees(np.arctan2(best[1], best[0])) % 360 == pytest.approx(chart.best.azimuth_deg % 360)


def test_the_maps_colours_are_told_apart_in_grey():
    grey = plt.get_cmap(COLOURS)(np.linspace(0, 1, 256))[:, :3] @ (0.2126, 0.7152, 0.0722)
    assert (np.diff(grey) < 0).all()


@pytest.mark.parametrize(("spread", "scale"), [(5.0, Normalize), (20.0, LogNorm)])
def test_a_range_of_more_than_a_decade_is_logarithmic(drawn, spread, scale):
    chart = drawn[3]
    variance = np.geomspace(1, spread**2, len(chart.found.space)) * 1e-6
    steep = replace(chart, found=replace(chart.found, variance=variance))
    assert type(steep.norm()) is scale


def test_the_scale_of_a_map_spans_95_percent_of_the_directions(drawn):
    """From the least; where all are nearly alike, one per cent from end to end; 0 to 1 where nothing is known."""
    chart = drawn[3]

    def norm(sigma):
        return replace(chart, found=replace(chart.found, variance=np.square(sigma))).norm()

    count = len(chart.found.space)
    sigma = np.linspace(2.0, 6.0, count)
    assert (norm(sigma).vmin, norm(sigma).vmax) == pytest.approx((2.0, 5.8))
    lost = np.append(sigma, [np.inf, np.nan])
    assert (norm(lost).vmin, norm(lost).vmax) == pytest.approx((2.0, 5.8))
    assert (norm(np.full(count, 3.0)).vmin, norm(np.full(count, 3.0)).vmax) == pytest.approx((3.0, 3.03))
    assert (norm(np.full(count, np.inf)).vmin, norm(np.full(count, np.inf)).vmax) == (0, 1)


def test_a_maps_scale_is_as_wide_as_the_map_at_most(drawn):
    figure, axis, below, _ = drawn
    (bar,) = (each for each in figure.axes if each not in (axis, below))
    figure.draw_without_rendering()
    map_, scale = axis.get_position(original=True), bar.get_position()
    assert map_.x0 < scale.x0 < scale.x1 < map_.x1  # margin: where it stands, by its kind
    assert scale.y1 < map_.y0  # margin: the same


@pytest.fixture
def calibrated(monkeypatch, tmp_path):
    """Draws a calibration's figure as its command does, and gives the figure as it was saved."""

    def draw(count, rms=0.031):
        lens = SimpleNamespace(cx=330.0, cy=225.0)
        rng = np.random.default_rng(7)
        boards = [SimpleNamespace(corners=rng.uniform(40, 440, (6, 2))) for _ in range(count)]
        left = [rng.normal(0, rms, (6, 2)) for _ in range(count)]
        found = SimpleNamespace(
            image_shape=(480, 640), rms_px=rms, residuals=left, lens=lens, status="ok", p_value=0.4321
        )
        kept = []
        monkeypatch.setattr(camera_figure.plt, "close", kept.append)
        path = camera_figure.draw(found, boards, tmp_path / "camera.png")
        monkeypatch.undo()
        assert path.read_bytes()[:4] == b"\x89PNG"
        plt.close(kept[0])
        return kept[0], boards, left

    return draw


def test_a_calibrations_arrows_are_its_residuals_enlarged(calibrated):
    """By 200: the largest round number that makes the root mean square arrow at most a fiftieth of 640 px."""
    figure, boards, left = calibrated(3, 0.05)
    (axis,) = figure.axes
    assert figure.get_size_inches().tolist() == [9, 9 * 480 / 640 + 1.2]  # of the picture's shape, and lines of words
    assert axis.get_title() == "Residuals x 200: 0.0500 px rms, ok, p = 0.43; +: the axis"
    for arrows, board, rest in zip(axis.collections, boards, left, strict=True):
        assert arrows.get_offsets() == pytest.approx(board.corners)
        assert np.stack([arrows.U, arrows.V], 1) == pytest.approx(200 * rest)
        assert (arrows.angles, arrows.scale, arrows.scale_units) == ("xy", 1, "xy")
    assert len({tuple(arrows.get_facecolor()[0]) for arrows in axis.collections}) == 3
    assert axis.lines[0].get_xydata().tolist() == [[330.0, 225.0]]
    assert (axis.get_xlim(), axis.get_ylim()) == ((-0.5, 639.5), (479.5, -0.5))


@pytest.mark.parametrize(("count", "named"), [(10, 10), (11, 0)])
def test_up_to_ten_boards_are_named_close_below_their_figure(calibrated, count, named):
    """Each in a line's colour; under the axis' name and within the figure, which is left to the picture."""
    figure, *_ = calibrated(count)
    (axis,) = figure.axes
    legend = axis.get_legend()
    assert (len(legend.get_texts()) if legend else 0) == named
    if legend:
        assert [each.get_text() for each in legend.get_texts()] == [f"board {i}" for i in range(1, 11)]
        place, whole = legend.get_window_extent(), figure.bbox
        label = axis.xaxis.label.get_window_extent()
        shown = axis.get_window_extent()
        # margin: where things stand, by their kind
        assert whole.y0 <= place.y0 < place.y1 <= label.y1
        assert shown.y0 - place.y1 < 0.1 * shown.height  # margin: close to it, by its kind
        assert shown.x0 < (place.x0 + place.x1) / 2 < shown.x1  # margin: the same
