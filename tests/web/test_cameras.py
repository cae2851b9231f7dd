"""Cameras in HTTP: who may see them, in which form, and that nobody draws for nobody."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow

from tests.processes import wait_for
from tests.web.serving import get, refused, serving
from twin.bridge.bus import Bus
from twin.bridge.msgs import CompressedImage, Header, Image, String, new
from twin.web.rosbridge.access import ROLES, RoleRules, Token
from twin.web.rosbridge.bridge import Limits
from twin.web.rosbridge.server import ServerConfig

PERIOD_NS = 20_000_000
TOPIC = "/camera/image_raw"


class Camera:
    """A camera that draws only for who looks, each picture another: its red is its number."""

    def __init__(self, width: int = 64, height: int = 48) -> None:
        self.shape = height, width
        self.drawn = 0
        self.publisher: Any = None

    def __call__(self, bus: Bus) -> None:
        node = bus.create_node("camera")
        self.publisher = node.create_publisher(Image, TOPIC, 1)
        self.compressed = node.create_publisher(CompressedImage, f"{TOPIC}/compressed", 1)
        self.words = node.create_publisher(String, "/words", 1)
        node.create_timer(PERIOD_NS, self.draw)

    @property
    def is_wanted(self) -> bool:
        return bool(self.publisher.has_subscribers or self.compressed.has_subscribers)

    def draw(self) -> None:
        if not self.is_wanted:
            return
        self.drawn += 1
        height, width = self.shape
        pixels = np.zeros((height, width, 3), np.uint8)
        pixels[..., 2] = self.drawn % 256
        pixels[: height // 2, :, 0] = 255  # the upper half is blue
        message = new(Image, height=height, width=width, encoding="bgr8", step=3 * width)
        message.data = pixels[..., ::-1].copy().reshape(-1)[: pixels.size]
        message.encoding = "rgb8"
        self.publisher.publish(message)
        file = BytesIO()
        Pillow.fromarray(pixels[..., ::-1]).save(file, "jpeg", quality=33)
        data = np.frombuffer(file.getvalue(), np.uint8)
        self.compressed.publish(CompressedImage(new(Header), "rgb8; jpeg compressed bgr8", data))


def parts(answer: Any) -> Callable[[], bytes]:
    """Return what reads a multipart answer, picture by picture."""

    def read() -> bytes:
        assert answer.readline() == b"--frame\r\n"
        headers = {}
        while (line := answer.readline()) != b"\r\n":
            name, _, value = line.decode().partition(": ")
            headers[name] = value.strip()
        assert headers["Content-Type"] == "image/jpeg"
        file = answer.read(int(headers["Content-Length"]))
        assert answer.read(2) == b"\r\n"
        return bytes(file)

    return read


def opened(file: bytes) -> Pillow.Image:
    return Pillow.open(BytesIO(file))


def test_a_stream_is_drawn_only_while_somebody_looks() -> None:
    camera = Camera()
    with serving(ServerConfig(port=0), nodes=camera) as server:
        time.sleep(0.2)
        assert camera.drawn == 0
        with get(server, f"/stream?topic={TOPIC}") as answer:
            assert answer.headers["Content-Type"].startswith("multipart/x-mixed-replace")
            read = parts(answer)
            reds = [opened(read()).getpixel((10, 40))[0] for _ in range(4)]
            assert reds == sorted(reds)
        wait_for(lambda: not camera.is_wanted)
        wait_for(lambda: not server.server._http.streams)


def test_a_picture_in_the_form_that_is_asked_for() -> None:
    with serving(ServerConfig(port=0), nodes=Camera()) as server:
        with get(server, f"/snapshot?topic={TOPIC}") as answer:
            assert answer.headers["Content-Type"] == "image/jpeg"
            whole = answer.read()
        assert opened(whole).size == (64, 48)
        red, _, blue = opened(whole).getpixel((20, 10))
        assert blue > 200 > 100 > red
        with get(server, f"/snapshot?topic={TOPIC}&width=32&quality=5") as answer:
            small = answer.read()
        assert opened(small).size == (32, 24)
        assert len(small) < len(whole)
        with get(server, f"/snapshot?topic={TOPIC}&type=ros_compressed") as answer:
            given = answer.read()
        tables = opened(given).quantization  # type: ignore[attr-defined]
        assert tables != opened(whole).quantization, "its own JPEG, as it is"  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("path", "status", "words"),
    [
        ("/stream", 400, "needs ?topic="),
        (f"/stream?topic={TOPIC}&type=h264", 400, "valid: mjpeg, ros_compressed"),
        (f"/snapshot?topic={TOPIC}&width=0", 400, "width=0"),
        (f"/snapshot?topic={TOPIC}&width=99999999999999", 400, "valid: 1 to 8192"),
        (f"/snapshot?topic={TOPIC}&quality=nan", 400, "quality=nan"),
        ("/snapshot?topic=/nothing", 404, "nobody publishes /nothing"),
        ("/stream?topic=/nothing", 404, "nobody publishes /nothing"),
        ("/stream?topic=/words", 404, "is a std_msgs/msg/String"),
        ("/snapshot?topic=%00%ff//", 404, "it may contain letters"),
    ],
)
def test_what_cannot_be_shown_is_a_sentence(path: str, status: int, words: str) -> None:
    with serving(ServerConfig(port=0), nodes=Camera()) as server:
        code, told = refused(server, path)
        assert code == status
        assert words in told


def test_a_picture_that_is_none_is_a_sentence() -> None:
    def nodes(bus: Bus) -> None:
        node = bus.create_node("camera")
        images = node.create_publisher(Image, "/short", 1)
        files = node.create_publisher(CompressedImage, "/junk", 1)
        deep = new(Image, height=2, width=2, step=8, encoding="32FC1", data=np.zeros(16, np.uint8))
        depths = node.create_publisher(Image, "/deep", 1)

        def say() -> None:
            images.publish(new(Image, height=9000, width=9000, step=27000, encoding="rgb8"))
            files.publish(CompressedImage(new(Header), "jpeg", np.frombuffer(b"no picture", np.uint8)))
            depths.publish(deep)

        node.create_timer(PERIOD_NS, say)

    with serving(ServerConfig(port=0), nodes=nodes) as server:
        for topic, words in (("short", "fewer bytes"), ("junk", "cannot be shown"), ("deep", "'32FC1'")):
            for path in ("snapshot", "stream"):
                code, told = refused(server, f"/{path}?topic=/{topic}")
                assert code == 415
                assert words in told


def test_who_may_not_look_does_not(tmp_path: Path) -> None:
    secret = "viewer-0123456789"
    viewer = RoleRules(subscribe=("/map", f"{TOPIC}/compressed")).of(ROLES["viewer"])
    config = ServerConfig(port=0, tokens=(Token(secret, viewer, "screen"),))
    audited: list[str] = []

    def code(path: str, **headers: str) -> int:
        return refused(server, path, **headers)[0]

    with serving(config, nodes=Camera(), audit=audited.append) as server:
        allowed = f"/snapshot?topic={TOPIC}/compressed"
        assert code(allowed) == 401
        assert code(f"{allowed}&token={secret}") == 200
        assert code(allowed, Authorization=f"Bearer {secret}") == 200
        assert code(f"/snapshot?topic={TOPIC}&token={secret}") == 403  # not in its list
        assert code(f"{allowed}&token={secret}", Origin="http://evil.example") == 403
        # A picture in somebody else's page has no origin: browsers only tell that it is elsewhere.
        assert code(f"{allowed}&token={secret}", Sec_Fetch_Site="cross-site") == 403
        assert code(f"{allowed}&token={secret}", Sec_Fetch_Site="same-origin") == 200
        for _ in range(10):
            assert code(f"{allowed}&token=wrong") == 401
        assert code(f"{allowed}&token={secret}") == 401
        wait_for(lambda: len(audited) == 10)


def test_as_many_look_as_there_is_room_for() -> None:
    limits, path = Limits(clients=1, messages_per_s=3.0), f"/stream?topic={TOPIC}"
    with serving(ServerConfig(port=0), limits, Camera()) as server, get(server, path):
        assert refused(server, path)[0] == 503
        assert 429 in [refused(server, "/snapshot?topic=/nothing")[0] for _ in range(8)]


def test_who_reads_slowly_gets_the_newest_picture_and_who_reads_nothing_is_given_up() -> None:
    camera = Camera(1280, 960)
    with serving(ServerConfig(port=0), Limits(stalled_s=0.5), camera) as server:
        host, port = server.server.address.removeprefix("ws://").split(":")
        with socket.create_connection((host, int(port)), timeout=60.0) as lazy:
            lazy.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            ask = f"GET /stream?topic={TOPIC}&quality=100 HTTP/1.1\r\nHost: localhost\r\n\r\n"
            lazy.sendall(ask.encode())
            wait_for(lambda: len(server.server._http.streams) == 1)
            buffered = []

            def is_gone() -> bool:
                buffered.extend(
                    each.transport.get_write_buffer_size() for each in tuple(server.server._http.streams)
                )
                return not server.server._http.streams

            wait_for(is_gone)
        assert max(buffered) < 500_000, "one picture waits, no queue of them"
        wait_for(lambda: not camera.is_wanted)
