"""Terms of the reward, from the simulator's truth, the mission and the checks of the scenario."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping

from twin.envs.scenario.episode import Episode
from twin.envs.scenario.own_code import blamed
from twin.errors import GymError, nearest


class Term(ABC):
    """Asked once after each step, the last one included; made anew for every run."""

    def __init__(self, episode: Episode) -> None:
        """Take a run when it is the agent's turn for the first time."""
        self.episode = episode

    @abstractmethod
    def value(self) -> float:
        """Return what the last step was worth."""


class Progress(Term):
    """Metres that the robot came nearer to the mission's goal, by the truth; there, all that was left."""

    def __init__(self, episode: Episode) -> None:
        super().__init__(episode)
        self._goal, self._distance = episode.task.last, 0.0
        self.value()

    def value(self) -> float:
        """Return how much nearer it came to the goal that it had before the step."""
        goal, before, here = self._goal, self._distance, self.episode.truth
        gain = 0.0
        if goal is not None and (goal.reached or not goal.done):
            gain = before - (0.0 if goal.reached else here.distance(goal.pose))
        self._goal = last = self.episode.task.last
        self._distance = 0.0 if last is None or last.done else here.distance(last.pose)
        return gain


class Growth(Term):
    """By how much something grew within the step."""

    def __init__(self, episode: Episode) -> None:
        super().__init__(episode)
        self._before = self.measure()

    @abstractmethod
    def measure(self) -> float:
        """Return what is to grow."""

    def value(self) -> float:
        """Return by how much it grew."""
        before, self._before = self._before, self.measure()
        return self._before - before


class GoalsReached(Growth):
    """Goals of the mission that ended with success."""

    def measure(self) -> float:
        """Return how many there are."""
        return float(self.episode.task.reached)


class Mission(Term):
    """1 when the mission ends with success, -1 when it fails."""

    def value(self) -> float:
        """Return how it ended; 0 while it goes on, and in the end of a run that it did not end."""
        succeeded = self.episode.parts.mission.succeeded if self.episode.over else None
        return 0.0 if succeeded is None else 1.0 if succeeded else -1.0


class Checks(Term):
    """At the end of the run the share of checks that passed, less the share of those that failed."""

    def value(self) -> float:
        """Return 1 if all hold, -1 if none does; 0 while the run goes on."""
        verdict = self.episode.verdict
        if verdict is None or not verdict.checks:
            return 0.0
        return sum(1.0 if check.passed else -1.0 for check in verdict.checks) / len(verdict.checks)


class Collision(Term):
    """-1 in a step at whose end the robot touches something other than floor and goods, by the truth."""

    def value(self) -> float:
        """Look at the contacts."""
        name, goods = self.episode.stack.name, {good.name for good in self.episode.world.scene.goods}
        return -float(
            any(
                name in (contact.body1.partition("/")[0], contact.body2.partition("/")[0])
                and contact.body2 not in goods
                for contact in self.episode.world.contacts()
            )
        )


class Time(Growth):
    """Simulated seconds that went by, negative."""

    def measure(self) -> float:
        """Return what is left of an endless time."""
        return -self.episode.time


TERMS: dict[str, type[Term]] = {
    "progress": Progress,
    "goals": GoalsReached,
    "mission": Mission,
    "checks": Checks,
    "collision": Collision,
    "time": Time,
}
"""By the name that `reward` of `make_env` gives a weight; add your own."""


class Reward:
    """A weighted sum of terms."""

    def __init__(self, episode: Episode, weights: Mapping[str, float]) -> None:
        self._terms: dict[str, tuple[float, Term]] = {}
        for name, weight in weights.items():
            with blamed(TERMS[name], "the reward"):
                self._terms[name] = weight, TERMS[name](episode)

    def terms(self) -> dict[str, float]:
        """Return what each term gives for the last step, with its weight."""
        found = {}
        for name, (weight, term) in self._terms.items():
            with blamed(type(term), "the reward"):
                found[name] = weight * float(term.value())
        return found


def require_terms(weights: object) -> dict[str, float]:
    """Return the weights of terms.

    Raises:
        GymError: They are none, or a term is not known.
    """
    if not isinstance(weights, Mapping):
        raise GymError(f"reward={weights!r}: valid are names of terms with weights, as {{'progress': 1.0}}")
    for name, weight in weights.items():
        if name not in TERMS:
            raise GymError(f"there is no reward '{name}'; {nearest(str(name), TERMS)}")
        if not isinstance(weight, int | float) or not math.isfinite(weight):
            raise GymError(f"the reward '{name}' has the weight {weight!r}; valid is a finite number")
    return dict(weights)
