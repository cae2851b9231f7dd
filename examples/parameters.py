"""Parameters that change at run time: `twin param set /parameters max_speed 1.5` while this runs."""

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.msgs import SetParametersResult
from twin.bridge.parameters.values import Parameter

NAMES = ("robot_name", "max_speed", "camera_on")


class ParametersNode:
    """Says its parameters again and again, and refuses a negative speed."""

    def __init__(self, bus: Bus) -> None:
        self.node = bus.create_node("parameters")
        self.node.declare_parameter("robot_name", "robot_1")
        self.node.declare_parameter("max_speed", 0.5)
        self.node.declare_parameter("camera_on", True)
        period_s = self.node.declare_parameter("period", 1.0).value
        self.node.add_on_set_parameters_callback(self.on_set)
        self.node.create_timer(round(period_s * 1e9), self.on_timer)

    def on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        """Agree to a change, or not."""
        for parameter in parameters:
            if parameter.name == "max_speed" and parameter.value < 0.0:
                return SetParametersResult(False, "max_speed must not be negative")
            self.node.get_logger().info(f"Set {parameter.name} to {parameter.value}")
        return SetParametersResult(True, "")

    def on_timer(self) -> None:
        """Say what the parameters are."""
        values = [f"{name} = {self.node.get_parameter(name).value}" for name in NAMES]
        self.node.get_logger().info(", ".join(values))


def make(bus: Bus) -> None:
    """Have the parameters robot_name, max_speed and camera_on, and say them once in a period [s]."""
    ParametersNode(bus)


if __name__ == "__main__":
    live.run(make)
