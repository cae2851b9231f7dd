from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from subprocess import CompletedProcess

import pytest

from twin.bridge.graph import EndpointInfo, parse_token
from twin.cli.ros.endpoint_text import endpoint_text

GRAPH = "service_graph.py"
ADD = ("/add_two_ints", "example_interfaces/srv/AddTwoInts")
PARAMETERS = ("parameter", "get_type_description")
"""What every node offers."""

Twin = Callable[..., "CompletedProcess[str]"]


def own(text: str) -> list[str]:
    return [line for line in text.splitlines() if not any(name in line for name in PARAMETERS)]


def test_services_are_listed_with_their_types(twin_here: Twin) -> None:
    done = twin_here("service", "list", "-t")
    assert done.stderr == ""
    assert own(done.stdout) == [
        "/add_two_ints [example_interfaces/srv/AddTwoInts]",
        "/never_answers [std_srvs/srv/Empty]",
        "/robot/stop [std_srvs/srv/SetBool]",
        "/weigh [lab_interfaces/srv/Weigh]",
    ]


def test_hidden_services_are_listed_if_wanted(twin_here: Twin) -> None:
    shown = twin_here("service", "list").stdout.splitlines()
    every = twin_here("service", "list", "--include-hidden-services").stdout.splitlines()
    assert {"/robot/_hidden", "/fibonacci/_action/send_goal"} <= set(every) - set(shown)
    assert twin_here("service", "list", "-c").stdout == f"{len(shown)}\n"


def test_a_service_is_found_by_type_and_a_type_by_service(twin_here: Twin) -> None:
    assert twin_here("service", "find", "std_srvs/srv/SetBool").stdout == "/robot/stop\n"
    assert twin_here("service", "find", "-a", "-c", "std_srvs/srv/Empty").stdout == "2\n"
    assert twin_here("service", "type", "/robot/stop").stdout == "std_srvs/srv/SetBool\n"


def test_info_counts_clients_and_servers(twin_here: Twin) -> None:
    done = twin_here("service", "info", "/add_two_ints")
    assert done.stdout == "Type: example_interfaces/srv/AddTwoInts\nClients count: 1\nServices count: 1\n"


def test_verbose_info_describes_each_of_them(twin_here: Twin) -> None:
    lines = twin_here("service", "info", "-v", "/add_two_ints").stdout.split("\n\n")
    assert lines[0].splitlines()[1] == "Clients count: 1"
    client, server = lines[1], lines[3]
    assert client.startswith("Node name: base\nNode namespace: /robot\nService type: example_interfaces/")
    assert "Endpoint type: CLIENT\nEndpoint count: 1\nGID: " in client
    assert server.startswith("Node name: adder\nNode namespace: /\n")
    assert (
        "Service type hash: RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a" in server
    )
    assert "Endpoint type: SERVER" in server
    assert "QoS profile:\n  Reliability: RELIABLE\n  History (Depth): KEEP_LAST (10)\n" in server


def test_verbose_info_of_a_foreign_server_tells_what_it_promised() -> None:
    qos = "::2,:0,5:1,0:3,2,1"
    typed = f"std_srvs::srv::dds_::Empty_/RIHS01_{'0' * 64}/{qos}"
    server = parse_token(f"@ros2_lv/0/ab/1/2/SS/%/%/other/%reset/{typed}")
    assert isinstance(server, EndpointInfo)
    assert endpoint_text(server).endswith(
        "  History (Depth): KEEP_ALL\n"
        "  Durability: VOLATILE\n"
        "  Lifespan: 1000000000 nanoseconds\n"
        "  Deadline: 5 nanoseconds\n"
        "  Liveliness: MANUAL_BY_TOPIC\n"
        "  Liveliness lease duration: 2000000001 nanoseconds"
    )


@pytest.mark.parametrize("command", ["info", "type"])
def test_an_unknown_service_names_the_nearest(twin_here: Twin, command: str) -> None:
    done = twin_here("service", command, "/add_two_int")
    assert done.returncode == 2
    assert done.stderr.startswith(
        "error: Unknown service '/add_two_int'; did you mean '/add_two_ints'? Valid: "
    )


def test_a_call_prints_request_and_response_as_ros2_does(twin_here: Twin) -> None:
    done = twin_here("service", "call", *ADD, "{a: 2, b: 3}")
    assert done.stderr == ""
    assert done.stdout == (
        "requester: making request: example_interfaces.srv.AddTwoInts_Request(a=2, b=3)\n\n"
        "response:\nexample_interfaces.srv.AddTwoInts_Response(sum=5)\n\n"
    )


def test_a_type_that_is_not_known_here_is_learnt_from_the_node(twin: Twin) -> None:
    done = twin("service", "call", "/weigh", "lab_interfaces/srv/Weigh", "{what: feather}")
    assert done.stderr == ""
    assert "lab_interfaces.srv.Weigh_Request(what='feather', times=1)\n" in done.stdout
    assert "lab_interfaces.srv.Weigh_Response(grams=2.5)\n" in done.stdout


def test_a_call_without_values_sends_defaults_and_takes_the_short_type(twin_here: Twin) -> None:
    done = twin_here("service", "call", "/robot/stop", "std_srvs/SetBool")
    assert "std_srvs.srv.SetBool_Request(data=False)" in done.stdout
    assert "std_srvs.srv.SetBool_Response(success=False, message='goes on')" in done.stdout


def test_a_request_is_read_from_standard_input(endpoint: str) -> None:
    command = [sys.executable, "-m", "twin.cli", "service", "call", *ADD, "--stdin", "--connect", endpoint]
    done = subprocess.run(command, input="a: 4\nb: 5\n", capture_output=True, text=True, timeout=120)
    assert "AddTwoInts_Response(sum=9)" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*ADD, "{a: 2, c: 3}"), "has no field 'c'"),
        ((*ADD, "{a: [2"), "is no YAML"),
        ((*ADD, "{}", "-r", "0"), "rate must be greater than zero"),
        (
            ("/add_two_ints", "std_srvs/srv/SetBool"),
            "is of type example_interfaces/srv/AddTwoInts, not std_srvs/",
        ),
        (("/add_two_ints", "std_srvs/msg/Empty"), "is no service"),
        (("/add_two_ints", "std_srvs/srv/Emty"), "did you mean 'std_srvs/srv/Empty'?"),
        (("/never_answers", "std_srvs/srv/Empty", "--timeout", "0.5"), "did not answer in 0.5 s"),
    ],
)
def test_what_cannot_be_called_is_said_in_a_sentence(
    twin_here: Twin, arguments: tuple[str, ...], message: str
) -> None:
    done = twin_here("service", "call", *arguments)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_waiting_for_a_service_ends_with_the_time_out(twin_here: Twin) -> None:
    done = twin_here("service", "call", "/add_two", "std_srvs/srv/Empty", "--timeout", "0.5")
    assert done.stdout == "waiting for service to become available...\n"
    assert done.returncode == 2
    assert "\nerror: Unknown service '/add_two'; did you mean '/add_two_ints'?" in done.stderr


def test_a_rate_repeats_the_call_until_ctrl_c(endpoint: str) -> None:
    command = [sys.executable, "-m", "twin.cli", "service", "call", "-r", "200", *ADD, "--connect", endpoint]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        responses = 0
        while responses < 30:  # none of them is lost
            line = process.stdout.readline()
            assert line, process.communicate()
            responses += line.startswith("example_interfaces.srv.AddTwoInts_Response(sum=0)")
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
    assert process.returncode == 130
    assert errors == ""


def test_a_wait_for_a_misspelt_name_says_so(twin_here: Twin) -> None:
    """It may come yet, so the command waits, as ros2's; but nobody should wait for a mistake unknowingly."""
    called = twin_here("service", "call", "/add_two_int", ADD[1], "--timeout", "0.5")
    assert "WARNING: there is no service /add_two_int yet; did you mean /add_two_ints?\n" in called.stderr
    sent = twin_here("action", "send_goal", "/fibonaci", "example_interfaces/action/Fibonacci", "-t", "0.5")
    assert "WARNING: there is no action /fibonaci yet; did you mean /fibonacci?\n" in sent.stderr
    assert called.returncode == sent.returncode == 2
