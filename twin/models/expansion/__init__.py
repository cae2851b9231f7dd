"""From xacro to URDF, in a process that may do nothing else."""
