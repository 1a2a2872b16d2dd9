"""A pytest plugin that records how near each comparison of the tests comes to its limit.

`pytest -p tests.margins.recorder --margins FILE ...`: of every place that compares numbers the worst margin, value over
limit, is added to FILE, a line of JSON each. Asserts are rewritten before pytest rewrites them; `pytest.approx` and the
comparisons of NumPy are wrapped where tests call them. What compares no floating-point number is not recorded.
"""

from __future__ import annotations

import ast
import builtins
import functools
import json
import math
import os
import sys
from pathlib import Path

import numpy as np
import numpy.testing
import pytest
from _pytest.assertion import rewrite

TESTS = Path(__file__).resolve().parent.parent
_NAME = "__compared_with_margin__"
_OPERATORS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}
_worst: dict[tuple[str, int], dict] = {}
_inside = False  # a comparison that is part of a recorded one


def pytest_addoption(parser):
    parser.addoption("--margins", metavar="FILE", help="add the worst margin of each comparison, a line of JSON each")


def pytest_configure(config):
    if config.getoption("--margins") is None:
        return
    setattr(builtins, _NAME, compared)
    original = rewrite.rewrite_asserts

    def with_margins(module, source, path=None, config=None):
        if path and TESTS in Path(path).resolve().parents:
            ast.fix_missing_locations(_Compared().visit(module))
        original(module, source, path, config)

    rewrite.rewrite_asserts = with_margins
    rewrite._read_pyc, rewrite._write_pyc = (lambda *_: None), (lambda *_: True)  # the cache holds asserts without
    config.pluginmanager.rewrite_hook._must_rewrite.add("tests")  # helpers too
    _wrap_approx()
    for module, name, ratio in _CLOSE:
        setattr(module, name, _wrapped(getattr(module, name), ratio))


def pytest_sessionfinish(session):
    name = session.config.getoption("--margins")
    if name is not None and _worst:
        with Path(name).open("a") as file:
            file.write("".join(json.dumps(record) + "\n" for record in _worst.values()))


def record(place: tuple[str, int], value: float, limit: float, ratio: float) -> None:
    """Keep it if none of that file and line came nearer to its limit."""
    before = _worst.get(place)
    if math.isnan(ratio) or (before and before["ratio"] >= ratio):
        return
    test = os.environ.get("PYTEST_CURRENT_TEST", "").removesuffix(" (call)")
    file, line = Path(place[0]).relative_to(TESTS.parent).as_posix(), place[1]
    _worst[place] = {"file": file, "line": line, "ratio": ratio, "value": value, "limit": limit, "test": test}


class _Compared(ast.NodeTransformer):
    """Comparisons of size that an assert, or a helper's result, stands on become calls of `compared`."""

    def visit_Assert(self, node):
        self.generic_visit(node)
        node.test = self._stands_on(node.test, node.lineno, False, "all")
        return node

    def visit_Return(self, node):
        self.generic_visit(node)
        node.value = node.value and self._stands_on(node.value, node.lineno, False, "held")
        return node

    def _stands_on(self, node, line, negated, which):
        again = functools.partial(self._stands_on, line=line)
        match node:
            case ast.Compare(ops=ops) if all(type(op) in _OPERATORS for op in ops):
                signs = ast.Constant("".join(_OPERATORS[type(op)] + " " for op in ops).rstrip())
                middle = node.comparators[0]
                fixed = isinstance(middle, ast.Constant) or (isinstance(middle, ast.Name) and middle.id.isupper())
                between = len(ops) == 2 and not fixed
                more = [signs, *map(ast.Constant, (negated, which, between, line))]
                called = ast.Call(ast.Name(_NAME, ast.Load()), more + [node.left, *node.comparators], [])
                return ast.copy_location(called, node)
            case ast.BoolOp(op=op):
                surely = isinstance(op, ast.And) != negated
                node.values = [again(part, negated=negated, which=which if surely else "held") for part in node.values]
            case ast.UnaryOp(op=ast.Not()):
                node.operand = again(node.operand, negated=not negated, which=which)
            case ast.Call(func=ast.Attribute(value=inner, attr="all" | "any" as name), args=[]):
                node.func.value = again(inner, negated=negated, which=_of(name, negated, which))
            case ast.Call(func=ast.Name(id="all" | "any" as name), args=[ast.GeneratorExp() as several]):
                each = "held" if _of(name, negated, which) != "all" else "all"
                several.elt = again(several.elt, negated=negated, which=each)
        return node


def _of(name: str, negated: bool, which: str) -> str:
    """Must all comparisons hold, or one of them? "held": not known, record those that do."""
    return which if (name == "all") != negated else "any"


def compared(signs: str, negated: bool, which: str, between: bool, line: int, *operands):
    """What the comparison gives; its margin is recorded."""
    signs = signs.split()
    result = True
    for sign, left, right in zip(signs, operands, operands[1:], strict=False):
        one = _python(sign, left, right)
        result = one if result is True else result & one if isinstance(one, np.ndarray) else result and one
    kinds = [_float(operand) for operand in operands]
    if None not in kinds and any(kinds) and not _counted(kinds, operands):
        ratios, value, limit = _margins(signs, operands, between, negated)
        held = np.asarray(result).all() != negated
        if ratios.size and (which != "held" or held):
            worst = np.argmin(ratios) if which == "any" else np.argmax(ratios)
            at = [float(np.broadcast_to(part, ratios.shape).flat[worst]) for part in (value, limit)]
            record((sys._getframe(1).f_code.co_filename, line), *at, float(ratios.flat[worst]))
    return result


def _python(sign: str, left, right):
    match sign:
        case "<":
            return left < right
        case "<=":
            return left <= right
        case ">":
            return left > right
    return left >= right


def _float(operand) -> bool | None:
    """Is it of floating point? None if it is no number at all."""
    kind = getattr(operand, "dtype", None)
    if kind is None and isinstance(operand, (list, tuple)):
        return None
    kind = np.asarray(operand).dtype.kind
    return kind == "f" if kind in "fiub" else None


def _counted(kinds: list[bool | None], operands) -> bool:
    """Is it a count beside a whole number, such as a binomial limit?"""
    return not all(kinds) and all((np.asarray(operand) == np.rint(operand)).all() for operand in operands)


def _margins(signs: list[str], operands, between: bool, negated: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value over limit, value and limit; of `low < x < high`, if x is no constant, from the middle of low and high."""
    with np.errstate(all="ignore"):
        numbers = [np.asarray(operand, float) for operand in operands]
        if between and signs[0][0] == signs[1][0]:
            low, value, high = numbers
            half = np.abs(high - low) / 2
            if np.isfinite(half).all() and low.all() and high.all():  # 0 < x < 1 says x is positive
                ratio = np.abs(value - (low + high) / 2) / half
                return *_at_least_1d(1 / ratio if negated else ratio), value, high
        parts = [
            (_ratio(*((a, b) if (sign[0] == "<") != negated else (b, a))), a, b)
            for sign, a, b in zip(signs, numbers, numbers[1:], strict=False)
        ]
    parts = [(*_at_least_1d(part[0]), *part[1:]) for part in parts]
    return (min if negated else max)(parts, key=lambda part: np.nanmax(part[0], initial=0))


def _at_least_1d(ratios: np.ndarray) -> tuple[np.ndarray]:
    return (np.atleast_1d(np.nan_to_num(ratios, nan=0.0, posinf=np.inf)),)


def _ratio(less: np.ndarray, more: np.ndarray) -> np.ndarray:
    """How near `less < more` is to its end: the smaller magnitude over the greater, 0 where their signs differ."""
    ratio = np.where(more > 0, less / more, np.where(less < 0, more / less, np.inf))
    ratio = np.where((less == 0) & (more == 0), 0.0, ratio)  # said of what is exactly zero
    return np.maximum(np.where((less < 0) & (more == 0) | ~np.isfinite(more) & (more > 0), 0.0, ratio), 0.0)


def _close(actual, expected, limit_of) -> tuple[float, float, float]:
    """|actual - expected| where it is worst, what it may be there (of |expected|), and their ratio."""
    with np.errstate(all="ignore"):
        actual, expected = np.broadcast_arrays(np.asarray(actual, float), np.asarray(expected, float))
        away, limit = np.abs(actual - expected), np.broadcast_to(limit_of(np.abs(expected)), actual.shape)
        ratio = np.where(actual == expected, 0.0, away / limit)
    if np.isnan(ratio).all():
        return 0.0, 0.0, math.nan
    worst = np.nanargmax(ratio)
    return tuple(float(part.flat[worst]) for part in (away, limit, ratio))


def _allclose(actual, expected, rtol=1e-5, atol=1e-8, **_):
    return _close(actual, expected, lambda size: atol + rtol * size)


def _math_isclose(actual, expected, *, rel_tol=1e-9, abs_tol=0.0):
    return _close(actual, expected, lambda size: np.maximum(rel_tol * np.maximum(size, abs(actual)), abs_tol))


_CLOSE = [
    (np, "allclose", _allclose),
    (np, "isclose", _allclose),
    (math, "isclose", _math_isclose),
    (numpy.testing, "assert_allclose", functools.partial(_allclose, rtol=1e-7, atol=0.0)),
    (numpy.testing, "assert_almost_equal", lambda a, b, n=7, **_: _close(a, b, lambda _: 1.5 * 10.0**-n)),
    (numpy.testing, "assert_array_almost_equal", lambda a, b, n=6, **_: _close(a, b, lambda _: 1.5 * 10.0**-n)),
]


def _wrapped(function, measured):
    """The function; where a test calls it its margin is recorded."""

    @functools.wraps(function)
    def call(*arguments, **options):
        global _inside
        place, outer, _inside = _place(), _inside, True
        try:
            result = function(*arguments, **options)
        finally:
            _inside = outer
        if place and not outer and (result is None or np.all(result)):  # what a test asks to go another way is no claim
            _recorded(place, lambda: measured(*arguments, **options))
        return result

    return call


def _recorded(place, measured) -> None:
    try:
        record(place, *measured())
    except (TypeError, ValueError):  # compares no numbers
        return


def _place() -> tuple[str, int] | None:
    """File and line of the test, or helper of tests, that called, if one did."""
    frame = sys._getframe(2)
    while frame and ("_pytest" in frame.f_code.co_filename or "numpy" in frame.f_code.co_filename):
        frame = frame.f_back
    path = Path(frame.f_code.co_filename) if frame else None
    return (str(path), frame.f_lineno) if path and TESTS in path.parents else None


def _wrap_approx() -> None:
    kinds = {kind for example in (1.0, [1.0], {"": 1.0}, np.ones(1)) for kind in type(pytest.approx(example)).__mro__}
    for kind in kinds - {object}:
        if "__eq__" in vars(kind):
            kind.__eq__ = _wrapped(kind.__eq__, _approximately)
            kind.__ne__ = _wrapped(lambda approx, actual: not approx.__eq__(actual), _not_approximately)


def _approximately(approx, actual):
    expected, relative, absolute = approx.expected, approx.rel, approx.abs
    if isinstance(expected, dict):
        actual, expected = [actual[key] for key in expected], list(expected.values())
    if relative is None and absolute is not None:
        return _close(actual, expected, lambda _: absolute)
    relative, absolute = 1e-6 if relative is None else relative, 1e-12 if absolute is None else absolute
    return _close(actual, expected, lambda size: np.maximum(relative * size, absolute))


def _not_approximately(approx, actual):
    value, limit, ratio = _approximately(approx, actual)
    return value, limit, 1 / ratio if ratio else math.inf
