"""The limb of a surface in the image, and what moves it.

At a limb the tangent plane holds the eye. A surface that moves by s along its normal N there, to first order, moves
the limb by s f / (z h) px along the image's normal: f the focal length in px, z the depth (or what else f is divided by
there, `scenes.Camera.divisor`), h the length of N's part across the camera's axis. Whatever is changed - a radius, an
axis, the eye - acts by that alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.contours.contour import Branch, contour
from imaging.contours.statuses import BEHIND, CONCAVE, OK
from imaging.geometry.projection import camera_frame, depth, divisor, from_axis, viewpoint
from scenes import Camera
from scenes.parts.surfaces import Surface, Torus
from scenes.parts.surfaces.roots import quadratic_roots
from scenes.parts.surfaces.surface import outwards
from scenes.viewpoint import Viewpoint

_AHEAD = 1e-6  # least cosine between the line of sight and the camera's axis
_SAME = 1e-3  # tubes: a root as near to where the line touches is that
_FLAT = 1e-9  # of the largest bend: less along the line of sight is none


@dataclass(frozen=True, eq=False)
class Strand:
    """Points in which a limb is seen, along one piece of it.

    Attributes
    ----------
    u : ndarray, shape (n,)
        Their parameters on the piece, 0 to 1.
    points, normals : ndarray, shape (n, 3)
        On the surface, and its unit normals there.
    at : ndarray, shape (n, 2)
        Images, ideal px from the image's middle.
    outward : ndarray, shape (n, 2)
        Unit normals of the image's curve, away from the body.
    arc : ndarray, shape (n,)
        Length of image that each stands for, px.
    magnification : ndarray, shape (n,)
        Shift along ``outward`` for one of the surface along its normal, px for the scene's unit.
    bend : ndarray, shape (n,)
        Normal curvature of the surface along the line of sight, positive, one over the scene's unit.
    curvature : ndarray, shape (n,)
        Of the image's curve, 1 / px; positive where it is convex seen from outside.
    design : ndarray, shape (n, p)
        Derivative of the place along ``outward`` by the surface's parameters (`Surface.parameters`), px for one.
    eye_design : ndarray, shape (n, 3)
        The same by the eye's place, the camera's axes kept, px for the scene's unit.
    closed : bool
        Whether the piece has no ends and all of it is seen.
    """

    u: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    at: np.ndarray
    outward: np.ndarray
    arc: np.ndarray
    magnification: np.ndarray
    bend: np.ndarray
    curvature: np.ndarray
    design: np.ndarray
    eye_design: np.ndarray
    closed: bool


@dataclass(frozen=True)
class Limb:
    """All pieces in which a limb is seen; none unless the status is ``ok``."""

    status: str
    strands: tuple[Strand, ...] = ()


def limb(surface: Surface, sensor, camera: Camera, parameters: int | np.ndarray = 64) -> Limb:
    """The limb of a surface from a sensor's pose.

    Seen are points where the line of sight touches from outside the material and the surface itself does not hide
    them; other surfaces are not asked, nor the image's frame.

    Parameters
    ----------
    surface : Surface
    sensor : Pose or pair of float
        Degrees.
    camera : Camera
    parameters : int or ndarray
        How many points a piece, at equal steps of its parameter (0 to 1), or these themselves, rising.

    Examples
    --------
    >>> from scenes.parts.surfaces import Sphere
    >>> camera = Camera(width=640, height=480, focal_px=1000.0, distance=50.0)
    >>> ball = limb(Sphere((0, 0, 0), 3.0), (40, 20), camera)
    >>> np.allclose(np.linalg.norm(ball.strands[0].at, axis=1), 1000 * 3 / (50**2 - 3**2) ** 0.5, rtol=1e-12)
    True
    """
    pose = np.array(list(sensor), float)
    eye = viewpoint(camera, pose)
    found = contour(surface, eye)
    if found.status != OK:
        return Limb(found.status)
    strands, why = [], BEHIND
    for branch in found.branches:
        u = _steps(branch, parameters)
        strand, reason = _strand(surface, pose, camera, eye, branch, u)
        if strand is None:
            why = CONCAVE if reason == CONCAVE else why
        else:
            strands.append(strand)
    return Limb(OK, tuple(strands)) if strands else Limb(why)


def _steps(branch: Branch, parameters: int | np.ndarray) -> np.ndarray:
    if isinstance(parameters, int):
        return (np.arange(parameters) + 0.5) / parameters
    return np.asarray(parameters, float)


def _strand(surface, pose, camera, eye: Viewpoint, branch: Branch, u: np.ndarray) -> tuple[Strand | None, str]:
    """What is seen of a branch, or why nothing is."""
    points = branch.points(u)
    away = -eye.towards(points)
    far = np.linalg.norm(away, axis=-1)
    ahead = (away @ camera_frame(camera, pose).forward > _AHEAD * far) & (depth(points, pose, camera) > 0)
    if not ahead.any():
        return None, BEHIND
    sight = away / np.where(far > 0, far, 1.0)[:, None]
    operator = surface.shape_operator(points)
    bend = np.einsum("ni,nij,nj->n", sight, operator, sight)
    outer = ahead & (bend > _FLAT * np.abs(operator).max((-1, -2)))
    seen = outer & ~_self_hidden(surface, eye, points, sight, far)
    if not seen.any():
        return None, CONCAVE if not outer.any() else BEHIND
    arc = _arc(from_axis(points, pose, camera), ahead, branch.closed)
    closed = branch.closed and bool(seen.all())
    keep = points[seen], u[seen], arc[seen], bend[seen], operator[seen], sight[seen]
    return _made(surface, pose, camera, *keep, closed), OK


def _made(surface, pose, camera, points, u, arc, bend, operator, sight, closed) -> Strand:
    axes, normals = camera_frame(camera, pose), surface.normals(points)
    across = np.stack([normals @ axes.right, normals @ axes.down], -1)
    size = np.linalg.norm(across, axis=-1)
    outward = across / size[:, None]
    magnification = camera.focal_px / (divisor(points, pose, camera) * size)
    return Strand(
        u=u,
        points=points,
        normals=normals,
        at=from_axis(points, pose, camera),
        outward=outward,
        arc=arc,
        magnification=magnification,
        bend=bend,
        curvature=_curvature(points, normals, operator, sight, outward, size, pose, camera),
        design=magnification[:, None] * surface.shifts(points),
        eye_design=-magnification[:, None] * normals,
        closed=closed,
    )


def _curvature(points, normals, operator, sight, outward, size, pose, camera) -> np.ndarray:
    """Turn of the image's normal over the length of image, along the contour's tangent N x S v."""
    axes = camera_frame(camera, pose)
    along = np.cross(normals, np.einsum("nij,nj->ni", operator, sight))
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    turned = np.einsum("nij,nj->ni", operator, along)
    screen = np.stack([axes.right, axes.down])
    tangent = np.stack([-outward[:, 1], outward[:, 0]], -1)
    turn = ((turned @ screen.T) * tangent).sum(-1) / size
    over, nearer = divisor(points, pose, camera)[:, None], camera.perspective * (along @ axes.forward)[:, None]
    moved = (camera.focal_px * (along @ screen.T) - from_axis(points, pose, camera) * nearer) / over
    return turn / (moved * tangent).sum(-1)


def _self_hidden(
    surface: Surface, eye: Viewpoint, points: np.ndarray, sight: np.ndarray, far: np.ndarray
) -> np.ndarray:
    """Whether the surface lies before where a line touches it: a quadric never does, a torus may.

    Of the quartic's four roots two are the touch; the other two are a quadratic's.
    """
    if not isinstance(surface, Torus):
        return np.zeros(len(points), bool)
    away, axis = points - surface.centre, surface.axis
    flat = sight - (sight @ axis)[:, None] * axis
    slope = (away * sight).sum(-1)  # (s^2 + 2 slope s + rest)^2 = 4 R^2 |beside + flat s|^2, s = 0 twice
    rest = (away**2).sum(-1) + surface.radius**2 - surface.tube**2
    inner = 4 * slope**2 + 2 * rest - 4 * surface.radius**2 * (flat**2).sum(-1)
    others = quadratic_roots(np.ones_like(slope), 2 * slope, inner)
    begin = far / eye.share if eye.share > 0 else np.full(len(far), np.inf)  # lines of sight, that far away
    before = (others < -_SAME * surface.tube) & (others > -begin[:, None])
    return before.any(-1) if outwards(surface.hollow) > 0 else np.zeros(len(points), bool)


def _arc(at: np.ndarray, ahead: np.ndarray, closed: bool) -> np.ndarray:
    """Half the chords to both neighbours; at open ends a whole one."""
    if len(at) < 2:
        return np.zeros(len(at))
    chord = np.linalg.norm(np.diff(at, axis=0, append=at[:1]), axis=-1)
    if not closed:
        chord[-1] = chord[-2]
    chord[~(ahead & np.roll(ahead, -1))] = 0.0
    before = np.roll(chord, 1)
    if not closed:
        before[0] = chord[0]
    return (chord + before) / 2
