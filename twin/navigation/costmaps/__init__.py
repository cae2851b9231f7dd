"""What a cell costs a robot: layers, inflation, footprints."""
