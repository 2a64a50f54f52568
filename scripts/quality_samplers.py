"""The ways to thin a cloud that the benchmark compares, each run from its own package.

Every sampler takes points, normals and a count and returns a :class:`Sample`. Where a package
cannot be asked for a number, its parameter is searched until the count is met to within 0.5 % from
above; it never gets fewer points than were asked for.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from meshlab_filter.bridge.layer import add_layer
from meshlab_filter.bridge.session import import_pymeshlab
from meshlab_filter.bridge.surface import reconstruct

TOLERANCE = 0.005


@dataclass
class Sample:
    """What a sampler made: original points by index, or positions and faces of its own.

    Attributes
    ----------
    seconds : float
        Of the call whose result this is; a search for its parameter is not counted.
    """

    seconds: float
    indices: np.ndarray | None = None
    positions: np.ndarray | None = None
    faces: np.ndarray | None = None


Sampler = Callable[[np.ndarray, np.ndarray, int], Sample]


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return what a call returns and how long it took."""
    start = time.perf_counter()
    result = call()
    return result, time.perf_counter() - start


def searched(
    at: Callable[[float], Any],
    low: float,
    high: float,
    count: int,
    *,
    size: Callable[[Any], int] = len,
    halvings: int = 15,
    tries: int = 20,
) -> tuple[Any, float]:
    """Bisect a parameter (geometrically) in which the number of points falls until it is met.

    The number may jump or even rise a little: where the bisection ends too high, some values about
    its end are tried.
    """
    best, seconds = timed(lambda: at(low))

    def attempt(value: float) -> bool:
        nonlocal best, seconds
        result, took = timed(lambda: at(value))
        enough = size(result) >= count
        if enough and size(result) <= size(best):
            best, seconds = result, took
        return bool(enough)

    def met() -> bool:
        return count <= size(best) <= count * (1 + TOLERANCE)

    middle = low
    for _ in range(halvings):
        if met():
            break
        middle = float(np.sqrt(low * high))
        if attempt(middle):
            low = middle
        else:
            high = middle
    for value in middle * np.random.default_rng(0).uniform(0.98, 1.02, size=tries):
        if met():
            break
        attempt(float(value))
    return best, seconds


def spacing(points: np.ndarray, count: int) -> float:
    """Return about the distance of count points spread over the cloud."""
    from scipy.spatial import cKDTree

    near = cKDTree(points).query(points, 7, workers=-1)[0][:, 1:].mean(axis=1)
    return float(np.median(near) * np.sqrt(len(points) / count))


def nearest_originals(points: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return the index of the original at each position, once each."""
    from scipy.spatial import cKDTree

    return np.unique(cKDTree(points).query(positions, workers=-1)[1])


def cloud_layer(points: np.ndarray, normals: np.ndarray):
    """Return a MeshSet with the cloud as its only layer; the quality is the index."""
    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(meshset, points, normals=normals, quality=np.arange(len(points), dtype=float))
    return meshset


def random(points, normals, count):
    """Pick points at random."""
    generator = np.random.default_rng(0)
    indices, seconds = timed(lambda: generator.choice(len(points), count, replace=False))
    return Sample(seconds, indices)


def meshlab_poisson(points, normals, count):
    """MeshLab: Poisson-disk sampling of the vertices, exact number."""

    def at(wanted):
        meshset = cloud_layer(points, normals)
        meshset.generate_sampling_poisson_disk(
            samplenum=round(wanted), subsample=True, exactnumflag=True
        )
        return meshset.current_mesh().vertex_matrix()

    # Within half a percent either way: ask for a little more until it is not fewer.
    for factor in (1.0, 1.0025, 1.005, 1.01, 1.02):
        positions, seconds = timed(lambda f=factor: at(count * f))
        indices = nearest_originals(points, positions)
        if len(indices) >= count:
            break
    return Sample(seconds, indices)


def meshlab_cluster(points, normals, count):
    """MeshLab: clustered vertex sampling, the vertex closest to each cell's centre."""
    pure = import_pymeshlab().PureValue

    def at(cell):
        meshset = cloud_layer(points, normals)
        meshset.generate_sampling_clustered_vertex(
            threshold=pure(cell), sampling="Closest to center"
        )
        return nearest_originals(points, meshset.current_mesh().vertex_matrix())

    edge = spacing(points, count)
    return Sample(*searched(at, edge / 3, edge * 3, count)[::-1])


def open3d_voxel(points, normals, count):
    """Open3D: voxel downsampling; the means are kept as positions."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    edge = spacing(points, count)
    positions, seconds = searched(
        lambda cell: np.asarray(cloud.voxel_down_sample(cell).points), edge / 3, edge * 3, count
    )
    return Sample(seconds, positions=positions)


def open3d_farthest(points, normals, count):
    """Open3D: farthest point sampling."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    positions, seconds = timed(lambda: np.asarray(cloud.farthest_point_down_sample(count).points))
    return Sample(seconds, positions=positions)


def fpsample(points, normals, count):
    """Fpsample: farthest point sampling with bucketed lines."""
    import fpsample as package

    indices, seconds = timed(
        lambda: package.bucket_fps_kdline_sampling(points, count, h=7, start_idx=0)
    )
    return Sample(seconds, indices.astype(np.int64))


def pcu_poisson(points, normals, count):
    """Point Cloud Utils: Poisson-disk downsampling."""
    import point_cloud_utils

    edge = spacing(points, count)
    indices, seconds = searched(
        lambda radius: point_cloud_utils.downsample_point_cloud_poisson_disk(
            points, radius, random_seed=1
        ),
        edge / 2,
        edge * 1.5,
        count,
        halvings=9,
        tries=4,
    )
    return Sample(seconds, np.asarray(indices, dtype=np.int64))


def _cgal_set(points):
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Point_set_3 import Point_set_3

    cloud = Point_set_3()
    cloud.reserve(len(points))
    for x, y, z in points.tolist():
        cloud.insert(Point_3(x, y, z))
    return cloud


def _cgal_points(cloud):
    return np.array([[p.x(), p.y(), p.z()] for p in cloud.points()])


def cgal_hierarchy(points, normals, count):
    """CGAL: hierarchical clustering; cells of up to 2 N/M points, surface variation searched."""
    from CGAL.CGAL_Point_set_processing_3 import hierarchy_simplify_point_set

    cloud = _cgal_set(points)
    # Of 1.3, 2, 4, 10 and 50 times N/M the smallest that can meet every count, and the best.
    largest = max(round(2 * len(points) / count), 2)

    def at(variation):
        cloud.cancel_removals()
        start = time.perf_counter()
        hierarchy_simplify_point_set(cloud, largest, variation)
        return variation, time.perf_counter() - start, cloud.size()

    (variation, seconds, _), _ = searched(at, 1e-9, 1 / 3, count, size=lambda r: r[2], halvings=30)
    at(variation)
    return Sample(seconds, positions=_cgal_points(cloud))


def cgal_wlop(points, normals, count):
    """CGAL: weighted locally optimal projection; moves points."""
    from CGAL.CGAL_Point_set_3 import Point_set_3
    from CGAL.CGAL_Point_set_processing_3 import wlop_simplify_and_regularize_point_set

    cloud, made = _cgal_set(points), Point_set_3()
    share = 100 * (count + 0.5) / len(points)
    _, seconds = timed(lambda: wlop_simplify_and_regularize_point_set(cloud, made, share))
    return Sample(seconds, positions=_cgal_points(made))


def _surface_first(points, normals, count, moved):
    start = time.perf_counter()
    base = cloud_layer(points, normals)
    reconstruct(base)
    pivoting = time.perf_counter() - start
    whole = base.current_mesh().face_matrix()
    pymeshlab = import_pymeshlab()

    def at(faces):
        meshset = pymeshlab.MeshSet(verbose=False)
        add_layer(meshset, points, normals=normals, faces=whole)
        meshset.meshing_decimation_quadric_edge_collapse(
            targetfacenum=round(faces), optimalplacement=moved, autoclean=True
        )
        meshset.meshing_remove_unreferenced_vertices()
        mesh = meshset.current_mesh()
        mesh.compact()
        return mesh.vertex_matrix(), mesh.face_matrix()

    # The fewer faces, the fewer points: search in the share of faces that goes.
    (positions, faces), seconds = searched(
        lambda part: at(2 * count / part), 0.5, 2.0, count, size=lambda mesh: len(mesh[0])
    )
    return Sample(pivoting + seconds, positions=positions, faces=faces)


def surface_first(points, normals, count):
    """MeshLab: ball pivoting of all points, quadric edge collapse onto original points."""
    return _surface_first(points, normals, count, moved=False)


def surface_first_moved(points, normals, count):
    """MeshLab: ball pivoting of all points, quadric edge collapse with optimal placement."""
    return _surface_first(points, normals, count, moved=True)


def ours(method: str) -> Sampler:
    """Return the sampler that a method of this package is."""

    def sampler(points, normals, count):
        from meshlab_filter.methods.registry import get_method

        rank = get_method(method).load()
        ranking, seconds = timed(lambda: rank(points, normals=normals, count=count))
        return Sample(seconds, ranking.indices)

    return sampler


#: What the best of each case is chosen from.
PEERS: dict[str, Sampler] = {
    "random": random,
    "MeshLab Poisson disk": meshlab_poisson,
    "MeshLab clustered vertex": meshlab_cluster,
    "Open3D voxel": open3d_voxel,
    "Open3D farthest point": open3d_farthest,
    "fpsample farthest point": fpsample,
    "point-cloud-utils Poisson": pcu_poisson,
    "CGAL hierarchy": cgal_hierarchy,
    "CGAL WLOP": cgal_wlop,
}
SURFACE_FIRST: dict[str, Sampler] = {
    "surface first": surface_first,
    "surface first, moved": surface_first_moved,
}
OURS = {
    name: ours(name) for name in ("adaptive", "cluster-entropy", "linsen2001", "shi2011", "lee2001")
}
SAMPLERS = PEERS | SURFACE_FIRST | OURS
