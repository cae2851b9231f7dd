"""Sampling of constant speeds within the dynamic window, scored by critics: Nav2's DWB."""
