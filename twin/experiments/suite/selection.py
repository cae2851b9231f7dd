"""Which tests are run: by words of their names, by tags, by shard."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Sequence

from twin.errors import ScenarioError
from twin.experiments.suite.cases import Case

_WORD = re.compile(r"[()]|[^\s()]+")
_OWN = ("and", "or", "not", "(", ")")
_GRAMMAR = ast.Expression | ast.BoolOp | ast.boolop | ast.UnaryOp | ast.Not | ast.Name | ast.Load
"""What Python's own parser may find in an expression; words stand there as names."""


def selected(
    cases: Sequence[Case], *, keyword: str = "", tags: str = "", shard: tuple[int, int] = (1, 1)
) -> list[Case]:
    """Return some of the tests, in their order.

    Args:
        cases: All tests.
        keyword: Words that a test's name contains, with `and`, `or`, `not` and brackets, as `pytest -k`.
        tags: The same of its tags, whole, as `pytest -m`.
        shard: Which part of how many: every n-th test, from the i-th on.

    Raises:
        ScenarioError: An expression is none, or chooses nothing.
    """
    found = list(cases)
    if keyword:
        chosen = expression(keyword, "-k")
        found = [case for case in found if chosen(lambda word, case=case: word.lower() in case.name.lower())]  # type: ignore[misc]
    if tags:
        chosen = expression(tags, "-m")
        found = [case for case in found if chosen(lambda word, case=case: word in case.tags)]  # type: ignore[misc]
    if cases and not found:
        raise ScenarioError(
            f"{_told(keyword, tags)}: chooses none of {len(cases)} tests; {_known(cases, bool(tags))}"
        )
    part, parts = shard
    return found[part - 1 :: parts]


def shard_of(text: str) -> tuple[int, int]:
    """Return which part of how many `I/N` means; raises ScenarioError."""
    match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise ScenarioError(f"--shard {text}: must be I/N, from 1/N to N/N, such as 1/4")
    return int(match[1]), int(match[2])


def expression(text: str, option: str) -> Callable[[Callable[[str], bool]], bool]:
    """Return what tells whether an expression holds, given which words do; raises ScenarioError."""
    words = _WORD.findall(text)
    names = [word if word in _OWN else f"word_{i}" for i, word in enumerate(words)]
    try:
        tree = ast.parse(" ".join(names), mode="eval")
    except (SyntaxError, MemoryError, RecursionError):
        tree = ast.parse("0", mode="eval")
    if not all(isinstance(node, _GRAMMAR) for node in ast.walk(tree)):
        raise ScenarioError(
            f"{option} {text}: must be words with and, or, not and brackets, such as 'seed=3 and not slow'"
        )
    code, words_of = compile(tree, option, "eval"), dict(zip(names, words, strict=True))
    return lambda holds: bool(eval(code, {}, {name: holds(word) for name, word in words_of.items()}))


def _told(keyword: str, tags: str) -> str:
    return " ".join([*([f"-k {keyword}"] if keyword else []), *([f"-m {tags}"] if tags else [])])


def _known(cases: Sequence[Case], tags: bool) -> str:
    names = sorted({tag for case in cases for tag in case.tags}) if tags else [case.name for case in cases]
    shown = ", ".join(names[:20]) or "none"
    return f"{'tags' if tags else 'tests'}: {shown}{', …' if len(names) > 20 else ''}"
