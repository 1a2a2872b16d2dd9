"""Which kinds of cameras there are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scenes.registry import Registry

if TYPE_CHECKING:
    from scenes.cameras.pinhole import Camera

CAMERAS: Registry[type[Camera]] = Registry("camera.kind")
