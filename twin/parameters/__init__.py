"""What a parameter is: declared once, as an annotated field of a frozen config.

The annotation has the unit and the bound, the docstring below the field its text:

    desired_linear_vel: Annotated[MetresPerSecond, Positive] = 0.5
    'Cruise speed.'
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
from twin.parameters.units import Amperes as Amperes
from twin.parameters.units import Hertz as Hertz
from twin.parameters.units import Joules as Joules
from twin.parameters.units import Kilograms as Kilograms
from twin.parameters.units import Metres as Metres
from twin.parameters.units import MetresPerSecond as MetresPerSecond
from twin.parameters.units import MetresPerSecondSquared as MetresPerSecondSquared
from twin.parameters.units import Newtons as Newtons
from twin.parameters.units import PerMetre as PerMetre
from twin.parameters.units import Radians as Radians
from twin.parameters.units import RadiansPerSecond as RadiansPerSecond
from twin.parameters.units import RadiansPerSecondSquared as RadiansPerSecondSquared
from twin.parameters.units import Seconds as Seconds
from twin.parameters.units import SquareMetres as SquareMetres
from twin.parameters.units import SquareRadians as SquareRadians
from twin.parameters.units import Unit as Unit
