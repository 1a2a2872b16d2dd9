"""Where the time of a run went, as a picture."""

from __future__ import annotations

from collections.abc import Mapping

from markupsafe import Markup

from validation.report.canvas import TEXT, WIDTH, inline, plt

_WORDS = {
    "predict": "predicted without an image",
    "render": "rendered without noise",
    "propagate": "predicted from the image",
    "correct": "biases simulated",
    "prepare": "estimators prepared",
    "expose": "noise drawn",
}
_OF_IMAGES = ("expose",)  # and all methods: once for each noisy image
_BESIDE = ("wall", "workers")
_HEIGHT = 0.36  # inches a bar


def parts(seconds: Mapping[str, float]) -> dict[str, float]:
    """Working seconds of all workers by what they were spent on, the longest first.

    >>> parts({"wall": 3.0, "workers": 2, "render": 1.0, "canny@12": 4.0})
    {'canny@12': 4.0, 'render': 1.0}
    """
    return dict(sorted(((k, v) for k, v in seconds.items() if k not in _BESIDE), key=lambda part: -part[1]))


def drawn(seconds: Mapping[str, float], images: int) -> Markup:
    """A bar for each part, with its seconds, and of what is done with each of ``images`` the milliseconds an image."""
    found = parts(seconds)
    figure, axis = plt.subplots(figsize=(WIDTH, 0.8 + _HEIGHT * len(found)), layout="constrained")
    bars = axis.barh([_WORDS.get(name, f"measured by {name}") for name in found], list(found.values()), color="#0b5a8f")
    axis.bar_label(bars, [_told(name, value, images) for name, value in found.items()], padding=4, fontsize=TEXT)
    axis.invert_yaxis()
    axis.margins(x=0.45)  # room for the labels
    axis.set_xlabel("seconds of all workers together", fontsize=TEXT)
    axis.tick_params(labelsize=TEXT)
    axis.spines[["top", "right"]].set_visible(False)
    return inline(figure, "time", "Working seconds of the run by what they were spent on")


def _told(name: str, value: float, images: int) -> str:
    if images and (name in _OF_IMAGES or name not in _WORDS):
        return f"{value:.1f} s, {1e3 * value / images:.2g} ms an image"
    return f"{value:.1f} s"
