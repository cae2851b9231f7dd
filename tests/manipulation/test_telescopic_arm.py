import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.manipulation.telescopic_arm import GraspPose, TelescopicArm, TelescopicArmConfig
from twin.manipulation.trajectory import JointLimits

ARM = TelescopicArm(
    TelescopicArmConfig(
        lift_joint="lift",
        extension_joint="stage",
        wrist_joint="wrist",
        extension_ratio=2.0,
        wrist_x=0.0,
        grasp_z=0.42,
        grasp_length=0.2,
    ),
    {
        "lift": JointLimits(lower=0.0, upper=1.0, max_velocity=0.4, max_acceleration=1.0),
        "stage": JointLimits(lower=0.0, upper=0.32, max_velocity=0.4, max_acceleration=1.0),
        "wrist": JointLimits(lower=-1.6, upper=1.6, max_velocity=1.0, max_acceleration=1.0),
    },
)


@given(st.floats(0.22, 0.8), st.floats(0.42, 1.42), st.floats(-0.3, 0.3))
def test_forward_undoes_inverse(x: float, z: float, yaw: float) -> None:
    pose, _ = ARM.forward(ARM.inverse(GraspPose(x=x, z=z, yaw=yaw)))
    assert (pose.x, pose.z, pose.yaw) == pytest.approx((x, z, yaw))


def test_out_of_reach_names_the_joint() -> None:
    with pytest.raises(ValueError, match=r"out of reach: 'stage' would be at 0\.900"):
        ARM.inverse(GraspPose(x=2.0, z=0.5))


def test_where_the_joints_put_the_grasp_frame() -> None:
    pose, y = ARM.forward({"lift": 0.3, "stage": 0.1, "wrist": 0.5})
    assert (pose.x, pose.z, pose.yaw) == pytest.approx((2.0 * 0.1 + 0.2 * math.cos(0.5), 0.72, 0.5))
    assert y == pytest.approx(0.2 * math.sin(0.5))


@pytest.mark.parametrize(
    ("x", "z", "joint"),
    [(0.8, 1.4205, "lift"), (0.8, 0.4195, "lift"), (0.8405, 0.5, "stage"), (0.1995, 0.5, "stage")],
)
def test_the_edges_of_its_reach(x: float, z: float, joint: str) -> None:
    with pytest.raises(ValueError, match=f"'{joint}' would be at"):
        ARM.inverse(GraspPose(x=x, z=z))
    assert ARM.inverse(GraspPose(x=min(max(x, 0.2), 0.84), z=min(max(z, 0.42), 1.42)))
