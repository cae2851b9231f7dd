"""Units of physical values: SI in the program; in a file a number in SI, or text with a unit."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, get_args

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic_core import CoreSchema


@dataclass(frozen=True)
class Unit:
    """Metadata of an `Annotated[float, Unit(...)]` that accepts an SI number or text with a unit."""

    quantity: str
    factors: tuple[tuple[str, str | float], ...]
    """Unit and its size in SI (exact text, or a float for irrational ones); the SI unit comes first."""
    sizes: tuple[float, float] = (1e-100, 1e12)
    """Smallest and largest size in SI of what is not 0."""

    @property
    def si(self) -> str:
        """The name of the SI unit."""
        return self.factors[0][0]

    def parse(self, value: object) -> float:
        """Return `value` in SI; raises ValueError naming the valid units."""
        if isinstance(value, int | float) and not isinstance(value, bool):
            return self._sized(float(value))
        match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
        names = ", ".join(name for name, _ in self.factors)
        if match is None or not match[2]:
            raise ValueError(f"must be a number ({self.quantity} in {self.si}) or text with a unit ({names})")
        factor = dict(self.factors).get(match[2])
        if factor is None:
            raise ValueError(f"must have a unit of {self.quantity} ({names})")
        rough = self._sized(float(match[1]) * float(Fraction(factor)))  # an exact 1e999999999 takes for ever
        if rough == 0.0 or isinstance(factor, float):
            return rough
        return float(Fraction(match[1]) * Fraction(factor))

    def _sized(self, value: float) -> float:
        low, high = self.sizes
        if value == 0.0 or low <= abs(value) <= high:
            return value
        raise ValueError(f"must be 0, or from {low:g} to {high:g} {self.si} in size")

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema  # only where schemas are made: the pure packages stay light

        return core_schema.no_info_before_validator_function(self.parse, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        names = "|".join(re.escape(name) for name, _ in self.factors)
        text = {"type": "string", "pattern": rf"^[-+]?[0-9.]+([eE][-+]?[0-9]+)?\s*({names})$"}
        return {"anyOf": [handler(core), text]}


_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")
_DEG = math.pi / 180.0

Seconds = Annotated[
    float,
    Unit(
        "time",
        (("s", "1"), ("ms", "1/1000"), ("us", "1/1000000"), ("min", "60"), ("h", "3600")),
        sizes=(1e-9, 1e9),  # whole nanoseconds, and their number has 64 bits
    ),
]
Metres = Annotated[float, Unit("length", (("m", "1"), ("cm", "1/100"), ("mm", "1/1000"), ("km", "1000")))]
Radians = Annotated[float, Unit("angle", (("rad", "1"), ("deg", _DEG), ("°", _DEG)))]
Kilograms = Annotated[float, Unit("mass", (("kg", "1"), ("g", "1/1000"), ("t", "1000")))]
MetresPerSecond = Annotated[
    float, Unit("speed", (("m/s", "1"), ("cm/s", "1/100"), ("mm/s", "1/1000"), ("km/h", "5/18")))
]
RadiansPerSecond = Annotated[
    float, Unit("turn rate", (("rad/s", "1"), ("deg/s", _DEG), ("°/s", _DEG), ("rpm", math.pi / 30.0)))
]
MetresPerSecondSquared = Annotated[float, Unit("acceleration", (("m/s²", "1"), ("m/s^2", "1")))]
RadiansPerSecondSquared = Annotated[
    float,
    Unit("angular acceleration", (("rad/s²", "1"), ("rad/s^2", "1"), ("deg/s²", _DEG), ("deg/s^2", _DEG))),
]
MetresPerSecondCubed = Annotated[float, Unit("jerk", (("m/s³", "1"), ("m/s^3", "1")))]
PerMetre = Annotated[float, Unit("inverse length", (("1/m", "1"),))]
Newtons = Annotated[float, Unit("force", (("N", "1"), ("mN", "1/1000"), ("kN", "1000")))]
Hertz = Annotated[float, Unit("frequency", (("Hz", "1"), ("kHz", "1000")), sizes=(1e-9, 1e9))]
Joules = Annotated[float, Unit("energy", (("J", "1"), ("kJ", "1000"), ("Wh", "3600"), ("kWh", "3600000")))]
SquareMetres = Annotated[
    float, Unit("area", (("m²", "1"), ("m^2", "1"), ("cm²", "1/10000"), ("cm^2", "1/10000")))
]
SquareRadians = Annotated[float, Unit("squared angle", (("rad²", "1"), ("rad^2", "1")))]
Amperes = Annotated[float, Unit("current", (("A", "1"), ("mA", "1/1000")))]
Volts = Annotated[float, Unit("voltage", (("V", "1"), ("mV", "1/1000")))]
Ohms = Annotated[float, Unit("resistance", (("Ω", "1"), ("ohm", "1"), ("mΩ", "1/1000"), ("mohm", "1/1000")))]
Watts = Annotated[float, Unit("power", (("W", "1"), ("mW", "1/1000"), ("kW", "1000")))]
Coulombs = Annotated[float, Unit("charge", (("C", "1"), ("Ah", "3600"), ("mAh", "18/5")))]
Share = Annotated[float, Unit("share", (("1", "1"), ("%", "1/100"), ("ppm", "1/1000000")))]


def unit_of(annotation: Any) -> Unit:
    """Return the unit of one of these types."""
    return next(part for part in get_args(annotation) if isinstance(part, Unit))


SECONDS = unit_of(Seconds)
UNITS = {
    part.si: part for hint in list(globals().values()) for part in get_args(hint) if isinstance(part, Unit)
}
"""By SI unit."""
