"""A rosbridge v2 server: topics, services and actions of a graph for clients on a websocket.

Protocol: ROSBRIDGE_PROTOCOL.md of rosbridge_suite, branch ros2. What a client may do is in `access`.
"""
