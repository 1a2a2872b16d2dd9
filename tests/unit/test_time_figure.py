"""The picture of where a run's time went."""

import re

from validation.report import time_figure


def test_a_bar_for_each_part_the_longest_first_and_what_an_image_costs():
    """Of 2000 images; what is done once a setting has no cost an image."""
    seconds = {"wall": 9.0, "workers": 2, "render": 2.0, "expose": 3.0, "canny@12": 0.5}
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", time_figure.drawn(seconds, 2000))
    bars = [text for text in texts if text in ("rendered without noise", "noise drawn", "measured by canny@12")]
    assert bars == ["noise drawn", "rendered without noise", "measured by canny@12"]
    assert {"3.0 s, 1.5 ms an image", "2.0 s", "0.5 s, 0.25 ms an image"} <= set(texts)
    assert not [text for text in texts if "wall" in text or text == "measured by workers"]


def test_a_run_without_images_has_no_cost_of_one():
    assert "an image" not in time_figure.drawn({"expose": 3.0}, 0)
