from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cbor2
import pytest

from tests.web.conftest import World
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import ActionServer
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import (
    Header,
    PoseStamped,
    PoseWithCovarianceStamped,
    String,
    Twist,
    TwistStamped,
    Vector3,
    new,
)
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import AddTwoInts, SetBool, Trigger
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.errors import BridgeError
from twin.geometry import Pose3
from twin.web.rosbridge.access import ROLES, read_rules

TWIST = "geometry_msgs/msg/Twist"


def errors(told: list[dict[str, Any]]) -> list[str]:
    return [each["msg"] for each in told if each["op"] == "status" and each["level"] == "error"]


def test_clients_hear_what_they_and_others_say(world: World) -> None:
    heard = world.listen(String, "/chatter")
    one, other = world.client(), world.client()
    assert other.tell("subscribe", topic="/chatter", type="std_msgs/String") == []
    assert one.tell("advertise", topic="/chatter", type="std_msgs/String", latch=False, queue_size=100) == []
    assert one.tell("publish", topic="/chatter", msg={"data": "hello"}) == []
    assert [message.data for message in heard] == ["hello"]
    assert other.heard() == [{"op": "publish", "topic": "/chatter", "msg": {"data": "hello"}}]
    other.tell("unsubscribe", topic="/chatter")
    one.tell("publish", topic="chatter", msg={"data": "again"})
    assert (other.heard(), heard[-1].data) == ([], "again")


def test_who_comes_later_hears_what_was_latched(world: World) -> None:
    publisher = world.bus.create_node("map").create_publisher(String, "/map", LATCHED)
    publisher.publish(String("old"))
    publisher.publish(String("new"))
    for _ in range(2):
        client = world.client()
        told = client.tell("subscribe", topic="/map")
        assert [each["msg"]["data"] for each in told] == ["new"]


def test_a_topic_is_encoded_once_for_all(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    from twin.web.rosbridge import frames

    encoded: list[object] = []
    to_values = frames.to_values
    monkeypatch.setattr(frames, "to_values", lambda *args: encoded.append(args) or to_values(*args))
    clients = [world.client() for _ in range(20)]
    for client in clients:
        client.tell("subscribe", topic="/chatter", type="std_msgs/String")
    world.bus.create_node("talker").create_publisher(String, "/chatter").publish(String("x"))
    world.spin()
    assert [len(client.heard()) for client in clients] == [1] * 20
    assert len(encoded) == 1


def test_who_comes_goes_and_asks_anew_hears_what_is_meant_for_it(world: World) -> None:
    first, second, third = clients = [world.client() for _ in range(3)]
    publisher = world.bus.create_node("talker").create_publisher(String, "/chatter")

    def say(text: str) -> list[list[str]]:
        publisher.publish(String(text))
        world.spin()
        return [[each["msg"]["data"] for each in client.heard()] for client in clients]

    for client in (first, second):
        client.tell("subscribe", topic="/chatter", id="one")
    assert say("a") == [["a"], ["a"], []]
    third.tell("subscribe", topic="/chatter", throttle_rate=100_000)
    assert say("b") == [["b"], ["b"], ["b"]]
    assert say("c") == [["c"], ["c"], []], "it comes too early for the third"
    third.tell("subscribe", topic="/chatter")
    assert say("d") == [["d"], ["d"], ["d"]], "its second subscription wants all"
    third.tell("subscribe", topic="/chatter", throttle_rate=100_000)
    assert say("-") == [["-"], ["-"], []], "now it does not"
    third.tell("subscribe", topic="/chatter", id="all")
    assert say("+") == [["+"], ["+"], ["+"]]
    third.tell("unsubscribe", topic="/chatter", id="all")
    assert say("-") == [["-"], ["-"], []], "what it wants without an id is left"
    third.tell("subscribe", topic="/chatter")
    second.tell("subscribe", topic="/chatter", id="one", throttle_rate=100_000)
    assert [say("x"), say("y")] == [[["x"], ["x"], ["x"]], [["y"], [], ["y"]]]
    second.tell("subscribe", topic="/chatter", id="one")
    first.tell("unsubscribe", topic="/chatter", id="one")
    assert say("e") == [[], ["e"], ["e"]]
    second.session.close()
    assert say("f") == [[], [], ["f"]]
    first.tell("subscribe", topic="/chatter")
    second = clients[1] = world.client()
    second.tell("subscribe", topic="/chatter", compression="png")
    publisher.publish(String("g"))
    world.spin()
    assert [[each["op"] for each in client.heard()] for client in clients] == [
        ["publish"],
        ["png"],
        ["publish"],
    ]


def test_all_who_expect_another_type_are_told_once(world: World) -> None:
    clients = [world.client() for _ in range(2)]
    for client in clients:
        client.tell("subscribe", topic="/chatter", type=TWIST)
    other = world.client()
    other.tell("subscribe", topic="/chatter")
    publisher = world.bus.create_node("talker").create_publisher(String, "/chatter")
    for text in "ab":
        publisher.publish(String(text))
    world.spin()
    for client in clients:
        (told,) = errors(client.heard())
        assert "has the type std_msgs/msg/String, not geometry_msgs/msg/Twist" in told
    assert [each["msg"]["data"] for each in other.heard()] == ["a", "b"]


def test_who_watches_no_more_hears_no_more(world: World) -> None:
    client, heard = world.client(), []
    client.tell("subscribe", topic="/chatter", type="std_msgs/String")
    world.bridge.topics.watch("picture", "/chatter", lambda each: heard.append(each.message.data))
    publisher = world.bus.create_node("talker").create_publisher(String, "/chatter")
    for text in "ab":
        publisher.publish(String(text))
        world.spin()
        world.bridge.topics.unwatch("picture", "/chatter")
    assert heard == ["a"]
    assert len(client.heard()) == 2


def test_throttle_and_queue(world: World) -> None:
    plain, queued = world.client(), world.client()
    plain.tell("subscribe", topic="/chatter", type="std_msgs/String", throttle_rate=100)
    queued.tell("subscribe", topic="/chatter", type="std_msgs/String", throttle_rate=100, queue_length=2)
    publisher = world.bus.create_node("talker").create_publisher(String, "/chatter")
    for number in range(5):
        publisher.publish(String(str(number)))
        world.spin(0.001)
    for _ in range(4):
        world.spin(0.1)

    def data(client: Any) -> list[str]:
        return [each["msg"]["data"] for each in client.heard()]

    assert data(plain) == ["0"]
    assert data(queued) == ["0", "3", "4"]  # the oldest went


@pytest.mark.parametrize("compression", ["none", "png", "cbor", "cbor-raw"])
def test_compressions(world: World, compression: str) -> None:
    client = world.client()
    client.tell("subscribe", topic="/chatter", type="std_msgs/String", compression=compression)
    world.bus.create_node("talker").create_publisher(String, "/chatter").publish(String("hello"))
    world.spin()
    (frame,) = client.frames
    assert isinstance(frame, bytes) is compression.startswith("cbor")
    if compression == "cbor":
        assert cbor2.loads(frame) == {"op": "publish", "topic": "/chatter", "msg": {"data": "hello"}}
    if compression == "cbor-raw":
        message = cbor2.loads(frame)["msg"]
        assert (message["secs"], message["nsecs"]) == (5, 0)
        assert codec(String).decode(message["bytes"]).data == "hello"


def test_pieces_of_a_text_are_one_message_again(world: World) -> None:
    client, other = world.client(), world.client()
    client.tell("subscribe", topic="/chatter", type="std_msgs/String", fragment_size=20)
    world.bus.create_node("talker").create_publisher(String, "/chatter").publish(String("a long one" * 5))
    world.spin()
    pieces = client.heard()
    assert len(pieces) > 2
    assert all(piece["op"] == "fragment" and len(piece["data"]) <= 20 for piece in pieces)
    whole = "".join(piece["data"] for piece in sorted(pieces, key=lambda piece: piece["num"]))
    heard = world.listen(String, "/other")
    whole = whole.replace("/chatter", "/other")
    other.tell("advertise", topic="/other", type="std_msgs/String")
    for number in (2, 0, 1):
        part = whole[number * 30 : number * 30 + 30] if number < 2 else whole[60:]
        assert other.tell("fragment", id="f", num=number, total=3, data=part) == []
    assert [message.data for message in heard] == ["a long one" * 5]


@pytest.mark.parametrize(
    ("op", "fields", "words"),
    [
        ("dance", {}, "'dance' is not known"),
        ("publish", {"topic": "/nobody", "msg": {}}, "advertise it first"),
        ("publish", {}, "needs topic"),
        ("publish", {"topic": "no name!", "msg": {}}, "is not a topic"),
        ("advertise", {"topic": "/x", "type": "no_msgs/msg/Such"}, "not known"),
        ("advertise", {"topic": "/x", "type": "../../etc"}, "not a type name"),
        ("subscribe", {"topic": "/x", "compression": "zip"}, "valid: none, png, cbor, cbor-raw"),
        ("subscribe", {"topic": "/x", "throttle_rate": -1}, "not negative"),
        ("subscribe", {"topic": "/x", "queue_length": "many"}, "whole number"),
        ("unadvertise", {"topic": "/x"}, "not advertised"),
        ("service_response", {"service": "/x", "id": "1"}, "nobody waits"),
        ("action_result", {"action": "/x", "id": "1"}, "executes no goal"),
        ("cancel_action_goal", {"action": "/x", "id": "1"}, "no goal"),
        ("set_level", {"level": "loud"}, "valid: none, error"),
        ("fragment", {"num": 3, "total": 2, "data": ""}, "num < total"),
    ],
)
def test_a_mistake_is_a_status(world: World, op: str, fields: dict[str, Any], words: str) -> None:
    (told,) = world.client().tell(op, **fields)
    assert (told["op"], told["level"]) == ("status", "error")
    assert words in told["msg"]


def test_another_type_than_the_topic_has_is_an_error(world: World) -> None:
    world.bus.create_node("talker").create_publisher(String, "/chatter")
    client = world.client()
    for op in ("subscribe", "advertise"):
        assert "has the type std_msgs/msg/String" in errors(client.tell(op, topic="/chatter", type=TWIST))[0]


def test_levels_of_status(world: World) -> None:
    client = world.client()
    assert client.tell("dance") != []
    client.tell("set_level", level="none")
    assert client.tell("dance") == []


def test_a_service_is_called(world: World) -> None:
    node = world.bus.create_node("adder")
    node.create_service(AddTwoInts, "/add", lambda request: AddTwoInts.Response(request.a + request.b))
    client = world.client()
    for args in ({"a": 2, "b": 3}, [2, 3]):
        (told,) = client.tell("call_service", id="7", service="add", type="any/Name", args=args)
        assert told == {
            "op": "service_response", "id": "7", "service": "add", "values": {"sum": 5}, "result": True
        }  # fmt: skip
    status, told = client.tell("call_service", id="8", service="/add", args={"c": 1})
    assert (status["id"], told["id"], told["result"]) == ("8", "8", False)
    assert client.tell("call_service", id="9", service="/nobody") == []
    world.spin(3.0)
    assert client.heard()[-1]["values"] == "the service /nobody does not exist"


def test_a_client_offers_a_service(world: World) -> None:
    server, client = world.client(), world.client()
    assert server.tell("advertise_service", service="/lamp", type="std_srvs/SetBool") == []
    asked = world.bus.create_node("asker").create_client(SetBool, "/lamp").call_async(SetBool.Request(True))
    world.spin()
    (call,) = server.heard()
    assert (call["op"], call["service"], call["args"]) == ("call_service", "/lamp", {"data": True})
    values = {"success": True, "message": "on"}
    assert errors(client.tell("service_response", service="/lamp", id=call["id"], values=values, result=True))
    server.tell("service_response", service="/lamp", id=call["id"], values=values, result=True)
    assert asked.result.message == "on"
    assert (
        "another client"
        in errors(client.tell("advertise_service", service="/lamp", type="std_srvs/SetBool"))[0]
    )
    none = world.bus.create_node("none").create_client(SetBool, "/lamp").call_async(SetBool.Request(True))
    world.spin()
    (call,) = server.heard()
    server.tell("service_response", service="/lamp", id=call["id"], values="broken", result=False)
    assert none.error is not None
    odd = world.bus.create_node("odd").create_client(SetBool, "/lamp").call_async(SetBool.Request(True))
    world.spin()
    (call,) = server.heard()
    server.tell("service_response", service="/lamp", id=call["id"], values=values, result=False)
    assert odd.result.message == "on"  # a response is one, as in rosbridge_suite
    later = world.bus.create_node("later").create_client(SetBool, "/lamp").call_async(SetBool.Request(True))
    world.spin()
    server.session.close()
    world.spin()
    assert later.error is not None  # who waits learns that nobody answers


def test_a_goal_is_sent_and_cancelled(world: World) -> None:
    def execute(handle: Any) -> Any:
        for _ in range(3):
            handle.publish_feedback(new(Fibonacci.Feedback))
            if handle.is_cancel_requested:
                handle.canceled()
                return new(Fibonacci.Result)
            for _ in range(20 if handle.request.order == 9 else 1):
                yield
        return new(Fibonacci.Result)

    ActionServer(world.bus.create_node("server"), Fibonacci, "/fibonacci", execute)
    client = world.client()
    goal = {"action": "/fibonacci", "action_type": "x/action/Any", "feedback": True}
    told = client.tell("send_action_goal", id="g1", args={"order": 3}, **goal)
    assert [each["op"] for each in told] == ["action_feedback"] * 3 + ["action_result"]
    assert (told[-1]["id"], told[-1]["status"], told[-1]["result"]) == ("g1", 4, True)
    client.tell("send_action_goal", id="g2", args={"order": 9}, **goal)
    client.tell("cancel_action_goal", id="g2", action="/fibonacci")
    for _ in range(5):
        world.spin(0.1)
    assert [each["status"] for each in client.heard() if each["op"] == "action_result"] == [5]


def test_a_client_offers_an_action(world: World) -> None:
    server, client = world.client(), world.client()
    kind = Fibonacci.name
    assert server.tell("advertise_action", action="/fib", type=kind) == []
    client.tell("send_action_goal", id="g", action="/fib", args={"order": 2}, feedback=True)
    (goal,) = server.heard()
    assert (goal["op"], goal["args"]) == ("send_action_goal", {"order": 2})
    field = next(iter(client.world.bridge.goals._offered["/fib"].type.Feedback.__slots__))
    server.tell("action_feedback", action="/fib", id=goal["id"], values={field: [0, 1]})
    assert client.heard()[-1]["values"] == {field: [0, 1]}
    server.tell(
        "action_result", action="/fib", id=goal["id"], values={"sequence": [0, 1]}, status=4, result=True
    )
    world.spin(0.1)
    (result,) = client.heard()
    assert (result["values"], result["status"]) == ({"sequence": [0, 1]}, 4)
    client.tell("send_action_goal", id="h", action="/fib", args={"order": 2})
    (goal,) = server.heard()
    client.tell("cancel_action_goal", id="h", action="/fib")
    world.spin(0.1)
    assert [each["op"] for each in server.heard()] == ["cancel_action_goal"]
    server.tell("action_result", action="/fib", id=goal["id"], values={}, status=5, result=True)
    world.spin(0.1)
    assert client.heard()[-1]["status"] == 5


def test_rosapi(world: World) -> None:
    node = world.bus.create_node("talker")
    node.create_publisher(String, "/chatter")
    node.declare_parameter("speed", 1.5)
    client = world.client()

    def ask(name: str, /, **args: Any) -> Any:
        for _ in range(3):
            client.world.spin(0.01)
        told = client.tell("call_service", service=f"rosapi/{name}", args=args, type=f"rosapi/{name}")
        (answer,) = told
        assert answer["result"]
        return answer["values"]

    topics = ask("topics")
    assert topics["types"][topics["topics"].index("/chatter")] == "std_msgs/msg/String"
    assert ask("topic_type", topic="/chatter") == {"type": "std_msgs/msg/String"}
    assert ask("topics_for_type", type="std_msgs/String") == {"topics": ["/chatter"]}
    assert "/talker" in ask("nodes")["nodes"]
    assert "/chatter" in ask("node_details", node="/talker")["publishing"]
    assert [each["type"] for each in ask("message_details", type="geometry_msgs/Twist")["typedefs"]] == [
        "geometry_msgs/msg/Twist",
        "geometry_msgs/msg/Vector3",
    ]
    assert ask("service_type", service="/rosapi/topics") == {"type": "rosapi_msgs/srv/Topics"}
    assert ask("get_param", name="/talker:speed")["value"] == "1.5"
    assert ask("set_param", name="/talker:speed", value="2")["successful"]
    assert node.get_parameter("speed").value == 2.0
    assert "/talker:speed" in ask("get_param_names")["names"]
    assert not ask("get_param", name="speed")["successful"]
    assert ask("get_time")["time"]["sec"] == 5


def test_what_steers_is_stopped_when_its_client_is_silent(world: World) -> None:
    heard = world.listen(TwistStamped, "/cmd_vel")
    client = world.client()
    client.tell("publish", topic="/cmd_vel", msg={"twist": {"linear": {"x": 0.4}}})
    world.spin(0.4)
    client.tell("publish", topic="/cmd_vel", msg={"twist": {"linear": {"x": 0.4}}})
    world.spin(0.4)
    assert [message.twist.linear.x for message in heard] == [0.4, 0.4]
    world.spin(0.2)
    assert [message.twist.linear.x for message in heard] == [0.4, 0.4, 0.0]
    world.spin(5.0)
    assert len(heard) == 3
    client.tell("publish", topic="/cmd_vel", msg={"twist": {"angular": {"z": 1.0}}})
    client.session.close()
    world.spin()
    assert heard[-1].twist.angular.z == 0.0  # gone: at once


def test_one_steers_at_a_time(world: World) -> None:
    heard = world.listen(Twist, "/cmd_vel")
    stops = []
    node = world.bus.create_node("guard")
    node.create_service(Trigger, "/guard/stop", lambda request: stops.append(1) or Trigger.Response(True, ""))
    one, other, viewer = world.client(), world.client(), world.client("viewer")
    move = {"topic": "/cmd_vel", "msg": {"linear": {"x": 0.2}}}
    assert one.tell("publish", **move) == []
    assert "has control" in errors(other.tell("publish", **move))[0]
    assert "has control" in errors(other.tell("send_action_goal", action="/go", args={}))[0]
    (asked,) = other.tell("call_service", service="/twin/control", args={"command": "take", "name": "Li"})
    assert not asked["values"]["success"]
    assert other.tell("call_service", service="/guard/stop")[0]["result"]  # needs no control
    assert stops == [1]
    assert not viewer.tell("call_service", service="/twin/control", args={"command": "take"})[0]["values"][
        "success"
    ]
    (taken,) = other.tell(
        "call_service", service="/twin/control", args={"command": "take_over", "name": "Li"}
    )
    assert (taken["values"]["holder"], taken["values"]["holder_id"]) == ("Li", taken["values"]["id"])
    assert "Li has taken control over" in one.heard()[-1]["msg"]
    assert heard[-1].linear == Vector3(0.0, 0.0, 0.0)  # what the other moved stands
    assert other.tell("publish", **move) == []
    assert errors(one.tell("publish", **move))
    world.spin(3.5)
    assert one.tell("publish", **move) == []  # nobody renewed it
    ops = [(line["op"], line["target"]) for line in world.lines if "refused" not in (line["values"] or {})]
    assert ops.count(("publish", "/cmd_vel")) == 3
    assert ("call_service", "/guard/stop") in ops


@pytest.mark.parametrize(
    "service",
    [
        "/guard/release",
        "/fleet/add_task",
        "/clear_tasks",
        "/go/_action/cancel_goal",
        "/turtle1/teleport_absolute",
        "/simulation/set_speed",
    ],
)
def test_services_that_steer_need_control(world: World, service: str) -> None:
    called = []
    node = world.bus.create_node("robot")
    node.create_service(Trigger, service, lambda request: called.append(1) or Trigger.Response(True, ""))
    one, other = world.client("operator"), world.client("operator")
    assert one.tell("call_service", service=service)[0]["result"]
    told = other.tell("call_service", service=service)
    assert "has control" in errors(told)[0]
    assert [each["result"] for each in told if each["op"] == "service_response"] == [False]
    world.spin(3.5)
    assert other.tell("call_service", service=service)[0]["result"]
    assert called == [1, 1]


def test_a_release_by_topic_needs_control(world: World) -> None:
    heard = world.listen(Header, "/guard/release")
    one, other = world.client("operator"), world.client("operator")
    assert one.tell("publish", topic="/guard/release", msg={}) == []
    assert "has control" in errors(other.tell("publish", topic="/guard/release", msg={}))[0]
    assert len(heard) == 1


@pytest.mark.parametrize("topic", ["/goal_pose", "/robot/goal_pose", "/initialpose"])
def test_nobody_is_sent_to_a_place_that_is_no_number(world: World, topic: str) -> None:
    kind = PoseWithCovarianceStamped if topic == "/initialpose" else PoseStamped
    heard = world.listen(kind, topic)
    pose: dict[str, Any] = {"position": {"x": None}}
    pose = {"pose": pose} if kind is PoseWithCovarianceStamped else pose
    client = world.client("operator")
    told = client.tell("publish", topic=topic, msg={"header": {"frame_id": "map"}, "pose": pose})
    assert errors(told)
    assert heard == []


def test_what_was_refused_is_in_the_audit_once_a_second(world: World) -> None:
    viewer = world.client("viewer")
    for _ in range(5):
        assert errors(viewer.tell("publish", topic="/cmd_vel", msg={}))
    assert errors(viewer.tell("call_service", service="/guard/release"))
    world.spin(1.1)
    assert errors(viewer.tell("publish", topic="/cmd_vel", msg={}))
    assert errors(viewer.tell("dance"))  # no command
    refused = [(line["op"], line["target"], "viewer" in line["values"]["refused"]) for line in world.lines]
    publish = ("publish", "/cmd_vel", True)
    assert refused == [publish, ("call_service", "/guard/release", True), publish]


def test_requests_that_a_client_never_answers_are_bounded(world: World) -> None:
    server = world.client()
    server.tell("advertise_service", service="/lamp", type="std_srvs/SetBool")
    asking = world.bus.create_node("asker").create_client(SetBool, "/lamp")
    asked = [asking.call_async(SetBool.Request(True)) for _ in range(1001)]
    world.spin()
    assert [future.error is not None for future in asked] == [True] + [False] * 1000


@pytest.mark.parametrize(
    ("service", "is_allowed"),
    [
        ("/turtle1/teleport_absolute", True),
        ("/turtle1/set_parameters", False),
        ("/turtlebot3/controller_server/set_parameters_atomically", False),
        ("/turtlebot3/change_map", False),
        ("/slam_toolbox/clear_queue", True),
        ("/robot_1/move_task", True),
        ("/reset_simulation", True),
        ("/clear_all/set_parameters", False),
    ],
)
def test_an_operator_calls_what_operates(service: str, is_allowed: bool) -> None:
    assert ROLES["operator"].allows("service", service) is is_allowed
    assert not ROLES["viewer"].allows("service", service)


def test_rules_of_a_file(world: World, tmp_path: Path) -> None:
    file = tmp_path / "rules.yaml"
    file.write_text("viewer: {subscribe: ['/map'], call: ['/rosapi/topics']}\noperator: {offer: true}\n")
    roles = read_rules(file)
    assert roles["engineer"] == ROLES["engineer"]
    assert roles["operator"].may_offer
    client = world.client()
    client.session.role = roles["viewer"]
    assert client.tell("subscribe", topic="/map", type="std_msgs/String") == []
    (told,) = errors(client.tell("subscribe", topic="/camera", type="std_msgs/String"))
    assert "the heard topic /camera is not for the role viewer" in told
    assert errors(client.tell("call_service", service="/rosapi/nodes"))
    assert client.tell("call_service", service="/rosapi/topics")[0]["result"]
    file.write_text("viewer: {hear: ['/map']}\nking: {}\noperator: {call: [stop]}\n")
    with pytest.raises(BridgeError) as fault:
        read_rules(file)
    for words in ("rules.yaml:1", "hear", "rules.yaml:2", "king", "rules.yaml:3"):
        assert words in str(fault.value)


def test_whom_a_token_names_cannot_be_taken_for_somebody_else(world: World) -> None:
    bob, anybody = world.client("operator", known_as="Bob"), world.client("operator")
    take = {"service": "/twin/control", "args": {"command": "take_over", "name": "Mei"}}
    assert anybody.tell("call_service", **take)[0]["values"]["holder"] == "Mei"
    assert bob.tell("call_service", **take)[0]["values"]["holder"] == "Mei (Bob)"
    assert "Mei (Bob) has taken control over" in anybody.heard()[-1]["msg"]
    renewed = {"service": "/twin/control", "args": {"command": "take", "name": "Mei"}}
    assert bob.tell("call_service", **renewed)[0]["values"]["success"]  # once a second, and not worth a line
    told = [(line["name"], line["called"]) for line in world.lines]
    assert told == [(f"test #{anybody.session.number}", "Mei"), (f"Bob #{bob.session.number}", "Mei (Bob)")]


@pytest.mark.parametrize("input_", ["guard/teleop", "cmd_vel_teleop"])
@pytest.mark.parametrize("namespace", ["", "/red"])
def test_an_operator_steers_by_the_way_that_is_for_people(world: World, namespace: str, input_: str) -> None:
    operator, engineer = world.client("operator"), world.client()
    move = {"msg": {"linear": {"x": 0.2}}}
    driven = world.listen(Twist, f"{namespace}/cmd_vel")
    engineer.tell("subscribe", topic=f"{namespace}/{input_}", type=TWIST)  # who only looks on is no way in
    assert operator.tell("publish", topic=f"{namespace}/cmd_vel", **move) == []
    by_hand = world.listen(Twist, f"{namespace}/{input_}")
    told = errors(operator.tell("publish", topic=f"{namespace}/cmd_vel", **move))
    assert told == [f"{namespace}/cmd_vel goes past {namespace}/{input_}: the role operator steers by that"]
    assert (
        "needs engineer" in errors(operator.tell("publish", topic=f"{namespace}/cmd_vel_smoothed", **move))[0]
    )
    assert len(driven) == 1
    assert operator.tell("publish", topic=f"{namespace}/{input_}", **move) == []
    assert len(by_hand) == 1
    operator.tell("call_service", service="/twin/control", args={"command": "release"})
    engineer.tell("publish", topic=f"{namespace}/cmd_vel", **move)  # it may everything
    assert len(driven) == 2


@pytest.mark.parametrize("role", ["viewer", "operator"])
def test_roles(world: World, role: str) -> None:
    client = world.client(role)
    may_drive = role == "operator"
    assert bool(errors(client.tell("advertise", topic="/cmd_vel", type=TWIST))) is not may_drive
    assert bool(errors(client.tell("publish", topic="/cmd_vel", msg={}))) is not may_drive
    assert "needs engineer" in errors(client.tell("advertise", topic="/tf", type="tf2_msgs/TFMessage"))[0]
    assert errors(client.tell("call_service", service="/rosapi/set_param", args={}))
    assert errors(client.tell("advertise_service", service="/x", type="std_srvs/Trigger"))
    assert errors(client.tell("advertise_action", action="/x", type=Fibonacci.name))
    assert client.tell("subscribe", topic="/chatter", type="std_msgs/String") == []
    assert client.tell("call_service", service="/rosapi/topics")[0]["result"]


def test_a_client_has_a_limited_number_of_subscriptions(world: World) -> None:
    client = world.client()
    told = [client.tell("subscribe", topic=f"/t{number}", type="std_msgs/String") for number in range(65)]
    assert [len(errors(each)) for each in told] == [0] * 64 + [1]
    client.session.close()
    assert world.bridge.topics._sources == {}


def republishing(world: World) -> Callable[[float], None]:
    """Return what moves `base` along x under `odom`."""
    broadcaster = TransformBroadcaster(world.bus.create_node("robot"))
    base = Pose3.from_xyz_rpy

    def move(x: float) -> None:
        broadcaster.send_transform(
            transform_stamped("odom", "base", world.bus.clock.now_ns, base((x, 0.0, 0.0)))
        )
        world.spin(0.2)

    return move


def test_transforms_come_when_they_have_changed(world: World) -> None:
    move, viewer = republishing(world), world.client("viewer")
    wanted = {"source_frames": ["base", "/nowhere"], "target_frame": "odom", "trans_thres": 0.1}
    kind = "tf2_web_republisher_msgs/TFSubscription"  # as roslibjs spells it
    goal = {"action": "/tf2_web_republisher", "action_type": kind, "feedback": True}
    assert viewer.tell("send_action_goal", id="g", args=wanted, **goal) == []

    def heard() -> list[float]:
        told = [each["values"]["transforms"] for each in viewer.heard() if each["op"] == "action_feedback"]
        return [one["transform"]["translation"]["x"] for each in told for one in each]

    move(1.0)
    move(1.05)
    assert heard() == [1.0]
    move(1.15)
    move(2.0)
    assert heard() == [1.15, 2.0]
    told = viewer.tell("cancel_action_goal", id="g", action="/tf2_web_republisher")
    world.spin(0.2)
    assert [each["status"] for each in (*told, *viewer.heard()) if each["op"] == "action_result"] == [5]
    move(9.0)
    assert heard() == []
    viewer.tell("send_action_goal", id="h", args=wanted, **goal)
    assert world.bridge.transforms.is_waiting
    viewer.session.close()
    world.spin(0.2)
    assert not world.bridge.transforms.is_waiting
    assert world.bridge.control.holder is None


def test_transforms_on_a_topic_end_when_nobody_hears_them(world: World) -> None:
    move, viewer = republishing(world), world.client("viewer")
    wanted = {"source_frames": ["base"], "target_frame": "odom", "rate": 10.0, "timeout": {"sec": 2}}
    (told,) = viewer.tell("call_service", service="/republish_tfs", args=wanted)
    topic = told["values"]["topic_name"]
    assert viewer.tell("subscribe", topic=topic) == []
    move(1.0)
    (told,) = viewer.heard()
    assert [each["child_frame_id"] for each in told["msg"]["transforms"]] == ["base"]
    world.spin(5.0)
    move(2.0)
    assert len(viewer.heard()) == 1
    viewer.tell("unsubscribe", topic=topic)
    world.spin(1.0)
    assert world.bridge.transforms.is_waiting
    world.spin(1.5)
    assert not world.bridge.transforms.is_waiting
    for _ in range(150):
        viewer.session.handle({"op": "call_service", "service": "/republish_tfs", "args": wanted})
        world.spin()
    assert len(world.bridge.transforms._topics) == 100
