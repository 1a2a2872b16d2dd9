"""The zone that one feature's edge points need, whatever the estimator: what noise adds to it is taken off.

The points are those of the `gradient` locator along the edge, or of the locator around a rim. Their joint errors are
known from its response to the pixels and the contrast that the image shows. The form is estimated from what stands out
of them - cosines along an edge, waves around a circle, single points - and tells what noise adds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import special
from scipy.ndimage import binary_dilation, median_filter

from imaging.features.measurand import measurands, normals
from imaging.geometry.projection import in_space
from imaging.models.form_law import CLEAREST, LEAST_CLEAR, FormLaw, every, form_law, residues
from imaging.pictures import Pictures
from measure.estimators.crossing import CrossingLocator
from measure.estimators.gradient import gradient_locator
from measure.estimators.separate import calipers_for, measurable, thinned
from measure.features.calipers import Caliper
from measure.features.found import Shape
from measure.features.layout import Layout, layout_of
from measure.features.optics import Optics
from measure.features.rims import Circles, nearest_tools
from measure.features.tools import RimTool
from scenes import Picture, Quantity, status
from scenes.measurands.features import place_of
from scenes.measurands.form import Reference, reference_of

_GRID = 0.5  # px to which the place of an edge is rounded where it is looked for, so that images can share it
_SMOOTH = 5  # places of whose contrasts the median is taken before an error is told from it
_CLEAR = 2.0  # times the contrast that a point must have: beside such ones none is lost by noise
_GAP = 3.0  # times the usual way between places, that a rim without gaps may have
_NONE = 1e-6  # part of the largest variance of a wave: less is rounding
_FALSE = 1e-4  # probability that noise alone makes a wave, or a point, of the form of a feature that has none
_LIKELY = 3.0  # standard deviations of further waves of a form that is sure


@dataclass(frozen=True, eq=False)
class FormTool:
    """What measures the form of a feature that is expected at one place.

    Attributes
    ----------
    locator : CrossingLocator
    pick : ndarray of int, shape (m,)
        Which of its places are points of the form.
    inward : ndarray, shape (m,)
        What is added to crossings to have their distances from the feature's nominal place, ideal px.
    unit : ndarray, shape (m,)
        The scene's unit for an ideal px across the feature.
    design : ndarray, shape (m, k)
        What the reference can be, the scene's unit.
    at : ndarray, shape (m,)
        As of `FormLaw`.
    is_closed : bool
        Whether the points go all the way around.
    reference : {"line", "circle", "nominal"}
    optics : Optics
    state : str
        As far as is known before an image.
    """

    locator: CrossingLocator
    pick: np.ndarray
    inward: np.ndarray
    unit: np.ndarray
    design: np.ndarray
    at: np.ndarray
    is_closed: bool
    reference: Reference
    optics: Optics
    state: str


@dataclass(frozen=True, eq=False)
class FoundForm:
    """A form in one image.

    Attributes
    ----------
    points : ndarray, shape (k,)
        Distances of the points from their reference, outwards or to the edge's left, the scene's unit.
    law : FormLaw
        Of their errors.
    is_closed : bool
    """

    points: np.ndarray
    law: FormLaw
    is_closed: bool

    @property
    def size(self) -> float:
        """Zone that the points need, as they were found."""
        return float(self.law.extreme(self.points))

    @property
    def form(self) -> np.ndarray:
        """What stands out of the points' errors: waves, and then single points; 0 where no wave or point is sure.

        A form that hides in them is not told from noise: the size is then too small by up to two standard deviations.
        """
        waves, size = _waves(self.points.size, self.is_closed), self.points.size
        variance = np.einsum("ik,ij,jk->k", waves, self.law.covariance, waves)
        told, known = waves.T @ self.points, variance > _NONE * variance.max()  # others are the reference's own
        sure = float(special.ndtri(1 - _FALSE / 2 / size))
        over = np.abs(told) / np.sqrt(np.where(known, variance, np.inf))
        form = waves @ np.where(over > _LIKELY, told, 0.0) if over.max() > sure else np.zeros(size)
        left = self.points - form
        return form + np.where(np.abs(left) > sure * np.sqrt(np.diag(self.law.covariance)), left, 0.0)

    def judged(self, *, noiseless: bool) -> tuple[float, float]:
        """Size, what noise adds to it taken off, and its variance, of what was found in an image with or without noise.

        The latter is what is found on average in images with noise.
        """
        form = self.form
        law = self.law.of(form) if form.any() else self.law.noise
        added = law.mean - float(self.law.extreme(form))
        found = self.law.of(self.points).mean if noiseless else self.size
        return found - added, law.u**2


@dataclass(frozen=True, eq=False)
class Forms:
    """A form in n images.

    Attributes
    ----------
    size, variance : ndarray, shape (n,)
        What noise adds taken off, the scene's unit, and its variance; NaN where it is not found.
    state : ndarray of str, shape (n,)
    found : tuple of FoundForm or None
        Of each image.
    """

    size: np.ndarray
    variance: np.ndarray
    state: np.ndarray
    found: tuple[FoundForm | None, ...]


def find_form(
    images: np.ndarray, picture: Picture, quantity: Quantity, shape: Shape, circles: dict[str, Circles], *,
    noiseless: bool = False,
) -> Forms:  # fmt: skip
    """The form of a feature in images (n, height, width), near the lines and circles that were found in them."""
    name = place_of(quantity.features[0])
    if name in circles:
        near = nearest_tools(picture, name, circles[name])
        tools = [None if each is None else _of_rim(*each, quantity) for each in near]
    else:
        tools = _edge_tools(picture, quantity, shape)
    found, states, expected = [], [], _expected(picture, quantity)
    for image, tool in zip(images, tools, strict=True):
        one, state = (None, status.NOT_VISIBLE) if tool is None else _measured(image, tool, expected)
        found.append(one)
        states.append(state)
    told = [(np.nan, np.nan) if each is None else each.judged(noiseless=noiseless) for each in found]
    size, variance = np.array(told).reshape(-1, 2).T
    return Forms(size, variance, np.array(states, object).astype(str), tuple(found))


def _expected(picture: Picture, quantity: Quantity) -> int | None:
    """How many points the picture should show; None where its light is not known."""
    law = form_law(Pictures.of(picture), quantity) if picture.lights else None
    return None if law is None else len(law.covariance)


def _measured(image: np.ndarray, tool: FormTool, expected: int | None) -> tuple[FoundForm | None, str]:
    """A form in one image, and its status.

    Points that are lost beside clear ones, where the scene shows them, are elsewhere than is looked: by more than the
    search window off. The form is then larger than what is left of it says, so it is a ``misfit``.
    """
    if tool.state not in status.MEASURED:
        return None, tool.state
    used = image.reshape(1, -1)[:, tool.locator.pixels]
    points = tool.locator.locate_each_in(used)
    offset, contrast = points.offset[0, tool.pick], points.contrast[0, tool.pick]
    valid = points.valid[0, tool.pick]
    contrast, noise = _smooth(np.where(valid, contrast, 0.0)), _noise(used[0], tool)
    valid &= contrast >= CLEAREST * np.sqrt(noise)
    if valid.mean() < LEAST_CLEAR or valid.sum() <= tool.design.shape[1] + 1:
        return None, status.LOW_CONTRAST
    errors = _errors(used[0], tool, contrast, np.flatnonzero(valid))
    law = FormLaw.beside(errors, tool.design[valid], tool.reference, tool.at[valid])
    at = ((offset + tool.inward) * tool.unit)[valid]
    if tool.reference != "nominal":
        at = residues(tool.design[valid]) @ at
    state = tool.state
    if (expected is None or valid.sum() < expected) and _is_torn(valid, contrast >= _CLEAR * CLEAREST * np.sqrt(noise)):
        state = status.worst(state, status.MISFIT)
    return FoundForm(at, law, tool.is_closed and bool(valid.all())), state


def _is_torn(valid: np.ndarray, clear: np.ndarray) -> bool:
    """Whether points (m,) end where they are clear: beside or one away from a point that is lost."""
    lost = binary_dilation(~valid, iterations=2)
    return bool((lost & valid & clear).any())


def _smooth(contrast: np.ndarray) -> np.ndarray:
    """Contrasts (m,), of neighbouring places the median: where a shadow ends at an edge its contrast jumps."""
    return median_filter(contrast, _SMOOTH, mode="nearest")


def _variance(used: np.ndarray, tool: FormTool) -> np.ndarray:
    """Of the noise of an image's pixels (P,), grey levels^2."""
    variance = tool.optics.noise_at(used[None])
    return np.full(used.size, tool.optics.noise_variance) if variance is None else variance[0]


def _noise(used: np.ndarray, tool: FormTool) -> np.ndarray:
    """Variance of the noise at each point (m,), as its crossing feels it, grey levels^2."""
    weights = tool.locator.unit_response()[tool.pick].power(2)
    return weights @ _variance(used, tool) / weights.sum(1)


def _errors(used: np.ndarray, tool: FormTool, contrast: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Covariance of some of the points at their contrasts (m,) in an image of pixels (P,), the scene's unit squared."""
    response = tool.locator.unit_response()[tool.pick[at]]
    scale = tool.unit[at] / contrast[at]
    weighted = response.multiply(_variance(used, tool)[None]).tocsr()
    return scale[:, None] * scale * (weighted @ response.T).toarray()


def _edge_tools(picture: Picture, quantity: Quantity, shape: Shape) -> list[FormTool | None]:
    """Of each image that which looks where its line is."""
    layout = layout_of(picture)
    e = layout.names.index(place_of(quantity.features[0]))
    off = np.einsum("nki,ni->nk", layout.ends[e] - shape.points[:, e, None], -shape.normals[:, e])
    steps = np.where(np.isfinite(off).all(-1, keepdims=True), np.round(off / _GRID) * _GRID, np.nan)
    return [None if np.isnan(step).any() else _edge_tool(picture, quantity, tuple(step.tolist())) for step in steps]


@lru_cache(maxsize=256)
def _edge_tool(picture: Picture, quantity: Quantity, off: tuple[float, float]) -> FormTool | None:
    """Of an edge whose ends lie so far, px, to the left of their expected place."""
    layout, name = layout_of(picture), place_of(quantity.features[0])
    caliper, moved = _caliper(layout, name, off)
    if not measurable(caliper):
        return None
    known = measurands(Pictures.of(picture))
    e = known.view.names.index(name)
    ends = known.seen.solid.vertices[list(known.seen.solid.edge(name).ends)]
    share = in_space(caliper.positions / caliper.length, *known.seen.divisor(ends))
    places = ends[0] + share[:, None] * (ends[1] - ends[0])
    unit = 1 / known.seen.per_unit(quantity.features[0], places, normals(known.view)[e])
    design = np.stack([np.ones(share.size), share - share.mean()], -1)
    return FormTool(
        gradient_locator(layout.optics, caliper), np.arange(share.size), moved, unit, design, share, False,
        reference_of(quantity), layout.optics, caliper.status,
    )  # fmt: skip


def _caliper(layout: Layout, name: str, off: tuple[float, float]) -> tuple[Caliper, np.ndarray]:
    """With the fewest positions that tell an edge, and how far from its expected place each is, ideal px."""
    e, offsets = layout.names.index(name), np.zeros((len(layout.names), 2))
    offsets[e] = off
    each = calipers_for(layout.shifted(offsets) if any(off) else layout, 4)[e]
    each = thinned(each, layout.optics.scale_px)
    share = each.positions / max(each.length, 1e-300)
    return each, off[0] + (off[1] - off[0]) * share


def _of_rim(tool: RimTool, moved: np.ndarray, errors: np.ndarray, quantity: Quantity) -> FormTool:
    """Of a circle or the limb of a ball, from what finds it, the errors (p,) at which that expects it, and those from
    there."""
    spacing = np.linalg.norm(np.diff(tool.places, axis=0), axis=-1) if len(tool.places) > 1 else np.ones(1)
    pick = tool.surest[:: every(float(np.median(spacing)), tool.optics.scale_px)]
    unit = 1 / tool.design[pick, 2]
    inward = (tool.inward - tool.beside(errors[None])[0] + tool.design @ moved)[pick]
    return FormTool(
        tool.locator, pick, inward, unit, tool.design[pick, :3] * unit[:, None],
        tool.locator.positions[pick], _is_closed(tool.design[tool.surest]), reference_of(quantity), tool.optics,
        tool.state,
    )  # fmt: skip


def _is_closed(design: np.ndarray) -> bool:
    """Whether places of designs (m, p) go all the way around without a gap."""
    angle = np.sort(np.arctan2(design[:, 1], design[:, 0]))
    gaps = np.diff(angle, append=angle[0] + 2 * np.pi)
    return bool(gaps.max() < _GAP * np.median(gaps))


@lru_cache(maxsize=64)
def _waves(count: int, is_closed: bool) -> np.ndarray:
    """Orthonormal waves of ``count`` places, in columns: around, or cosines along."""
    at = (np.arange(count) + 0.5) / count
    if is_closed:
        turns = np.arange(1, (count - 1) // 2 + 1)
        angle = 2 * np.pi * at[:, None] * turns
        columns = [np.ones((count, 1)), np.cos(angle), np.sin(angle)]
    else:
        columns = [np.cos(np.pi * at[:, None] * np.arange(count))]
    waves = np.concatenate(columns, 1)
    return waves / np.linalg.norm(waves, axis=0)
