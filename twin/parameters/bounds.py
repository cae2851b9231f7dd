"""Bounds of parameters, as annotated-types has them: pydantic understands them, and needs not be imported."""

from __future__ import annotations

from annotated_types import Ge, Gt, Interval, Le, Lt

Positive = Gt(0)
NotNegative = Ge(0)
Negative = Lt(0)
NotPositive = Le(0)
Fraction = Interval(ge=0, le=1)
"""From 0 to 1."""
