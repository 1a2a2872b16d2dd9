"""What ``ice design`` prints."""

from __future__ import annotations

from rich.console import Group
from rich.text import Text

from planner.designing.outcome import Design, Offer
from scenes.status import is_trusted
from validation.designed import StationProof
from validation.report import design_words
from validation.report.cells import pose, table

_BEST = 3  # stations that are told of


def report(found: Design, currency: str, proofs: tuple[StationProof, ...], seconds: float) -> Group:
    """The station, why, the front, what was left out."""
    scene, wishes = found.problem.scene, found.problem.wishes
    asked = (
        f"U <= T / {wishes.k:g}" if wishes.false_acceptance is None
        else f"at most {wishes.false_acceptance:g} of the parts wrongly accepted"
    )  # fmt: skip
    lines = [f"{scene.title or scene.name}: {asked} (T: half of the tolerance zone)"]
    lines += _best(found, currency, rendered=bool(proofs))
    lines += [line for each in proofs for line in _proof(each)]
    parts = [Text("\n".join(lines)), _front(found, currency)]
    notes = [line for offer in _few(found) for line in _why(found, offer, currency)]
    notes += ["Left out:", *(f"  {line}" for line in design_words.left_out(found))]
    notes.append(f"Eye safety is not looked at. {seconds:.1f} s.")
    return Group(*parts, Text("\n".join(notes)))


def _best(found: Design, currency: str, *, rendered: bool) -> list[str]:
    best = found.best
    if best is None:
        return ["Nothing of the catalogue measures all."]
    head = "The least cost that meets it" if found.reached else "Nothing meets it; the nearest"
    if not found.searched.complete:
        head += " (the search was ended)"
    settings = best.rated.settings
    exposure = (
        "exposure as the light is bright" if settings.exposure_s is None else f"{settings.exposure_s * 1e3:.3g} ms"
    )
    opened = (
        [n for n, s in zip(_names(found), best.close.statuses, strict=True) if not is_trusted(s)] if best.close else []
    )
    lines = [
        f"{head}: {design_words.cost(found, best.cost, currency)}, worst U / T {_ratio(found, best)}"
        f" ({design_words.limiting(found, best)})",
        f"  camera {best.rated.names[0]}, f/{settings.f_number:.3g}, {exposure}, at {settings.distance_mm:.4g} mm"
        f" {pose(best.rated.sensor)}",
        f"  lens   {best.rated.names[1]} ({settings.lens.kind}): {1000 * settings.pixel_mm:.3g} um a pixel,"
        f" blur {settings.blur_px:.2f} px",
        f"  light  {best.rated.names[2]}" + (f" at {settings.light_mm:.4g} mm" if settings.light_mm else "")
        + (f" {pose(best.rated.light)}" if best.rated.light else ""),
    ]  # fmt: skip
    if opened and not rendered:
        lines.append(f"  not signed yet: {', '.join(opened)}; their bias is told by rendering (--renders)")
    return lines


def _names(found: Design) -> list[str]:
    return [each.name for each in found.problem.scene.quantities]


def _ratio(found: Design, offer: Offer) -> str:
    value = design_words.u_over_t(found, offer)
    return "-" if value is None else f"{value:.3f}"


def _proof(proof: StationProof) -> list[str]:
    states = "all values may be signed" if proof.trusted else f"statuses {', '.join(proof.budget.statuses)}"
    names = " + ".join(proof.offer.rated.names)
    told = f"{proof.ratio:.3f} (told {proof.offer.ratio:.3f})"
    lines = [f"{names}, rendered: worst U over what is allowed {told}, biases taken off; {states}."]
    if proof.run is not None:
        lines.append(f"Noisy pictures: {proof.run.verdict.text}")
    return lines


def _few(found: Design) -> list[Offer]:
    """The best, and its neighbours on the front."""
    if found.best is None:
        return []
    others = [each for each in found.front if each.rated is not found.best.rated and each.cost >= found.best.cost]
    return [found.best, *others][:_BEST]


def _why(found: Design, offer: Offer, currency: str) -> list[str]:
    sources = ", ".join(f"{name} {100 * share:.0f} %" for name, share in design_words.limits(offer))
    limiting = design_words.limiting(found, offer)
    told = f"{offer.rated.names[0]} + {offer.rated.names[1]}: {limiting} is limited by {sources}"
    more = design_words.step_more(found, offer, currency)
    return [told + (f"; {more}" if more else "")]


def _front(found: Design, currency: str):
    columns = ("cost", "U / T", "camera, lens, light", "sensor", "limited by")
    rows = []
    for each in found.front:
        sources = design_words.limits(each)
        cost, parts = design_words.cost(found, each.cost, currency), "\n".join(each.rated.names)
        rows.append((cost, _ratio(found, each), parts, pose(each.rated.sensor), sources[0][0] if sources else "-"))
    return table("Less U for more", *columns, rows=rows, words=("camera, lens, light", "sensor", "limited by"))
