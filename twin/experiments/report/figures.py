"""Figures as SVG that takes its colours from the page, so that they suit light, dark and paper."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

ROLES = {
    "ink": "#010101",
    "muted": "#020202",
    "line": "#030303",
    "paper": "#040404",
    "truth": "#050505",
    "belief": "#060606",
    "odometry": "#070707",
    "plan": "#080808",
    "bad": "#090909",
    "good": "#0d0d01",
    "odd": "#0d0d02",
    "wall": "#0a0a0a",
    "solid": "#0b0b0b",
    **{f"state{i}": f"#0c0c{i:02x}" for i in range(8)},
}
"""Colours of the page by name -> colours that stand for them until the SVG is in the page."""
WIDTH = 7.2
"""Of a figure [inches]: an A4 page without its margins."""


@contextmanager
def figure(size: tuple[float, float]) -> Iterator[Figure]:
    """Yield an empty figure whose text and lines have the colours of the page."""
    look: dict[Any, Any] = {
        "svg.fonttype": "none",
        "svg.hashsalt": "twin",
        "font.family": "sans-serif",
        "font.size": 8.5,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.axisbelow": True,
        "axes.labelcolor": ROLES["ink"],
        "axes.edgecolor": ROLES["muted"],
        "text.color": ROLES["ink"],
        "xtick.color": ROLES["muted"],
        "ytick.color": ROLES["muted"],
    }
    with mpl.rc_context(look):
        yield Figure(figsize=size, layout="constrained")


def svg(drawn: Figure, label: str) -> str:
    """Return a figure as an element of a page."""
    buffer = io.StringIO()
    drawn.savefig(buffer, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    for role, colour in ROLES.items():
        text = text.replace(colour, f"var(--{role})")
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'font: ([\d.]+)px [^;"]*', r"font-size: \1px", text)
    used = set(re.findall(r"#([\w.-]+)", text))
    text = re.sub(r' id="([\w.-]+)"', lambda name: name[0] if name[1] in used else "", text)
    box = re.search(r'viewBox="[^"]*"', text)
    assert box is not None
    inside = text[text.index(">") + 1 :]
    names = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    return f'<svg {names} class="drawing" role="img" aria-label="{escape(label)}" {box[0]}>{inside}'
