"""The scenario environments in gymnasium's registry."""

from gymnasium.envs.registration import register, registry

SCENARIO, PICK = "twin/Scenario-v0", "twin/WarehousePick-v0"
_ENTRY_POINTS = {
    SCENARIO: "twin.envs.scenario.env:ScenarioEnv",
    PICK: "twin.envs.scenario.pick.env:WarehousePickEnv",
}


def register_scenarios() -> None:
    """Register `twin/Scenario-v0`, which takes what `make_env` takes, and `twin/WarehousePick-v0`.

    Harmless when repeated.
    """
    for name, entry_point in _ENTRY_POINTS.items():
        if name not in registry:
            register(name, entry_point, order_enforce=False, disable_env_checker=True)
