"""What a parameter is: declared once, as an annotated field of a frozen config.

The annotation has type, unit and bound, the docstring below the field its text:

    desired_linear_vel: Annotated[MetresPerSecond, Positive] = 0.5
    '''Cruise speed.'''

From this are made: the key of a scenario with its JSON schema (`scenario.parameter_group.keys_of`), the ROS
parameter with its descriptor and the check of a live set (`nodes.node_parameters.declare_config`), the reader
of parameter files (`parameters.placed.overlay`), and the tables of the docs. All refuse a value outside of
its bounds in the same words, and NaN, infinity, and sizes beyond `Unit.sizes` in any case.

- Units: `Metres`, `Seconds`, ...; a number without one is a plain `float` or `int`. The text needs not tell
  the unit.
- Bounds: `Positive`, `NotNegative`, `Fraction`, `Interval(ge=1, le=1000)`, ...: no value inside may end a
  run, so counts and rates have an upper one. What two fields may not be together, `__post_init__` refuses by
  a ValueError that begins with a parameter's name.
- Choices: `Literal["a", "b"]`. Lists: `tuple[str, ...]`, `tuple[Metres, Metres]`; items have bounds, too.
- `X | None`: a config in which it is None has no such ROS parameter.
- Times that a config keeps in nanoseconds: with `controller_period_ns: Annotated[PeriodNs, Interval(gt=0,
  le=1000)]` the parameter is `controller_frequency`, and its bounds are in Hz; `timeout_ns:
  Annotated[DurationNs, Positive]` is `timeout`, in seconds.
- `Name("...")`: the parameter's name, where the field's cannot be it; `Nav2("...")`: Nav2's name in files,
  and how the value is read, where that is otherwise; `ReadOnly`; `MayBeInfinite`; `NameOrPath`; `Derived`: no
  key of scenarios.
- A config inside, or a mapping of configs by name, is a section of its own name, or of `Name("...")`; with
  `Flat` it is none: `controllers: Annotated[Mapping[str, Any], Flat]` gives 'FollowPath.xy'.
  `Underscored` and `Itself` are robot_localization's way: `odom0` is a topic, `odom0_config` which states.

A config's annotations must be resolvable at run time: no names that are imported for type checkers only.
"""

from annotated_types import Ge as Ge
from annotated_types import Gt as Gt
from annotated_types import Interval as Interval
from annotated_types import Le as Le
from annotated_types import Lt as Lt

from twin.parameters.bounds import Fraction as Fraction
from twin.parameters.bounds import Negative as Negative
from twin.parameters.bounds import NotNegative as NotNegative
from twin.parameters.bounds import NotPositive as NotPositive
from twin.parameters.bounds import Positive as Positive
from twin.parameters.forms import Derived as Derived
from twin.parameters.forms import DurationNs as DurationNs
from twin.parameters.forms import Flat as Flat
from twin.parameters.forms import Itself as Itself
from twin.parameters.forms import MayBeInfinite as MayBeInfinite
from twin.parameters.forms import Name as Name
from twin.parameters.forms import NameOrPath as NameOrPath
from twin.parameters.forms import Nav2 as Nav2
from twin.parameters.forms import PeriodNs as PeriodNs
from twin.parameters.forms import ReadOnly as ReadOnly
from twin.parameters.forms import Underscored as Underscored
from twin.parameters.units import Amperes as Amperes
from twin.parameters.units import Coulombs as Coulombs
from twin.parameters.units import Hertz as Hertz
from twin.parameters.units import Joules as Joules
from twin.parameters.units import Kilograms as Kilograms
from twin.parameters.units import Metres as Metres
from twin.parameters.units import MetresPerSecond as MetresPerSecond
from twin.parameters.units import MetresPerSecondCubed as MetresPerSecondCubed
from twin.parameters.units import MetresPerSecondSquared as MetresPerSecondSquared
from twin.parameters.units import Newtons as Newtons
from twin.parameters.units import Ohms as Ohms
from twin.parameters.units import PerMetre as PerMetre
from twin.parameters.units import Radians as Radians
from twin.parameters.units import RadiansPerSecond as RadiansPerSecond
from twin.parameters.units import RadiansPerSecondSquared as RadiansPerSecondSquared
from twin.parameters.units import Seconds as Seconds
from twin.parameters.units import Share as Share
from twin.parameters.units import SquareMetres as SquareMetres
from twin.parameters.units import SquareRadians as SquareRadians
from twin.parameters.units import Unit as Unit
from twin.parameters.units import Volts as Volts
from twin.parameters.units import Watts as Watts
