"""What a measurement can say of itself. Only `OK` and `CLUTTER` come with a value."""

OK = "ok"
CLUTTER = "clutter"  # a second edge is too near: the value may be biased
SHORT = "short"  # too little of an edge is left to fit a line
LOW_CONTRAST = "low_contrast"  # too little of the edge stands out of the noise
SIGN_CHANGE = "sign_change"  # the contrast changes sign along the edge
NOT_VISIBLE = "not_visible"  # hidden, or outside the image
ILL_CONDITIONED = "ill_conditioned"  # the lines of a corner are nearly parallel

MEASURED = (OK, CLUTTER)
_WORST_FIRST = (NOT_VISIBLE, SHORT, SIGN_CHANGE, LOW_CONTRAST, ILL_CONDITIONED, CLUTTER, OK)
ALL = frozenset(_WORST_FIRST)


def worst(*statuses: str) -> str:
    """The most serious of several statuses.

    >>> worst("ok", "clutter", "short")
    'short'
    """
    return min(statuses, key=_WORST_FIRST.index)
