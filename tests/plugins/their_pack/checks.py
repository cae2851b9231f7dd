from dataclasses import dataclass

from their_pack.used import USED
from twin.scenario.checks import Check, CheckResult


class Thorough(Check):
    """So many others of this package were used."""

    @dataclass(frozen=True, kw_only=True)
    class Config:
        at_least: int

    def observe(self, observation):
        pass

    def result(self):
        used = "|".join(sorted(USED))
        passed = len(USED) >= self.config.at_least
        return CheckResult(name=self.name, passed=passed, value=float(len(USED)), reason=used)
