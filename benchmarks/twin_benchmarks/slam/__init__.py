"""SLAM on recorded lidar logs, scored by the relations of Kümmerle et al. 2009: `twin bench slam`."""
