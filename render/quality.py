"""What the accuracy of a noise-free image costs: rays a pixel."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scenes import InvalidInput


@dataclass(frozen=True)
class Quality:
    """What the clean image's accuracy costs.

    Attributes
    ----------
    supersample : int
        Fine pixels that divide a pixel, each way.
    samples : int, optional
        Rays a fine pixel, a square number; 4 in compiled variants and 1 in scalar ones when not given.
    edge_samples : int, optional
        Rays of a fine pixel that an edge crosses, a square number; 256 when not given, but in scalar variants 64 for a
        diffuse surface, and 16 for the paper's reflectance where it has no texture (`render.texture`) and runs as
        interpreted Python, some 40 times slower. Where single rays are random all pixels that the task's edges are
        located from get as many, in images of at most 131,072 pixels; of curved parts whose random light is faint, in
        scalar variants, 16. In larger ones, and where not ``everywhere``, they get ``random_samples``.
    random_samples : int, optional
        Rays of every other pixel, as a whole, where a single ray is random wherever it hits (interreflection, an
        aperture, a light of finite size), a square number; 16 when not given, 4 in scalar variants where that light is
        faint. Light between plane faces is told by fewer pixels there, straight lines between them.
    seed : int
    everywhere : bool
        Whether pixels that nothing is measured by are seen as well as the others. If not, they are dark or, where light
        takes random ways, have the direct light alone: for images that are measured and not looked at.
    alike : bool
        Whether whatever is rendered from one place has the same rays, in scalar variants: of fine pixels that an edge
        crosses they stand in a grid, and what surfaces send to each other is rendered apart, in whole pixels, and added
        to the direct light. For the difference of two images, which few rays tell; an image itself is off by some
        tenths of a standard deviation.
    denser : int
        Times more rays, each way, of all fine pixels where a single ray is random.
    gathered : bool
        Whether rays of light between faces end at the first that they meet, which sends what patches tell of it
        (`render.gathered`), where they do: most of the noise is of light that met more. In scalar variants, where not
        ``everywhere``.

    On Task1's 16 settings, eight seeds, a scalar variant's lines lie within 0.00024 px (rms; 0.0007 at most) of the
    exact image's and its distances within 0.0008 px (0.0025), for 0.15 s of one core a setting; with 256 rays its
    distances lie within 0.0003 px (0.0006).
    """

    supersample: int = 4
    samples: int | None = None
    edge_samples: int | None = None
    random_samples: int | None = None
    seed: int = 0
    everywhere: bool = True
    alike: bool = False
    denser: int = 1
    gathered: bool = False

    def __post_init__(self) -> None:
        for name in ("supersample", "denser"):
            if getattr(self, name) < 1:
                raise InvalidInput(f"{name} must be at least 1, got {getattr(self, name)}")
        for name in ("samples", "edge_samples", "random_samples"):
            value = getattr(self, name)
            if value is not None and (value < 1 or math.isqrt(value) ** 2 != value):
                raise InvalidInput(f"{name} must be a square number, got {value}")
