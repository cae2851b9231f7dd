"""Timers and rates, on the bus's clock."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

from twin.bridge.clock import Clock
from twin.bridge.node.tasks import NEVER_NS
from twin.errors import BridgeError
from twin.periods import Period, next_due


class Timer:
    """Calls back at multiples of a period of simulated time; several missed ones are one call."""

    def __init__(
        self,
        period_ns: Period,
        callback: Callable[[], Any],
        clock: Clock,
        rescheduled: Callable[[], None],
        *,
        autostart: bool = True,
    ) -> None:
        if period_ns <= 0:
            raise BridgeError(f"a timer period of {period_ns} ns; valid is more than zero")
        self.period_ns = period_ns
        self.last_ns: int | None = None
        """When it called back last [ns]."""
        self.due_ns = NEVER_NS
        """When it fires next [ns]."""
        self._callback = callback
        self._clock = clock
        self._rescheduled = rescheduled
        self.reset()
        if not autostart:
            self.cancel()

    def reset(self) -> None:
        """Fire next at the first multiple of the period after now; also after `cancel`."""
        self._schedule(self._clock.now_ns)
        self._rescheduled()

    def cancel(self) -> None:
        """Fire no more, until reset."""
        self.due_ns = NEVER_NS

    @property
    def is_canceled(self) -> bool:
        """Whether it fires no more, until reset."""
        return self.due_ns == NEVER_NS

    @property
    def is_ready(self) -> bool:
        """Whether it is due."""
        return self._clock.now_ns >= self.due_ns

    @property
    def time_until_next_call(self) -> int | None:
        """How long until it is due [ns], negative if it is late; None if cancelled."""
        return None if self.is_canceled else self.due_ns - self._clock.now_ns

    def run(self, now_ns: int) -> None:
        """Call back if due."""
        if now_ns >= self.due_ns:
            self._schedule(now_ns)
            self.last_ns = now_ns
            self._callback()
        elif not self.is_canceled and now_ns < self.due_ns - self.period_ns:
            # The clock was set back: a bag played again, a new run.
            self._schedule(now_ns)

    def _schedule(self, now_ns: int) -> None:
        self.due_ns = next_due(self.period_ns, now_ns)


class Beat:
    """When something in an execution is due next; goes on as before where the clock is set."""

    def __init__(self, clock: Clock) -> None:
        """Be due now."""
        self._clock, self._due_ns = clock, clock.steady_ns

    @property
    def late_ns(self) -> int:
        """How long it has been due [ns]; negative: it is not yet."""
        return self._clock.steady_ns - self._due_ns

    @property
    def due_ns(self) -> int:
        """When it is due, to be yielded [ns]."""
        return self._clock.now_ns - self.late_ns

    def put_off(self, by_ns: int) -> None:
        """Be due so much later than it was."""
        self._due_ns += by_ns


class Rate:
    """Sleeps to the next multiple of a period in executions: `yield from rate.sleep()`."""

    def __init__(self, period_ns: Period, clock: Clock) -> None:
        self.period_ns = period_ns
        self._clock = clock

    def sleep(self) -> Generator[Any, None, None]:
        """Wait until the clock reaches the next multiple of the period."""
        start_ns = self._clock.now_ns
        until_ns = next_due(self.period_ns, start_ns)
        while start_ns <= self._clock.now_ns < until_ns:
            yield until_ns
