"""What keys and a gamepad ask for."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import pytest

from twin.errors import TwinError
from twin.live.teleop.gamepad import Gamepad
from twin.live.teleop.keys import STILL, Command, Keys, Layout, TeleopConfig

S = 1_000_000_000


def after(keys: Keys, typed: str, now_ns: int = S) -> Command:
    for key in typed:
        keys.press(key, now_ns)
    return keys.command(now_ns)


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("i", (0.5, 0, 0, 0)),
        ("o", (0.5, 0, 0, -1)),
        ("m", (-0.5, 0, 0, -1)),
        ("J", (0, 0.5, 0, 0)),
        (">", (-0.5, -0.5, 0, 0)),
        ("b", (0, 0, -0.5, 0)),
        ("k", STILL),
        ("y", STILL),
    ],
)
def test_keys_of_teleop_twist_keyboard(key: str, expected: tuple[float, ...]) -> None:
    keys = Keys(TeleopConfig())
    assert after(keys, f"i{key}") == expected


def test_speeds_go_by_ten_per_cent_each_by_itself() -> None:
    keys = Keys(TeleopConfig())
    assert after(keys, "qwe") == STILL, "they drive nothing"
    assert (keys.speed, keys.turn) == pytest.approx((0.5 * 1.21, 1.21))
    assert after(keys, "u") == pytest.approx((0.605, 0, 0, 1.21))
    assert after(keys, "z") == pytest.approx((0.5445, 0, 0, 1.089)), "at once"
    assert after(keys, "xc") == pytest.approx((0.49005, 0, 0, 0.9801))


def test_keys_of_turtlebot3_add_up_to_its_limits() -> None:
    keys = Keys(TeleopConfig(layout=Layout.TURTLEBOT3, speed=0.22, turn=2.84))
    assert after(keys, "wwwxa") == pytest.approx((0.02, 0, 0, 0.1))
    assert after(keys, "w" * 50 + "d" * 50) == pytest.approx((0.22, 0, 0, -2.84))
    assert after(keys, "s") == STILL
    assert after(keys, "xd ") == STILL


def test_arrows_drive_in_both() -> None:
    for layout, up in ((Layout.TWIST, 0.5), (Layout.TURTLEBOT3, 0.01)):
        keys = Keys(TeleopConfig(layout=layout))
        keys.press("arrow A", S)
        assert keys.command(S).x == up
        keys.press("arrow Z", S)
        assert keys.command(S) == STILL


@pytest.mark.parametrize("layout", list(Layout))
def test_without_a_key_it_stops_and_no_speed_key_revives_it(layout: Layout) -> None:
    keys = Keys(TeleopConfig(layout=layout))
    moving = "i" if layout is Layout.TWIST else "w"
    assert after(keys, moving).x > 0.0
    assert keys.command(S + 700_000_000).x > 0.0, "a key that is held is repeated after 0.66 s"
    after(keys, "q" if layout is Layout.TWIST else "a", S + 800_000_000)
    assert keys.command(S + 800_000_000).x == 0.0

    for_ever = Keys(TeleopConfig(layout=layout, dead_man=0.0))
    after(for_ever, moving)
    assert for_ever.command(1000 * S).x > 0.0


def test_a_gamepad_drives_while_its_button_is_held(tmp_path: Path) -> None:
    path = tmp_path / "js0"
    os.mkfifo(path)
    pad = Gamepad(path)
    writer = os.open(path, os.O_WRONLY)

    def event(kind: int, number: int, value: int) -> None:
        os.write(writer, struct.pack("=IhBB", 0, value, kind, number))

    event(0x82, 1, -32767)
    assert pad.command(0.5, 1.0) is None, "nobody holds the button"
    event(1, 4, 1)
    assert pad.command(0.5, 1.0) == (0.5, 0, 0, 0), "forward is negative"
    event(2, 0, 16384)
    assert pad.command(0.5, 1.0) == pytest.approx((0.5, 0, 0, -0.5), abs=1e-4)
    event(2, 1, 1000)
    event(2, 0, -2000)
    assert pad.command(0.5, 1.0) == STILL, "a stick never rests at zero"
    event(2, 1, -32767)
    event(1, 4, 0)
    assert pad.command(0.5, 1.0) is None
    event(1, 4, 1)
    assert pad.command(0.5, 1.0) is not None
    os.close(writer)
    assert pad.command(0.5, 1.0) is None, "it was unplugged"
    with pytest.raises(TwinError, match="no gamepad can be read there"):
        Gamepad(tmp_path / "js1")
