"""Characters that steer a terminal or turn the order of what it shows, where text of others is shown."""

from __future__ import annotations

import re

UNSEEN = "\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""C1 controls, separators of lines, marks and overrides of Unicode's bidirectional algorithm (UAX #9)."""
_BUT_LINES = re.compile(f"[\x00-\x08\x0b-\x1f{UNSEEN}]")
_STYLES = r"\[(?:[0-9;]*m|[0-9]*[AK]|\?25[hl])"
_BUT_STYLES = re.compile(rf"[\x00-\x08\x0b\x0c\x0e-\x1a\x1c-\x1f{UNSEEN}]|\x1b(?!{_STYLES})")


def escaped(text: str, *, keeps_styles: bool = False) -> str:
    r"""Return a text with escapes as JSON and YAML have them for characters that are no plain text.

    Args:
        text: Any text; what is written from right to left, too, stays as it is.
        keeps_styles: Leave what a terminal needs for colours and progress: carriage return, and the sequences
            that set a style, go up, clear a line, and hide or show the cursor.

    >>> escaped("safe\u202egnp.exe")
    'safe\\u202egnp.exe'
    """
    pattern = _BUT_STYLES if keeps_styles else _BUT_LINES
    return pattern.sub(lambda match: f"\\u{ord(match[0]):04x}", text)
