"""The sensors: a file each has all there is of one, from the robot file to its message.

`twin/models/sensors.py` names them; whoever reads, builds or converts a robot finds them there.
"""

from twin.models.specs import SensorSpec as SensorSpec
from twin.sensors.sensor import Sensor as Sensor
from twin.sim.sensors import Mount as Mount
