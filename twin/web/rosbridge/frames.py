"""What travels on the websocket: JSON texts, pictures of them, CBOR, and pieces of long texts."""

from __future__ import annotations

import base64
import math
import struct
import threading
import zlib
from collections.abc import Callable, Hashable
from typing import Any, Literal, TypeVar, get_args

from twin.bridge.cdr.codec import Codec
from twin.bridge.topics.raw import RawSample
from twin.errors import BridgeError
from twin.web.rosbridge.values import to_values

Compression = Literal["none", "png", "cbor", "cbor-raw"]
COMPRESSIONS: tuple[Compression, ...] = get_args(Compression)
Frame = str | bytes
"""A text frame, or a binary one."""
Send = Callable[[Frame, str | None], None]
"""Takes a frame, and the topic that it is of: of a topic newer ones may take its place."""

H = TypeVar("H", bound=Hashable)
_NS = 1_000_000_000


def to_json(values: Any) -> str:
    """Return values as JSON; NaN and infinity are null."""
    import orjson

    return orjson.dumps(values, option=orjson.OPT_SERIALIZE_NUMPY).decode()


def from_json(text: Frame) -> dict[str, Any]:
    """Return the object that a frame is.

    Raises:
        BridgeError: no JSON, or another value than an object.
    """
    import orjson

    try:
        values = orjson.loads(text)
    except (orjson.JSONDecodeError, RecursionError) as error:
        raise BridgeError(f"the message is no JSON: {error}") from None
    if not isinstance(values, dict):
        raise BridgeError("the message is no JSON object with an op")
    return values


class Heard:
    """A message of a topic on its way to clients; made into a frame once for all that want it so."""

    __slots__ = ("_codec", "_frames", "_made_of_it", "_making", "_message", "sample")

    def __init__(self, sample: RawSample, codec: Codec[Any] | None) -> None:
        """Take a sample; only `cbor-raw` does without a codec."""
        self.sample = sample
        self._codec = codec
        self._message: Any = None
        self._frames: dict[Compression, Frame] = {}
        self._made_of_it: dict[Hashable, bytes] = {}
        self._making = threading.Lock()

    def made(self, how: H, make: Callable[[Any, H], bytes]) -> bytes:
        """Return what `make` makes of the message in a way, once for all that want it so; in any thread.

        Raises:
            BridgeError: as `frame`, and what `make` raises.
        """
        with self._making:
            if how not in self._made_of_it:
                self._made_of_it[how] = make(self.message, how)
            return self._made_of_it[how]

    def frame(self, compression: Compression) -> Frame:
        """Return the `publish` of this message.

        Raises:
            BridgeError: the type is not known, or the bytes are no such message.
        """
        if compression not in self._frames:
            self._frames[compression] = self._made(compression)
        return self._frames[compression]

    def _made(self, compression: Compression) -> Frame:
        if compression == "png":
            return to_json({"op": "png", "data": png_of(str(self.frame("none")))})
        publish: dict[str, Any] = {"op": "publish", "topic": self.sample.topic}
        if compression == "none":
            return to_json({**publish, "msg": to_values(self.message)})
        import cbor2

        if compression == "cbor":
            return cbor2.dumps({**publish, "msg": to_values(self.message, "cbor")})
        secs, nsecs = divmod(self.sample.source.time_ns, _NS)
        return cbor2.dumps({**publish, "msg": {"secs": secs, "nsecs": nsecs, "bytes": self.sample.payload}})

    @property
    def message(self) -> Any:
        """The message; raises BridgeError as `frame`."""
        if self._codec is None:
            raise BridgeError(f"the type {self.sample.type} of {self.sample.topic} is not known here (yet)")
        if self._message is None:
            try:
                self._message = self._codec.decode(self.sample.payload)
            except Exception:
                sent = f"a message on {self.sample.topic}"
                raise BridgeError(f"{sent} has other bytes than a {self.sample.type}") from None
        return self._message


def png_of(text: str) -> str:
    """Return a text as the pixels of a picture, padded with newlines: base64 of a PNG, 8 bits RGB."""
    data = text.encode()
    width = max(1, math.isqrt(math.ceil(len(data) / 3)))
    row = 3 * width
    height = max(1, math.ceil(len(data) / row))
    data = data.ljust(row * height, b"\n")
    lines = b"".join(b"\0" + data[start : start + row] for start in range(0, len(data), row))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(lines)), (b"IEND", b""))
    picture = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )
    return base64.b64encode(picture).decode()


def in_fragments(frame: Frame, size: int | None, number: int) -> list[Frame]:
    """Return a text as `fragment` messages of at most so many characters each; others as they are."""
    if size is None or isinstance(frame, bytes) or len(frame) <= size:
        return [frame]
    pieces = [frame[start : start + size] for start in range(0, len(frame), size)]
    return [
        to_json({"op": "fragment", "id": str(number), "data": piece, "num": index, "total": len(pieces)})
        for index, piece in enumerate(pieces)
    ]


class Fragments:
    """Puts a client's `fragment` messages together."""

    def __init__(self, most_bytes: int, timeout_s: float = 10.0, most: int = 16) -> None:
        """Set limits: characters that wait in all, how long pieces wait [s], messages begun at a time."""
        self._most_bytes = most_bytes
        self._timeout_s = timeout_s
        self._most = most
        self._begun: dict[str, tuple[float, int, dict[int, str]]] = {}

    def add(self, message: dict[str, Any], now_s: float) -> dict[str, Any] | None:
        """Return the message of which the last piece has come, else None.

        Raises:
            BridgeError: no fragment, or more than the limits allow.
        """
        for key in [key for key, (since_s, _, _) in self._begun.items() if now_s - since_s > self._timeout_s]:
            del self._begun[key]
        key, data = str(message.get("id")), message.get("data")
        number, total = message.get("num"), message.get("total")
        if not (isinstance(data, str) and type(number) is int and type(total) is int and 0 <= number < total):
            raise BridgeError("a fragment needs id, data (a text), num and total (num < total)")
        _, expected, pieces = self._begun.setdefault(key, (now_s, total, {}))
        pieces[number] = data
        waiting = sum(len(piece) for _, _, each in self._begun.values() for piece in each.values())
        too_much = waiting > self._most_bytes or len(self._begun) > self._most or total > self._most_bytes
        if too_much or expected != total:
            del self._begun[key]
            raise BridgeError(
                f"the fragments {key[:80]!r} are dropped: more than {self._most_bytes} characters or "
                f"{self._most} messages at a time, or another total than before"
            )
        if len(pieces) < total:
            return None
        del self._begun[key]
        return from_json("".join(pieces[index] for index in range(total)))
