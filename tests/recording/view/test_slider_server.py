"""The page with the sliders: it moves the robot, stays on this computer, and refuses what is not its own."""

from __future__ import annotations

import http.client
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from twin.convert.inspection import inspect_robot
from twin.errors import RecordingError
from twin.models import ReadOptions, link_poses, load
from twin.models.description import RobotDescription
from twin.recording.read_back import read
from twin.recording.stream import open_recording
from twin.recording.view.live_view import Watcher, reload
from twin.recording.view.posture import Posture
from twin.recording.view.robot_session import RobotSession
from twin.recording.view.robot_view import RobotView, robot_layout
from twin.recording.view.slider_server import MAX_BODY, SliderServer

ROBOT = """<robot name='r'><link name='a'/><link name='b'/><link name='c'/>
<joint name='lift' type='prismatic'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>
  <limit lower='0' upper='{}' effort='1' velocity='1'/></joint>
<joint name='hand' type='revolute'><origin xyz='1 0 0'/><parent link='b'/><child link='c'/><axis xyz='0 0 1'/>
  <limit lower='-1' upper='1' effort='1' velocity='1'/><mimic joint='lift' multiplier='0.5'/></joint>
</robot>"""
JSON = {"Content-Type": "application/json"}


class Screen:
    """Remembers what it was told to show."""

    def __init__(self) -> None:
        self.robots: list[RobotDescription] = []
        self.postures: list[dict[str, Any]] = []
        self.closed = 0

    def draw(self, description: RobotDescription, posture: Posture) -> Screen:
        self.robots.append(description)
        return self

    def move(self, posture: Posture) -> None:
        self.postures.append(posture.positions)

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "r.urdf"
    path.write_text(ROBOT.format(0.8), encoding="utf-8")
    return path


@pytest.fixture
def screen() -> Screen:
    return Screen()


@pytest.fixture
def session(file: Path, screen: Screen) -> RobotSession:
    robot = load(file)
    return RobotSession(robot, Posture(robot), screen.draw)


@pytest.fixture
def server(session: RobotSession) -> Iterator[SliderServer]:
    server = SliderServer(session, port=0)
    with server.running():
        yield server


def ask(
    server: SliderServer,
    method: str,
    path: str,
    body: bytes | None = None,
    headers: dict[str, str] | None = None,
) -> tuple[int, Any]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    try:
        connection.request(method, path, body, headers or {})
        answer = connection.getresponse()
        text = answer.read()
        return answer.status, json.loads(text) if answer.getheader("Content-Type") == JSON[
            "Content-Type"
        ] else text
    finally:
        connection.close()


def post(server: SliderServer, path: str, document: Any) -> tuple[int, Any]:
    return ask(server, "POST", path, json.dumps(document).encode(), JSON)


def test_a_slider_moves_the_robot_and_its_followers(server: SliderServer, screen: Screen) -> None:
    status, answer = post(server, "/values", {"lift": 0.6})
    assert (status, answer["values"], answer["followers"]) == (200, {"lift": 0.6}, {"hand": 0.3})
    assert screen.postures[-1] == {"lift": 0.6, "hand": 0.3}
    assert ask(server, "GET", "/values") == (200, answer)


def test_buttons(server: SliderServer) -> None:
    assert post(server, "/preset", {"preset": "center"})[1]["values"] == {"lift": 0.4}
    assert post(server, "/preset", {"preset": "zero"})[1]["values"] == {"lift": 0.0}
    assert 0.0 < post(server, "/preset", {"preset": "random"})[1]["values"]["lift"] < 0.8
    assert post(server, "/preset", {"preset": "explode"})[0] == 400


def test_what_the_page_is_told(server: SliderServer, session: RobotSession) -> None:
    _, state = ask(server, "GET", "/state")
    assert state["robot"] == "r"
    assert state["diagnostics"] is None  # still checking
    (lift,) = state["coordinates"]
    assert (lift["name"], lift["type"], lift["unit"], lift["upper"]) == ("lift", "prismatic", "m", 0.8)
    (hand,) = state["mimics"]
    assert (hand["name"], hand["joint"], hand["multiplier"]) == ("hand", "lift", 0.5)
    session.diagnose(inspect_robot(load(Path(state["file"]))))
    _, checked = ask(server, "GET", "/state")
    assert {item["code"] for item in checked["diagnostics"]} >= {"massless"}
    assert checked["robot_revision"] > state["robot_revision"]


def test_the_page_needs_nothing_from_elsewhere(server: SliderServer) -> None:
    status, page = ask(server, "GET", "/")
    assert status == 200
    assert b"</html>" in page
    assert b"://" not in page
    assert b"innerHTML" not in page  # names in robot files are text, never markup


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/values", b"{"),
        ("/values", b"[" * 60_000),
        ("/values", b"\xff\xfe"),
        ("/values", b"[1]"),
        ("/values", b'{"lift": "up"}'),
        ("/values", b'{"lift": true}'),
        ("/values", b'{"lift": NaN}'),
        ("/values", b'{"lift": 1e999}'),
        ("/values", b'{"lift": 1' + b"0" * 400 + b"}"),
        ("/values", b'{"lift": 1' + b"0" * 9000 + b"}"),
        ("/values", b'{"lift": 0.9}'),
        ("/values", b'{"hand": 0.1}'),
        ("/values", b'{"lfit": 0.1}'),
        ("/preset", b"{}"),
        ("/preset", b'{"preset": ["zero"]}'),
    ],
)
def test_bad_requests_change_nothing(server: SliderServer, screen: Screen, path: str, body: bytes) -> None:
    before = len(screen.postures)
    status, answer = ask(server, "POST", path, body, JSON)
    assert status == 400
    assert answer["error"]
    assert len(screen.postures) == before
    assert ask(server, "GET", "/values")[0] == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({**JSON, "Host": "evil.example"}, 403),
        ({**JSON, "Origin": "http://evil.example"}, 403),
        ({**JSON, "Origin": "null"}, 403),
        ({"Content-Type": "text/plain"}, 415),
        ({}, 415),
        ({**JSON, "Content-Length": str(MAX_BODY + 1)}, 413),
        ({**JSON, "Content-Length": "9" * 5000}, 413),
        ({**JSON, "Content-Length": "-1"}, 411),
    ],
)
def test_other_pages_are_refused(
    server: SliderServer, screen: Screen, headers: dict[str, str], status: int
) -> None:
    before = len(screen.postures)
    assert ask(server, "POST", "/values", b'{"lift": 0.1}', headers)[0] == status
    assert len(screen.postures) == before


def test_our_own_page_is_not_refused(server: SliderServer) -> None:
    for origin in (server.url.rstrip("/"), f"http://localhost:{server.server_port}"):
        assert ask(server, "POST", "/values", b'{"lift": 0.1}', {**JSON, "Origin": origin})[0] == 200


@pytest.mark.parametrize("path", ["/index.html", "/../live_view.py", "/etc/passwd", "//etc/passwd"])
def test_no_file_but_the_page_is_served(server: SliderServer, path: str) -> None:
    assert ask(server, "GET", path)[0] == 404
    assert post(server, path, {})[0] == 404
    assert ask(server, "GET", "/state", headers={"Host": "evil.example"})[0] == 403


def test_only_this_computer_can_connect_and_the_port_is_free_again(session: RobotSession) -> None:
    server = SliderServer(session, port=0)
    assert server.server_address[0] == "127.0.0.1"
    with server.running(), pytest.raises(RecordingError, match=r"port \d+ cannot be used.*--port"):
        SliderServer(session, port=server.server_port)
    with SliderServer(session, port=server.server_port):
        pass


def test_sliders_write_transforms(file: Path, tmp_path: Path, recorded_poses: Any) -> None:
    robot = load(file)

    def draw(description: RobotDescription, posture: Posture) -> RobotView:
        blueprint = robot_layout(description, posture)
        return RobotView(open_recording(tmp_path / "a.rrd", "view", "a", blueprint), description)

    session = RobotSession(robot, Posture(robot), draw)
    server = SliderServer(session, port=0)
    with server.running():
        for value in (0.1, 0.2, 0.7):
            assert post(server, "/values", {"lift": value})[0] == 200
    session.close()
    poses = recorded_poses(read(tmp_path / "a.rrd"), "a")
    for link, pose in link_poses(robot, {"lift": 0.7}).items():
        assert poses[link].xyz == pytest.approx(pose.xyz, abs=1e-6)
        assert poses[link].quat_wxyz == pytest.approx(pose.quat_wxyz, abs=1e-6)


def test_a_file_that_changes(file: Path, session: RobotSession, screen: Screen) -> None:
    session.set({"lift": 0.6})
    watcher = Watcher(load(file))
    assert not watcher.changed()
    file.write_text(ROBOT.format(0.75), encoding="utf-8")
    assert watcher.changed()
    watcher = reload(session, file, ReadOptions(), watcher)
    assert (len(screen.robots), screen.closed) == (2, 1)
    assert session.values()["values"] == {"lift": 0.6}  # where it was
    assert session.state()["coordinates"][0]["upper"] == 0.75

    file.write_text("<robot name='r'><link", encoding="utf-8")
    assert watcher.changed()
    assert reload(session, file, ReadOptions(), watcher) is watcher
    (found,) = session.state()["diagnostics"]
    assert (found["code"], found["severity"]) == ("bad-xml", "error")
    assert (len(screen.robots), session.values()["values"]) == (2, {"lift": 0.6})

    file.write_text(ROBOT.format(0.5), encoding="utf-8")
    assert watcher.changed()
    reload(session, file, ReadOptions(), watcher)
    assert session.values()["values"] == {"lift": 0.0}  # 0.6 is out of reach now
