"""Run by a python that has zenoh-ros2-sdk and pamoja-ros2, two implementations that are not ours.

Arguments: what to do, the port. Prints JSON lines.
"""

from __future__ import annotations

import json
import sys
import time

STRING = (
    "std_msgs/msg/String",
    "string data\n",
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
)
VECTOR = "=" * 80 + "\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
TWIST = (
    "geometry_msgs/msg/Twist",
    f"geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n{VECTOR}",
    "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
)
ADD = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"


def say(**what: object) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def where(port: str) -> dict[str, object]:
    return {"router_ip": "127.0.0.1", "router_port": int(port), "domain_id": 0}


def publish(port: str) -> None:
    from zenoh_ros2_sdk import ROS2Publisher

    name, text, type_hash = STRING
    publisher = ROS2Publisher("/chatter", name, text, node_name="sdk", type_hash=type_hash, **where(port))
    twists = ROS2Publisher("/cmd_vel", TWIST[0], TWIST[1], node_name="sdk", type_hash=TWIST[2], **where(port))
    vector = twists.session_mgr.store.types["geometry_msgs/msg/Vector3"]
    deadline = time.monotonic() + 100
    while not (publisher.pub.matching_status.matching and twists.pub.matching_status.matching):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    publisher.publish(data="from the sdk")
    twists.publish(linear=vector(x=0.5, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=-1.0))
    say(key=publisher.keyexpr, session=publisher.session_mgr.session_id)
    sys.stdin.readline()
    publisher.session_mgr.close()


def subscribe(port: str) -> None:
    from zenoh_ros2_sdk import ROS2Subscriber

    name, text, type_hash = STRING
    heard: list[str] = []
    subscriber = ROS2Subscriber(
        "/chatter",
        name,
        lambda m: heard.append(m.data),
        text,
        node_name="sdk",
        type_hash=type_hash,
        **where(port),
    )
    say(ready=True)
    deadline = time.monotonic() + 100
    while not heard:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    say(heard=heard)
    subscriber.session_mgr.close()


def call(port: str) -> None:
    from zenoh_ros2_sdk import ROS2ServiceClient

    client = ROS2ServiceClient(
        "/add",
        "example_interfaces/srv/AddTwoInts",
        "int64 a\nint64 b\n",
        "int64 sum\n",
        type_hash=ADD,
        **where(port),
    )
    response = client.call(a=20, b=22)
    say(sum=None if response is None else int(response.sum))
    client.session_mgr.close()


def names(_: str) -> None:
    from pamoja import ros2

    for name, kind, type_hash in json.loads(sys.stdin.readline()):
        say(
            key=ros2.entity_key(0, name, kind, type_hash),
            dds=ros2.dds_type_name(kind),
            mangled=ros2.percent_mangle(name),
            twist=bytes(ros2.twist_to_cdr((1.0, 2.0, 3.0), (4.0, 5.0, -6.0))).hex(),
        )


if __name__ == "__main__":
    {"publish": publish, "subscribe": subscribe, "call": call, "names": names}[sys.argv[1]](sys.argv[2])
