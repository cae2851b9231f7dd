"""Groups of points that hang together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from twin.clouds.points import Points, coordinates, is_measured
from twin.errors import CloudError

_MOST_PAIRS = 50_000_000


def euclidean_clusters(
    points: Points, tolerance: float, *, min_size: int = 1, max_size: int | None = None
) -> list[NDArray[np.intp]]:
    """Return the indices of points in each cluster, as PCL's EuclideanClusterExtraction does.

    Two points are in the same cluster if a chain of points leads from one to the other in steps of at most
    `tolerance` [m]. The largest cluster is first, of equal ones the one with the earliest point.

    Args:
        points: Any cloud; points that were not measured are in no cluster.
        tolerance: Longest step [m].
        min_size: Clusters of fewer points are left out.
        max_size: Clusters of more points are left out.

    Raises:
        CloudError: The points lie so densely that their pairs would not fit into memory.
    """
    usable = np.flatnonzero(is_measured(points))
    if not len(usable):
        return []
    tree = cKDTree(coordinates(points)[usable])
    if int(tree.count_neighbors(tree, tolerance)) > 2 * _MOST_PAIRS:
        raise CloudError(
            f"too many points are within {tolerance:g} m of each other; thin them by a voxel grid first"
        )
    one, other = tree.query_pairs(tolerance, output_type="ndarray").T
    near = coo_array((np.ones(len(one), bool), (one, other)), shape=(len(usable), len(usable)))
    _, labels = connected_components(near, directed=False)
    order = np.argsort(labels, kind="stable")
    clusters = np.split(usable[order], np.flatnonzero(np.diff(labels[order])) + 1)
    most = len(usable) if max_size is None else max_size
    kept = [cluster for cluster in clusters if min_size <= len(cluster) <= most]
    return sorted(kept, key=lambda cluster: (-len(cluster), cluster[0]))
