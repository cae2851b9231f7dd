"""What commands share: groups of options, an example below the help, options that many have."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any

import typer

from twin.cli import completion

scenario_argument = functools.partial(typer.Argument, show_default=False, autocompletion=completion.scenarios)
Overrides = Annotated[
    list[str] | None,
    typer.Option(metavar="KEY=VALUE", help="Change one value of the file; may be repeated."),
]
Seed = Annotated[int | None, typer.Option(help="Seed of all noise, instead of the file's.")]
Jobs = Annotated[
    int, typer.Option("-j", "--jobs", min=0, metavar="N", help="Runs at a time; 0: one per core.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of the table.")]


def takes(name: str, make: Callable[..., Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command, instead of its parameter `name`, the parameters of `make`, which makes its value."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        shared = inspect.signature(make, eval_str=True).parameters
        own = inspect.signature(command, eval_str=True)

        @functools.wraps(command)
        def wrapper(**given: Any) -> None:
            value = make(**{each: given.pop(each) for each in shared})
            command(**given, **{name: value})

        parameters = []
        for parameter in own.parameters.values():
            parameters += [*shared.values()] if parameter.name == name else [parameter]
        parameters = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in parameters]
        wrapper.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
        wrapper.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return wrapper

    return decorate


def example(command: str) -> str:
    """Return what stands below a command's help."""
    return f"Example: [bold]{command.replace('[', chr(92) + '[')}[/bold]"
