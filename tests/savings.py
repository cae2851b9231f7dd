"""The oracle of what runs save: everything done over again."""

from __future__ import annotations

from dataclasses import fields

from twin.savings import Savings

OFF = Savings(**{field.name: False for field in fields(Savings)})
"""No saving at all."""
