"""What is computed once of an object and goes with it, which a cache by itself prevents."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

A = TypeVar("A")
R = TypeVar("R")
P = ParamSpec("P")


def once(function: Callable[Concatenate[A, P], R]) -> Callable[Concatenate[A, P], R]:
    """A function of an object that keeps its results there; all other arguments are hashable.

    >>> class Tool: pass
    >>> @once
    ... def made(tool, number):
    ...     return [number]
    >>> tool = Tool()
    >>> made(tool, 3) is made(tool, 3), made(tool, 3) is made(Tool(), 3)
    (True, False)
    """

    @wraps(function)
    def kept(one: A, *arguments: P.args, **keywords: P.kwargs) -> R:
        results = vars(one).setdefault("_once", {})
        key = function, arguments, tuple(sorted(keywords.items()))
        if key not in results:
            results[key] = function(one, *arguments, **keywords)
        return results[key]

    return kept
