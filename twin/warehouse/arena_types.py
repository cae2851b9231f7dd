"""What the values of arena files are made of."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from twin.parameters import Metres, Radians

Length = Annotated[Metres, Field(gt=0.0)]
Point = tuple[Metres, Metres]
PoseList = tuple[Metres, Metres, Radians]
Interval = tuple[Metres, Metres]
Colour = Literal["red", "yellow", "green", "blue", "orange", "grey", "white", "wood"]
