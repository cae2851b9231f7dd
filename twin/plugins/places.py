"""Where a class of a user is written, found by reading alone: nothing of his is imported or run."""

from __future__ import annotations

import ast
import importlib.util
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

from twin.errors import PluginError, Problem, nearest


@dataclass(frozen=True)
class Place:
    """Where a plugin's code is."""

    attribute: str
    """Name of the class or function in its module or file."""
    module: str | None = None
    """Name to import; None: a file that is in no package."""
    file: Path | None = None
    """None: it has no Python source."""
    line: int | None = None
    """1-based line at which it is defined; None: not told by the text."""

    @property
    def depth(self) -> int:
        """In how many packages its file is."""
        is_package = self.file is not None and self.file.name == "__init__.py"
        return 0 if self.module is None else self.module.count(".") + is_package


def in_file(file: Path, attribute: str, what: str) -> Place:
    """Return the place of `FILE.py:Class`; `what` begins a message.

    Raises:
        PluginError: there is no such file or class, or the file is no Python.
    """
    if not file.is_file():
        raise PluginError(Problem(f"{what}: there is no such file", file))
    return Place(attribute, file=file, line=_line_of(file, attribute, what))


def in_module(module: str, attribute: str, what: str) -> Place:
    """Return the place of `module:Class`.

    Raises:
        PluginError: there is no such module or class.
    """
    running = sys.modules.get(module)
    source = getattr(running, "__file__", None)
    if running is None:
        spec = _spec(module)
        if spec is None:
            raise PluginError(
                f"{what}: there is no module '{module}'; install its package, or set PYTHONPATH"
            )
        source = spec.origin
    if source is None or not source.endswith(".py"):
        return Place(attribute, module)
    file = Path(source)
    return Place(attribute, module, file, _line_of(file, attribute, what))


def folder_of(module: str, what: str) -> Path:
    """Return the folder of a package's files.

    Raises:
        PluginError: there is no such package.
    """
    spec = _spec(module)
    folders = None if spec is None else spec.submodule_search_locations
    if not folders:
        raise PluginError(f"{what}: there is no package '{module}'; install it, or set PYTHONPATH")
    return Path(next(iter(folders)))


def _spec(module: str) -> ModuleSpec | None:
    """Find a module without importing the packages that it is in, as `importlib.util.find_spec` would."""
    first, *rest = module.split(".")
    try:
        spec = importlib.util.find_spec(first)
    except (ImportError, ValueError):  # a module that was made by hand, or no name of one
        return None
    for part in rest:
        if spec is None or spec.submodule_search_locations is None:
            return None
        # By its last name alone: for a dotted one, folders without __init__.py ask for the imported parent.
        spec = PathFinder.find_spec(part, list(spec.submodule_search_locations))
    return spec


def _line_of(file: Path, attribute: str, what: str) -> int | None:
    """Return where a name is defined at the top of a file."""
    try:
        tree = ast.parse(file.read_bytes(), filename=str(file))
    except SyntaxError as fault:
        raise PluginError(Problem(f"{what}: SyntaxError: {fault.msg}", file, fault.lineno)) from None
    except (OSError, ValueError) as fault:
        raise PluginError(Problem(f"{what}: cannot be read: {fault}", file)) from None
    names = dict(_names(tree.body))
    own = [node.name for node in tree.body if isinstance(node, ast.ClassDef | ast.FunctionDef)]
    outer = attribute.partition(".")[0]
    if outer in names:
        return names[outer]
    if "*" in names:
        return None
    raise PluginError(
        Problem(f"{what}: there is no '{attribute}' in it; {nearest(attribute, own or names)}", file)
    )


def _names(body: list[ast.stmt]) -> Iterator[tuple[str, int]]:
    """Yield the names that a module's statements bind, with their lines."""
    for statement in body:
        match statement:
            case ast.ClassDef(name=name) | ast.FunctionDef(name=name):
                yield name, statement.lineno
            case ast.ImportFrom(names=aliases) | ast.Import(names=aliases):
                yield from ((alias.asname or alias.name, statement.lineno) for alias in aliases)
            case ast.Assign(targets=targets):
                yield from ((t.id, statement.lineno) for t in targets if isinstance(t, ast.Name))
            case ast.AnnAssign(target=ast.Name(id=name)):
                yield name, statement.lineno
            case ast.If(body=inner, orelse=other) | ast.Try(body=inner, orelse=other):
                yield from _names(inner)
                yield from _names(other)
