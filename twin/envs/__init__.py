"""Gymnasium environments: vectors of small worlds at the speed of physics, and any scenario as one.

Importing this module registers them, so `gym.make("twin.envs:twin/DiffDriveGoal-v0")` works by itself, and
`gym.make("twin/DiffDriveGoal-v0")` after `import twin.envs`.
"""

from gymnasium.envs.registration import register, registry

SCENARIO = "twin/Scenario-v0"
"""Takes what `twin.make_env` takes."""
_NAVIGATION = (("DiffDriveGoal", "diff_drive_goal", 300), ("WarehouseNav", "warehouse_nav", 600))
_SCENARIOS = (
    (SCENARIO, "twin.envs.scenario.env:ScenarioEnv"),
    ("twin/WarehousePick-v0", "twin.envs.scenario.pick.env:WarehousePickEnv"),
)

for _name, _module, _steps in _NAVIGATION:
    if f"twin/{_name}-v0" not in registry:
        register(
            id=f"twin/{_name}-v0",
            entry_point=f"twin.envs.{_module}:{_name}Env",
            vector_entry_point=f"twin.envs.{_module}:{_name}VectorEnv",
            max_episode_steps=_steps,
        )
for _name, _entry_point in _SCENARIOS:
    if _name not in registry:
        register(_name, _entry_point, order_enforce=False, disable_env_checker=True)
