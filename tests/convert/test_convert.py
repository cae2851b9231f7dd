"""The converted model is the robot that the file describes: same names, masses, kinematics and dynamics."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tests.oracles.odd.case import chain
from twin.convert import Conversion, convert
from twin.errors import ConversionError
from twin.geometry import Pose3, matrix_from_quat_wxyz
from twin.models import catalogue, link_poses, load
from twin.models.description import RobotDescription
from twin.models.kinematics import joint_positions
from twin.models.loader import parse_urdf
from twin.models.shapes import Mesh, Visual

ROBOTS = tuple(catalogue())
INERTIAL = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>"
COMMAND = "<ros2_control><joint name='lead'><command_interface name='position'/></joint></ros2_control>"
SEEDS = Path(__file__).parents[3] / "shared" / "seed_models"


def random_positions(description: RobotDescription, rng: np.random.Generator) -> dict[str, float]:
    free = {n: j for n, j in description.joints.items() if j.type != "fixed" and j.mimic is None}
    leaders = {
        name: float(rng.uniform(-2 if j.limit.lower is None else j.limit.lower, j.limit.upper or 2))
        for name, j in free.items()
    }
    every = joint_positions(description, leaders)
    return {n: float(p[0]) for n, p in every.items() if description.joints[n].type != "fixed"}


def compiled(conversion: Conversion, positions: dict[str, float]) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = conversion.spec.copy().compile()
    data = mujoco.MjData(model)
    for name, value in positions.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_forward(model, data)
    return model, data


def mass_matrix(description: RobotDescription, positions: dict[str, float]) -> np.ndarray:
    """Return M by the textbook: sum over links of Jᵀ diag(m, I) J, base fixed; joints in file order."""
    poses = link_poses(description, positions)
    above = {joint.child: joint for joint in description.joints.values()}
    moving = [name for name, joint in description.joints.items() if joint.type != "fixed"]
    total = np.zeros((len(moving), len(moving)))
    for name, link in description.links.items():
        if link.inertial is None:
            continue
        T_root_com = poses[name] @ link.inertial.T_link_com
        linear, angular = np.zeros((3, len(moving))), np.zeros((3, len(moving)))
        child = name
        while child in above:
            joint = above[child]
            if joint.type != "fixed":
                axis = matrix_from_quat_wxyz(poses[child].quat_wxyz) @ joint.axis
                column = moving.index(joint.name)
                if joint.type == "prismatic":
                    linear[:, column] = axis
                else:
                    linear[:, column] = np.cross(axis, T_root_com.xyz - poses[child].xyz)
                    angular[:, column] = axis
            child = joint.parent
        R = matrix_from_quat_wxyz(T_root_com.quat_wxyz)
        total += (
            link.inertial.mass * linear.T @ linear + angular.T @ (R @ link.inertial.inertia @ R.T) @ angular
        )
    return total


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_link_is_a_body_and_no_mass_is_lost(robot: str) -> None:
    description = load(robot)
    model = convert(description).spec.compile()
    assert {model.body(i).name for i in range(1, model.nbody)} == set(description.links)
    for name, link in description.links.items():
        expected = 0.0 if link.inertial is None else link.inertial.mass
        assert model.body(name).mass[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("robot", ROBOTS)
def test_forward_kinematics(robot: str, rng: np.random.Generator) -> None:
    description = load(robot)
    conversion = convert(description, base="fixed")
    for _ in range(3):
        positions = random_positions(description, rng)
        _, data = compiled(conversion, positions)
        for name, pose in link_poses(description, positions).items():
            np.testing.assert_allclose(data.body(name).xpos, pose.xyz, atol=1e-9)
            np.testing.assert_allclose(
                data.body(name).xmat.reshape(3, 3), matrix_from_quat_wxyz(pose.quat_wxyz), atol=1e-9
            )


@pytest.mark.parametrize("robot", ROBOTS)
def test_mass_matrix(robot: str, rng: np.random.Generator) -> None:
    description = load(robot)
    positions = random_positions(description, rng)
    model, data = compiled(convert(description, base="fixed"), positions)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    full -= np.diag(model.dof_armature)
    order = [model.joint(name).dofadr[0] for name in positions]
    np.testing.assert_allclose(full[np.ix_(order, order)], mass_matrix(description, positions), atol=1e-9)


def test_dynamics_equal_pinocchio(rng: np.random.Generator) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    description = load("warehouse_bot")
    positions = random_positions(description, rng)
    model, data = compiled(convert(description, base="fixed"), positions)
    oracle = pinocchio.buildModelFromXML(description.urdf)
    q = pinocchio.neutral(oracle)
    for name, value in positions.items():
        joint = oracle.joints[oracle.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = (
            [math.cos(value), math.sin(value)] if joint.nq == 2 else [value]
        )
    gravity = pinocchio.computeGeneralizedGravity(oracle, oracle.createData(), q)
    for name in positions:
        expected = gravity[oracle.joints[oracle.getJointId(name)].idx_v]
        assert data.qfrc_bias[model.joint(name).dofadr[0]] == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("robot", ROBOTS)
def test_bases(robot: str) -> None:
    description = load(robot)
    free, fixed, kinematic = (convert(description, base=base) for base in ("free", "fixed", "kinematic"))
    assert free.root_joint is not None
    assert free.spec.compile().joint(free.root_joint).type[0] == mujoco.mjtJoint.mjJNT_FREE
    assert fixed.root_joint is None
    assert fixed.spec.compile().nmocap == 0
    model = kinematic.spec.compile()
    assert model.body(description.root).mocapid[0] == 0
    assert fixed.spec.compile().nv == model.nv == free.spec.compile().nv - 6


@pytest.mark.parametrize(
    ("robot", "height"), [("diff_bot", 0.0), ("sp1s", 0.0), ("warehouse_bot", 0.0), ("r2d2", 0.7)]
)
def test_spawn_height_stands_the_robot_on_the_floor(robot: str, height: float) -> None:
    assert convert(load(robot)).spawn_height == pytest.approx(height, abs=1e-9)


def test_actuators_limits_and_followers_of_warehouse_bot() -> None:
    description = load("warehouse_bot")
    model = convert(description).spec.compile()
    names = {model.actuator(i).name for i in range(model.nu)}
    assert names == {"wheel_left_joint", "wheel_right_joint", *description.commands}
    lift = model.actuator("lift_joint")
    np.testing.assert_allclose(lift.ctrlrange, (0.0, 1.05))
    np.testing.assert_allclose(lift.forcerange, (-600.0, 600.0))
    np.testing.assert_allclose(model.joint("lift_joint").range, (0.0, 1.05))
    np.testing.assert_allclose(model.joint("wrist_yaw_joint").range, (-1.6, 1.6))
    assert model.eq("right_finger_joint_mimic").data[1] == 1.0


def test_mimic_with_offset_and_multiplier_follows() -> None:
    joint = "<joint name='{0}' type='continuous'><parent link='base'/><child link='{1}'/>{2}</joint>"
    text = (
        f"<robot name='r'><link name='base'>{INERTIAL}</link><link name='l'>{INERTIAL}</link>"
        f"<link name='f'>{INERTIAL}</link>"
        + joint.format("lead", "l", "")
        + joint.format("follow", "f", "<mimic joint='lead' multiplier='-2' offset='0.5'/>")
        + f"{COMMAND}</robot>"
    )
    model = convert(parse_urdf(text, Path("r.urdf")), base="fixed").spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.4
    mujoco.mj_step(model, data, 2000)
    assert data.joint("lead").qpos[0] == pytest.approx(0.4, abs=1e-3)
    assert data.joint("follow").qpos[0] == pytest.approx(0.5 - 2 * 0.4, abs=1e-3)


def test_a_mimic_of_a_mimic_moves_by_both_multipliers_and_its_inertia_counts_so() -> None:
    joint = "<joint name='{0}' type='continuous'><parent link='base'/><child link='{1}'/>{2}</joint>"
    links = "".join(f"<link name='{name}'>{INERTIAL}</link>" for name in ("base", "l", "f", "g"))
    mimic = "<mimic joint='{}' multiplier='{}'/>"
    text = (
        f"<robot name='r'>{links}"
        + joint.format("lead", "l", "")
        + joint.format("follow", "f", mimic.format("lead", -2))
        + joint.format("last", "g", mimic.format("follow", 1.5))
        + f"{COMMAND}</robot>"
    )
    model = convert(parse_urdf(text, Path("r.urdf")), base="fixed").spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.1
    mujoco.mj_step(model, data, 2000)
    assert data.joint("last").qpos[0] == pytest.approx(-2 * 1.5 * 0.1, abs=1e-3)
    moved = 1.0 + (-2) ** 2 + (-2 * 1.5) ** 2  # each link turns with 1 kg m²
    assert model.actuator("lead").gainprm[0] == pytest.approx(moved * 100.0**2)


def test_contact_parameters_of_wheels_casters_and_pads() -> None:
    model = convert(load("warehouse_bot")).spec.compile()

    def collisions(body: str) -> list[int]:
        start, count = model.body(body).geomadr[0], model.body(body).geomnum[0]
        return [geom for geom in range(start, start + count) if model.geom_group[geom] == 3]

    (wheel,) = collisions("wheel_left")
    assert model.geom_type[wheel] == mujoco.mjtGeom.mjGEOM_ELLIPSOID
    np.testing.assert_allclose(model.geom_size[wheel], (0.1, 0.1, 0.025))
    assert model.geom_solref[wheel, 0] == 0.004
    (caster,) = collisions("caster_front_left")
    assert model.geom_condim[caster] == 1
    for pad in collisions("left_finger"):
        assert (model.geom_solref[pad, 0], model.geom_friction[pad, 0]) == (0.004, 1.0)
    visuals = model.geom_group == 2
    assert not np.any(model.geom_contype[visuals] | model.geom_conaffinity[visuals])


def test_wheels_of_a_slow_simulation_are_softer() -> None:
    model = convert(load("diff_bot"), timestep=0.005).spec.compile()
    wheels = model.geom_type == mujoco.mjtGeom.mjGEOM_ELLIPSOID
    np.testing.assert_array_equal(model.geom_solref[wheels, 0], 0.01)


def test_wheels_of_a_skid_steer_are_elastic() -> None:
    """On a contact whose force jumps at the first touch, four scrubbing wheels hop."""
    skid = convert(load("sp1s")).spec.compile()
    wheels = skid.geom_type == mujoco.mjtGeom.mjGEOM_ELLIPSOID
    np.testing.assert_array_equal(skid.geom_solimp[wheels, 0], 0.0)


def test_neighbours_do_not_collide_even_with_a_fixed_base() -> None:
    for base in ("free", "fixed", "kinematic"):
        for robot in ("r2d2", "sp1s", "diff_bot", "warehouse_bot"):
            _, data = compiled(convert(load(robot), base=base), {})
            assert data.ncon == 0, (robot, base)


def test_overlapping_neighbours_do_not_collide_on_a_fixed_base() -> None:
    """MuJoCo's own filter lets a link collide with a parent that is welded to the world."""
    ball = "<collision><geometry><sphere radius='0.1'/></geometry></collision>"
    text = (
        f"<robot name='r'><link name='base'>{ball}</link><link name='arm'>{INERTIAL}{ball}</link>"
        "<joint name='j' type='continuous'><parent link='base'/><child link='arm'/></joint></robot>"
    )
    _, data = compiled(convert(parse_urdf(text, Path("r.urdf")), base="fixed"), {})
    assert data.ncon == 0


def test_a_moving_link_without_mass_is_refused_by_name() -> None:
    if not SEEDS.is_dir():
        pytest.skip("the tutorials' files are not beside this checkout")
    with pytest.raises(ConversionError, match=r"link 'link2' moves and has no mass") as caught:
        convert(load(SEEDS / "test_robot_3.urdf"))
    assert len(caught.value.problems) == 4


def test_the_tutorials_own_files_convert_whole() -> None:
    if not SEEDS.is_dir():
        pytest.skip("the tutorials' files are not beside this checkout")
    for file, mass in (("r2d2.urdf", 7.0), ("simple_robot.urdf.xacro", 1.2)):
        model = convert(load(SEEDS / file)).spec.compile()
        assert np.sum(model.body_mass) == pytest.approx(mass)


def test_a_root_named_world_is_fixed_and_renamed() -> None:
    text = (
        f"<robot name='r'><link name='world'/><link name='arm'>{INERTIAL}</link>"
        "<joint name='j' type='continuous'><parent link='world'/><child link='arm'/></joint></robot>"
    )
    conversion = convert(parse_urdf(text, Path("r.urdf")))
    assert conversion.root_joint is None
    assert conversion.description.root == "world_link"
    model = conversion.spec.compile()
    assert model.nv == 1
    assert {model.body(i).name for i in range(model.nbody)} == {"world", "world_link", "arm"}


def test_unreadable_mesh_is_named(tmp_path: Path) -> None:
    file = tmp_path / "arm.dae"
    file.write_text("<COLLADA/>", encoding="utf-8")
    description = load("diff_bot")
    visual = Visual(T_link_geometry=Pose3.from_xyz_rpy(), geometry=Mesh(path=file))
    links = {**description.links, "base_link": replace(description.links["base_link"], visuals=(visual,))}
    with pytest.raises(ConversionError, match=r"mesh 'arm\.dae' of link 'base_link' has no scene"):
        convert(replace(description, links=links))


def test_mesh_is_converted(tmp_path: Path) -> None:
    file = tmp_path / "tetra.obj"
    file.write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", encoding="utf-8"
    )
    description = load("diff_bot")
    visual = Visual(T_link_geometry=Pose3.from_xyz_rpy(), geometry=Mesh(path=file, scale=(0.1, 0.1, 0.1)))
    links = {
        **description.links,
        "base_link": replace(description.links["base_link"], visuals=(visual, visual)),
    }
    model = convert(replace(description, links=links)).spec.compile()
    assert model.nmesh == 1
    assert np.sum(model.body_mass) == pytest.approx(1.37)


def test_what_the_file_does_not_say_is_called_a_guess() -> None:
    guesses = {guess.element: guess.note for guess in convert(load("warehouse_bot")).guesses}
    assert "larger of 1" in guesses["friction of link 'base_link'"]
    assert "critically damped" in guesses["servo of joint 'lift_joint'"]
    assert "friction of link 'wheel_left'" not in guesses  # it has a mu1


def test_conversion_is_deterministic() -> None:
    texts = {convert(load("warehouse_bot")).spec.to_xml() for _ in range(2)}
    assert len(texts) == 1


@pytest.mark.parametrize(("links", "refused"), [(450, False), (451, True)])
def test_a_chain_as_deep_as_mujocos_reader_goes(links: int, refused: bool) -> None:
    robot = parse_urdf(chain("fixed", links), Path("chain.urdf"))
    if refused:
        with pytest.raises(ConversionError, match="more than 450 links hang on each other, down to 'l450'"):
            convert(robot)
    else:
        convert(robot)
