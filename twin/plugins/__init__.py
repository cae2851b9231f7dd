"""Things that users bring: checks, missions, sensors, controllers. Found by name, run with care.

What ships is registered in the same way as what a user brings:

    CHECKS = Kind("check", base="twin.scenario.checks:Check", group="twin.checks")
    CHECKS.register("no_collision", "twin.scenario.checks.no_collision:NoCollision")

    plugin = CHECKS.find("my_checks.py:Smooth", folder)  # reads, and runs nothing
    check = plugin.create("smooth")                      # runs the user's file
    with plugin.guard:                                   # what it raises is an error that names file and line
        check.observe(observation)
"""

from twin.plugins.execution import Execution as Execution
from twin.plugins.execution import execution as execution
from twin.plugins.guard import require_finite as require_finite
from twin.plugins.installed import Files as Files
from twin.plugins.kind import Kind as Kind
from twin.plugins.plugin import Plugin as Plugin
