"""Filters of messages, as `ros2 topic echo --filter "m.data > 3"`: a small part of Python, never more.

`ros2` evaluates any Python; here only what is listed is understood, so that a copied command can do no harm.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from twin.errors import BridgeError, nearest

Filter = Callable[[Any], bool]

_VALID = (
    "m and its fields, numbers, texts, lists, [index], comparisons, in, and, or, not, + - * / // %, "
    "a if b else c, for … in … inside any(), all(), sum(), len(), min(), max(), abs(), round(), "
    "math functions, and methods of texts such as m.data.startswith('a')"
)

_BINARY: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
}
_COMPARE: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
}
_UNARY: dict[type[ast.AST], Callable[[Any], Any]] = {
    ast.Not: operator.not_,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Invert: operator.invert,
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    function.__name__: function
    for function in (abs, all, any, bool, float, int, len, max, min, round, sorted, str, sum)
} | {
    function.__name__: function
    for function in (
        *(math.sqrt, math.hypot, math.sin, math.cos, math.atan2, math.fabs, math.floor, math.ceil),
        *(math.isnan, math.isinf, math.isfinite),
    )
}
_MATH = {"pi": math.pi, "inf": math.inf, "nan": math.nan, "tau": math.tau, "e": math.e}
_TEXT_METHODS = ("startswith", "endswith", "lower", "upper", "strip", "find", "count", "split", "isdigit")


def compile_filter(expression: str) -> Filter:
    """Return a function that says of a message whether the expression is true for it.

    Raises:
        BridgeError: not an expression of the part that is understood; the filter raises it too, if a message
            has no such field or the values cannot be compared.
    """
    try:
        tree = ast.parse(expression.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        reason = error.msg if isinstance(error, SyntaxError) else "too deep"
        raise BridgeError(f"--filter {expression!r} is no expression ({reason}); valid: {_VALID}") from error
    for node in ast.walk(tree):
        _check(node, expression)

    def accepts(message: Any) -> bool:
        try:
            return bool(_value(tree, {"m": message}))
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            raise BridgeError(f"--filter {expression!r} cannot be told of this message: {error}") from error

    return accepts


_ALLOWED = (
    *(ast.Attribute, ast.BinOp, ast.BoolOp, ast.Call, ast.Compare, ast.Constant, ast.GeneratorExp, ast.IfExp),
    *(
        ast.List,
        ast.ListComp,
        ast.Load,
        ast.Name,
        ast.Slice,
        ast.Store,
        ast.Subscript,
        ast.Tuple,
        ast.UnaryOp,
    ),
    *(ast.comprehension, ast.boolop, *_BINARY, *_COMPARE, *_UNARY),
)


def _check(node: ast.AST, expression: str) -> None:
    bad = not isinstance(node, _ALLOWED)
    if isinstance(node, ast.Attribute):
        bad = node.attr.startswith("_")
    elif isinstance(node, ast.Call):
        function = node.func
        known = (isinstance(function, ast.Name) and function.id in _FUNCTIONS) or isinstance(
            function, ast.Attribute
        )
        bad = not known or bool(node.keywords)
    elif isinstance(node, ast.comprehension):
        bad = not isinstance(node.target, ast.Name) or bool(node.is_async)
    elif isinstance(node, ast.Constant):
        bad = not isinstance(node.value, (bool, int, float, str, type(None)))
    if bad:
        where = ast.unparse(node) if isinstance(node, ast.expr) else type(node).__name__
        raise BridgeError(f"--filter {expression!r}: {where!r} is not understood; valid: {_VALID}")


def _value(node: ast.AST, names: Mapping[str, Any]) -> Any:
    """Return what a checked expression is worth."""
    match node:
        case ast.Constant():
            return node.value
        case ast.Name():
            if node.id not in names:
                raise LookupError(f"{node.id!r} is not known; the message is m")
            return names[node.id]
        case ast.Attribute(value=ast.Name(id="math"), attr=name):
            return _MATH[name]
        case ast.Attribute():
            return _attribute(_value(node.value, names), node.attr)
        case ast.Subscript():
            return _value(node.value, names)[_value(node.slice, names)]
        case ast.Slice(lower=lower, upper=upper, step=step):
            return slice(*(None if part is None else _value(part, names) for part in (lower, upper, step)))
        case ast.List() | ast.Tuple():
            return [_value(item, names) for item in node.elts]
        case ast.IfExp():
            return _value(node.body if _value(node.test, names) else node.orelse, names)
        case ast.UnaryOp():
            return _UNARY[type(node.op)](_value(node.operand, names))
        case ast.BinOp():
            return _binary(node, names)
        case ast.BoolOp():
            return _either(node, names)
        case ast.Compare():
            return _compare(node, names)
        case ast.GeneratorExp() | ast.ListComp():
            return list(_elements(node.elt, node.generators, names))
        case ast.Call():
            return _call(node, names)
    raise TypeError(f"{ast.unparse(node)} has no value")


def _attribute(owner: Any, name: str) -> Any:
    """Return a field of a message."""
    from twin.bridge.types.fields import fields_of

    if not hasattr(owner, "__msgtype__"):
        raise AttributeError(f"{type(owner).__name__} has no field {name!r}")
    fields = {field.name: field.attribute for field in fields_of(owner.__msgtype__)}
    if name not in fields:
        raise AttributeError(f"{owner.__msgtype__} has no field {name!r}; {nearest(name, fields)}")
    return getattr(owner, fields[name])


def _binary(node: ast.BinOp, names: Mapping[str, Any]) -> Any:
    left, right = _value(node.left, names), _value(node.right, names)
    if isinstance(node.op, (ast.Mult, ast.Mod)) and isinstance(left, (str, list)):
        raise TypeError("texts and lists cannot be multiplied or formatted")
    if isinstance(node.op, ast.Mult) and isinstance(right, (str, list)):
        raise TypeError("texts and lists cannot be multiplied")
    return _BINARY[type(node.op)](left, right)


def _either(node: ast.BoolOp, names: Mapping[str, Any]) -> Any:
    value: Any = None
    for part in node.values:
        value = _value(part, names)
        if bool(value) is isinstance(node.op, ast.Or):
            return value
    return value


def _compare(node: ast.Compare, names: Mapping[str, Any]) -> Any:
    left = _value(node.left, names)
    result: Any = True
    for operation, part in zip(node.ops, node.comparators, strict=True):
        right = _value(part, names)
        result = _COMPARE[type(operation)](left, right)
        if not result:
            return result
        left = right
    return result


def _elements(element: ast.expr, loops: list[ast.comprehension], names: Mapping[str, Any]) -> Iterator[Any]:
    if not loops:
        yield _value(element, names)
        return
    loop, *inner = loops
    assert isinstance(loop.target, ast.Name)
    for value in _value(loop.iter, names):
        bound = {**names, loop.target.id: value}
        if all(_value(condition, bound) for condition in loop.ifs):
            yield from _elements(element, inner, bound)


def _call(node: ast.Call, names: Mapping[str, Any]) -> Any:
    arguments = [_value(argument, names) for argument in node.args]
    if isinstance(node.func, ast.Name):
        return _FUNCTIONS[node.func.id](*arguments)
    assert isinstance(node.func, ast.Attribute)
    if isinstance(node.func.value, ast.Name) and node.func.value.id == "math":
        return _FUNCTIONS[node.func.attr](*arguments)
    owner = _value(node.func.value, names)
    if not isinstance(owner, str) or node.func.attr not in _TEXT_METHODS:
        raise TypeError(f"{node.func.attr}() is no method of a text that is understood")
    return getattr(owner, node.func.attr)(*arguments)
