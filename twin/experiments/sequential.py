"""Whether a share of runs passes, judged after each run: a sequential test that may stop at any time.

Against the claim "at most p0 pass" stands the mean likelihood ratio of all rates above p0 to p0 itself,
weighted by Jeffreys' prior: whatever rate up to p0 is the true one, this is a supermartingale that begins at
1, so the chance that it ever reaches 1/alpha is at most alpha (Ville 1939; Robbins, "Statistical methods
related to the law of the iterated logarithm", Ann. Math. Statist. 41, 1970; as a bet: Waudby-Smith & Ramdas,
"Estimating means of bounded random variables by betting", J. R. Stat. Soc. B 86, 2024). Against "at least p0
pass" the same from below. So nothing is paid for looking after each run, nor for more seeds later.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

_PRIOR = 0.5
"""Both parameters of Jeffreys' beta prior: of the priors tried it needs the fewest runs where all pass."""
_HALVINGS = 50


def log_evidence(
    passed: ArrayLike, failed: ArrayLike, rate: ArrayLike, *, above: bool
) -> NDArray[np.float64]:
    """Return the logarithm of the evidence that the true pass rate is above, or below, `rate`.

    Args:
        passed: How many runs passed, any shape.
        failed: How many did not.
        rate: Between 0 and 1.
        above: Whether evidence is for more, or for less.

    Returns:
        Natural logarithms, of the common shape; -inf is none at all.
    """
    from scipy.special import betainc, betaincc, betaln, xlog1py, xlogy

    share: Any = betaincc if above else betainc
    with np.errstate(divide="ignore"):
        wins = np.asarray(passed) + _PRIOR
        losses = np.asarray(failed) + _PRIOR
        mean = betaln(wins, losses) + np.log(share(wins, losses, rate))
        prior = betaln(_PRIOR, _PRIOR) + np.log(share(_PRIOR, _PRIOR, rate))
        found: NDArray[np.float64] = mean - prior - xlogy(passed, rate) - xlog1py(failed, -np.asarray(rate))
    return found


def judge(
    passed: int, failed: int, errors: int, minimum: float, confidence: float, points: int = 1
) -> Literal["pass", "fail"] | None:
    """Return whether at least a share `minimum` of all runs passes; None is not known yet.

    A run that ended in an error counts against either answer. A sweep passes if all its points do, which
    needs no correction; it fails if one does, so each of them fails at `1 - (1 - confidence) / points` only.

    Args:
        passed: Runs so far that passed.
        failed: Runs in which a check failed.
        errors: Runs that could not be made or finished.
        minimum: Of the share.
        confidence: The chance of a wrong answer is at most 1 - confidence, however often this is asked.
        points: How many claims like this one the sweep has.
    """
    alpha = 1.0 - confidence
    if log_evidence(passed, failed + errors, minimum, above=True) >= -math.log(alpha):
        return "pass"
    if log_evidence(passed + errors, failed, minimum, above=False) >= -math.log(alpha / points):
        return "fail"
    return None


def bounds(passed: int, failed: int, confidence: float) -> tuple[float, float]:
    """Return the least and greatest pass rate that runs leave open, each at this confidence, at any time."""
    least = -math.log(1.0 - confidence)

    def bound(*, above: bool) -> float:
        low, high = 0.0, 1.0  # evidence for more falls with the rate, that for less rises
        for _ in range(_HALVINGS):
            middle = (low + high) / 2.0
            excluded = bool(log_evidence(passed, failed, middle, above=above) >= least)
            low, high = (middle, high) if excluded == above else (low, middle)
        return low if above else high

    return bound(above=True), bound(above=False)


def clopper_pearson(passed: int, runs: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the exact interval of a pass rate after a number of runs that was fixed beforehand.

    Clopper & Pearson, "The use of confidence or fiducial limits", Biometrika 26, 1934.
    """
    from scipy.special import betaincinv

    tail = (1.0 - confidence) / 2.0
    low = betaincinv(passed, runs - passed + 1, tail) if passed else 0.0
    high = betaincinv(passed + 1, runs - passed, 1.0 - tail) if passed < runs else 1.0
    return float(low), float(high)
