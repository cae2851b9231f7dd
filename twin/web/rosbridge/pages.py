"""Files for browsers, on the bridge's own port."""

from __future__ import annotations

import base64
import hashlib
import mimetypes
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

_POLICY = (
    "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data: blob:; "
    "style-src 'self' 'unsafe-inline'; object-src 'none'; base-uri 'none'; frame-ancestors 'self'; "
    "script-src 'self'"
)
_IMPORT_MAP = re.compile(rb'<script type="importmap">(.*?)</script>', re.DOTALL)
_TYPES = {
    ".mjs": "text/javascript",
    ".js": "text/javascript",
    ".wasm": "application/wasm",
    ".dae": "text/xml",
}


class Page(NamedTuple):
    """An answer to a GET."""

    status: int
    content_type: str
    body: bytes
    headers: tuple[tuple[str, str], ...] = ()


def refusal(status: int, why: str) -> Page:
    """Return an answer that says in words why there is no other."""
    return Page(status, "text/plain; charset=utf-8", f"{why}\n".encode())


NOT_FOUND = refusal(404, "not found")


def policy_of(page: Page) -> str:
    """Return the Content-Security-Policy: own scripts, and import maps, which have to stand in the page."""
    maps = _IMPORT_MAP.findall(page.body) if page.content_type.startswith("text/html") else []
    hashes = [base64.b64encode(hashlib.sha256(each).digest()).decode() for each in maps]
    return " ".join([_POLICY, *(f"'sha256-{each}'" for each in hashes)])


def page_of(folders: Mapping[str, Path], path: str) -> Page:
    """Return the file that a path means.

    Args:
        folders: First parts of paths -> folders below which files are given away, nothing beside them; the
            empty part is the rest.
        path: Of the request, percent-encoded, without its query.
    """
    parts = [part for part in unquote(path).split("/") if part]
    folder, below = folders.get(""), parts
    if parts and parts[0] in folders:
        folder, below = folders[parts[0]], parts[1:]
    if folder is None or any(part.startswith(".") or "\0" in part or "\\" in part for part in below):
        return NOT_FOUND
    root = folder.resolve()
    file = root.joinpath(*below)
    try:
        file = (file / "index.html" if file.is_dir() else file).resolve()
        if not file.is_relative_to(root) or not file.is_file():
            return NOT_FOUND
        body = file.read_bytes()
    except OSError:
        return NOT_FOUND
    return Page(200, content_type(file.name), body)


def content_type(name: str) -> str:
    """Return what browsers take a file of this name for."""
    kind = _TYPES.get(Path(name).suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream"
    return f"{kind}; charset=utf-8" if kind.startswith("text/") else kind
