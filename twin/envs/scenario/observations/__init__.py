"""Topics as arrays of numbers with bounds and units: a file for each kind."""

from twin.envs.scenario.observations.channel import Channel as Channel
from twin.envs.scenario.observations.costmap import Costmap as Costmap
from twin.envs.scenario.observations.field import Field as Field
from twin.envs.scenario.observations.odometry import Odometry as Odometry
from twin.envs.scenario.observations.pose import PoseInMap as PoseInMap
from twin.envs.scenario.observations.poses import Poses as Poses
from twin.envs.scenario.observations.scan import Scan as Scan
