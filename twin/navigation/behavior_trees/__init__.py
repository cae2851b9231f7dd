"""Behaviour trees with the semantics of BehaviorTree.CPP 4, read from its XML; no ROS in here."""
