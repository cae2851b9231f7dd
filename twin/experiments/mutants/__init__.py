"""Known-bad stacks, and which of them a scenario's checks catch."""

from twin.experiments.mutants.mutant import Mutant, NotHere, Site
from twin.experiments.mutants.mutate import Outcome, Report, mutate
from twin.experiments.mutants.registry import MUTANTS

__all__ = ["MUTANTS", "Mutant", "NotHere", "Outcome", "Report", "Site", "mutate"]
