"""A bus in a fork: its nodes go on among themselves, and nobody outside hears of it."""

from __future__ import annotations

import json
import os

import pytest

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import String
from twin.bridge.qos import LATCHED
from twin.bridge.services import Respond
from twin.bridge.srvs import Trigger


def test_what_is_under_way_between_own_nodes_arrives(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    with Bus.open(clock, listen=(endpoint,)) as bus, live.join((endpoint,)) as outside:
        node = bus.create_node("one")
        open_questions: list[Respond] = []
        node.create_deferred_service(Trigger, "ask", lambda _, respond: open_questions.append(respond))
        client = bus.create_node("asker").create_client(Trigger, "ask")
        latched = node.create_publisher(String, "latched", LATCHED)
        latched.publish(String(data="before"))
        heard: list[str] = []
        node.create_subscription(String, "talk", lambda m: heard.append(m.data), 10)
        talk = bus.create_node("talker").create_publisher(String, "talk", 10)

        observed: list[str] = []
        observer = outside.bus.create_node("observer")
        observer.create_subscription(String, "talk", lambda m: observed.append(m.data), 10)
        theirs = observer.create_publisher(String, "talk", 10)
        elsewhere = outside.bus.create_node("elsewhere").create_client(Trigger, "ask")
        assert outside.spin(lambda: elsewhere.service_is_ready and theirs.has_subscribers, timeout_s=60.0)

        answered, unheard = client.call_async(Trigger.Request()), elsewhere.call_async(Trigger.Request())
        assert outside.spin(lambda: bus.external.waiting > 0, timeout_s=60.0)
        bus.admit()
        bus.spin()
        assert len(open_questions) == 2
        talk.publish(String(data="waits in the inbox"))
        theirs.publish(String(data="nobody has admitted it"))
        assert outside.spin(lambda: bus.external.waiting > 0, timeout_s=60.0)

        read, write = os.pipe()
        pid = os.fork()
        if not pid:
            told = {}
            try:
                bus.go_alone()
                monkeypatch.setattr(
                    "twin.bridge.services.questions.pack_attachment", None
                )  # a reply over Zenoh
                monkeypatch.setattr("twin.bridge.topics.pack_attachment", None)  # a message over Zenoh
                late: list[str] = []
                bus.create_node("late").create_subscription(
                    String, "latched", lambda m: late.append(m.data), LATCHED
                )
                for respond in open_questions:
                    respond(Trigger.Response(True, "from the fork"))
                talk.publish(String(data="said in the fork"))
                asked = client.call_async(Trigger.Request())
                for _ in range(3):
                    bus.admit()
                    bus.spin()
                open_questions.pop()(Trigger.Response(True, "again"))
                bus.spin()
                bus.spin()
                told = {
                    "answer": answered.result.message,
                    "asked": asked.result.message,
                    "heard": heard,
                    "late": late,
                }
                node.destroy()
                bus.close()
            finally:
                os.write(write, json.dumps(told).encode())
                os._exit(0)
        os.close(write)
        with os.fdopen(read) as pipe:
            told = json.loads(pipe.read())
        os.waitpid(pid, 0)
        assert told == {
            "answer": "from the fork",
            "asked": "again",
            "heard": ["waits in the inbox", "said in the fork"],
            "late": ["before"],
        }

        bus.admit()
        bus.spin()
        assert heard == ["waits in the inbox", "nobody has admitted it"]
        assert not answered.done
        for respond in open_questions:
            respond(Trigger.Response(True, "from the run"))
        talk.publish(String(data="last"))
        assert outside.spin(lambda: unheard.done and "last" in observed, timeout_s=60.0)
        assert unheard.result.message == "from the run"
        assert "said in the fork" not in observed
