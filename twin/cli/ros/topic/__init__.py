"""`twin topic`: what is published, by whom, how often; and publishing by hand."""

from __future__ import annotations

import typer

from twin.cli.option_groups import example
from twin.cli.ros.topic import echo as topic_echo
from twin.cli.ros.topic import list as topic_list
from twin.cli.ros.topic import measure as topic_measure
from twin.cli.ros.topic import pub as topic_pub
from twin.cli.ros.topic import relay as topic_relay

app = typer.Typer(
    no_args_is_help=True,
    help="Topics: list, look, measure, publish, pass on; as `ros2 topic` and topic_tools.",
    epilog=example("twin topic echo /odom --field pose.pose.position"),
)

_COMMANDS = (
    ("list", topic_list.list_topics, "twin topic list -t"),
    ("info", topic_list.info, "twin topic info /cmd_vel --verbose"),
    ("type", topic_list.type_of, "twin topic type /cmd_vel"),
    ("find", topic_list.find, "twin topic find geometry_msgs/msg/Twist"),
    ("echo", topic_echo.echo, "twin topic echo /odom --field pose.pose.position --once"),
    ("hz", topic_measure.hz, "twin topic hz /scan --use-sim-time"),
    ("bw", topic_measure.bw, "twin topic bw /scan"),
    ("delay", topic_measure.delay, "twin topic delay /scan --use-sim-time"),
    ("pub", topic_pub.pub, "twin topic pub -r 10 /cmd_vel geometry_msgs/msg/Twist '{linear: {x: 0.1}}'"),
    ("relay", topic_relay.relay, "twin topic relay /odom /robot/odom"),
    ("drop", topic_relay.drop, "twin topic drop /scan 1 2"),
)

for _name, _function, _example in _COMMANDS:
    app.command(_name, epilog=example(_example))(_function)

app.add_typer(topic_relay.throttle, name="throttle")
