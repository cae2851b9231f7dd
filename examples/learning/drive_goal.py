"""What was learned drives in the whole twin, over messages: `python examples/learning/drive_goal.py`."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import twin
from twin.envs.diff_drive_goal import DiffDriveGoalConfig, Room
from twin.envs.randomisation import Episode

HERE = Path(__file__).parent


def room(seed: int, folder: Path) -> tuple[Path, list[float], tuple[float, float]]:
    """Write the room of a seed of `twin/DiffDriveGoal-v0` as an arena; return start and goal, too."""
    config = DiffDriveGoalConfig()
    layout = Room(config).layout(Episode(seed, 0))
    x, y = (size / 2.0 for size in config.room)
    lines = [
        f"name: room_{seed}",
        f"hall: {{x: [{-x}, {x}], y: [{-y}, {y}], wall_height: 0.5}}",
        "obstacles:",
    ]
    for number, (size, pose) in enumerate(zip(config.boxes, layout.placed, strict=True)):
        if pose is not None:
            lines.append(f"  box_{number}: {{pose: {[*pose]}, size: {[*size, 0.5]}, colour: orange}}")
    file = folder / f"room_{seed}.yaml"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file, [*layout.start], layout.goal


def drive(seed: int, policy: Path, folder: Path, out: Path | None = None) -> twin.Verdict:
    """Drive from start to goal of a seed's room."""
    arena, start, goal = room(seed, folder)
    ahead, left = twin.Pose2(*start).inverse().apply(goal)
    overrides = {
        "seed": seed,
        "world.arena": str(arena),
        "robots.0.pose": dict(zip(("x", "y", "yaw"), start, strict=True)),
        "mission.ahead": float(ahead),
        "mission.left": float(left),
        "mission.policy": str(policy.resolve()),
    }
    return twin.run(HERE / "goal.yaml", overrides=overrides, out=out)


def main() -> None:
    """Drive in rooms that training has never seen, and tell how many runs passed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--policy", type=Path, default=HERE / "goal.npz", help="what learn_goal.py wrote")
    parser.add_argument("--seeds", type=int, default=10, help="how many rooms, from seed 1000 on")
    parser.add_argument("--out", type=Path, help="folder of results and recordings, one for each seed")
    arguments = parser.parse_args()
    passed = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1000, 1000 + arguments.seeds):
            out = None if arguments.out is None else arguments.out / str(seed)
            verdict = drive(seed, arguments.policy, Path(folder), out)
            why = "; ".join(check.reason for check in verdict.checks if not check.passed)
            print(f"seed {seed}: {verdict.verdict} {why}".rstrip())
            passed += verdict.verdict == "pass"
    print(f"{passed} of {arguments.seeds} reached the goal")


if __name__ == "__main__":
    main()
