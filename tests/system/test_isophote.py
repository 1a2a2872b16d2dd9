"""The isophote on exact images by GalSim: its line, its efficiency, the variance that is said of it, its statuses."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.stats import chi2
from skimage.measure import find_contours

import measure
import render
import scenes
from measure.features.layout import layout_of, polygon_layout
from measure.features.optics import Optics
from measure.features.shape import prepared
from scenes import Picture, status
from tests.benchmarks.independent import rectangle
from tests.galsim_images import box, box_corners
from tests.oracle import block_image, polygon_image

SHAPE, CENTRE, BLUR = (96, 100), (50.3, 47.8), 0.7


def boxes(width, height, degrees, contrast=100.0):
    """Noise-free image and layout of a rectangle; noise of variance 25."""
    clean = 20 + contrast * box(width, height, degrees, CENTRE, SHAPE, BLUR)
    corners = box_corners(width, height, degrees, CENTRE)
    return clean, polygon_layout(corners, Optics(SHAPE, BLUR, 25.0))


def test_both_makers_draw_the_same():
    """A rectangle by GalSim (Fourier space) and by our scan lines: 1e-8 of the contrast."""
    ours = polygon_image(box_corners(40, 25, 22, CENTRE), SHAPE, BLUR, 1.0)
    assert np.abs(ours - box(40, 25, 22, CENTRE, SHAPE, BLUR)).max() < 1e-8


@pytest.mark.parametrize("degrees", [0, 22, 45])
def test_it_is_the_line_of_the_contour(rng, degrees):
    """Lines through scikit-image's contours of the smoothed image at the same levels; 20 images, contrast/noise 20.

    The contour is interpolated linearly between pixels, hence the common part of 0.01 px; what noise does to both
    agrees to a third of its size. Negative control: the second derivative's lines go their own way.
    """
    clean, layout = boxes(60, 50, degrees)
    images = clean + 5 * rng.standard_normal((20, *SHAPE))
    tools = {name: prepared(layout, name, 12.0) for name in ("isophote", "gradient")}
    own, other = (
        np.stack([_middles(part.locator.locate(images), part.caliper) for part in tools[name].parts], 1)
        for name in ("isophote", "gradient")
    )
    contour = np.array([[_contour(image, part) for part in tools["isophote"].parts] for image in images])
    assert np.abs((own - contour).mean(0)).max() < 0.05
    assert (own - contour).std(0).max() < 0.35 * own.std(0).mean()  # margin: 20 images tell it to 16 %
    assert (other - contour).std(0).min() > 0.5 * own.std(0).mean()  # margin: 0.8, and 20 images tell it to 16 %


def _middles(points, caliper):
    """Offset of a least-squares line in the middle of the edge, px, for each image."""
    return np.array([_line(along, offset, caliper) for along, offset in zip(points.along, points.offset, strict=True)])


def _line(along, offset, caliper):
    return np.polyval(np.polyfit(along, offset, 1), caliper.positions.mean())


def _contour(image, part):
    """The same from the contour of the smoothed image less the level that the locator takes along the edge."""
    locator, caliper = part.locator, part.caliper
    level = locator.basis @ (locator.level @ image.ravel()[locator.pixels])
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    along, _ = caliper.coordinates(np.stack([x, y], -1).astype(float))
    line = np.polyval(np.polyfit(caliper.positions, level, 1), along)
    found = np.concatenate(find_contours(gaussian_filter(image, 1.0) - line, 0.0))[:, ::-1]
    along, offset = caliper.coordinates(found)
    near = (np.abs(offset) < 2) & (along > caliper.positions[0]) & (along < caliper.positions[-1])
    return _line(along[near], offset[near], caliper)


@pytest.mark.parametrize(("side", "degrees", "ratio"), [(60, 22, 5), (60, 0, 50), (30, 22, 20), (15, 22, 200)])
def test_the_variance_is_the_predicted_one(rng, side, degrees, ratio):
    """Diagonal and width in 1500 images: two-sided chi-square interval at 1 % over all eight; 1.3 x is outside."""
    done = rectangle(side, degrees, ratio, ("isophote",), 1500, rng)["isophote"]
    low, high = chi2.ppf([0.01 / 16, 1 - 0.01 / 16], 1499) / 1499
    seen = done.empirical / done.predicted
    assert done.failed <= 5
    assert ((low < seen) & (seen < high)).all()
    assert (low > seen / 1.3).all() or (seen / 1.3 < low).all()  # margin: 30 % are 6 standard errors of 1500 images
    assert np.abs(done.bias).max() < 0.002  # margin: the claim, two thousandths of a pixel


def test_between_the_gradient_and_the_bound(rng):
    """The width of squares: at most 1.8 of the bound down to 30 px; the gradient has 1.2 to 2 times as much."""
    for side in (90, 60, 30):
        found = rectangle(side, 22, 20, ("isophote", "gradient"), 2, rng)
        own, other = (found[name].predicted[1] for name in ("isophote", "gradient"))
        assert 1 < own < 1.8  # margin: the claim, between the bound and 1.8 of it
        assert 1.2 < other / own < 2  # margin: the claim, between 1.2 and 2


def test_the_levels_noise_counts():
    """Without the levels' rows the response would say at least a tenth too little."""
    _, layout = boxes(60, 50, 22)
    part = prepared(layout, "isophote", 12.0).parts[0]
    noise = part.locator.unit_noise()
    weights = noise.weights / noise.weights.sum()
    kernel = part.locator.kernel[part.locator.offsets.size // 2 :: part.locator.offsets.size]
    alone = part.locator.slope_to_contrast[:, None] * kernel.toarray()
    # margin: a tenth, so that it is no rounding
    assert np.sum((weights @ alone) ** 2) < 0.9 * np.sum((weights @ noise.response) ** 2)


@pytest.mark.parametrize("known", [True, False])
def test_shading_does_not_move_it(task1, known):
    """Faces under a near light, exact image: the shading is known, or a slope fitted where nobody says where it is.

    Contrast 46 on one edge, standard deviation 0.026 px. With levels that are the same everywhere the distance is 0.05
    px off in both cases.
    """
    sensor, light = (42.1, 225.5), (34.1, 263.2)
    clean = block_image(task1, sensor, light)
    found = measure.distance(clean, task1, sensor, light if known else None, "isophote")
    true = np.linalg.norm(np.subtract(*_true_corners(layout_of(Picture.of(task1, sensor, light)))))
    assert found.status == status.OK
    # margin: less than a standard deviation; 0.05 where the shading is left out
    assert abs(found.value_px - true) < 0.025


def _true_corners(layout):
    for first, second in layout.corners:
        apart = np.linalg.norm(layout.ends[first][:, None] - layout.ends[second], axis=-1)
        yield layout.ends[first][np.unravel_index(apart.argmin(), (2, 2))[0]]


def test_a_side_without_a_level_of_its_own_is_clutter(task1):
    """A side face a few px wide: no pixel of it is clear of both its edges. The others are measured as ever."""
    sensor, light = (22.7, 247.4), (7.2, 140.5)
    found = measure.distance(block_image(task1, sensor, light), task1, sensor, light, "isophote")
    assert found.status == status.CLUTTER
    assert status.OK in found.edge_status


def test_nothing_but_noise_is_no_edge(task1, rng):
    noise = 20 + 2.4 * rng.standard_normal((20, task1.camera.height, task1.camera.width))
    found = measure.distance(noise, task1, (30, 135), (15, 315), "isophote")
    assert (found.status != status.OK).all()


@pytest.mark.render
def test_where_noise_decides_from_where_an_edge_is_looked_for_nothing_is_told():
    """An edge half a pixel from its expected place by a neighbour's light jumps by 36 sigma in a third of noisy images:
    looked for again from elsewhere, an isophote takes other levels. The gradient's zero crossing stays where it is."""
    plate = scenes.load("plate")
    picture = Picture.of(plate, plate.settings[2].sensor, plate.settings[2].light)
    image = render.image(picture, quality=render.Quality(supersample=2))
    told = measure.propagate(image, picture, estimator="isophote").measurands
    names = [quantity.name for quantity in plate.quantities]
    assert told.status[names.index("length")] == "ill_conditioned"
    noisy = render.expose(image, plate.noise, np.random.default_rng(1), 40)
    values = measure.measure(noisy, picture, estimator="isophote").value[:, names.index("length")]
    steady = measure.propagate(image, picture, estimator="gradient").measurands
    sigma = np.sqrt(steady.covariance[names.index("length"), names.index("length")])
    assert (np.abs(values - np.median(values)) > 8 * sigma).sum() > 5  # margin: 17 of them
    assert steady.status[names.index("length")] == "ok"
