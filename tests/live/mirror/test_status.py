"""How a mirror tells of itself."""

from __future__ import annotations

from dataclasses import replace

from twin.bridge.msgs import DiagnosticStatus
from twin.geometry import Pose2
from twin.live.mirror.label import Evidence, Judgement
from twin.live.mirror.status import Status, to_array, worst
from twin.live.mirror.status_text import status_text

STATUS = Status(
    robot="warehouse_bot",
    judgement=Judgement(label="shadow", why=("the latest data are 0.5 s old", "stopped by an operator")),
    evidence=Evidence(age_s=0.5, position=0.012, yaw=-0.25, clock_bound_s=0.001, commands="stopped"),
    virtual=Pose2(1.0, -2.0, 0.5),
    physical=Pose2(1.01, -2.0, 0.25),
    clock_offset_s=0.4,
    delay_s=(0.08, 0.004),
    told={"mission": "tote_a: reach", "battery": "83%"},
    resets=1,
    alarms=("the left wheel slips",),
)


def test_who_hears_it_knows_all_of_it() -> None:
    (message,) = to_array([STATUS], 5_000_000_000).status
    assert Status.from_message(message) == STATUS
    unknown = replace(STATUS, physical=None, delay_s=None, clock_offset_s=None, told={}, alarms=())
    assert Status.from_message(unknown.to_message()) == unknown


def test_it_warns_as_diagnostics_do() -> None:
    levels = [
        replace(STATUS, judgement=Judgement(label=label, why=())).to_message().level
        for label in ("twin", "shadow", "model")
    ]
    assert levels == [0, 1, 2]


def test_other_diagnostics_are_not_its_own() -> None:
    for name, message in (("amcl", "shadow: x"), ("twin: bot", "OK"), ("twin: bot", "")):
        other = DiagnosticStatus(level=0, name=name, message=message, hardware_id="", values=[])
        assert Status.from_message(other) is None


def test_the_least_of_the_labels_counts() -> None:
    twin = replace(STATUS, judgement=Judgement(label="twin", why=()))
    assert worst([twin, STATUS]) == "shadow"
    assert worst([twin]) == "twin"


def test_a_person_reads_both_poses_their_difference_the_label_and_why() -> None:
    assert status_text([STATUS]).splitlines() == [
        "warehouse_bot  SHADOW",
        "  because     the latest data are 0.5 s old",
        "  because     stopped by an operator",
        "  alarm       the left wheel slips",
        "  physical    x   +1.010 m  y   -2.000 m  yaw   +14.3 deg",
        "  virtual     x   +1.000 m  y   -2.000 m  yaw   +28.6 deg",
        "  difference  0.012 m, -14.3 deg apart, seen 0.50 s ago",
        "  clock       +0.4000 s from ours, known to 1.0 ms",
        "  link        data come 80 ms late, within 4 ms",
        "  mission     tote_a: reach",
        "  battery     83%",
        "  commands    stopped",
        "  put where the physical robot is: once",
    ]
