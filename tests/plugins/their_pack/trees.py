from their_pack.used import USED
from twin.navigation.behavior_trees.node import Status, TreeNode
from twin.navigation.behavior_trees.ports import inputs


class Say(TreeNode):
    PORTS = inputs(text=("string", "hello"))

    def tick(self):
        USED.add(f"Say {self.get('text')}")
        return Status.SUCCESS
