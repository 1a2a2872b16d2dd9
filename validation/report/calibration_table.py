"""What ``ice calibrate`` prints."""

from __future__ import annotations

from rich.table import Table

from measure.calibration import Calibration, Curve, blur_for
from validation.report import cells


def facts(found: Calibration) -> dict:
    return {**vars(found), "curves": [vars(curve) for curve in found.curves]}


def table(found: Calibration) -> Table:
    caption = (
        "kappa^2: variance of an edge point across its edge, px^2, over (noise / contrast)^2.\n"
        "correlation: over how many px along the edge errors are alike.\n"
        "product: of the two, which decides how well a line is found. efficiency: the bound over it.\n"
        "linear to: noise / contrast up to which that holds.\n"
        f"closed form of gradient: kappa^2 {found.closed_kappa2:.3f} over {found.closed_correlation_px:.2f} px; the "
        f"calibrated model uses it. Bound of kappa^2 x length: {found.bound:.3f} px.\n"
        f"The paper's kappa^2 is {found.paper_kappa2}; the closed form gives that at a lens blur of "
        f"{blur_for(found.paper_kappa2, found.scale_px):.2f} px instead of {found.blur_px:g}.\n"
        "floor: noise-free error of the points. strip and arrangement find none: theirs is the variance "
        "of a line's middle, told at gradient's length."
    )
    columns = ("locator", "floor px", "kappa^2", "correlation px", "product px", "efficiency",
               "linear to noise/contrast")  # fmt: skip
    title, rows = f"{found.scene}: position noise of the locators", map(_row, found.curves)
    return cells.table(title, *columns, rows=rows, caption=caption, padding=(0, 2))


def _row(curve: Curve) -> list[str]:
    product = curve.kappa2 * curve.correlation_px
    values = (curve.floor_px, curve.kappa2, curve.correlation_px, product, curve.efficiency, curve.linear_to)
    return [curve.name, *map(cells.number, values)]
