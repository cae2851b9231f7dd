"""Scenarios: YAML to a validated `Scenario`, checks folded over a run, the verdict."""
