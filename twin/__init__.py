"""A digital twin for mobile robots: robots from URDF, physics, ROS 2 nodes, verdicts.

`docs/api.md` has every name of this module, `docs/python.md` programs of ten lines. Names are imported when
first used: `import twin` alone loads nothing heavy.
"""

TYPE_CHECKING = False
"""As `typing` has it, which need not be imported for it: Ctrl-C finds nothing to interrupt here."""
if TYPE_CHECKING:
    from twin.api.bags import Bag, read_bag
    from twin.api.files import load_arena, load_scenario, read_recording, read_runs
    from twin.api.robot import Robot, load_robot
    from twin.api.simulation import Simulation, run
    from twin.api.truth import Truth
    from twin.api.world import PlacedRobot, World
    from twin.bridge import action_types as actions
    from twin.bridge import msgs, srvs
    from twin.bridge.wire.session import SessionConfig
    from twin.envs.scenario.make import make_env, make_vec_env
    from twin.errors import TwinError
    from twin.geometry import Pose2, Pose3
    from twin.recording.read_back import Recording
    from twin.runtime.threads import end_threads
    from twin.scenario.schema import Scenario
    from twin.scenario.verdict import Verdict
    from twin.warehouse.arena import Arena

__all__ = [
    "Arena",
    "Bag",
    "PlacedRobot",
    "Pose2",
    "Pose3",
    "Recording",
    "Robot",
    "Scenario",
    "SessionConfig",
    "Simulation",
    "Truth",
    "TwinError",
    "Verdict",
    "World",
    "actions",
    "end_threads",
    "load_arena",
    "load_robot",
    "load_scenario",
    "make_env",
    "make_vec_env",
    "msgs",
    "read_bag",
    "read_recording",
    "read_runs",
    "run",
    "srvs",
]

_HOMES = {
    "Arena": "twin.warehouse.arena",
    "Bag": "twin.api.bags",
    "PlacedRobot": "twin.api.world",
    "Pose2": "twin.geometry",
    "Pose3": "twin.geometry",
    "Recording": "twin.recording.read_back",
    "Robot": "twin.api.robot",
    "Scenario": "twin.scenario.schema",
    "SessionConfig": "twin.bridge.wire.session",
    "Simulation": "twin.api.simulation",
    "Truth": "twin.api.truth",
    "TwinError": "twin.errors",
    "Verdict": "twin.scenario.verdict",
    "World": "twin.api.world",
    "end_threads": "twin.runtime.threads",
    "load_arena": "twin.api.files",
    "load_robot": "twin.api.robot",
    "load_scenario": "twin.api.files",
    "make_env": "twin.envs.scenario.make",
    "make_vec_env": "twin.envs.scenario.make",
    "read_bag": "twin.api.bags",
    "read_recording": "twin.api.files",
    "read_runs": "twin.api.files",
    "run": "twin.api.simulation",
}
_MODULES = {"actions": "twin.bridge.action_types", "msgs": "twin.bridge.msgs", "srvs": "twin.bridge.srvs"}


def _load(name: str) -> object:
    from importlib import import_module

    if name in _HOMES:
        found = getattr(import_module(_HOMES[name]), name)
    elif name in _MODULES:
        found = import_module(_MODULES[name])
    else:
        raise AttributeError(f"module 'twin' has no attribute '{name}'")
    globals()[name] = found
    return found


if not TYPE_CHECKING:
    __getattr__ = _load


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
