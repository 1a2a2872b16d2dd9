"""The analytic image of an arrangement against exact images, and its derivatives against central differences."""

import numpy as np
import pytest

from imaging.blurred.arrangement import arrangement_of, polygon_arrangement
from imaging.blurred.model import BlurredModel
from imaging.pictures import Pictures
from scenes import Picture
from tests.oracle import block_image, polygon_image

SHAPE = (60, 80)
SLIVER = np.array([[20.2, 5.3], [20.9, 55.0], [22.0, 54.1], [21.3, 5.9]])  # upright: the oracle integrates along rows


def turned(width, height, degrees, centre=(39.3, 29.7)):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]).T / 2
    return np.stack([c * x * width - s * y * height, s * x * width + c * y * height], 1) + centre


def everywhere(arrangement, shape, free=None):
    y, x = np.mgrid[: shape[0], : shape[1]]
    free = np.arange(len(arrangement.vertices)) if free is None else free
    return BlurredModel(arrangement, x.ravel(), y.ravel(), free)


def uniform(arrangement, background, level):
    levels = np.zeros(arrangement.level_slices[-1].stop)
    levels[arrangement.level_slices[0].start], levels[arrangement.level_slices[1].start] = background, level
    return levels


@pytest.mark.parametrize("blur", [0.3, 0.6, 1.4])
@pytest.mark.parametrize(
    "corners", [turned(50, 30, d) for d in (0, 13, 45, 90)] + [SLIVER, turned(3, 2, 30), turned(90, 30, 20)]
)
def test_polygon_against_the_exact_image(corners, blur):
    """Rectangles, a sliver 1.2 px wide, one of 3 x 2 px and one that leaves the image: within 1e-5 of the contrast."""
    arrangement = polygon_arrangement(corners, blur)
    model = everywhere(arrangement, SHAPE)
    image = model.image(model.start(uniform(arrangement, 20.0, 120.0))).reshape(SHAPE)
    assert np.abs(image - polygon_image(corners, SHAPE, blur, 100.0, 20.0)).max() < 1e-3


def test_pixels_anywhere(rng):
    """A model of some of the pixels has their values."""
    arrangement = polygon_arrangement(turned(50, 30, 13), 0.6)
    whole = everywhere(arrangement, SHAPE)
    some = rng.permutation(whole.x.size)[:500]
    part = BlurredModel(arrangement, whole.x[some], whole.y[some], whole.free)
    state = whole.start(uniform(arrangement, 20.0, 120.0))
    for one, all_ in zip(part.evaluate(state), whole.evaluate(state), strict=True):
        assert one == pytest.approx(all_[some], abs=1e-5)


@pytest.mark.parametrize("lens", [{}, {"distortion": -0.2}, {"distortion": (0.1, 0.05, 2e-3, -1e-3, 0.0)}])
@pytest.mark.parametrize("aperture", [0.0, 0.4])
def test_derivatives(task1, lens, aperture):
    """By every vertex, level and the blur, against central differences; with a bent and a defocused picture."""
    camera = task1.camera.model_copy(update={"width": 96, "height": 90, "focal_px": 300.0})
    camera = camera.model_copy(update={"lens": camera.lens.model_copy(update={**lens, "aperture_radius": aperture})})
    picture = Picture.of(task1.model_copy(update={"camera": camera}), (47, 211), (33, 250))
    arrangement = arrangement_of(Pictures.of(picture))
    model = everywhere(arrangement, (90, 96), np.unique(arrangement.pieces))
    state = model.start()
    _, jacobian = model.evaluate(state)
    for k in range(model.count):
        step = np.zeros(model.count)
        step[k] = 1e-4
        numeric = (model.image(model.moved(state, step)) - model.image(model.moved(state, -step))) / 2e-4
        size = np.abs(numeric).max()
        assert size > 0
        # the box of the pixel counts as a Gaussian where a level's slope meets an edge: 3e-4 of the derivative
        assert np.abs(numeric - jacobian[:, k]).max() < (5e-3 if aperture else 2e-3) * size


@pytest.mark.parametrize(
    ("sensor", "light"), [((21, 16.1), (36.1, 36.4)), ((56, 222), (30, 200)), ((9, 23.6), (52, 54))]
)
def test_block_against_the_oracle(task1, sensor, light):
    """Faces with their own shading, slivers: the oracle's projection and shading are its own. 0.15 of 200 grey levels.

    Negative control: with levels constant across the blur the picture is off by more.
    """
    camera = task1.camera.model_copy(update={"width": 96, "height": 90, "focal_px": 300.0})
    scene = task1.model_copy(update={"camera": camera})
    arrangement = arrangement_of(Pictures.of(Picture.of(scene, sensor, light)))
    model = everywhere(arrangement, (90, 96))
    exact = block_image(scene, sensor, light).ravel() - scene.noise.dark_level
    assert np.abs(model.image(model.start()) - exact).max() < 0.15
    flat = everywhere(arrangement, (90, 96))
    flat.__dict__["slopes"] = tuple(0 * slope for slope in model.slopes)
    assert np.abs(flat.image(flat.start()) - exact).max() > 0.3  # margin: twice what the right one is allowed


def test_bent_edges(task1):
    """A barrel lens bends the outline of a face outwards: the exact image of a polygon of 400 recorded points."""
    camera = task1.camera.model_copy(update={"width": 96, "height": 90, "focal_px": 120.0})
    camera = camera.model_copy(update={"lens": camera.lens.model_copy(update={"distortion": -0.4})})
    corners = turned(70, 50, 10, (47.5, 44.5))
    arrangement = polygon_arrangement(corners, 0.6)
    arrangement = type(arrangement)(**{**vars(arrangement), "camera": camera})
    model = everywhere(arrangement, (90, 96))
    t = np.linspace(0, 1, 100, endpoint=False)[:, None]
    outline = np.concatenate([a + t * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)])
    exact = polygon_image(arrangement.recorded(outline), (90, 96), 0.6, 100.0, 20.0)
    image = model.image(model.start(uniform(arrangement, 20.0, 120.0))).reshape(90, 96)
    assert np.abs(image - exact).max() < 0.05
    assert np.abs(image - polygon_image(corners, (90, 96), 0.6, 100.0, 20.0)).max() > 10


def test_a_lying_sliver():
    """The same turned by 90 degrees is the same picture turned: rows and columns are treated otherwise."""
    pictures = []
    for corners in (SLIVER, SLIVER[:, ::-1]):
        arrangement = polygon_arrangement(corners, 0.6)
        model = everywhere(arrangement, (60, 60))
        pictures.append(model.image(model.start(uniform(arrangement, 20.0, 120.0))).reshape(60, 60))
    assert pictures[1] == pytest.approx(pictures[0].T, abs=1e-4)
