from their_pack.used import USED
from twin.bridge.msgs import Bool
from twin.sensors import Sensor, SensorSpec


class Warmth(Sensor):
    types = ("Warmth",)
    topic, rate_hz, message = "warm", 10.0, Bool

    @classmethod
    def read(cls, element, common, report):
        return SensorSpec(**common)

    def sample(self, time_ns):
        USED.add("Warmth")
        return True

    @classmethod
    def to_message(cls, spec, header, reading):
        return Bool(data=reading)
