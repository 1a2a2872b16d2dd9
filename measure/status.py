"""What a measurement can say of itself. Only those in `MEASURED` come with a value."""

OK = "ok"
CLUTTER = "clutter"  # what lies around an edge (another edge, shading, the end of the scale) biases the value
SHORT = "short"  # too little of an edge is left to fit a line
LOW_CONTRAST = "low_contrast"  # too little of the edge stands out of the noise
SIGN_CHANGE = "sign_change"  # the contrast changes sign along the edge
NOT_VISIBLE = "not_visible"  # hidden, or outside the image
ILL_CONDITIONED = "ill_conditioned"  # nearly parallel lines at a corner, or the image tells too little of what is near
AMBIGUOUS = "ambiguous"  # another solution explains the image as well
MISFIT = "misfit"  # the image is not what the model says within its noise: neither value nor variance can be trusted
CORRELATED = "correlated"  # the noise of neighbouring pixels is not independent: the variance says so, not exactly
COMPRESSED = "compressed"  # by JPEG or its like: what is lost is no noise, and the variance is too small
TONE_UNKNOWN = "tone_unknown"  # neither file nor picture says whether levels are linear in the light, and it matters

MEASURED = (OK, TONE_UNKNOWN, CLUTTER, MISFIT, CORRELATED, COMPRESSED)
_WORST_FIRST = (
    NOT_VISIBLE, SHORT, SIGN_CHANGE, LOW_CONTRAST, ILL_CONDITIONED, AMBIGUOUS, COMPRESSED, CORRELATED, MISFIT, CLUTTER,
    TONE_UNKNOWN, OK,
)  # fmt: skip
ALL = frozenset(_WORST_FIRST)


def worst(*statuses: str) -> str:
    """The most serious of several statuses.

    >>> worst("ok", "clutter", "short")
    'short'
    """
    return min(statuses, key=_WORST_FIRST.index)
