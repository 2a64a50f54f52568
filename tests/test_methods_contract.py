"""What every method promises: repeatable, a subset, counts met, bad input refused."""

import inspect
import re

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.errors import InvalidCloudError, InvalidParameterError
from meshlab_filter.methods.registry import METHODS

SIZE = 600


def sphere(size=SIZE, seed=0):
    """Return points on a slightly squashed sphere and their outward normals."""
    normals = np.random.default_rng(seed).normal(size=(size, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals * [1.0, 1.0, 0.7], normals


@pytest.fixture(scope="module")
def cloud():
    """Points and normals of a small closed surface."""
    return sphere()


@pytest.mark.parametrize("name", METHODS)
def test_registry_tells_the_truth_about_parameters(name):
    """Names and defaults in the registry are those of the function."""
    signature = inspect.signature(METHODS[name].load()).parameters
    common = ("points", "normals", "count", "seed")
    other = (*common, "progress")
    own = {key: value.default for key, value in signature.items() if key not in other}
    assert own == {parameter.name: parameter.default for parameter in METHODS[name].parameters}
    assert set(common) <= set(signature)
    assert METHODS[name].reports_progress == ("progress" in signature)
    assert all(value.kind is value.KEYWORD_ONLY for value in list(signature.values())[1:])


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("count", [1, 60, 300, 590, SIZE])
def test_count_is_met(name, count, cloud):
    """Methods that say so meet the count; the others say by how much they miss."""
    points, normals = cloud
    result = METHODS[name].load()(points, normals=normals, count=count)
    if METHODS[name].exact_count:
        assert len(result.indices) == count
        assert result.info.get("missed", 0) == 0
    else:
        assert result.info["missed"] == len(result.indices) - count
        # Where whole clusters go, the last one left is what a count of 1 can be met with.
        assert abs(result.info["missed"]) <= max(40, 0.02 * SIZE)


@pytest.mark.parametrize("name", [key for key in METHODS if METHODS[key].seeded])
def test_same_seed_same_ranks(name, cloud):
    """Two runs give the same ranks to the bit, and the input is left alone."""
    points, normals = cloud
    before = points.copy(), normals.copy()
    first = METHODS[name].load()(points, normals=normals, count=200, seed=3)
    second = METHODS[name].load()(points, normals=normals, count=200, seed=3)
    npt.assert_array_equal(first.rank, second.rank)
    assert first.threshold == second.threshold
    npt.assert_array_equal(points, before[0])
    npt.assert_array_equal(normals, before[1])


@pytest.mark.parametrize("name", METHODS)
def test_result_is_a_subset(name, cloud):
    """The ranks are one for each point, not negative; the indices ascend and do not repeat."""
    points, normals = cloud
    result = METHODS[name].load()(points, normals=normals, count=100)
    assert result.rank.shape == (SIZE,)
    assert result.rank.dtype == np.int64
    assert result.rank.min() >= 0
    assert (np.diff(result.indices) > 0).all()
    assert len(result.indices) > 0
    assert result.indices.min() >= 0
    assert result.indices.max() < SIZE


@pytest.mark.parametrize("name", [key for key in METHODS if METHODS[key].total_order])
def test_total_orders_are_permutations(name, cloud):
    """Every point has its own rank, and a deeper run begins with the same removals."""
    points, normals = cloud
    deep = METHODS[name].load()(points, normals=normals, count=50)
    shallow = METHODS[name].load()(points, normals=normals, count=300)
    npt.assert_array_equal(np.sort(deep.rank), np.arange(SIZE))
    npt.assert_array_equal(shallow.indices, np.flatnonzero(deep.rank >= SIZE - 300))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("count", [0, -3, SIZE + 1, 2.5, True, "10"])
def test_bad_counts_are_refused(name, count, cloud):
    """A count that is no whole number between 1 and N is refused by name."""
    points, normals = cloud
    with pytest.raises(InvalidParameterError, match="Invalid count"):
        METHODS[name].load()(points, normals=normals, count=count)


@pytest.mark.parametrize("name", METHODS)
def test_bad_seeds_are_refused(name, cloud):
    """A negative seed is refused by name."""
    points, normals = cloud
    with pytest.raises(InvalidParameterError, match="Invalid seed"):
        METHODS[name].load()(points, normals=normals, count=10, seed=-1)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("points", [np.zeros((5, 2)), np.full((5, 3), np.nan), np.zeros((0, 3))])
def test_bad_points_are_refused(name, points):
    """Points of the wrong shape, not finite or none at all are refused."""
    with pytest.raises(InvalidCloudError, match="points"):
        METHODS[name].load()(points)


@pytest.mark.parametrize("name", [key for key in METHODS if METHODS[key].uses_normals])
def test_normals_must_fit(name, cloud):
    """Normals that are fewer than the points are refused."""
    points, normals = cloud
    with pytest.raises(InvalidCloudError, match="normals"):
        METHODS[name].load()(points, normals=normals[:-1], count=10)


#: What no parameter of a type takes.
BAD = {
    int: (-1, 2.5, float("nan"), True, "many"),
    float: (-1, float("nan"), float("inf"), True, "many"),
    bool: (2, "maybe"),
    str: ("no-such-word",),
}
BAD_PARAMETERS = [
    (name, parameter.name, value)
    for name in METHODS
    for parameter in METHODS[name].parameters
    for value in BAD[parameter.type]
]


@pytest.mark.parametrize(("name", "parameter", "value"), BAD_PARAMETERS)
def test_bad_parameters_are_refused(name, parameter, value, cloud):
    """A value out of range or of another kind is refused in a sentence with its name and value."""
    points, normals = cloud
    # These say how many points stay in their own way, so that a count beside them is refused.
    others = {} if parameter in ("delete", "keep") else {"count": 100}
    with pytest.raises(InvalidParameterError) as refusal:
        METHODS[name].load()(points, normals=normals, **others, **{parameter: value})
    said = str(refusal.value)
    assert re.fullmatch(rf"Invalid {parameter}\. (Must|Cannot) .*\. Given: .*\.", said), said
    assert str(value) in said


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize(
    "points",
    [
        np.zeros((30, 3)),
        np.arange(30.0)[:, None] * [1.0, 2.0, 3.0],
        np.mgrid[0:6, 0:5, 0:1].reshape(3, -1).T.astype(float),
        np.repeat(np.random.default_rng(0).normal(size=(10, 3)), 3, axis=0),
    ],
    ids=["one place", "line", "plane", "triplicates"],
)
def test_degenerate_clouds_end_well(name, points):
    """Coinciding, collinear and coplanar points give a ranking, not an error or a warning."""
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    normals[::4] = [1.0, 0.0, 0.0]
    result = METHODS[name].load()(points, normals=normals, count=10)
    assert 1 <= len(result.indices) <= len(points)


@pytest.mark.parametrize("name", [key for key in METHODS if METHODS[key].uses_normals])
def test_normals_are_estimated(name, cloud):
    """Without normals the method finds its own."""
    result = METHODS[name].load()(cloud[0], count=200)
    assert abs(len(result.indices) - 200) <= 20
