"""Put a scene and robots into one MjSpec."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import mujoco

from twin.convert.actuators import driven_joints
from twin.convert.geoms import OWN_CONTACT, primitive
from twin.errors import Problem, ScenarioError
from twin.models.solids import volume
from twin.sim.casters import casters_under_chassis
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Body, FreeBody, PlacedBody, Scene, Shape, StaticBody
from twin.sim.servos import keep_velocity_limit

FLOOR = "floor"
"""Name of the floor's geom."""

_SOLID, _ROLLING = 1, 2
"""Contact bits: of everything that can be touched, and of what only the floor touches."""

GROUP_SOLID = 0
"""Floor, statics and goods: seen and touched."""
GROUP_PAINT = 1
"""Seen only."""
GROUP_VISUAL = 2
"""The robots' visuals, set by the converter."""
GROUP_COLLISION = 3
"""The robots' collision shapes, set by the converter."""


def build_spec(
    scene: Scene, robots: Sequence[RobotPlacement], physics: Physics, *, visuals: bool = True
) -> mujoco.MjSpec:
    """Return the uncompiled world; elements of robot `r` are named `r/<name>`.

    Without the robots' visual geoms it moves in the same way.

    Raises:
        ScenarioError: Two things have the same name.
    """
    _check_names(scene, robots)
    spec = mujoco.MjSpec()
    spec.modelname = scene.name
    physics.apply(spec)
    _look(spec, scene)
    _floor(spec, scene)
    # Stiff contacts rest within 0.1 mm of the surface; the time constant must span two steps.
    solref = [max(0.004, 2.0 * physics.timestep), 1.0]
    # A body of its own (without a name) for what is neither touched nor hit by rays: those skip it whole.
    paint = spec.worldbody.add_body()
    for static in scene.statics:
        _add_static(spec.worldbody, paint, static, solref)
    for goods in scene.goods:
        _add_goods(spec, goods, solref)
    for placed in scene.placed:
        _add_placed(spec, placed, solref)
    for placement in robots:
        _attach(spec, placement, visuals)
    _let_lower_friction_act(spec, scene.goods)
    return spec


def static_geom(name: str, index: int) -> str:
    """Return the name of a static body's i-th geom."""
    return f"{name}#{index}"


def _check_names(scene: Scene, robots: Sequence[RobotPlacement]) -> None:
    named: tuple[Body | RobotPlacement, ...] = (*scene.statics, *scene.goods, *scene.placed, *robots)
    names = Counter([FLOOR, *(thing.name for thing in named)])
    problems = [
        Problem(f"{count} things in scene '{scene.name}' have the name '{name}'; give each its own")
        for name, count in sorted(names.items())
        if count > 1
    ]
    if problems:
        raise ScenarioError(problems)


def _look(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Light and cameras' buffers; changes no physics."""
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.visual.headlight.diffuse = [0.45, 0.45, 0.45]
    spec.visual.headlight.specular = [0.1, 0.1, 0.1]
    spec.visual.map.zfar = 100.0
    spec.visual.quality.shadowsize = 8192
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1080
    # MuJoCo would derive these from all bodies, the 40 m floor included.
    spec.stat.extent, spec.stat.center = 14.0, [0.0, 0.0, 0.5]
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.87, 0.91, 0.95],
        rgb2=[0.62, 0.68, 0.75],
        width=256,
        height=1536,
    )
    spec.worldbody.add_light(
        name="sun",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=[-7.0, -10.0, 20.0],  # its shadows reach as far around the line through `dir` as `extent` says
        dir=[0.35, 0.5, -1.0],
        diffuse=[0.5, 0.5, 0.48],
        castshadow=True,
    )


def _floor(spec: mujoco.MjSpec, scene: Scene) -> None:
    spec.add_texture(
        name="checker",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.66, 0.67, 0.68],
        rgb2=[0.62, 0.63, 0.645],
        width=512,
        height=512,
    )
    material = spec.add_material(name="floor", reflectance=0.0, texrepeat=[0.5, 0.5], texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "checker"
    # A body of its own (without a name: it is not part of the scene): what touches nothing but the floor need
    # not be tested against the scenery.
    spec.worldbody.add_body().add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        contype=_SOLID | _ROLLING,
        conaffinity=_SOLID | _ROLLING,
        size=[scene.floor_size[0] / 2.0, scene.floor_size[1] / 2.0, 1.0],
        material="floor",
        friction=[scene.floor_friction, 0.005, 0.0001],
        group=GROUP_SOLID,
    )


def _add_static(
    world: mujoco.MjsBody, paint: mujoco.MjsBody, static: StaticBody, solref: list[float]
) -> None:
    # Geoms of the world body: never tested against each other, and found by one bounding tree.
    pose = static.T_world_body
    frames = {body: body.add_frame(pos=pose.xyz, quat=pose.quat_wxyz) for body in (world, paint)}
    for index, shape in enumerate(static.shapes):
        body = world if shape.solid else paint
        geom = _add_geom(body, shape, static.friction, solref)
        geom.name = static_geom(static.name, index)
        geom.set_frame(frames[body])


def _add_goods(spec: mujoco.MjSpec, goods: FreeBody, solref: list[float]) -> None:
    pose = goods.T_world_body
    body = spec.worldbody.add_body(name=goods.name, pos=pose.xyz, quat=pose.quat_wxyz)
    body.sleep = mujoco.mjtSleepPolicy.mjSLEEP_ALLOWED
    body.add_freejoint(name=goods.name)
    volumes = [volume(shape.geometry) * shape.solid for shape in goods.shapes]
    for geom, part in zip(_add_geoms(body, goods, solref), volumes, strict=True):
        geom.mass = goods.mass * part / sum(volumes)


def _add_placed(spec: mujoco.MjSpec, placed: PlacedBody, solref: list[float]) -> None:
    pose = placed.T_world_body
    body = spec.worldbody.add_body(name=placed.name, pos=pose.xyz, quat=pose.quat_wxyz, mocap=True)
    _add_geoms(body, placed, solref)


def _add_geoms(
    body: mujoco.MjsBody, thing: FreeBody | PlacedBody, solref: list[float]
) -> list[mujoco.MjsGeom]:
    geoms = [_add_geom(body, shape, thing.friction, solref) for shape in thing.shapes]
    for index, geom in enumerate(geoms):
        geom.name = static_geom(thing.name, index)
    return geoms


def _add_geom(body: mujoco.MjsBody, shape: Shape, friction: float, solref: list[float]) -> mujoco.MjsGeom:
    kind, size = primitive(shape.geometry)
    touch = _SOLID if shape.solid else 0
    return body.add_geom(
        type=kind,
        size=size,
        pos=shape.T_body_geometry.xyz,
        quat=shape.T_body_geometry.quat_wxyz,
        rgba=shape.rgba,
        friction=[friction, 0.005, 0.0001],
        solref=solref,
        contype=touch,
        conaffinity=touch,
        group=GROUP_SOLID if shape.solid else GROUP_PAINT,
    )


def _let_lower_friction_act(spec: mujoco.MjSpec, goods: Sequence[FreeBody]) -> None:
    """Rank goods, and links with a friction of their own: of two the slippery one decides, as in Gazebo.

    MuJoCo takes the friction of the geom with the higher priority, at one priority the larger one. Against
    all else, of priority 0, goods and such links keep theirs; wheels and casters keep it against everything.
    """
    names = {good.name for good in goods}
    solid = [geom for geom in spec.geoms if geom.contype]
    ranked = [geom for geom in solid if 0 < geom.priority < OWN_CONTACT or geom.parent.name in names]
    grades = sorted({geom.friction[0] for geom in ranked}, reverse=True)
    for geom in solid:
        if geom.priority >= OWN_CONTACT:
            geom.priority = len(grades) + 1
    for geom in ranked:
        geom.priority = grades.index(geom.friction[0]) + 1


def _attach(spec: mujoco.MjSpec, placement: RobotPlacement, visuals: bool) -> None:
    robot = placement.conversion.spec.copy()
    for geom in () if visuals else list(robot.geoms):
        if geom.group == GROUP_VISUAL:
            robot.delete(geom)
    spec.attach(robot, prefix=f"{placement.name}/", frame=spec.worldbody.add_frame())
    _limit_velocities(spec, placement)
    root = spec.body(f"{placement.name}/{placement.conversion.description.root}")
    root.pos, root.quat = placement.T_world_root.xyz, placement.T_world_root.quat_wxyz
    for link in casters_under_chassis(placement.conversion.description):
        for geom in spec.body(f"{placement.name}/{link}").geoms:
            if geom.contype:
                geom.contype = geom.conaffinity = _ROLLING
    if root.joints:  # MuJoCo refuses a policy for a body that cannot move
        root.sleep = mujoco.mjtSleepPolicy.mjSLEEP_NEVER


def _limit_velocities(spec: mujoco.MjSpec, placement: RobotPlacement) -> None:
    description = placement.conversion.description
    for command in description.commands.values():
        joints = driven_joints(description, command.joint)
        limits = [(description.joints[name].limit.velocity, abs(share)) for name, share in joints.items()]
        velocity = min((limit / share for limit, share in limits if limit and share), default=None)
        actuator = spec.actuator(f"{placement.name}/{command.joint}")
        if velocity is not None and actuator is not None:
            keep_velocity_limit(
                actuator,
                spec.joint(actuator.target),
                velocity,
                moved=placement.conversion.moved_inertia.get(command.joint, 0.0),
                timestep=spec.option.timestep,
            )
