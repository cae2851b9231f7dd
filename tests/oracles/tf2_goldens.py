"""Look-ups answered by the real tf2, for tests/bridge/tf/test_oracle.py.

Needs tf2_py and rospy: Debian's python3-tf2-ros (tf2 0.7.6, the BufferCore of ROS 1 Noetic), run with the
system's Python:

    /usr/bin/python3 tests/oracles/tf2_goldens.py                 # writes tests/oracles/tf2_goldens.json
    /usr/bin/python3 tests/oracles/tf2_goldens.py --seed 7 -o -   # another draw, on stdout

Each case is a list of steps for one buffer and what each step gave. Steps:
    set       parent, child, stamp [ns], [x, y, z, qx, qy, qz, qw], static
    lookup    target, source, time [ns]                             -> [x .. qw, stamp [ns]]
    full      target, time, source, time, fixed                     -> the same
    can       target, source, time                                  -> true or false
    can_full  target, time, source, time, fixed                     -> true or false
    common    target, source                                        -> [ns]
    clear
A step that raises gives the name of tf2's exception. Left out is what ROS 1 and ROS 2 do differently: a frame
that is static first and not later, or the other way round. Times are below 1000 s, as tf2_py of ROS 1 takes
them as floating-point seconds.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
from pathlib import Path

S = 1_000_000_000
OUTPUT = Path(__file__).with_name("tf2_goldens.json")


def rounded(value):
    return round(value, 3)


def quaternion(rng, spread=math.pi):
    """Return a rotation about a random axis by up to `spread` [rad], of either sign."""
    axis = [rng.gauss(0, 1) for _ in range(3)]
    norm = math.sqrt(sum(a * a for a in axis))
    half = rng.uniform(-spread, spread) / 2
    sign = rng.choice((1, -1))
    return [sign * math.sin(half) * a / norm for a in axis] + [sign * math.cos(half)]


def pose(rng, spread=math.pi):
    return [rounded(rng.uniform(-20, 20)) for _ in range(3)] + quaternion(rng, spread)


def stamps(rng, count, start=100 * S, step=S // 10):
    out = [start + rng.randrange(S)]
    for _ in range(count - 1):
        out.append(out[-1] + rng.randrange(step // 4, 2 * step))
    return out


def some_time(rng, known):
    """Return a time of interest: a stamp, between two, a nanosecond beside one, outside, or the latest."""
    first, last = min(known), max(known)
    return rng.choice(
        (
            rng.choice(known),
            rng.randrange(first, last + 1),
            rng.randrange(first, last + 1),
            rng.choice(known) + rng.choice((-1, 1)),
            first - rng.randrange(1, S),
            last + rng.randrange(1, S),
            0,
            0,
        )
    )


def tree(rng, prefix, frames, static_share, common=None):
    """Return steps for a random tree, its frames, and all its stamps."""
    names = [prefix + str(i) for i in range(frames)]
    steps, known = [], []
    common = common or stamps(rng, rng.randrange(4, 9))
    for i in range(1, frames):
        parent = names[max(0, i - rng.choice((1, 1, 1, 2, 3)))]
        if rng.random() < static_share:
            steps.append(["set", parent, names[i], rng.choice((0, common[0])), pose(rng), True])
            continue
        own = rng.choice((common, stamps(rng, rng.randrange(2, 7))))
        spread = rng.choice((0.2, math.pi))
        steps += [["set", parent, names[i], stamp, pose(rng, spread), False] for stamp in own]
        known += own
    return steps, names, known or common


def trees(rng):
    for number in range(12):
        steps, names, known = tree(rng, "f", rng.randrange(2, 9), rng.choice((0.0, 0.3, 0.6)))
        for _ in range(14):
            steps.append(["lookup", rng.choice(names), rng.choice(names), some_time(rng, known)])
        for _ in range(3):
            steps.append(["can", rng.choice(names), rng.choice(names), some_time(rng, known)])
            steps.append(["common", rng.choice(names), rng.choice(names)])
        yield f"tree {number}", steps


def two_times(rng):
    for number in range(5):
        steps, names, known = tree(rng, "f", rng.randrange(3, 7), 0.3, stamps(rng, 8))
        for _ in range(14):
            target, source, fixed = (rng.choice(names) for _ in range(3))
            times = [rng.choice(known) if rng.random() < 0.7 else some_time(rng, known) for _ in range(2)]
            steps.append(["full", target, times[0], source, times[1], fixed])
        steps.append(["can_full", names[0], known[0], names[-1], known[-1], names[0]])
        steps.append(["full", names[0], known[0], "nobody", known[0], names[0]])
        steps.append(["full", names[0], known[0], names[1], known[0], "nobody"])
        yield f"two times {number}", steps


def forests(rng):
    for number in range(3):
        steps, names, known = tree(rng, "a", rng.randrange(2, 5), 0.3)
        other, others, more = tree(rng, "b", rng.randrange(2, 5), 0.3)
        steps += other
        everything = names + others + ["nobody", "", "/a0"]
        for _ in range(16):
            steps.append(
                ["lookup", rng.choice(everything), rng.choice(everything), some_time(rng, known + more)]
            )
        for name in ("nobody", "", "/a0"):
            steps += [["lookup", name, name, 0], ["lookup", name, name, 5 * S], ["can", "a0", name, 0]]
        yield f"forest {number}", steps


def evicted(rng):
    for number in range(3):
        start = 200 * S
        steps = [["set", "odom", "base", start + i * S // 2, pose(rng), False] for i in range(30)]
        last = start + 29 * S // 2
        times = last - 10 * S, last - 10 * S - 1, last - 10 * S + 1, last - 12 * S, start, last, 0
        steps += [["lookup", "odom", "base", time] for time in times]
        steps.append(["set", "odom", "base", last - 10 * S - 1, pose(rng), False])
        steps.append(["set", "odom", "base", last - 9 * S - 7, pose(rng), False])
        times = last - 9 * S - 7, last - 9 * S - 8, last - 10 * S - 1
        steps += [["lookup", "odom", "base", time] for time in times]
        jump = last + rng.randrange(9 * S, 12 * S)
        steps.append(["set", "odom", "base", jump, pose(rng), False])
        times = last, jump, jump - 10 * S, jump - S, jump - 10 * S - 1
        steps += [["lookup", "base", "odom", time] for time in times]
        yield f"evicted {number}", steps


def disorder(rng):
    for number in range(3):
        known = stamps(rng, 7)
        steps = [["set", "odom", "base", stamp, pose(rng), False] for stamp in rng.sample(known, 7)]
        steps += [["set", "odom", "base", stamp, pose(rng), False] for stamp in rng.sample(known, 4)]
        for stamp in known:
            steps.append(["lookup", "odom", "base", stamp])
        for _ in range(8):
            steps.append(["lookup", "base", "odom", some_time(rng, known)])
        yield f"out of order and repeated {number}", steps


def reparented(rng):
    for number in range(4):
        known = stamps(rng, 9)
        steps = [["set", "world", "a", 0, pose(rng), True]]
        steps += [["set", "world", "b", stamp, pose(rng), False] for stamp in known]
        halves = known[:5], known[5:]
        for parent, half in zip(rng.sample(("a", "b", "other"), 2), halves, strict=False):
            steps += [["set", parent, "cup", stamp, pose(rng), False] for stamp in half]
        steps += [["set", "cup", "tea", stamp, pose(rng), False] for stamp in known]
        for _ in range(16):
            frames = rng.sample(("world", "a", "b", "other", "cup", "tea"), 2)
            steps.append(["lookup", *frames, some_time(rng, known)])
        steps += [["common", "world", "tea"], ["common", "a", "b"], ["common", "other", "tea"]]
        for _ in range(4):
            times = [rng.choice(known), rng.choice(known)]
            steps.append(["full", "tea", times[0], "tea", times[1], rng.choice(("world", "a", "b"))])
        yield f"another parent {number}", steps


def single(rng):
    for number in range(2):
        stamp = 50 * S + rng.randrange(S)
        steps = [
            ["set", "map", "odom", stamp, pose(rng), False],
            ["set", "odom", "base", stamp, pose(rng), False],
            ["set", "odom", "base", stamp + S, pose(rng), False],
            ["set", "base", "laser", 0, pose(rng), True],
        ]
        for time in (stamp, stamp - 1, stamp + 1, stamp + S, stamp + S // 3, 0):
            steps.append(["lookup", "map", "laser", time])
            steps.append(["lookup", "laser", "odom", time])
            steps.append(["can", "map", "odom", time])
        yield f"one sample {number}", steps


def loops(rng):
    steps = [["set", p, c, 100 * S, pose(rng), False] for p, c in (("a", "b"), ("b", "c"), ("c", "a"))]
    steps.append(["set", "c", "d", 100 * S, pose(rng), False])
    steps.append(["set", "x", "y", 100 * S, pose(rng), False])
    for frames in (("a", "d"), ("d", "a"), ("x", "d"), ("d", "y"), ("a", "c")):
        steps += [["lookup", *frames, time] for time in (0, 100 * S, 99 * S)]
    yield "loop", steps


def cleared(rng):
    steps, names, known = tree(rng, "f", 5, 0.4)
    steps.append(["clear"])
    for time in (0, known[0]):
        steps += [["lookup", names[0], name, time] for name in names]
        steps.append(["can", names[0], names[-1], time])
    again, _, known = tree(random.Random(3), "g", 3, 0.0)
    steps += again
    steps += [["lookup", "g0", "g2", known[0]], ["lookup", "f0", "g2", known[0]], ["common", "f0", "g2"]]
    yield "cleared", steps


def stamped_zero(rng):
    steps = [
        ["set", "map", "odom", 0, pose(rng), False],
        ["set", "odom", "base", 0, pose(rng), False],
        ["lookup", "map", "base", 0],
        ["lookup", "map", "odom", 5 * S],
        ["set", "odom", "base", 5 * S, pose(rng), False],
        ["lookup", "odom", "base", 0],
        ["lookup", "map", "base", 0],
        ["lookup", "odom", "base", 2 * S],
        ["common", "map", "base"],
        ["set", "map", "odom", 5 * S, pose(rng), False],
        ["lookup", "map", "base", 0],
        ["common", "map", "base"],
    ]
    yield "stamped zero", steps


def rotations(rng):
    """Nearly the same, nearly opposite, q and -q, rounded by hand, refused."""
    steps, names = [], []
    for i, turn in enumerate((0.0, 1e-9, 3e-8, 1e-6, 1e-3, math.pi - 1e-9, math.pi, 2 * math.pi - 1e-7)):
        name = f"turn{i}"
        names.append(name)
        q = quaternion(rng)
        half = turn / 2
        # q · (rotation about x by `turn`)
        s, c = math.sin(half), math.cos(half)
        turned = [q[0] * c + q[3] * s, q[1] * c + q[2] * s, q[2] * c - q[1] * s, q[3] * c - q[0] * s]
        steps.append(["set", "world", name, 10 * S, [1.0, 2.0, 3.0, *q], False])
        steps.append(["set", "world", name, 11 * S, [2.0, -2.0, 5.0, *turned], False])
    for name in names:
        steps += [["lookup", "world", name, 10 * S + part] for part in (S // 3, S // 2, 9 * S // 10)]
    for stamp, q in (
        (10, (0.0, 0.0, 0.1, 0.995)),
        (11, (0.0, 0.0, 0.383, 0.924)),
        (12, (0.71, 0.0, 0.0, 0.71)),
    ):
        steps.append(["set", "world", "typed", stamp * S, [1.0, 2.0, 0.0, *q], False])
        steps.append(["set", "typed", "hand", stamp * S, [0.5, -1.0, 2.0, *q], False])
        steps.append(["set", "typed", "foot", stamp * S, pose(rng), False])
    for frames in (
        ("world", "hand"),
        ("hand", "world"),
        ("hand", "foot"),
        ("foot", "hand"),
        ("turn4", "foot"),
    ):
        steps += [["lookup", *frames, time] for time in (10 * S, 10 * S + 123_456_789, 11 * S, 12 * S, 0)]
        steps.append(["full", frames[0], 10 * S, frames[1], 11 * S, "world"])
    for i, q in enumerate(((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.02), (0.0, 0.0, float("nan"), 1.0))):
        steps.append(["set", "world", f"bad{i}", 10 * S, [0.0, 0.0, 0.0, *q], False])
        steps.append(["lookup", "world", f"bad{i}", 10 * S])
    for frames in (("world", "world"), ("", "child"), ("world", ""), ("/world", "/slash")):
        steps.append(["set", *frames, 10 * S, pose(rng), False])
        steps.append(["lookup", "world", frames[1].strip("/") or "child", 10 * S])
    yield "rotations", steps


GENERATORS = (
    trees, two_times, forests, evicted, disorder, reparented, single, loops, cleared, stamped_zero, rotations,
)  # fmt: skip


class Tf2:
    """The real buffer, one step at a time."""

    def __init__(self) -> None:
        import rospy
        import tf2_py
        from geometry_msgs.msg import TransformStamped

        self._core = tf2_py.BufferCore(rospy.Duration(10))
        self._errors = tf2_py.TransformException
        self._message = TransformStamped
        self._time = lambda ns: rospy.Time(ns // S, ns % S)

    def do(self, step):
        kind, *rest = step
        try:
            return getattr(self, "_" + kind)(*rest)
        except self._errors as error:
            return type(error).__name__

    def _set(self, parent, child, stamp, numbers, static):
        message = self._message()
        message.header.frame_id, message.child_frame_id = parent, child
        message.header.stamp = self._time(stamp)
        t, q = message.transform.translation, message.transform.rotation
        t.x, t.y, t.z, q.x, q.y, q.z, q.w = numbers
        (self._core.set_transform_static if static else self._core.set_transform)(message, "oracle")

    def _lookup(self, target, source, time):
        return self._numbers(self._core.lookup_transform_core(target, source, self._time(time)))

    def _full(self, target, target_time, source, source_time, fixed):
        times = self._time(target_time), self._time(source_time)
        return self._numbers(self._core.lookup_transform_full_core(target, times[0], source, times[1], fixed))

    def _can(self, target, source, time):
        return bool(self._core.can_transform_core(target, source, self._time(time))[0])

    def _can_full(self, target, target_time, source, source_time, fixed):
        times = self._time(target_time), self._time(source_time)
        return bool(self._core.can_transform_full_core(target, times[0], source, times[1], fixed)[0])

    def _common(self, target, source):
        return self._core.get_latest_common_time(target, source).to_nsec()

    def _clear(self):
        self._core.clear()

    def _numbers(self, found):
        t, q = found.transform.translation, found.transform.rotation
        return [t.x, t.y, t.z, q.x, q.y, q.z, q.w, found.header.stamp.to_nsec()]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("-o", "--output", default=str(OUTPUT), help="file, or - for stdout")
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    cases = []
    for generator in GENERATORS:
        for name, steps in generator(rng):
            tf2 = Tf2()
            cases.append({"name": name, "steps": steps, "gave": [tf2.do(step) for step in steps]})
    lines = ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases)
    text = f'{{"seed":{arguments.seed},"tf2":"0.7.6","cases":[\n{lines}\n]}}\n'
    if arguments.output == "-":
        sys.stdout.write(text)
    else:
        Path(arguments.output).write_text(text, "utf-8")


if __name__ == "__main__":
    main()
