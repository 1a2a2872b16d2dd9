"""How `make docs` builds these pages: offline, every warning an error."""

import sys
from importlib.metadata import version as installed
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE / "_extensions")]

project = "ICE"
version = release = installed("ice-vision")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml", "notebooks"]
exclude_patterns = ["_build", "_extensions"]
default_role = "py:obj"
highlight_language = "text"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
html_math_renderer = "mathml"
html_theme = "furo"
html_title = "ICE"
html_static_path = ["_static"]
html_css_files = ["wide.css"]
html_extra_path = ["scene.schema.json"]
html_copy_source = html_show_sphinx = html_show_copyright = False

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
# Types of docstrings are prose ("ndarray, shape (n, 2)"), so no links are sought in them.
napoleon_use_param = napoleon_use_rtype = False
napoleon_custom_sections = [("Attributes", "params_style")]

# What is not public, and other projects' names, have no page here: they are shown without a link.
nitpick_ignore_regex = [("py:.*", ".*")]


def _keys(app: Sphinx, what: str, name: str, found: Any, *rest: Any) -> tuple[str, None] | None:
    """A model of the scene format is told by its keys, whose types and limits the reference of the format has."""
    if what == "class" and issubclass(found, BaseModel):
        return f"(*, {', '.join(found.model_fields)})", None
    return None


_KEPT: dict[str, list[str]] = {}


def _keep(app: Sphinx, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """What an attribute says before napoleon, which takes all before a colon for a type."""
    if what in ("attribute", "data", "property"):
        _KEPT[name] = list(lines)


def _put_back(app: Sphinx, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    lines[:] = _KEPT.pop(name, lines)


def setup(app: Sphinx) -> None:
    """What stands in backticks is a link where it names something public, else code; pydantic's own stays out."""
    app.connect("autodoc-process-docstring", _keep, priority=400)
    app.connect("autodoc-process-docstring", _put_back, priority=600)
    app.connect("autodoc-process-signature", _keys)
    app.connect("missing-reference", lambda app, env, node, shown: shown if node["reftype"] == "obj" else None)
    app.connect("autodoc-skip-member", lambda app, what, name, *rest: True if name.startswith("model_") else None)
