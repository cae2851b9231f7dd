"""The Python expressions of a xacro file, evaluated without giving them Python.

xacro forbids names with double underscores and takes the builtins away; a lambda, a format string or an
attribute gets around that. So here an expression is first parsed, and only listed forms are evaluated.
What can reach further, or take long, goes through a function that looks at the values: every attribute, every
operator that can make something large, every call, every turn of a loop.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import CodeType, MappingProxyType
from typing import Any

from twin.models.expansion.sandbox import Refused
from twin.models.expansion.xacro_values import FUNCTIONS, WIDE, checked, size_of

MAX_LENGTH = 10_000
"""Characters of an expression."""
MAX_STEPS = 1_000_000
"""Calls and turns of loops in one file; a hundred items of a value that is worked on count as one."""
NODES = (
    "Expression Constant Name Load Store Attribute Subscript Slice Tuple List Dict Set Starred BoolOp And Or "
    "UnaryOp UAdd USub Not Invert BinOp Add Sub Mult Div FloorDiv Mod Pow LShift RShift BitAnd BitOr BitXor "
    "Compare Eq NotEq Lt LtE Gt GtE Is IsNot In NotIn IfExp Call keyword ListComp SetComp DictComp "
    "GeneratorExp comprehension Lambda arguments arg JoinedStr FormattedValue"
)
ALLOWED = tuple(getattr(ast, name) for name in NODES.split())
FORMS = {"NamedExpr": ":=", "Await": "await", "Yield": "yield", "MatMult": "@"}

METHODS: Mapping[type, frozenset[str]] = MappingProxyType(
    {
        kind: frozenset(names.split())
        for kind, names in {
            str: "capitalize casefold center count endswith find index isalnum isalpha isascii "
            "isdecimal isdigit isidentifier islower isnumeric isspace isupper join ljust lower lstrip "
            "partition removeprefix removesuffix replace rfind rindex rjust rpartition rsplit rstrip split "
            "splitlines startswith strip swapcase title upper zfill",
            dict: "copy get items keys pop setdefault update values clear",
            list: "append clear copy count extend index insert pop remove reverse sort",
            tuple: "count index",
            set: "add copy difference discard intersection isdisjoint issubset issuperset remove union",
            frozenset: "difference intersection isdisjoint issubset issuperset union",
            int: "real imag numerator denominator bit_length conjugate",
            float: "real imag is_integer conjugate",
            complex: "real imag conjugate",
        }.items()
    }
)
"""What values have; functions, classes, generators and modules have no attributes here."""
_DUNDER = re.compile(r"__\w+__")
_ATTRIBUTE, _CALL, _LOOP, _STEP, _WEIGH = "<attribute>", "<call>", "<loop>", "<step>", "<weigh>"
_OPERATORS = {ast.Add: "<+>", ast.Mult: "<*>", ast.Pow: "<**>", ast.LShift: "<<<>", ast.Mod: "<%>"}


class Expressions:
    """Evaluates the expressions of one file.

    Args:
        namespace: Mappings of this type have nothing but their items, as attributes.
        record: Mappings of this type have their items as attributes too.
    """

    def __init__(self, namespace: type[Any], record: type[Any]) -> None:
        self._namespace = namespace
        self._record = record
        self._steps = 0
        # These names are no Python names, so that no expression can use or replace them.
        self._builtins: dict[str, Any] = {
            _ATTRIBUTE: self._attribute,
            _CALL: self._call,
            _LOOP: self._loop,
            _STEP: self._step,
            _WEIGH: self.weigh,
            **{name: self._operator(function) for name, function in FUNCTIONS.items()},
        }

    def evaluate(
        self, expression: str, variables: dict[str, Any], more: Mapping[str, Any] | None = None
    ) -> Any:
        """Return the value of an expression.

        Args:
            expression: Its text.
            variables: What it may name; the builtins are replaced in it.
            more: Looked up before `variables`.

        Raises:
            Refused: It is of a form that a model file has no need of, or its value gets too large.
            Exception: Whatever the evaluation raises.
        """
        code = compiled(expression.strip())
        # A copy each time: the table of an include's namespace can be named, and changed, by an expression.
        variables.update(__builtins__=dict(self._builtins))
        return self.weigh(eval(code, variables, more))

    def weigh(self, value: Any) -> Any:
        """Return a value that is not too large to be written out, and count the work that it will be.

        Raises:
            Refused: It is too large, or the file has done enough.
        """
        self._step(checked(value), size_of(value) // 100)
        return value

    def _attribute(self, value: Any, name: str) -> Any:
        # Items only: a namespace's own attributes lead to the tables of the expansion.
        if isinstance(value, self._namespace):
            if name in value:
                return value[name]
            raise NameError(f"name '{name}' is not defined")
        for kind, names in METHODS.items():
            if isinstance(value, kind) and name in names:
                return getattr(value, name)
        if isinstance(value, self._record):
            return value[name]
        raise Refused(f"'.{name}' of a {type(value).__name__} is not for model files")

    def _call(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        for value in (*args, *kwargs.values()):
            self.weigh(value)
        return self.weigh(function(*args, **kwargs))

    def _operator(self, function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        return lambda a, b: self.weigh(function(a, self.weigh(b) if isinstance(a, str) else b))

    def _loop(self, items: Iterable[Any]) -> Iterator[Any]:
        for item in items:
            yield self._step(item)

    def _step(self, value: Any, work: int = 0) -> Any:
        self._steps += 1 + work
        if self._steps > MAX_STEPS:
            raise Refused(f"the file's expressions take more than {MAX_STEPS} calls and turns of loops")
        return value


@functools.lru_cache(maxsize=4096)
def compiled(expression: str) -> CodeType:
    """Return the code of an expression with its guards.

    Raises:
        Refused: It is of a form that a model file has no need of.
        SyntaxError: It is no expression.
    """
    if len(expression) > MAX_LENGTH:
        raise Refused(f"an expression of {len(expression)} characters; at most {MAX_LENGTH} are read")
    try:
        tree = ast.parse(expression, "<expression>", "eval")
        for node in ast.walk(tree):
            _check(node)
        guarded = ast.fix_missing_locations(_Guards().visit(tree))
        return compile(guarded, "<expression>", "eval")
    except (RecursionError, MemoryError):
        raise Refused("the expression is nested too deeply") from None


def _check(node: ast.AST) -> None:
    if not isinstance(node, ALLOWED):
        kind = type(node).__name__
        raise Refused(f"'{FORMS.get(kind, kind)}' is not for expressions of model files")
    for name in _names(node):
        if name.startswith("__") or (isinstance(node, ast.Attribute) and name.startswith("_")):
            raise Refused(f"'{name}': names of Python's inside are not for model files")
    if isinstance(node, ast.Constant):
        checked(node.value)
        if isinstance(node.value, str) and _DUNDER.search(node.value):
            raise Refused(f"'{node.value[:40]}': names of Python's inside are not for model files")
    if isinstance(node, ast.FormattedValue) and node.format_spec is not None:
        parts = node.format_spec.values if isinstance(node.format_spec, ast.JoinedStr) else []
        if any(not isinstance(part, ast.Constant) or WIDE.search(str(part.value)) for part in parts):
            raise Refused("a format this wide is not for model files")


def _names(node: ast.AST) -> tuple[str, ...]:
    if isinstance(node, ast.Name):
        return (node.id,)
    if isinstance(node, ast.Attribute):
        return (node.attr,)
    if isinstance(node, ast.arg | ast.keyword):
        return (node.arg or "",)
    return ()


class _Guards(ast.NodeTransformer):
    """Puts the guards into an expression."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        self.generic_visit(node)
        return _apply(_ATTRIBUTE, node.value, ast.Constant(node.attr))

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        return ast.Call(_name(_CALL), [node.func, *node.args], node.keywords)

    def visit_Lambda(self, node: ast.Lambda) -> ast.AST:
        return self._guard(node, "body", _STEP)

    def visit_comprehension(self, node: ast.comprehension) -> ast.AST:
        return self._guard(node, "iter", _LOOP)

    def visit_FormattedValue(self, node: ast.FormattedValue) -> ast.AST:
        return self._guard(node, "value", _WEIGH)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        guard = _OPERATORS.get(type(node.op))
        return node if guard is None else _apply(guard, node.left, node.right)

    def _guard(self, node: ast.AST, field: str, guard: str) -> ast.AST:
        self.generic_visit(node)
        setattr(node, field, _apply(guard, getattr(node, field)))
        return node


def _apply(function: str, *values: ast.expr) -> ast.Call:
    return ast.Call(_name(function), list(values), [])


def _name(name: str) -> ast.Name:
    return ast.Name(name, ast.Load())
