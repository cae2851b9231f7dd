"""The child process that expands one xacro file.

xacro evaluates Python expressions of the file behind a guard that can be escaped. So only listed forms of
them are evaluated (`xacro_expressions`), and the process gives up what a model file has no business with
(`sandbox`).
It reads twin's own request on stdin, pickled, and writes its answer on stdout as JSON, since a model file has
a say in that.
"""

from __future__ import annotations

import json
import os
import pickle
import re
import sys
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from types import TracebackType
from typing import Any
from xml.dom.minidom import Document, Element

import xacro
import xacro.substitution_args as substitution
import yaml  # noqa: F401  (xacro imports it when asked for; the door is closed then)

from twin.models.expansion.sandbox import Refused, close_the_door, limit_resources, refuse_outside
from twin.models.expansion.xacro_document import Sources, elements, place
from twin.models.expansion.xacro_expressions import Expressions
from twin.models.expansion.xacro_values import checked, guarded_symbols
from twin.models.urdf.packages import Packages, unknown_package
from twin.models.urdf.xml_text import MAX_BYTES

MAX_MACROS = 300
"""Macros inside of each other; some use them as loops."""
MAX_CALLS = 20_000
"""Macros called in one file."""
MAX_INCLUDES = 50
"""Files inside of each other."""
LONGEST = 400
"""Characters of a message: an expression may be part of it."""
UNDEFINED_ARGUMENT = re.compile(r"Undefined substitution argument (\w+)")
FRAMES = 20_000
"""Of the interpreter; a macro takes up to ten."""


def main() -> None:
    """Expand the requested file and answer with its text, or with what went wrong and where."""
    request = pickle.load(sys.stdin.buffer)
    limit_resources()
    with (
        open(os.devnull, "w", encoding="utf-8") as nowhere,
        redirect_stdout(nowhere),
        redirect_stderr(nowhere),
    ):
        answer = _answer(request)  # xacro prints
    json.dump(answer, sys.stdout)


def _answer(request: Mapping[str, Any]) -> dict[str, Any]:
    packages = Packages(request["packages"])
    sys.setrecursionlimit(FRAMES)
    found: dict[str, str] = {}
    expressions = Expressions(xacro.NameSpace, xacro.YamlDictWrapper)
    _guard(Sources(), expressions, packages, found, request["environment"])
    reading = close_the_door(packages)
    try:
        document = xacro.process_file(request["file"], mappings=request["args"])
        # Without xacro's banner: it holds the file's path, and the text is published and part of digests.
        text = '<?xml version="1.0"?>' + document.documentElement.toxml()
        if len(text) > MAX_BYTES:
            message = f"the file expands to {len(text)} bytes; at most {MAX_BYTES} are read"
            raise Refused(message, code="too-large")
        read = reading.files if reading.is_repeatable() else None
        return {"urdf": text, **_table(document.documentElement), "read": read, "found": found}
    except RecursionError:
        return _fault("it is nested too deeply; a macro or property may call itself without end")
    except MemoryError:
        return _fault("the expansion needs more memory than a model file may use")
    except Exception as error:  # every fault of the file, whatever its type, is the user's to read
        return _explain(error)


def _table(top: Element) -> dict[str, Any]:
    """Return the files, and index and line of every element."""
    places = [place(element) or ("", 0) for element in elements(top)]
    files = {file: index for index, file in enumerate(dict.fromkeys(file for file, _ in places))}
    return {"files": list(files), "places": [(files[file], line) for file, line in places]}


def _guard(
    sources: Sources,
    expressions: Expressions,
    packages: Packages,
    found: dict[str, str],
    environment: Mapping[str, str],
) -> None:
    """Put our own functions in the place of those of xacro that read, evaluate or recurse."""
    _guard_reading(sources, expressions, packages)
    _guard_expansion()
    guarded_symbols(xacro._global_symbols)
    guarded_symbols(substitution._eval_dict)
    xacro.safe_eval = expressions.evaluate

    def evaluate_extension(text: str, context: Mapping[str, Any]) -> str:
        names = {**substitution._eval_dict, "arg": lambda name: substitution._eval_arg(name, context["arg"])}
        arguments = {key: substitution.convert_value(value, "auto") for key, value in context["arg"].items()}
        return str(expressions.evaluate(text, {**arguments, **names}))

    def find(package: str) -> str:
        if package in packages:
            found[package] = str(packages[package])
            return found[package]
        raise Refused(f"$(find {package}): package not found; {unknown_package(package, packages)}")

    def env(name: str) -> str:
        if name in environment:
            return environment[name]
        raise Refused(f"$(env {name}): not set, or not allowed; give --allow-env {name}")

    def optenv(name: str, default: str = "") -> str:
        return environment.get(name, default)

    substitution._eval = evaluate_extension
    substitution._eval_dirname = lambda _: os.path.dirname(os.path.abspath(xacro.filestack[-1]))
    functions = {"find": find, "env": env, "optenv": optenv}
    for name, function in functions.items():
        setattr(substitution, f"_eval_{name}", function)
        substitution._eval_dict[name] = function


def _guard_reading(sources: Sources, expressions: Expressions, packages: Packages) -> None:
    def parse(_: None, filename: str) -> Document:
        refuse_outside(filename, packages)
        try:
            return sources.parse(filename)
        except OSError as error:
            # As xacro does: the file is named as missing, not as the place of the fault.
            xacro.filestack.pop()
            raise xacro.XacroException(f"{error.strerror}: {filename}", exc=error) from None

    def read_yaml(filename: str) -> Any:
        refuse_outside(xacro.abs_filename_spec(filename), packages)
        return expressions.weigh(load_yaml(filename))

    load_yaml = xacro.load_yaml
    for table in (xacro._global_symbols, xacro._global_symbols["xacro"]):
        dict.__setitem__(table, "load_yaml", read_yaml)
    xacro.parse = parse
    evaluate = xacro.eval_text
    xacro.eval_text = lambda text, symbols: checked(evaluate(text, symbols))


def _guard_expansion() -> None:
    call, include = xacro.handle_macro_call, xacro.process_include
    calls = 0
    # The same pattern, without the nested repetition whose matching takes exponential time.
    pattern = xacro.re_macro_arg.pattern.replace(r"[^\s'\"]+", r"[^\s'\"]++")
    pattern = pattern.replace("'.*?'", "'[^']*+'").replace(r"\".*?\"", r"\"[^\"]*+\"")
    xacro.re_macro_arg = re.compile(pattern)

    def call_macro(node: Element, macros: Any, symbols: Any) -> bool:
        nonlocal calls
        if node.tagName.startswith("xacro:"):
            name = node.tagName.removeprefix("xacro:")
            calls += 1
            if len(xacro.macrostack) > MAX_MACROS:
                raise Refused(f"macro '{name}' is called {MAX_MACROS} times inside of itself, without end")
            if calls > MAX_CALLS:
                raise Refused(f"more than {MAX_CALLS} macros are called, the last one is '{name}'")
        return call(node, macros, symbols)

    def include_file(node: Element, macros: Any, symbols: Any, expand: Any) -> None:
        if len(xacro.filestack) > MAX_INCLUDES:
            chain = " -> ".join(map(os.path.basename, xacro.filestack[-3:]))
            raise Refused(f"files include each other without end: … -> {chain}")
        include(node, macros, symbols, expand)

    xacro.handle_macro_call = call_macro
    xacro.process_include = include_file


def _explain(error: Exception) -> dict[str, Any]:
    refused = _refusal(error)
    file, line = _place(error.__traceback__)
    if refused is not None and refused.file is not None:
        file, line = refused.file, refused.line
    macro = xacro.macrostack[-1].body.getAttribute("name") if xacro.macrostack else ""
    message = " ".join(_message(error).split())
    if len(message) > LONGEST:
        message = message[:LONGEST] + "…"
    message += f" (in macro '{macro}')" if macro else ""
    if missing := UNDEFINED_ARGUMENT.search(message):
        default = f"<xacro:arg name='{missing[1]}' default=''/> before its first use"
        message += f"; give --arg {missing[1]}:=VALUE, or {default}"
    if "substitution command [find-pkg-share" in message:
        message += "; $(find-pkg-share …) is of launch files, here write $(find PACKAGE)"
    return _fault(message, file or xacro.filestack[-1], line, refused.code if refused else "xacro")


def _fault(
    message: str, file: str | None = None, line: int | None = None, code: str = "xacro"
) -> dict[str, Any]:
    return {"error": message, "file": file, "line": line, "code": code}


def _refusal(error: BaseException | None) -> Refused | None:
    while error is not None and not isinstance(error, Refused):
        error = getattr(error, "exc", None)
    return error


def _message(error: BaseException) -> str:
    """Return xacro's message without the names of Python's exception types."""
    if not isinstance(error, xacro.XacroException):
        return f"no such key {error}" if isinstance(error, KeyError) else str(error) or type(error).__name__
    own = str(error.args[0] or "") if error.args else ""
    if error.exc is not None and (own.startswith("<class ") or isinstance(error.exc, OSError)):
        own = own if isinstance(error.exc, OSError) else ""
    inner = "" if error.exc is None or isinstance(error.exc, OSError) else _message(error.exc)
    suffix = "" if inner and "when evaluating" in inner else error.suffix or ""
    return " ".join(part for part in (own, inner, suffix) if part)


def _place(traceback: TracebackType | None) -> tuple[str | None, int | None]:
    """Return the place of the element that was expanded when an error came up."""
    found: tuple[str | None, int | None] = (None, None)
    while traceback is not None:
        frame = traceback.tb_frame
        if frame.f_code is xacro.eval_all.__code__:
            node = frame.f_locals.get("node")
            found = place(node) or place(getattr(node, "parentNode", None)) or found
        traceback = traceback.tb_next
    return found


if __name__ == "__main__":
    main()
