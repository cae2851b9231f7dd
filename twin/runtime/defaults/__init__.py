"""The parameters of a robot's nodes before a scenario says anything: read off its description and drive."""
