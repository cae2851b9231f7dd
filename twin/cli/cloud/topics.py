"""`twin cloud publish` and `twin cloud save`: from a file to a topic, and back."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Annotated, Any

import typer

from twin.cli.cloud.files import Encoding, File, Output
from twin.cli.option_groups import takes
from twin.cli.ros.endings import endless
from twin.cli.ros.joining import Joining, joins
from twin.cli.ros.topic.options import NodeName, TopicName
from twin.cli.ros.topic.pub import PublishPlan, publish_as_planned
from twin.errors import CloudError


@joins
@takes("plan", PublishPlan)
@partial(endless, ends_by_itself=lambda given: given["plan"].count > 0)
def publish(
    file: File,
    topic: Annotated[str, typer.Option("--topic", help="Where to publish.")] = "cloud_pcd",
    frame: Annotated[str, typer.Option("--frame", help="In which the points are.")] = "base_link",
    *,
    plan: PublishPlan,
    node_name: NodeName = None,
    joining: Joining,
) -> None:
    """Publish a file as sensor_msgs/PointCloud2 at a rate, also for those who come later; as pcl_ros does."""
    from twin.bridge.msgs import PointCloud2, header
    from twin.bridge.point_cloud2 import cloud_of
    from twin.bridge.qos import LATCHED
    from twin.cli.ros.topic.process import open_topics
    from twin.clouds.files import read_cloud

    cloud = cloud_of(header(0, frame), read_cloud(file))
    told = f"{cloud.width * cloud.height} points of {', '.join(field.name for field in cloud.fields)}"
    with open_topics(joining, node_name=node_name) as process:
        publisher = process.node.create_publisher(PointCloud2, process.topic(topic), LATCHED)
        publish_as_planned(
            process,
            publisher,
            lambda: replace(cloud, header=header(process.now_ns, frame)),
            plan,
            lambda message: told,
        )


@joins
def save(
    topic: TopicName,
    output: Output,
    encoding: Encoding = "binary",
    timeout: Annotated[
        float, typer.Option("--timeout", metavar="S", min=0.0, help="Give up after so long.")
    ] = 10.0,
    *,
    joining: Joining,
) -> None:
    """Write the next cloud on a topic to a file; its frame and stamp are said, as files have none."""
    from twin.bridge.msgs import ns
    from twin.bridge.point_cloud2 import read_points
    from twin.bridge.qos import LATCHED, SENSOR_DATA
    from twin.cli.ros.topic.process import Listener, open_topics
    from twin.clouds.files import check_ending, write_cloud
    from twin.files.writing import check_file

    check_ending(output)
    check_file(output, "OUT")
    got: list[Any] = []
    with open_topics(joining) as process:
        name = process.topic(topic)
        process.wait_for_topic(name, timeout)
        listener = Listener.of_type(process, name, "sensor_msgs/msg/PointCloud2")
        latched = all(it.qos.durability == "transient_local" for it in process.graph.publishers(name))
        listener.listen(LATCHED if latched else SENSOR_DATA, got.append)
        process.live.spin(lambda: bool(got), timeout)
        if not got:
            raise CloudError(f"no cloud came on {name} in {timeout:g} s; does somebody publish there?")
        message = listener.decode(got[0])
    if message is None:
        raise CloudError(f"what came on {name} is no cloud")
    points = read_points(message, reshape_organized_cloud=True)
    write_cloud(output, points, encoding)
    at = ns(message.header.stamp) / 1e9
    typer.echo(f"{output}: {points.size} points in '{message.header.frame_id}' at {at:.3f} s")
