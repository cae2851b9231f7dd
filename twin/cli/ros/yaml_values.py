"""Messages, requests and goals from the YAML of a command line or of standard input."""

from __future__ import annotations

import sys
from typing import Any

from twin.errors import BridgeError


def message_of(cls: type[Any], text: str) -> Any:
    """Return a message from YAML such as '{a: 1, b: 2}'.

    Raises:
        BridgeError: no mapping in YAML, an unknown field or a value that does not fit.
    """
    from twin.bridge.messages.from_values import message_from_dict

    return message_from_dict(cls, values_of(text))


def values_of(text: str) -> dict[str, Any]:
    """Return the values of fields; none for an empty text.

    Raises:
        BridgeError: no mapping in YAML.
    """
    import yaml

    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        reason = " ".join(str(getattr(error, "problem", None) or error).split())
        raise BridgeError(f"{text!r} is no YAML ({reason}); valid: such as '{{a: 1, b: 2}}'") from error
    if values is not None and not isinstance(values, dict):
        raise BridgeError(
            f"The passed value needs to be a dictionary in YAML format, such as '{{data: 1}}', not {text!r}"
        )
    return values or {}


def text_of(values: str | None, stdin: bool) -> str:
    """Return the values given as an argument or, if wanted, on standard input; '{}' if there are none.

    Raises:
        BridgeError: both.
    """
    if stdin and values is not None:
        raise BridgeError("values are given as an argument and with --stdin; valid is one of both")
    return sys.stdin.read() if stdin else values or "{}"
