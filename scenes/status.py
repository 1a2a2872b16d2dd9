"""What a prediction or a measurement says of itself: the statuses, what each means, what to do, which may be relied on.

Only those in `MEASURED` come with a value, and only what `is_trusted` may be decided upon, signed, or counted as shown.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from itertools import zip_longest
from typing import Any

OK = "ok"
TONE_UNKNOWN = "tone_unknown"
GLANCED = "glanced"
CLUTTER = "clutter"
MISFIT = "misfit"
UNPLACED = "unplaced"
CORRELATED = "correlated"
COMPRESSED = "compressed"
AMBIGUOUS = "ambiguous"
ILL_CONDITIONED = "ill_conditioned"
LOW_CONTRAST = "low_contrast"
SIGN_CHANGE = "sign_change"
SHORT = "short"
NOT_VISIBLE = "not_visible"

# The worst first.
MEANINGS = {
    NOT_VISIBLE: "what it needs is hidden or outside the image",
    SHORT: "too little of an edge is left in the image",
    SIGN_CHANGE: "the contrast changes its sign along an edge",
    LOW_CONTRAST: "too little of an edge stands out of the noise",
    ILL_CONDITIONED: "edges that meet are nearly parallel, noise decides which edge is found, or the image says too "
    "little of what is near",
    AMBIGUOUS: "another solution explains the image as well",
    COMPRESSED: "compression (JPEG) has lost what is no noise: the variance is too small",
    CORRELATED: "the noise of neighbouring pixels is not independent: the variance is not exact",
    UNPLACED: "the datums tell less of the part's place than was known before, and it matters; or pictures that are "
    "adjusted together leave it open",
    MISFIT: "the image is not what the model says within its noise: neither value nor variance can be relied on",
    CLUTTER: "what lies around an edge (another edge, shading, the end of the scale) biases the value",
    TONE_UNKNOWN: "neither file nor picture says whether levels are linear in the light, and it matters",
    GLANCED: "known at a glance: what lies around its edges, and their bias, have not been looked at closely yet",
    OK: "value and sigma can be relied on",
}
REMEDIES = {
    NOT_VISIBLE: "turn the camera until it sees all of it, take pictures from several sides (`ice plan --views 2`), "
    "or choose another feature",
    SHORT: "come nearer or turn the camera, so that the image of the edge becomes longer",
    SIGN_CHANGE: "move the lamp until the same side is the brighter one along all of the edge",
    LOW_CONTRAST: "move the lamp, expose longer, or choose another edge",
    ILL_CONDITIONED: "turn the camera, or choose edges that meet at a larger angle",
    AMBIGUOUS: "give a start nearer to the true pose, show one more feature, or measure several pictures together",
    COMPRESSED: "save pictures without compression (PNG, TIFF)",
    CORRELATED: "save the sensor's own pixels: no colour filter's interpolation, no resizing, no sharpening",
    UNPLACED: "name datums that lie farther apart or at other heights, turn the camera, or say the part's place more "
    "exactly (`uncertainty.part_shift`, `part_tilt_deg`); of pictures adjusted together take more, or know better "
    "where sensors stand",
    MISFIT: "mend the scene until it describes this picture (`ice fit`), or remove what is not in it",
    CLUTTER: "move lamp or camera (`ice plan`), or say more exactly how the part reflects: the bias is then taken off",
    TONE_UNKNOWN: "save linear levels, or say in the scene how levels follow the light",
    GLANCED: "look closely, by `ice predict` or `ice plan`; while something is dragged, let camera and lamp rest",
    OK: "",
}
WORST_FIRST = tuple(MEANINGS)
ALL = frozenset(MEANINGS)
MEASURED = (OK, GLANCED, TONE_UNKNOWN, CLUTTER, MISFIT, UNPLACED, CORRELATED, COMPRESSED)
OF_SIGMA, OF_TOLERANCE = 1.0, 0.2  # what u(bias) may be of noise, and of half the tolerance zone


def worst(*statuses: str) -> str:
    """The most serious of several statuses.

    >>> worst("ok", "clutter", "short")
    'short'
    """
    return min(statuses, key=WORST_FIRST.index)


def is_trusted(status: Any) -> Any:
    """Whether a value may be decided upon, signed, and counted as shown; the one rule for all that do.

    Parameters
    ----------
    status : str or ndarray of str

    Returns
    -------
    bool or ndarray of bool

    >>> is_trusted("ok"), is_trusted("clutter")
    (True, False)
    """
    return status == OK


def corrected(
    found: str, simulated: str, u_bias: float, sigma: float, tolerance: float = 0.0, *, modelled: bool = True
) -> str:
    """Status of a value whose bias a simulation told and that was taken off; the one rule for all that do.

    What lies around an edge biases a simulated picture as it does the real one, so ``clutter`` is what the correction
    leaves: ``ok`` where its standard uncertainty is small beside the noise or the tolerance, ``clutter`` where not.

    Parameters
    ----------
    found, simulated : str
        Of the value as measured, and in the simulated noise-free picture.
    u_bias, sigma : float
        Standard uncertainties (not variances) of the correction and by noise, of one unit; infinite: not known.
    tolerance : float
        Half of its zone, of the same unit; 0 where there is none.
    modelled : bool
        Whether ``misfit`` of the picture may be what the simulated one has, too.

    Examples
    --------
    >>> corrected("clutter", "clutter", 0.5, 1.0), corrected("clutter", "clutter", 2.0, 1.0)
    ('ok', 'clutter')
    >>> corrected("ok", "short", 0.5, 1.0), corrected("misfit", "ok", 0.0, 1.0), corrected("misfit", "misfit", 0.0, 1.0)
    ('short', 'misfit', 'ok')
    """
    if simulated not in MEASURED or found not in (OK, CLUTTER, MISFIT):
        return worst(found, simulated) if simulated not in MEASURED else found
    if found == MISFIT and not (modelled and simulated == MISFIT):
        return MISFIT
    return OK if math.isfinite(u_bias) and u_bias <= allowed(sigma, tolerance) else CLUTTER


def allowed(sigma: float, tolerance: float = 0.0) -> float:
    """The largest standard uncertainty of a bias that is taken off beside which a value is `ok`; as of `corrected`."""
    return max(OF_SIGMA * sigma, OF_TOLERANCE * tolerance)


def unsure(u_bias: float, sigma: float, tolerance: float, unit: str) -> str:
    """Why a value is `clutter` although its bias is taken off, with the numbers; arguments as of `corrected`.

    >>> unsure(0.031, 0.0021, 0.02, "mm")
    'its bias is known to 0.031 mm (1 sigma); at most 0.004 mm is allowed, a fifth of half the tolerance zone'
    """
    if not math.isfinite(u_bias):
        return "how large its bias is cannot be told"
    which = (
        "the sigma of noise" if OF_SIGMA * sigma >= OF_TOLERANCE * tolerance else "a fifth of half the tolerance zone"
    )
    most = f"at most {allowed(sigma, tolerance):.2g} {unit} is allowed, {which}"
    return f"its bias is known to {u_bias:.2g} {unit} (1 sigma); {most}"


def doubt(status: str, bias: str = "") -> str:
    """Why a value is not relied on, in a few words: what is wrong, and what is not known of it; empty where it is.

    ``bias`` is how large it may be, with its unit, where that is known.

    >>> doubt("clutter"), doubt("short")
    ('clutter, bias unknown', 'short, no value')
    >>> doubt("clutter", "0.03 mm")
    'clutter, bias up to 0.03 mm'
    """
    if is_trusted(status):
        return ""
    if status in (CORRELATED, COMPRESSED):
        return f"{status}, uncertainty unknown"
    if status == UNPLACED:
        return f"{status}, place of the part not told"
    if status not in MEASURED:
        return f"{status}, no value"
    return f"{status}, bias up to {bias}" if bias and status == CLUTTER else f"{status}, bias unknown"


def legend(statuses: Iterable[str], reasons: Iterable[str] = ()) -> list[str]:
    """What each status that is not trusted means, and what to do about it, one line each.

    Parameters
    ----------
    statuses : iterable of str
    reasons : iterable of str
        For each of them what decided it, with its number; empty where that is not known. The first of a status is told.

    Examples
    --------
    >>> legend(["ok", "compressed"])[0].split("; ")[1]
    'save pictures without compression (PNG, TIFF).'
    >>> legend(["short"], ["bore: edge e4 is 3 px long"])[0].split("; ")[0]
    'short: too little of an edge is left in the image (bore: edge e4 is 3 px long)'
    """
    told: dict[str, str] = {}
    for name, reason in zip_longest(statuses, reasons, fillvalue=""):
        if name and not is_trusted(name):
            told[name] = told.get(name) or reason
    return [
        f"{name}: {MEANINGS[name]}{f' ({reason})' if reason else ''}; {REMEDIES[name]}."
        for name, reason in told.items()
    ]


def counted(statuses: Iterable[str]) -> str:
    """Statuses with their numbers, the most frequent first.

    >>> counted(["clutter", "short", "clutter"])
    'clutter 2, short 1'
    """
    return ", ".join(f"{name} {count}" for name, count in Counter(map(str, statuses)).most_common())
