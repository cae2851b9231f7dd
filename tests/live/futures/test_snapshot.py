"""A moment of a run in a file: it is made again, or refused."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import pytest

from tests.live.futures.conftest import Begin, digest, listening
from twin.bridge import live
from twin.bridge.msgs import Twist, new
from twin.bridge.parameters.values import Parameter
from twin.bridge.srvs import SetParameters
from twin.errors import SimulationError, TwinError
from twin.live.futures import Futures, WhatIf
from twin.live.futures.inputs import Inputs
from twin.live.futures.snapshot import Snapshot
from twin.runtime.open_run import OpenRun


@pytest.fixture
def driven(begin: Begin, endpoint: str) -> tuple[OpenRun, Inputs]:
    """A run that another session has driven, and of which it has changed a parameter."""
    run = begin(0.0, network=listening(endpoint), duration="1000 s", drive="900 s")
    node = run.run.bus.create_node("governor")  # not of the scenario: nobody makes it again
    node.destroy()
    inputs = Inputs(run)
    with live.join((endpoint,)) as here:
        someone = here.bus.create_node("someone")
        commands = someone.create_publisher(Twist, "/cmd_vel", 10)
        client = someone.create_client(SetParameters, "/mission/set_parameters")
        end = time.monotonic() + 100.0
        assert here.spin(lambda: commands.has_subscribers and client.service_is_ready, timeout_s=100.0)
        message = new(Twist)
        message.angular.z = -1.0
        run.between_ticks.append(lambda: here.spin_once(0.0))
        for _ in range(5):
            count = len(inputs.kept)
            commands.publish(message)
            run.advance(lambda count=count: len(inputs.kept) > count or time.monotonic() > end)
        wrong = Parameter("no such", value=1).to_parameter_msg()
        future = client.call_async(SetParameters.Request([wrong]))
        run.advance(lambda: future.done or time.monotonic() > end)
        assert not future.result.results[0].successful
        run.between_ticks.clear()
        at = run.run.world.time_ns
        run.advance(lambda: run.run.world.time_ns >= at + 100_000_000)
    return run, inputs


def test_it_is_made_again_bit_for_bit(driven: tuple[OpenRun, Inputs], tmp_path: Path) -> None:
    run, inputs = driven
    assert {one.kind for one in inputs.kept} == {"message", "request"}
    snapshot = Snapshot.of(run, inputs)
    snapshot.write(tmp_path / "now.json")
    assert "s are run again" in snapshot.cost
    again = Snapshot.read(tmp_path / "now.json").restore()
    try:
        assert again.run.world.time_ns == run.run.world.time_ns
        assert digest(again) == digest(run)
        digests = []
        for one in (run, again):
            with Futures(one, WhatIf(n=1, horizon=0.5)) as futures:
                digests.append(futures.wait().outcomes[0].digest)
        assert digests[0] == digests[1]
    finally:
        again.close()
    other = [replace_payload(one) if one.kind == "message" else one for one in snapshot.inputs]
    with pytest.raises(SimulationError, match=r"is another run: digest \w+ instead of \w+; was"):
        replace(snapshot, inputs=tuple(other)).restore()


def replace_payload(one):  # type: ignore[no-untyped-def]
    message = new(Twist)
    message.angular.z = 1.0  # instead of -1.0
    from twin.bridge.cdr.codec import codec

    return one._replace(payload=codec(Twist).encode(message))


def test_what_is_otherwise_now_is_told_in_a_sentence(begin: Begin, tmp_path: Path) -> None:
    run = begin(0.2)
    snapshot = Snapshot.of(run, Inputs(run))
    made = snapshot.provenance
    for changed, why in (
        (replace(made, versions={**made.versions, "mujoco": "1.0"}), "made with mujoco 1.0, here it is"),
        (replace(made, cpu="abacus"), "made with CPU abacus, here it is"),
        (replace(made, files={"robot.urdf": "1"}), "made with file robot.urdf 1, here it is missing"),
        (replace(made, scenario={**made.scenario, "seed": 2}), "is another run: digest"),
    ):
        with pytest.raises(SimulationError, match=why):
            replace(snapshot, provenance=changed).restore()
    for text, why in (("{}", "not a snapshot"), ("[1]", "not a snapshot"), (None, "no such file")):
        file = tmp_path / "some.json"
        file.unlink(missing_ok=True)
        if text is not None:
            file.write_text(text)
        with pytest.raises(TwinError, match=why):
            Snapshot.read(file)
