"""Signal temporal logic over what a run shows: formulas, their text, and monitors that judge them online.

Pure: no message, no simulator, no file. A signal is piecewise constant: it keeps each value until the next
one, has its first one before that, and its last one after the end. Time is whole nanoseconds from the start.

Source: A. Donzé, O. Maler, "Robust satisfaction of temporal logic over real-valued signals", FORMATS 2010;
windows as in A. Donzé, T. Ferrère, O. Maler, "Efficient robust monitoring for STL", CAV 2013.
"""

from twin.scenario.temporal.formula import FOREVER as FOREVER
from twin.scenario.temporal.formula import Always as Always
from twin.scenario.temporal.formula import And as And
from twin.scenario.temporal.formula import Finally as Finally
from twin.scenario.temporal.formula import Formula as Formula
from twin.scenario.temporal.formula import Not as Not
from twin.scenario.temporal.formula import Predicate as Predicate
from twin.scenario.temporal.formula import Until as Until
from twin.scenario.temporal.formula import Window as Window
from twin.scenario.temporal.formula import eventually as eventually
from twin.scenario.temporal.formula import implies as implies
from twin.scenario.temporal.formula import negation as negation
from twin.scenario.temporal.formula import never as never
from twin.scenario.temporal.formula import one_of as one_of
from twin.scenario.temporal.formula import unless as unless
from twin.scenario.temporal.margins import Margin as Margin
from twin.scenario.temporal.monitor import Monitor as Monitor
