"""What most plugins of navigation have in common: parameters."""

from __future__ import annotations

from typing import Any, ClassVar


class Configured:
    """An object with parameters."""

    Config: ClassVar[type | None] = None
    """Frozen dataclass of its parameters; None: it has none."""
    config: Any
    """An object of it."""

    def __init__(self, *, config: Any = None) -> None:
        """Take an object of its `Config`; without one the defaults."""
        self.config = config or (self.Config and self.Config())
