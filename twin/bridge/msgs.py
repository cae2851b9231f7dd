"""Message classes by their ROS names: `Twist(linear=Vector3(...), ...)`.

They are dataclasses, as rosbags makes them, each when it is first used: every field is given, by name
or position; `new(Twist)` fills what is left out with ROS's defaults. Sequences of numbers are numpy
arrays of the field's type, read-only when received. Services and actions are in `srvs` and `action_types`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.types.default_values import new as new

if TYPE_CHECKING:
    from rosbags.typesys.stores import ros2_jazzy as ros

    GoalInfo = ros.action_msgs__msg__GoalInfo
    GoalStatus = ros.action_msgs__msg__GoalStatus
    GoalStatusArray = ros.action_msgs__msg__GoalStatusArray
    Duration = ros.builtin_interfaces__msg__Duration
    Time = ros.builtin_interfaces__msg__Time
    DiagnosticArray = ros.diagnostic_msgs__msg__DiagnosticArray
    DiagnosticStatus = ros.diagnostic_msgs__msg__DiagnosticStatus
    KeyValue = ros.diagnostic_msgs__msg__KeyValue
    Accel = ros.geometry_msgs__msg__Accel
    Point = ros.geometry_msgs__msg__Point
    Point32 = ros.geometry_msgs__msg__Point32
    PointStamped = ros.geometry_msgs__msg__PointStamped
    Polygon = ros.geometry_msgs__msg__Polygon
    PolygonStamped = ros.geometry_msgs__msg__PolygonStamped
    Pose = ros.geometry_msgs__msg__Pose
    PoseArray = ros.geometry_msgs__msg__PoseArray
    PoseStamped = ros.geometry_msgs__msg__PoseStamped
    PoseWithCovariance = ros.geometry_msgs__msg__PoseWithCovariance
    PoseWithCovarianceStamped = ros.geometry_msgs__msg__PoseWithCovarianceStamped
    Quaternion = ros.geometry_msgs__msg__Quaternion
    Transform = ros.geometry_msgs__msg__Transform
    TransformStamped = ros.geometry_msgs__msg__TransformStamped
    Twist = ros.geometry_msgs__msg__Twist
    TwistStamped = ros.geometry_msgs__msg__TwistStamped
    TwistWithCovariance = ros.geometry_msgs__msg__TwistWithCovariance
    TwistWithCovarianceStamped = ros.geometry_msgs__msg__TwistWithCovarianceStamped
    Vector3 = ros.geometry_msgs__msg__Vector3
    Vector3Stamped = ros.geometry_msgs__msg__Vector3Stamped
    Wrench = ros.geometry_msgs__msg__Wrench
    WrenchStamped = ros.geometry_msgs__msg__WrenchStamped
    MapMetaData = ros.nav_msgs__msg__MapMetaData
    OccupancyGrid = ros.nav_msgs__msg__OccupancyGrid
    Odometry = ros.nav_msgs__msg__Odometry
    Path = ros.nav_msgs__msg__Path
    FloatingPointRange = ros.rcl_interfaces__msg__FloatingPointRange
    IntegerRange = ros.rcl_interfaces__msg__IntegerRange
    ListParametersResult = ros.rcl_interfaces__msg__ListParametersResult
    Log = ros.rcl_interfaces__msg__Log
    Parameter = ros.rcl_interfaces__msg__Parameter
    ParameterDescriptor = ros.rcl_interfaces__msg__ParameterDescriptor
    ParameterEvent = ros.rcl_interfaces__msg__ParameterEvent
    ParameterType = ros.rcl_interfaces__msg__ParameterType
    ParameterValue = ros.rcl_interfaces__msg__ParameterValue
    SetParametersResult = ros.rcl_interfaces__msg__SetParametersResult
    Clock = ros.rosgraph_msgs__msg__Clock
    BatteryState = ros.sensor_msgs__msg__BatteryState
    CameraInfo = ros.sensor_msgs__msg__CameraInfo
    CompressedImage = ros.sensor_msgs__msg__CompressedImage
    Image = ros.sensor_msgs__msg__Image
    Imu = ros.sensor_msgs__msg__Imu
    JointState = ros.sensor_msgs__msg__JointState
    Joy = ros.sensor_msgs__msg__Joy
    LaserScan = ros.sensor_msgs__msg__LaserScan
    PointCloud2 = ros.sensor_msgs__msg__PointCloud2
    PointField = ros.sensor_msgs__msg__PointField
    Range = ros.sensor_msgs__msg__Range
    Bool = ros.std_msgs__msg__Bool
    ColorRGBA = ros.std_msgs__msg__ColorRGBA
    Empty = ros.std_msgs__msg__Empty
    Float32 = ros.std_msgs__msg__Float32
    Float64 = ros.std_msgs__msg__Float64
    Float64MultiArray = ros.std_msgs__msg__Float64MultiArray
    Header = ros.std_msgs__msg__Header
    Int32 = ros.std_msgs__msg__Int32
    Int64 = ros.std_msgs__msg__Int64
    MultiArrayDimension = ros.std_msgs__msg__MultiArrayDimension
    MultiArrayLayout = ros.std_msgs__msg__MultiArrayLayout
    String = ros.std_msgs__msg__String
    UInt32 = ros.std_msgs__msg__UInt32
    UInt8 = ros.std_msgs__msg__UInt8
    TFMessage = ros.tf2_msgs__msg__TFMessage
    JointTrajectory = ros.trajectory_msgs__msg__JointTrajectory
    JointTrajectoryPoint = ros.trajectory_msgs__msg__JointTrajectoryPoint
    MultiDOFJointTrajectory = ros.trajectory_msgs__msg__MultiDOFJointTrajectory
    MultiDOFJointTrajectoryPoint = ros.trajectory_msgs__msg__MultiDOFJointTrajectoryPoint
    UUID = ros.unique_identifier_msgs__msg__UUID
    Marker = ros.visualization_msgs__msg__Marker
    MarkerArray = ros.visualization_msgs__msg__MarkerArray
    CollisionMonitorState: Any
    Costmap: Any
    CostmapFilterInfo: Any
    CostmapMetaData: Any
    CostmapUpdate: Any
    VoxelGrid: Any
    OccupancyGridUpdate: Any
    BehaviorTreeLog: Any
    BehaviorTreeStatusChange: Any
    Particle: Any
    ParticleCloud: Any
    SpeedLimit: Any
    ExploreStatus: Any
    GripperCommandMsg: Any
    JointTolerance: Any
    JointTrajectoryControllerState: Any
    AprilTagDetection: Any
    AprilTagDetectionArray: Any
    Detection2D: Any
    Detection2DArray: Any
    Detection3D: Any
    Detection3DArray: Any
    LabelInfo: Any
    ObjectHypothesisWithPose: Any
    VisionClass: Any

_NAMES = {
    "action_msgs": "GoalInfo GoalStatus GoalStatusArray",
    "builtin_interfaces": "Duration Time",
    "diagnostic_msgs": "DiagnosticArray DiagnosticStatus KeyValue",
    "geometry_msgs": (
        "Accel Point Point32 PointStamped Polygon PolygonStamped Pose PoseArray PoseStamped "
        "PoseWithCovariance PoseWithCovarianceStamped Quaternion Transform TransformStamped Twist "
        "TwistStamped TwistWithCovariance TwistWithCovarianceStamped Vector3 Vector3Stamped Wrench "
        "WrenchStamped"
    ),
    "nav_msgs": "MapMetaData OccupancyGrid Odometry Path",
    "rcl_interfaces": (
        "FloatingPointRange IntegerRange ListParametersResult Log Parameter ParameterDescriptor "
        "ParameterEvent ParameterType ParameterValue SetParametersResult"
    ),
    "rosgraph_msgs": "Clock",
    "sensor_msgs": (
        "BatteryState CameraInfo CompressedImage Image Imu JointState Joy LaserScan PointCloud2 "
        "PointField Range"
    ),
    "std_msgs": (
        "Bool ColorRGBA Empty Float32 Float64 Float64MultiArray Header Int32 Int64 MultiArrayDimension "
        "MultiArrayLayout String UInt32 UInt8"
    ),
    "tf2_msgs": "TFMessage",
    "trajectory_msgs": (
        "JointTrajectory JointTrajectoryPoint MultiDOFJointTrajectory MultiDOFJointTrajectoryPoint"
    ),
    "unique_identifier_msgs": "UUID",
    "visualization_msgs": "Marker MarkerArray",
    "nav2_msgs": (
        "CollisionMonitorState Costmap CostmapFilterInfo CostmapMetaData CostmapUpdate BehaviorTreeLog "
        "BehaviorTreeStatusChange Particle ParticleCloud SpeedLimit VoxelGrid"
    ),
    "map_msgs": "OccupancyGridUpdate",
    "explore_lite_msgs": "ExploreStatus",
    "control_msgs": "GripperCommand JointTolerance JointTrajectoryControllerState",
    "apriltag_msgs": "AprilTagDetection AprilTagDetectionArray",
    "vision_msgs": (
        "Detection2D Detection2DArray Detection3D Detection3DArray LabelInfo ObjectHypothesisWithPose "
        "VisionClass"
    ),
}
"""Package -> its messages that are here."""
_ALIASES = {"GripperCommand": "GripperCommandMsg"}

if not TYPE_CHECKING:
    _TYPES = {
        _ALIASES.get(name, name): f"{package}/msg/{name}"
        for package, names in _NAMES.items()
        for name in names.split()
    }

    def __getattr__(name):
        """Make a class when it is first asked for."""
        if name not in _TYPES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return globals().setdefault(name, types.get(_TYPES[name]))

    def __dir__():
        return sorted({*globals(), *_TYPES})

    Duration, Header, Time = (types.get(_TYPES[name]) for name in ("Duration", "Header", "Time"))

_NS = 1_000_000_000


def stamp(time_ns: int) -> Time:
    """Return a time [ns] as a message.

    >>> stamp(1_500_000_000)
    builtin_interfaces__msg__Time(sec=1, nanosec=500000000)
    """
    return Time(time_ns // _NS, time_ns % _NS)


def duration(time_ns: int) -> Duration:
    """Return a duration [ns] as a message."""
    return Duration(time_ns // _NS, time_ns % _NS)


def ns(time: Time | Duration) -> int:
    """Return a time or duration message as [ns]."""
    return time.sec * _NS + time.nanosec


def header(time_ns: int, frame_id: str) -> Header:
    """Return a header stamped with a time [ns]."""
    return Header(stamp(time_ns), frame_id)
