"""What each function of the product gave in some calls of a case: recorded while stored cases run."""

from __future__ import annotations

import contextlib
import functools
import importlib
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from scenes.model import rebuild
from tests.regression.digest import Digest, Digester, together
from tests.regression.stored import uncompiled

ROOT = Path(__file__).parents[2]
PACKAGES = "scenes", "imaging", "planner", "measure", "render", "validation"
CALLS = 1, 2, 4, 8  # of a function in a case
_STEPWISE = 0x20 | 0x80 | 0x200  # flags of generators and coroutines, which return many times
_WITHIN = re.compile(r"\.<(locals|listcomp|setcomp|dictcomp)>")  # the last three are functions until Python 3.12
_CLEARED = (*(f"{name}." for name in PACKAGES), "tests.")  # beginnings of modules whose caches are
_LEFT = "tests.regression.stored", "tests.regression.kept", "tests.regression.returns"  # these know no case
_ONCE = {"render.bsdf._register"}  # kept for as long as the process lives

Call = tuple[Digest, Digest]  # of what a function was given and gave, and of what it held on the way


class Recorder:
    """Some calls of each function, by ``file:qualified name``, of what is run within ``recording``."""

    def __init__(self, root: Path = ROOT, packages: tuple[str, ...] = PACKAGES) -> None:
        self.calls: dict[str, list[Call]] = {}
        self._within = tuple(f"{root / name}/" for name in packages)
        self._root = root
        self._lists: dict[int, tuple[CodeType, list[Call] | None]] = {}  # by a code's place: its hash takes long
        self._counts: dict[int, int] = {}
        self._digester = Digester()

    @contextlib.contextmanager
    def recording(self) -> Iterator[None]:
        """Record; who listens already (``tests.proofs.reach``) goes on to."""
        before = sys.getprofile()
        sys.setprofile(functools.partial(self._listen, before) if before else self._note)
        try:
            yield
        finally:
            sys.setprofile(before)

    def _listen(self, before: Callable[..., Any], frame: FrameType, event: str, given: Any) -> None:
        before(frame, event, given)
        self._note(frame, event, given)

    def _note(self, frame: FrameType, event: str, given: Any) -> None:
        if event != "return":
            return
        code = frame.f_code
        known = self._lists.get(id(code))
        if known is None:
            known = self._lists[id(code)] = code, self._list(code)
        calls = known[1]
        if calls is None:
            return
        count = self._counts[id(code)] = self._counts.get(id(code), 0) + 1
        if count in CALLS:
            calls.append(self._call(code, frame.f_locals, given))

    def _list(self, code: CodeType) -> list[Call] | None:
        """Where the calls of a function go; None if it is not the product's, or a part of a function."""
        name, file = _WITHIN.sub("", code.co_qualname), code.co_filename
        if not file.startswith(self._within) or code.co_flags & _STEPWISE or not code.co_flags & 0x1:
            return None
        if code.co_name.startswith("<") and code.co_name != "<lambda>":
            return None
        return self.calls.setdefault(f"{Path(file).relative_to(self._root)}:{name}", [])

    def _call(self, code: CodeType, held: dict[str, Any], gave: Any) -> Call:
        count = code.co_argcount + code.co_kwonlyargcount
        given = code.co_varnames[:count]
        own = {*code.co_varnames[count:], *code.co_cellvars}  # cells: until Python 3.12 what comprehensions use, too
        way = sorted(own.intersection(held).difference(given, ("__class__",)))
        of = self._digester.of
        outer = together("call", [of(gave), *(of(held[name]) for name in given if name in held)])
        return outer, together("way", [of(held[name]) for name in way])


@functools.cache
def _modules() -> tuple[Any, ...]:
    """All of the product, loaded, its records' checks made: what an import, or a first use, calls is no case's."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    for path in paths:
        if path.name != "__main__.py":
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            with contextlib.suppress(ImportError):
                importlib.import_module(name)
    rebuild()
    ours = (*PACKAGES, "tests")
    return tuple(module for name, module in sorted(sys.modules.items()) if name.split(".")[0] in ours)


@functools.cache
def _caches() -> tuple[Any, ...]:
    """What keeps results of functions of the product and of the tests' cases."""
    held = [each for module in _modules() for each in vars(module).values()]
    held += [each for kind in held if isinstance(kind, type) for each in vars(kind).values()]
    found = {id(each): each for each in held if isinstance(each, functools._lru_cache_wrapper)}
    return tuple(
        each
        for each in found.values()
        if each.__module__.startswith(_CLEARED)
        and not each.__module__.startswith(_LEFT)
        and f"{each.__module__}.{each.__qualname__}" not in _ONCE
    )


def forget() -> None:
    """Clear what earlier cases left: the calls of the next are then always the same."""
    from measure.features import shape

    for each in _caches():
        each.cache_clear()
    shape._TOOLS.clear()


def recorded(make: Callable[[], Any]) -> dict[str, list[Call]]:
    """Some calls of each function that a case calls, rendered as everywhere: not compiled."""
    _modules()
    forget()
    recorder = Recorder()
    with uncompiled(), recorder.recording():
        make()
    return recorder.calls
