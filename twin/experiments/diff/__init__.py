"""Where two runs part: the first tick, topic and field."""

from twin.experiments.diff.compare import compare
from twin.experiments.diff.difference import Difference, Divergence
from twin.experiments.diff.side import Side, made_again, of_path, sides

__all__ = ["Difference", "Divergence", "Side", "compare", "made_again", "of_path", "sides"]
