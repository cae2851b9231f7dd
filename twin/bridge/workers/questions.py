"""Requests of one process that another one answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from twin.bridge.services.questions import Question


class Questions:
    """Those that wait for the other process, by number."""

    def __init__(self) -> None:
        self._open: dict[int, Question] = {}
        self._count = 0

    def keep(self, question: Question) -> int:
        """Return the number of a question that is passed on."""
        self._count += 1
        self._open[self._count] = question
        return self._count

    def answer(self, number: int, payload: bytes | None) -> None:
        """Answer with a response as CDR, or None: never."""
        question = self._open.pop(number)
        if payload is None:
            question.drop()
        else:
            question.reply(payload, 0)


@dataclass(eq=False)
class Passed:
    """A question that came from another process, as the service here sees it."""

    payload: bytes
    """The request as CDR."""
    send: Callable[[bytes | None], None] = field(repr=False)
    """Takes the response as CDR, or None: there is none."""

    def reply(self, payload: bytes, now_ns: int) -> None:
        """Answer with a response as CDR."""
        self.send(payload)

    def drop(self) -> None:
        """Answer never."""
        self.send(None)
