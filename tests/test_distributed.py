"""Simplifying tile by tile: the same result from any scheduler, worker or second attempt."""

import os
import signal

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter import tilejob, tiletasks
from meshlab_filter.distributed import simplify_tiles
from meshlab_filter.errors import (
    FileFormatError,
    InvalidParameterError,
    OutputError,
    SchedulerError,
)

laspy = pytest.importorskip("laspy")
dask = pytest.importorskip("distributed")

SIZE = 4000


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Write a LAS file of a dented sphere with intensity and time."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(SIZE, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales, header.offsets = np.full(3, 0.001), np.array([5e5, 5.4e6, 0.0])
    data = laspy.LasData(header)
    data.x, data.y, data.z = (normals * (10 + np.sin(7 * normals[:, :1])) + header.offsets).T
    data.intensity = np.arange(SIZE) % 65536
    data.gps_time = np.arange(SIZE)
    path = tmp_path_factory.mktemp("source") / "in.las"
    data.write(path)
    return path


@pytest.fixture(scope="module")
def client():
    """Run one Dask cluster in this process for the tests that do not ask for their own."""
    with (
        dask.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=":0"
        ) as cluster,
        dask.Client(cluster) as client,
    ):
        yield client


def kept(path):
    """Return which points of the source stayed."""
    return laspy.read(path).gps_time.astype(int)


def leftovers(folder):
    """Return names of hidden files and folders."""
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


CASES = {
    "delete": {"delete": 20},
    "share": {"delete": 0.1, "keep_representative": True, "init": "spread"},
    "count": {"method": "cluster-entropy", "count": 1000},
    "adaptive": {"count": 1234},
}


@pytest.mark.parametrize("case", CASES)
def test_survivors_keep_everything(source, client, tmp_path, case):
    """Survivors are points of the source in its order, with every dimension as it was."""
    target = tmp_path / "out.laz"
    report = simplify_tiles(source, target, tiles=5, scheduler=client, **CASES[case])
    before, after = laspy.read(source), laspy.read(target)
    rows = kept(target)
    assert (np.diff(rows) > 0).all()
    for name in before.point_format.dimension_names:
        npt.assert_array_equal(np.asarray(after[name]), np.asarray(before[name])[rows])
    npt.assert_array_equal(after.header.offsets, before.header.offsets)
    assert report["points"] == {"original": SIZE, "simplified": len(rows)}
    assert report["tiles"] == 5
    assert leftovers(tmp_path) == []
    assert any(vlr.user_id == "meshlab-filter" for vlr in after.header.vlrs)


def test_counts(source, client, tmp_path):
    """A count is met to the point by adaptive, and as nearly as clusters allow by the paper's."""
    for method, miss in (("adaptive", 0), ("cluster-entropy", 20)):
        target = tmp_path / f"{method}.las"
        report = simplify_tiles(
            source, target, tiles=4, scheduler=client, method=method, count=1500
        )
        assert abs(report["missed"]) <= miss
        assert report["missed"] == len(kept(target)) - 1500


def test_one_tile_is_the_untiled_method(source, client, tmp_path):
    """With one tile the clusters deleted are those of lowest entropy of the whole cloud."""
    from meshlab_filter.methods.cluster_entropy import rank

    simplify_tiles(source, tmp_path / "out.las", tiles=1, scheduler=client, delete=20, seed=3)
    data = laspy.read(source)
    cells = np.column_stack([data.X, data.Y, data.Z])
    whole = rank(cells * data.header.scales, delete=20, seed=tiletasks.tile_seed(3, 0))
    npt.assert_array_equal(kept(tmp_path / "out.las"), whole.indices)


def test_a_tile_is_ranked_no_further_than_it_need_be(source, client, tmp_path, monkeypatch):
    """Ranked to the last point, each tile keeps the same of its own points."""
    rank, counts = tiletasks.adaptive.rank, []

    def to_the_last(points, *, count=None, **options):
        counts.append(count)
        return rank(points, **options)

    options = {"tiles": 4, "scheduler": client, "count": 800}
    monkeypatch.setattr(tiletasks, "pilot_tile_shares", lambda folder, parameters: [1, 2, 3, 4])
    simplify_tiles(source, tmp_path / "early.las", **options)
    monkeypatch.setattr(tiletasks.adaptive, "rank", to_the_last)
    simplify_tiles(source, tmp_path / "whole.las", **options)
    npt.assert_array_equal(kept(tmp_path / "early.las"), kept(tmp_path / "whole.las"))
    assert {114, 171, 229, 286} <= set(counts)


def test_clusters_are_ranked_over_all_tiles(source, client, tmp_path, monkeypatch):
    """The clusters deleted are the lowest of all tiles; totals are as asked."""
    gathered = []
    original = tilejob.how_many_to_delete

    def spy(sizes, entropy, *arguments, **options):
        gathered.append((sizes, entropy))
        return original(sizes, entropy, *arguments, **options)

    monkeypatch.setattr(tilejob, "how_many_to_delete", spy)
    report = simplify_tiles(
        source, tmp_path / "out.las", tiles=5, scheduler=client, clusters=201, delete=33
    )
    ((sizes, entropy),) = gathered
    assert report["clusters"] == {"total": 201, "deleted": 33}
    assert len(sizes) == 201
    assert (np.diff(entropy) >= 0).all()
    assert sizes.sum() == SIZE
    assert report["points"]["simplified"] == SIZE - sizes[:33].sum()


@pytest.mark.parametrize("case", ["delete", "adaptive"])
def test_workers_do_not_show(source, tmp_path, case):
    """One, two and four workers write the same bytes."""
    outputs = set()
    for workers in (1, 2, 4):
        with (
            dask.LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=False, dashboard_address=":0"
            ) as cluster,
            dask.Client(cluster) as client,
        ):
            target = tmp_path / f"out{workers}.laz"
            simplify_tiles(source, target, tiles=6, scheduler=client, **CASES[case])
        outputs.add(target.read_bytes())
    assert len(outputs) == 1


def test_threads_by_default(source, client, tmp_path):
    """Threads of this process give the bytes of any other scheduler; the dashboard is named."""
    said, stages = [], []
    simplify_tiles(
        source, tmp_path / "a.las", tiles=3, delete=20, workers=2, announce=said.append,
        progress=lambda stage, share: stages.append(stage),
    )  # fmt: skip
    simplify_tiles(source, tmp_path / "b.las", tiles=3, delete=20, scheduler=client)
    assert (tmp_path / "a.las").read_bytes() == (tmp_path / "b.las").read_bytes()
    assert said[0].startswith("http://127.0.0.1:")
    assert {"cutting", "ranking tiles", "writing"} <= set(stages)


@pytest.mark.slow
def test_a_killed_worker_is_survived(source, client, tmp_path):
    """A worker killed half-way changes nothing: nothing is lost and nothing comes twice."""
    with (
        dask.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as cluster,
        dask.Client(cluster) as processes,
    ):
        killed = []

        def kill_one(stage, share):
            if stage == "ranking tiles" and not killed:
                pids = sorted(processes.run(os.getpid).values())
                os.kill(pids[0], signal.SIGKILL)
                killed.append(pids[0])

        simplify_tiles(
            source, tmp_path / "a.las", tiles=8, delete=20, scheduler=processes, progress=kill_one
        )
    assert killed
    simplify_tiles(source, tmp_path / "b.las", tiles=8, delete=20, scheduler=client)
    assert (tmp_path / "a.las").read_bytes() == (tmp_path / "b.las").read_bytes()


@pytest.mark.parametrize("case", ["delete", "adaptive"])
def test_a_stopped_run_goes_on(source, client, tmp_path, case):
    """Tiles that were finished are not done again, and the result is that of one run."""

    class Stopped(BaseException):
        """What a user's Ctrl-C looks like from inside."""

    def stop(stage, share):
        if stage == "ranking tiles" and share >= 0.5:
            raise Stopped

    with pytest.raises(Stopped):
        simplify_tiles(
            source, tmp_path / "a.las", tiles=6, scheduler=client, progress=stop, **CASES[case]
        )
    (folder,) = [path for path in tmp_path.iterdir() if path.is_dir()]
    kind = "clusters" if case == "delete" else "kept"
    done = {path: path.stat().st_mtime_ns for path in folder.glob(f"*.{kind}.npy")}
    assert len(done) >= 3
    again = {}

    def look(stage, share):
        if stage == "ranking tiles" and share == 1:
            again.update({path: path.stat().st_mtime_ns for path in done})

    simplify_tiles(
        source, tmp_path / "a.las", tiles=6, scheduler=client, progress=look, **CASES[case]
    )
    assert again == done
    simplify_tiles(source, tmp_path / "b.las", tiles=6, scheduler=client, **CASES[case])
    assert (tmp_path / "a.las").read_bytes() == (tmp_path / "b.las").read_bytes()
    assert leftovers(tmp_path) == []


def test_other_parameters_start_anew(source, client, tmp_path):
    """The key of the tiles is of the source's bytes and of every parameter."""
    keys = {
        tilejob.TileJob.of(source, None, tiles, None, None, seed, given).key
        for tiles, seed, given in (
            (3, 0, {"delete": 5}), (3, 1, {"delete": 5}), (4, 0, {"delete": 5}),
            (3, 0, {"delete": 6}), (3, 0, {"delete": 5, "k": 2}),
        )
    }  # fmt: skip
    assert len(keys) == 5


@pytest.mark.parametrize("halfway", ["tile000002.points", "tile000002.clusters.npy"])
def test_a_corrupt_tile(source, client, tmp_path, halfway):
    """A tile that is damaged ends the run with a sentence; source and folder are left alone."""
    before = source.read_bytes()

    def damage(stage, share):
        # The points once they are all cut, the clusters once they are all ranked.
        if share == 1 and stage == ("cutting" if "points" in halfway else "ranking tiles"):
            (folder,) = [path for path in tmp_path.iterdir() if path.is_dir()]
            (folder / halfway).write_bytes((folder / halfway).read_bytes()[:-3])

    with pytest.raises(FileFormatError, match=r"^A tile is damaged; run again[^\n]*$"):
        simplify_tiles(
            source, tmp_path / "out.las", tiles=4, delete=20, scheduler=client, progress=damage
        )
    assert source.read_bytes() == before
    assert list(tmp_path.iterdir()) == []


def test_disk_full(source, client, tmp_path, monkeypatch):
    """Too little room for the tiles is said before anything is written."""
    from collections import namedtuple

    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr("shutil.disk_usage", lambda path: usage(10, 9, 1))
    with pytest.raises(OutputError, match="Too little disk space for the tiles"):
        simplify_tiles(source, tmp_path / "out.las", delete=20, scheduler=client)
    assert not (tmp_path / "out.las").exists()


def test_disk_full_in_a_task(source, client, tmp_path, monkeypatch):
    """A disk that is full in the middle is one sentence, and the run can go on later."""

    def full(path, array):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(np, "save", full)
        with pytest.raises(OutputError, match="No space left on device"):
            simplify_tiles(source, tmp_path / "out.las", tiles=2, delete=20, scheduler=client)
    simplify_tiles(source, tmp_path / "out.las", tiles=2, delete=20, scheduler=client)
    assert len(kept(tmp_path / "out.las")) < SIZE


@pytest.mark.slow
def test_a_vanished_scheduler(source, tmp_path):
    """A scheduler that goes away is one sentence; what was finished is kept for the next run."""
    with dask.LocalCluster(
        n_workers=1, processes=False, protocol="tcp://", dashboard_address=":0"
    ) as cluster:

        def vanish(stage, share):
            if stage == "ranking tiles":
                cluster.close()

        with pytest.raises(SchedulerError, match="The Dask scheduler went away"):
            simplify_tiles(
                source, tmp_path / "out.las", tiles=8, delete=20,
                scheduler=cluster.scheduler_address, progress=vanish,
            )  # fmt: skip
    assert len(leftovers(tmp_path)) == 1
    simplify_tiles(source, tmp_path / "out.las", tiles=8, delete=20)
    assert leftovers(tmp_path) == []


@pytest.mark.slow
def test_nobody_at_the_address(source, tmp_path):
    """An address without a scheduler is one sentence."""
    with pytest.raises(SchedulerError, match="No Dask scheduler answers there"):
        simplify_tiles(source, tmp_path / "out.las", delete=20, scheduler="tcp://127.0.0.1:9")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scheduler": "slurm"}, "Invalid scheduler"),
        ({"tiles": 0}, "Invalid tiles"),
        ({"tiles": "many"}, "Invalid tiles"),
        ({"workers": -1}, "Invalid workers"),
        ({"method": "random"}, r"Invalid method for tiles\. Must be cluster-entropy or adaptive"),
        ({"method": "adaptive", "delete": None}, "needs the number or share"),
        ({"delete": 5000}, "Invalid delete"),
        ({"clusters": 3, "delete": 1, "tiles": 4}, "at least one for each of 4 tiles"),
        ({"k": 0}, "Invalid k"),
        ({"evenness": 1}, "Invalid parameter of method cluster-entropy"),
        ({"seed": -1}, "Invalid seed"),
    ],
)
def test_invalid_parameters(source, client, tmp_path, options, message):
    """Every bad parameter is one sentence, and nothing is left behind."""
    options = {"delete": 20, "scheduler": client, "tiles": 2, **options}
    with pytest.raises(InvalidParameterError, match=message):
        simplify_tiles(source, tmp_path / "out.las", **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"delete": 20, "k": 0}, "Invalid k"),
        ({"delete": 20, "init": "corners"}, "Invalid init"),
        ({"delete": 20, "max_iter": 0}, "Invalid max_iter"),
        ({"delete": 20, "tol": -1.0}, "Invalid tol"),
        ({"delete": 20, "definition": "raw entropy"}, "Invalid definition"),
        ({"delete": 20, "keep_representative": "perhaps"}, "Invalid keep_representative"),
        ({"keep": 0.1, "evenness": -0.1}, "Invalid evenness"),
        ({"keep": 0.1, "crease_safety": "much"}, "Invalid crease_safety"),
        ({"keep": 0.1, "noisy": "perhaps"}, "Invalid noisy"),
    ],
)
def test_values_are_checked_before_the_source_is_streamed(
    source, client, tmp_path, options, message
):
    """A value out of range is refused before anything is sampled or cut."""
    stages = []
    with pytest.raises(InvalidParameterError, match=message):
        simplify_tiles(
            source, tmp_path / "out.las", tiles=2, scheduler=client, **options,
            progress=lambda stage, share: stages.append(stage),
        )  # fmt: skip
    assert stages == []
    assert list(tmp_path.iterdir()) == []


def test_only_las(source, client, tmp_path):
    """Tiles are for LAS files, and the output is not the input."""
    with pytest.raises(InvalidParameterError, match=r"Invalid file for tiles"):
        simplify_tiles(source, tmp_path / "out.ply", delete=20, scheduler=client)
    with pytest.raises(OutputError, match="The output is the input"):
        simplify_tiles(source, source, delete=20, scheduler=client)


def test_seams_do_not_show(tmp_path, client):
    """Points near the cuts are kept as often as elsewhere, and as far from one another."""
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(1)
    a, b = rng.random((2, 8000))
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales, header.offsets = np.full(3, 1e-5), np.zeros(3)
    data = laspy.LasData(header)
    data.x, data.y, data.z = a, b, 0.1 * np.sin(6 * a) * np.cos(5 * b)
    data.gps_time = np.arange(8000)
    data.write(tmp_path / "in.las")
    simplify_tiles(tmp_path / "in.las", tmp_path / "out.las", tiles=2, count=1600, scheduler=client)
    left = laspy.read(tmp_path / "out.las").xyz
    middle = np.median(a)
    near = np.abs(left[:, 0] - middle) < 0.04
    assert abs(near.mean() / (np.abs(a - middle) < 0.04).mean() - 1) < 0.25
    gaps = cKDTree(left).query(left, k=2)[0][:, 1]
    assert np.median(gaps[near]) == pytest.approx(np.median(gaps[~near]), rel=0.25)
