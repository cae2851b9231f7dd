"""Which small changes there are: cosmic-ray's operators on the lines that tests reach."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator

PACKAGES = (
    *("geometry.py", "periods.py", "parameters", "navigation", "controllers", "manipulation", "models"),
    *("sim", "convert", "scenario/checks", "warehouse"),
)
"""Under twin/: what computes, without files, terminals and the network."""
OPERATORS = (
    *(
        f"ReplaceBinaryOperator_{name}"
        for name in ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul", "Mod_Mul", "Pow_Mul")
    ),
    *(
        f"ReplaceComparisonOperator_{name}"
        for name in (
            *("Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt", "Lt_GtE", "LtE_Gt", "Gt_LtE", "GtE_Lt"),
            *("Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is"),
        )
    ),
    *("ReplaceUnaryOperator_Delete_USub", "ReplaceUnaryOperator_Delete_Not"),
    *("AddNot", "ReplaceAndWithOr", "ReplaceOrWithAnd", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue"),
    *("ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ZeroIterationForLoop", "NumberReplacer"),
)
"""Of cosmic-ray. Left out are those that draw at random, that remove decorators (without one a kernel
computes the same), that replace `|`, which is mostly of types, and further replacements of one operator."""
KERNELS = ("jit", "fast_jit")
"""Decorators of compiled functions, whose lines no coverage sees."""


@dataclass(frozen=True, kw_only=True)
class Site:
    """Where an operator can change something."""

    file: str
    """From the repository's root."""
    operator: str
    occurrence: int
    line: int
    lines: range
    """Those of its statement, of a compound one those of its head."""
    in_kernel: bool


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One change of one line."""

    site: Site
    text: str
    """The line as it is ..."""
    becomes: str
    """... and as it would be."""
    source: str
    """The whole file with the change."""

    @property
    def name(self) -> str:
        """What the list of equivalent changes tells it by: no line number, which would not last."""
        return f"{self.site.file}: {self.text} -> {self.becomes}"


def sites_of(root: Path, file: str) -> Iterator[Site]:
    """Yield every place of a file that an operator can change."""
    source = (root / file).read_text("utf-8")
    statements, nodes = _statements(ast.parse(source)), list(ast_nodes(get_ast(source)))
    for name in OPERATORS:
        operator = _operator(name)
        places = [(node, place) for node in nodes for place in operator.mutation_positions(node)]
        for occurrence, (node, ((line, _), _)) in enumerate(places):
            around = [(len(lines), lines, kernel) for lines, kernel in statements if line in lines]
            # Not in a docstring, nor the star of keyword-only parameters.
            if around and not (node.type == "operator" and node.parent.type in ("parameters", "param")):
                _, lines, kernel = min(around, key=lambda found: found[0])
                yield Site(
                    file=file,
                    operator=name,
                    occurrence=occurrence,
                    line=line,
                    lines=lines,
                    in_kernel=kernel,
                )


def mutant_at(root: Path, site: Site) -> Mutant | None:
    """Return the change; None if it leaves the file as it is, or makes it no Python."""
    source = (root / site.file).read_text("utf-8")
    changed = mutate_code(source, _operator(site.operator), site.occurrence)
    try:
        ast.parse(changed or source)
    except SyntaxError:
        return None
    before, after = source.splitlines(), (changed or source).splitlines()
    for one, other in zip(before, after, strict=False):
        if one != other:
            return Mutant(site=site, text=one.strip(), becomes=other.strip(), source=str(changed))
    return None


def _operator(name: str) -> Any:
    return get_operator(f"core/{name}")()


def _statements(tree: ast.Module) -> list[tuple[range, bool]]:
    """Return the lines of every statement, or of its head, and whether it is in a kernel."""
    found = []

    def visit(body: list[ast.stmt], in_kernel: bool) -> None:
        for statement in body:
            last = statement.end_lineno or statement.lineno
            inner = [getattr(statement, name, []) for name in ("body", "orelse", "finalbody", "handlers")]
            first_inner = min((child.lineno for children in inner for child in children), default=last + 1)
            if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
                found.append((range(statement.lineno, max(first_inner, statement.lineno + 1)), in_kernel))
            marks = {ast.unparse(mark) for mark in getattr(statement, "decorator_list", [])}
            for children in inner:
                visit([*children], in_kernel or bool(marks & {*KERNELS}))

    visit(tree.body, False)
    return found
