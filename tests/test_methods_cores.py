"""Every method gives the same ranks on one core and on several."""

import json
import os
import subprocess
import sys

import pytest
from command import environment

from meshlab_filter.methods.registry import METHODS

#: A noisy ellipsoid of more points than the package hands to one thread at a time. What counts
#: cores is told how many this process may use, as on a machine that has no more.
RANK_ALL = """
import os, sys
if sys.argv[1] == "one":
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:1])
cores = len(os.sched_getaffinity(0))
os.cpu_count = lambda: cores
import hashlib, json
import numpy as np
from meshlab_filter.methods.registry import METHODS

rng = np.random.default_rng(0)
points = rng.normal(size=(9000, 3))
points *= [1.0, 0.8, 0.6] / np.linalg.norm(points, axis=1, keepdims=True)
points += rng.normal(scale=1e-3, size=points.shape)
ranks = {
    name: method.load()(points, count=1800, seed=1).rank
    for name, method in METHODS.items()
    if method.seeded
}
digests = {name: hashlib.sha256(rank.tobytes()).hexdigest() for name, rank in ranks.items()}
print(json.dumps({"cores": cores, **digests}))
"""


@pytest.fixture(scope="module")
def digests():
    """Rank with every method in two processes at once, one of them bound to a core."""
    if not hasattr(os, "sched_setaffinity"):
        pytest.skip("this system cannot bind a process to a core")
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("there is one core only")
    running = [
        subprocess.Popen(
            [sys.executable, "-c", RANK_ALL, cores],
            env=environment(),
            stdout=subprocess.PIPE,
            text=True,
        )
        for cores in ("one", "all")
    ]
    printed = [process.communicate(timeout=300)[0] for process in running]
    assert [process.returncode for process in running] == [0, 0]
    one, several = map(json.loads, printed)
    assert one["cores"] == 1 < several["cores"]
    return one, several


@pytest.mark.parametrize("name", [name for name, method in METHODS.items() if method.seeded])
def test_ranks_do_not_depend_on_the_cores(name, digests):
    """The bytes of the ranks are the same."""
    one, several = digests
    assert one[name] == several[name]
