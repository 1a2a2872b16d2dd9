"""A calibrated camera as tables, as a lens file, as lines of a scene, as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

import scenes
from measure.boards.camera import CameraCalibration
from measure.boards.cross_validation import Compared
from measure.goodness import WORST
from measure.photo.lens import SplinedIntrinsics
from scenes import InvalidInput
from scenes.results import picked
from scenes.status import legend
from validation.boards import Boards
from validation.report import cells
from validation.strict_json import dumps

_STRONG = 0.9  # correlation that is told of
_OF_BOARDS = (
    "corners: columns x rows of inner corners, dots or markers. not ok: corners that are not used, by status. noise: "
    "grey levels. rms: distance of corners from where the calibrated camera sees them. distance: from the camera to "
    "the board's first corner, +- 1 sigma."
)
_OF_CAMERA = (
    "fx, fy: focal lengths (fx alone: of both axes). cx, cy: where the optical axis meets the image. k1, k2, p1, p2, "
    "k3: OpenCV's distortion."
)


def boards(found: CameraCalibration, seen: Boards, units: str) -> Table:
    """One row a board."""
    columns = ("file", "corners", "not ok", "noise", "blur px", "rms px", f"distance {units}", "+-")
    table = cells.table("Boards", *columns, words=("file",), wrap=True, caption=_OF_BOARDS)
    for each in _board_facts(found, seen):
        size = f"{each['shape'][0]} x {each['shape'][1]}"
        bad = ", ".join(f"{count} {name}" for name, count in each["status"].items() if name != "ok") or "-"
        table.add_row(
            Path(each["file"]).name, size, bad, f"{each['noise']:.2f}", f"{each['blur_px']:.2f}",
            f"{each['rms_px']:.4f}", f"{each['distance']:.3f}", f"{each['distance_sd']:.2g}",
        )  # fmt: skip
    return table


def parameters(found: CameraCalibration) -> Table:
    """One row an intrinsic."""
    table = cells.table(
        "Camera", "", "value", "+- (1 sigma)", "unit", words=("", "unit"), wrap=True, caption=_OF_CAMERA
    )
    shown = slice(1) if found.is_splined else slice(None)
    for name, value, sd in zip(found.names[shown], found.values[shown], found.sd[shown], strict=True):
        pixels = name in ("fx", "fy", "cx", "cy")
        digits = int(np.clip(1 - np.floor(np.log10(sd)), 0, 12)) if 0 < sd < np.inf else 4
        table.add_row(name, f"{value:.{digits}f}", f"{sd:.2g}", "px" if pixels else "")
    return table


def summary(found: CameraCalibration, units: str) -> str:
    """What the residuals say, how the board is bent, and the strongest correlations."""
    lines = [
        f"{found.status}: reprojection {found.rms_px:.4f} px rms; chi-square {found.chi_square:.1f} for "
        f"{found.freedom} degrees of freedom, p = {found.p_value:.2g} (the chance of so large residuals if board and "
        f"lens are as the model says; below {WORST:g} they are not)"
    ]
    if found.dispersion != 1:
        lines.append(
            f"The corners lie further off than their covariance says: all covariances are multiplied by "
            f"{found.dispersion:.3g}. Another --model, or a board that is not flat (--curved)?"
        )
    if found.curved:
        (x, y), (dx, dy) = found.sags, np.sqrt(np.diag(found.sag_covariance))
        lines.append(
            f"The board's middle stands out by {x:+.4g} +- {dx:.2g} {units} along its columns and {y:+.4g} +- {dy:.2g} "
            f"{units} along its rows, away from the camera if positive."
        )
    if isinstance(found.lens, SplinedIntrinsics):
        columns, rows = len(found.lens.spline.right[0]), len(found.lens.spline.right)
        lines.append(
            f"Displacements are splines over the {found.lens.spline.plane} plane, {columns} x {rows} control points; "
            "the axis is the ray that is seen in the image's middle."
        )
    pairs = [] if found.is_splined else _strong(found)
    if pairs:
        strong = abs(pairs[0][2]) > _STRONG
        title = "strongly correlated, so that the boards hardly tell them apart" if strong else "strongest correlation"
        lines.append(f"{title}: " + ", ".join(f"{a} and {b} {value:+.3f}" for a, b, value in pairs))
    return "\n".join(lines + legend([found.status]))


def comparison(compared: Compared) -> str:
    """What boards that were left out say of two models."""
    (plain, other), (first, second) = compared.models, compared.rms_px
    why = (
        "they are seen better so, beyond chance"
        if compared.proposed == other
        else "no better beyond chance by the other"
    )
    return (
        f"boards that are left out in turn: {first:.4f} px rms by {plain}, {second:.4f} px by {other}, "
        f"p = {compared.p_value:.2g}. Proposed: {compared.proposed} ({why})."
    )


def lens_file(found: CameraCalibration) -> str:
    """TOML as `measure.load_lens` reads it."""
    if isinstance(found.lens, SplinedIntrinsics):
        return _splined_file(found, found.lens)
    lens, sd = found.lens, dict(zip(found.names, found.sd, strict=True))
    lines = [f"# {found.status}: {found.rms_px:.4g} px rms, p = {found.p_value:.2g}; 1 sigma beside each number"]
    lines += [f"{name} = {getattr(lens, name)!r}  # +- {sd[name]:.2g} px" if name in sd else
              f"{name} = {getattr(lens, name)!r}  # as fx" for name in ("fx", "fy", "cx", "cy")]  # fmt: skip
    told = ", ".join(f"{name} {sd[name]:.2g}" for name in ("k1", "k2", "p1", "p2", "k3") if name in sd)
    lines.append(f"distortion = {list(map(float, lens.distortion))}  # +- {told or 'not free'}")
    return "\n".join(lines) + "\n"


def _splined_file(found: CameraCalibration, lens: SplinedIntrinsics) -> str:
    return "\n".join([
        f"# {found.status}: {found.rms_px:.4g} px rms, p = {found.p_value:.2g}; 1 sigma beside each number",
        f"fx = {lens.fx!r}  # +- {found.sd[0]:.2g} px",
        f"cx = {lens.cx!r}  # the image's middle",
        f"cy = {lens.cy!r}",
        "",
        "[spline]",
        *_spline_lines(lens),
    ]) + "\n"  # fmt: skip


def _spline_lines(lens: SplinedIntrinsics) -> list[str]:
    told = lens.spline.model_dump(include={"kind", "plane", "extent", "right", "down"})
    return [f"{key} = {json.dumps(value)}" for key, value in told.items()]


def uncertainty_file(found: CameraCalibration) -> str:
    """JSON as ``uncertainty.covariance`` reads it, of a splined lens as ``uncertainty.lens_modes`` does."""
    _check_finite(found)
    if found.is_splined:
        return dumps({"modes": [mode.model_dump() for mode in found.lens_modes]}) + "\n"
    return dumps(_covariance(found)) + "\n"


def scene_lines(found: CameraCalibration, scene: str, beside: Path | None) -> str:
    """The lines of a scene's ``[camera]`` and ``[uncertainty]`` that the calibration says.

    A scene's camera has one focal length, the geometric mean here, and its axis in the middle of the image; how far off
    it is, is said in a comment.

    Raises
    ------
    InvalidInput
        If the scene cannot be read, or its image has another size.
    """
    camera = scenes.load(scene).camera
    height, width = found.image_shape
    if (camera.width, camera.height) != (width, height):
        raise InvalidInput(
            f"{scene}: camera.width x height must be {width} x {height}, as the boards', got "
            f"{camera.width} x {camera.height}"
        )
    lens = found.lens
    if isinstance(lens, SplinedIntrinsics):
        lines = ["[camera]", f"focal_px = {lens.fx!r}", "", "[camera.lens]", *_spline_lines(lens), "", "[uncertainty]"]
        unsaid = "# lens_modes: how well this lens is known, in the file that -o FILE writes beside it."
        return "\n".join([*lines, f"lens_modes = {json.dumps(beside.name)}" if beside else unsaid])
    off = lens.cx - (width - 1) / 2, lens.cy - (height - 1) / 2
    told = ", ".join(f"{key} = {json.dumps(value)}" for key, value in _covariance(found).items())
    given = json.dumps(beside.name) if beside else f"{{ {told} }}"
    return "\n".join([
        "[camera]",
        f"focal_px = {float(np.sqrt(lens.fx * lens.fy))!r}  # fx {lens.fx:.3f}, fy {lens.fy:.3f}",
        f"lens = {{ distortion = {list(map(float, lens.distortion))} }}",
        f"# The axis meets the image {off[0]:+.2f}, {off[1]:+.2f} px from its middle, where a scene has it.",
        "",
        "[uncertainty]",
        f"covariance = {given}",
    ])  # fmt: skip


def facts(found: CameraCalibration, seen: Boards, units: str, compared: Compared | None = None) -> dict[str, Any]:
    """The document of ``ice calibrate-camera --json``."""
    lens = found.lens
    if isinstance(lens, SplinedIntrinsics):
        bent = {"spline": lens.spline.model_dump(include={"plane", "extent", "right", "down"})}
    else:
        bent = {"distortion": list(lens.distortion)}
    return {
        "status": found.status,
        "image": list(found.image_shape[::-1]),
        "units": units,
        "lens": {**picked(lens, "fx", "fy", "cx", "cy"), **bent},
        "names": list(found.names),
        "values": found.values.tolist(),
        "sd": found.sd.tolist(),
        "covariance": found.covariance.tolist(),
        "correlation": found.correlation.tolist(),
        **picked(found, "rms_px", "chi_square", "freedom", "p_value", "dispersion"),
        "sags": found.sags.tolist() if found.curved else None,
        "sag_sd": np.sqrt(np.diag(found.sag_covariance)).tolist() if found.curved else None,
        "compared": compared
        and {
            **picked(compared, "rms_px", "p_value", "proposed"),
            "models": list(compared.models),
        },
        "boards": _board_facts(found, seen),
        "left_out": [{"file": str(path), "reason": reason} for path, reason in seen.left_out],
    }


def _board_facts(found: CameraCalibration, seen: Boards) -> list[dict[str, Any]]:
    told = []
    for file, board, left, pose, covariance in zip(
        seen.files, seen.boards, found.residuals, found.poses, found.pose_covariance, strict=True
    ):
        away = pose[3:]
        distance = float(np.linalg.norm(away))
        told.append({
            "file": str(file), "shape": list(board.shape), "noise": board.noise, "blur_px": board.blur_px,
            "status": {name: board.status.count(name) for name in sorted(set(board.status))},
            "rms_px": float(np.sqrt(2 * np.nanmean(left**2))), "pose": pose.tolist(),
            "pose_sd": np.sqrt(np.diag(covariance)).tolist(), "distance": distance,
            "distance_sd": float(np.sqrt(away @ covariance[3:, 3:] @ away) / distance),
        })  # fmt: skip
    return told


def _strong(found: CameraCalibration) -> list[tuple[str, str, float]]:
    """Pairs by correlation, the strongest first; at least one where there are any."""
    with np.errstate(invalid="ignore"):
        rho = found.correlation
    pairs = [(a, b, float(rho[i, j])) for i, a in enumerate(found.names) for j, b in enumerate(found.names[:i])]
    pairs = sorted((pair for pair in pairs if np.isfinite(pair[2])), key=lambda pair: -abs(pair[2]))
    return [pair for pair in pairs if abs(pair[2]) > _STRONG] or pairs[:1]


def _check_finite(found: CameraCalibration) -> None:
    if not np.isfinite(found.covariance).all():
        raise InvalidInput("BOARD must determine a camera, got boards that leave its covariance infinite")


def _covariance(found: CameraCalibration) -> dict[str, Any]:
    _check_finite(found)
    told = found.for_budget
    return {"names": list(told.names), "matrix": [list(row) for row in told.matrix]}
