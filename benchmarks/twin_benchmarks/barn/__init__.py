"""The BARN challenge in the twin: worlds, scenarios, the referee, the report."""
