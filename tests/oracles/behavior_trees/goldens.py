"""What the real BehaviorTree.CPP and the real control nodes of Nav2 do, for tests/navigation/behavior_trees.

Needs cmake, a C++17 compiler and the two sources, as cloned from their repositories:

    cd tests/oracles/behavior_trees
    python goldens.py --btcpp BehaviorTree.CPP --nav2 navigation2 --build build

builds the library without ZeroMQ and SQLite (a minute or two), `tracer.cpp` beside it, and writes
`goldens.json`. The committed file is of BehaviorTree.CPP 4.10.0 and of Nav2's main branch at a3a97043ee93.

Each case is a tree, a script and its trace. Leaves answer the letters of their word one tick after the
other, over and over: S(uccess), F(ailure), R(unning), - (skipped). A script is `t`, `tickOnce` as Nav2 calls
it, or `h`, `haltTree`, each 100 ms after the last. Each step of a trace is [what the tree said, what the
leaves did (`aS`: a ticked, success; `b!`: b halted while it ran), the status of every node afterwards,
parents first].

First come trees written to show one thing, then random ones. Left out are nodes that wait on the wall clock
in a thread of their own (Delay, Timeout, Sleep), and trees at which BehaviorTree.CPP throws.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
from pathlib import Path

HERE = Path(__file__).parent
OUTPUT = HERE / "goldens.json"
CONTROLS = (
    *("Sequence", "SequenceWithMemory", "ReactiveSequence", "Fallback", "ReactiveFallback"),
    *("Parallel", "ParallelAll", "IfThenElse", "WhileDoElse"),
    *("PipelineSequence", "RecoveryNode", "RoundRobin", "NonblockingSequence", "PersistentSequence"),
)
DECORATORS = (
    *(
        "Inverter",
        "ForceSuccess",
        "ForceFailure",
        "KeepRunningUntilFailure",
        "Repeat",
        "RetryUntilSuccessful",
    ),
    *("RunOnce", "RateController", "SingleTrigger", "SubTree"),
)
WRITTEN = (
    # A halted SequenceWithMemory goes on where it was; a Sequence begins anew.
    ('<SequenceWithMemory><Leaf name="a" say="S"/><Leaf name="b" say="RRS"/></SequenceWithMemory>', "tthttt"),
    ('<Sequence><Leaf name="a" say="S"/><Leaf name="b" say="RRS"/></Sequence>', "tthttt"),
    ('<SequenceWithMemory><Leaf name="a" say="S"/><Leaf name="b" say="FS"/></SequenceWithMemory>', "ttht"),
    # An earlier child that runs again halts the later one that ran.
    ('<ReactiveSequence><Leaf name="a" say="SRS"/><Leaf name="b" say="R"/></ReactiveSequence>', "tttht"),
    ('<ReactiveFallback><Leaf name="a" say="FRF"/><Leaf name="b" say="R"/></ReactiveFallback>', "tttht"),
    # Nav2's pipeline keeps asking what came before; a failure there halts what follows.
    (
        '<PipelineSequence><Leaf name="a" say="SSRF"/><Leaf name="b" say="SS"/><Leaf name="c" say="R"/>'
        "</PipelineSequence>",
        "tttttht",
    ),
    # The recoveries take turns, also over successes of what they rescue; a halt forgets whose turn it is.
    (
        '<RecoveryNode number_of_retries="6"><Leaf name="a" say="FRFFS"/><RoundRobin wrap_around="true">'
        '<Leaf name="b" say="RS"/><Leaf name="c" say="S"/><Leaf name="d" say="FS"/></RoundRobin>'
        "</RecoveryNode>",
        "ttttttttthtttttt",
    ),
    (
        '<RoundRobin wrap_around="false"><Leaf name="a" say="S"/><Leaf name="b" say="SF"/></RoundRobin>',
        "ttttht",
    ),
    ('<RateController hz="2.5"><Leaf name="a" say="SRSF"/></RateController>', "t" * 20),
)


class Draw:
    """Draws trees."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)

    def case(self, kind: str) -> dict[str, str]:
        """Draw a tree whose root is of this kind, and a script."""
        self.leaves, self.subtrees, self.has_place = 0, "", False
        tree = self.node(2, kind)
        steps = self.rng.choices("th", (7, 1), k=self.rng.randint(8, 16))
        return case(tree, "".join(steps), self.subtrees)

    def node(self, depth: int, kind: str) -> str:
        if kind == "Leaf":
            return self.leaf()
        if kind == "SubTree":
            name = f"Sub{self.subtrees.count('<BehaviorTree')}"
            inner = self.node(depth - 1, self.kind(depth - 1))
            if f'ID="{name}"' in self.subtrees:  # drawn within: one level is enough
                return inner
            self.subtrees += f'<BehaviorTree ID="{name}">{inner}</BehaviorTree>'
            return f'<SubTree ID="{name}" _autoremap="true"/>'
        if kind in DECORATORS:
            count = 1
        else:
            least, most = {"IfThenElse": (2, 3), "WhileDoElse": (2, 3), "RecoveryNode": (2, 2)}.get(
                kind, (1, 4)
            )
            count = self.rng.randint(least, most)
        children = "".join(self.node(depth - 1, self.kind(depth - 1)) for _ in range(count))
        return f"<{kind}{self.ports(kind, count)}>{children}</{kind}>"

    def kind(self, depth: int) -> str:
        if depth <= 0 or self.rng.random() < 0.4:
            return "Leaf"
        kind = self.rng.choice(CONTROLS + DECORATORS)
        if kind == "PersistentSequence":  # one a tree: they would share their entry
            kind, self.has_place = ("Sequence" if self.has_place else kind), True
        return kind

    def leaf(self) -> str:
        self.leaves += 1
        name = chr(ord("a") + self.leaves - 1)
        weights = self.rng.choice(((5, 2, 3, 0), (2, 5, 3, 0), (3, 2, 5, 0), (3, 2, 3, 1), (1, 1, 1, 3)))
        word = "".join(self.rng.choices("SFR-", weights, k=self.rng.randint(1, 5)))
        return f'<Leaf name="{name}" say="{word}"/>'

    def ports(self, kind: str, count: int) -> str:
        rng = self.rng
        given = {
            "Parallel": lambda: (
                f' success_count="{rng.choice((-1, rng.randint(1, count), -count))}"'
                f' failure_count="{rng.choice((1, rng.randint(1, count), -1))}"'
            ),
            "ParallelAll": lambda: f' max_failures="{rng.choice((1, rng.randint(1, count), -1))}"',
            "RecoveryNode": lambda: f' number_of_retries="{rng.randint(0, 3)}"',
            "RoundRobin": lambda: f' wrap_around="{rng.choice(("true", "false"))}"',
            "PersistentSequence": lambda: ' current_child_idx="{place}"',
            "Repeat": lambda: f' num_cycles="{rng.randint(1, 3)}"',
            "RetryUntilSuccessful": lambda: f' num_attempts="{rng.randint(1, 3)}"',
            "RunOnce": lambda: rng.choice(("", ' then_skip="false"')),
            "RateController": lambda: f' hz="{rng.choice((2.5, 4.0, 20.0))}"',
        }.get(kind)
        return given() if given else ""


def case(tree: str, script: str, subtrees: str = "") -> dict[str, str]:
    main = f'<BehaviorTree ID="Main">{tree}</BehaviorTree>'
    xml = f'<root BTCPP_format="4" main_tree_to_execute="Main">{main}{subtrees}</root>'
    return {"xml": xml, "script": script}


def cases(seed: int, per_kind: int) -> list[dict[str, str]]:
    draw = Draw(seed)
    drawn = [draw.case(kind) for kind in CONTROLS + DECORATORS for _ in range(per_kind)]
    return [case(tree, script) for tree, script in WRITTEN] + drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--btcpp", type=Path, required=True, help="sources of BehaviorTree.CPP")
    parser.add_argument("--nav2", type=Path, required=True, help="sources of navigation2")
    parser.add_argument("--build", type=Path, required=True, help="folder to build in")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--per-kind", type=int, default=12, help="random trees for each kind of root")
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT)
    given = parser.parse_args()
    sources = (f"-DBTCPP={given.btcpp.resolve()}", f"-DNAV2={given.nav2.resolve()}")
    subprocess.run(("cmake", "-S", HERE, "-B", given.build, "-DCMAKE_BUILD_TYPE=Debug", *sources), check=True)
    jobs = str(os.cpu_count() or 1)
    subprocess.run(("cmake", "--build", given.build, "--target", "tracer", "-j", jobs), check=True)
    text = json.dumps(cases(given.seed, given.per_kind))
    done = subprocess.run((given.build / "tracer",), input=text, capture_output=True, text=True, check=True)
    traced = [one for one in json.loads(done.stdout) if one["trace"] is not None]
    lines = ",\n".join(json.dumps(one, separators=(",", ":"), sort_keys=True) for one in traced)
    given.output.write_text(f"[\n{lines}\n]\n")


if __name__ == "__main__":
    main()
