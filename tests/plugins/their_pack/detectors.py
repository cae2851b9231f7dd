from their_pack.used import USED
from twin.geometry import Pose2
from twin.navigation.docking.faces import Detector


class Sure(Detector):
    """There is always a box."""

    def detect(self, points):
        USED.add("Sure")
        return [Pose2(1.0, 0.0, 0.0)]
