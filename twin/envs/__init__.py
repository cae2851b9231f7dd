"""Gymnasium environments: vectors of small worlds at the speed of physics, and any scenario as one.

Importing this module registers them, so `gym.make("twin.envs:twin/WarehousePick-v0")` works by itself, and
`gym.make("twin/WarehousePick-v0")` after `import twin.envs`.
"""

from twin.envs.scenario.registration import register_scenarios

register_scenarios()
