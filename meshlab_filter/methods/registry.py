"""The table of methods: what each keeps, where it comes from and which parameters it takes."""

from __future__ import annotations

import difflib
import importlib
from dataclasses import dataclass
from typing import Any, Protocol

import numpy.typing as npt

from ..errors import InvalidParameterError
from .ranking import Ranking

_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


class RankFunction(Protocol):
    """What every method's ``rank`` looks like; the method's own parameters are keyword-only."""

    def __call__(
        self,
        points: npt.ArrayLike,
        *,
        normals: npt.ArrayLike | None = None,
        count: int | None = None,
        seed: int = 0,
        **parameters: Any,
    ) -> Ranking:
        """Rank the points."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a method.

    Attributes
    ----------
    name : str
        Keyword of the rank function.
    type : type
        ``int``, ``float``, ``str`` or ``bool``.
    default : object
        What the method takes when the parameter is not given; None where it is derived.
    meaning : str
        One line: what it does, its unit and what None stands for.
    """

    name: str
    type: type
    default: Any
    meaning: str

    def parse(self, text: str) -> Any:
        """Return the value that a text from the command line stands for.

        Parameters
        ----------
        text : str
            As typed; ``none`` stands for None where the default is None.

        Returns
        -------
        int, float, str, bool or None

        Raises
        ------
        InvalidParameterError
            If the text is not of the parameter's type.

        Examples
        --------
        >>> Parameter("neighbors", int, 15, "neighbours of a point").parse("12")
        12
        """
        if self.default is None and text.lower() == "none":
            return None
        try:
            if self.type is float:
                return int(text) if text.lstrip("+-").isdecimal() else float(text)
            if self.type is not bool:
                return self.type(text)
            if text.lower() not in _TRUE + _FALSE:
                raise ValueError(text)
        except ValueError:
            kind = {int: "a whole number", float: "a number", bool: "true or false"}[self.type]
            raise InvalidParameterError(
                f"Invalid {self.name}. Must be {kind}. Given: {text!r}."
            ) from None
        return text.lower() in _TRUE


@dataclass(frozen=True, kw_only=True)
class Method:
    """One way to simplify a cloud.

    Attributes
    ----------
    name : str
        What ``--method`` takes.
    module : str
        Module of the rank function, relative to this package's parent, imported on first use.
    function : str
        Name of the rank function in that module.
    summary : str
        One line: what the method does.
    keeps : str
        One line: which points stay.
    source : str
        Citation.
    parameters : tuple of Parameter
        Beyond ``normals``, ``count`` and ``seed``, which every method takes.
    uses_normals : bool
        Whether normals matter; they are estimated where the cloud has none.
    exact_count : bool
        Whether ``count`` is met to the point; else as nearly as the method can.
    total_order : bool
        Whether every point has its own rank, so that one run holds every level of detail.
    seeded : bool
        Whether the same seed gives the same result; False only for MeshLab's Poisson disks, which
        draw from a generator that cannot be seeded.
    reports_progress : bool
        Whether the rank function takes ``progress``, called with the share done, 0 … 1.
    """

    name: str
    module: str
    function: str = "rank"
    summary: str
    keeps: str
    source: str
    parameters: tuple[Parameter, ...] = ()
    uses_normals: bool = False
    exact_count: bool = False
    total_order: bool = False
    seeded: bool = True
    reports_progress: bool = False

    def load(self) -> RankFunction:
        """Import the method's module and return its rank function.

        Examples
        --------
        >>> get_method("random").load().__name__
        'rank'
        """
        module = importlib.import_module(self.module, package=__package__)
        function: RankFunction = getattr(module, self.function)
        return function

    def check_parameters(self, parameters: dict[str, Any]) -> None:
        """Refuse a parameter that the method does not have, naming those it has.

        Raises
        ------
        InvalidParameterError
            If a name is not among ``parameters``.
        """
        known = [parameter.name for parameter in self.parameters]
        for name in parameters:
            if name not in known:
                has = f"one of {', '.join(known)}" if known else "left out, there are none"
                raise InvalidParameterError(
                    f"Invalid parameter of method {self.name}. Must be {has}. Given: {name!r}."
                )

    def parse(self, assignments: list[str] | tuple[str, ...]) -> dict[str, Any]:
        """Turn ``NAME=VALUE`` texts into keyword arguments of the rank function.

        Parameters
        ----------
        assignments : sequence of str
            Each ``NAME=VALUE``; a hyphen in NAME counts as an underscore.

        Returns
        -------
        dict

        Raises
        ------
        InvalidParameterError
            If a text has no equals sign, names no parameter or holds the wrong type.

        Examples
        --------
        >>> get_method("shi2011").parse(["normal-threshold=0.2"])
        {'normal_threshold': 0.2}
        """
        values: dict[str, Any] = {}
        for assignment in assignments:
            name, equals, text = assignment.partition("=")
            if not equals:
                raise InvalidParameterError(
                    f"Invalid method parameter. Must be NAME=VALUE. Given: {assignment!r}."
                )
            name = name.strip().replace("-", "_")
            self.check_parameters({name: text})
            parameter = next(known for known in self.parameters if known.name == name)
            values[name] = parameter.parse(text.strip())
        return values


def get_method(name: str) -> Method:
    """Return the method of that name.

    Raises
    ------
    InvalidParameterError
        If there is none, with the nearest names.

    Examples
    --------
    >>> get_method("lee2001").keeps
    'in each cell, the point whose normal is nearest the mean normal'
    """
    if name in METHODS:
        return METHODS[name]
    near = difflib.get_close_matches(str(name), METHODS, n=3) or list(METHODS)
    raise InvalidParameterError(
        f"Invalid method. Must be one that `meshlab-filter methods` lists, such as "
        f"{', '.join(near)}. Given: {name!r}."
    )


_NEIGHBORS = Parameter("neighbors", int, 15, "nearest neighbours a point is judged by")
_CLUSTERS = Parameter("clusters", int, None, "number of clusters; none: 5 % of the points")
_DENSITY_K = Parameter("k", int, None, "neighbour of the density; none: the cluster's rounded root")

METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            name="adaptive",
            module=".adaptive",
            summary="decimation in rounds: take away what the others describe best",
            keeps="the points whose loss would raise the error most",
            source="this package (docs/METHODS.md)",
            parameters=(
                Parameter("evenness", float, 0.4, "0 only follows the shape, more spaces evenly"),
                Parameter("crease_safety", float, 0.4, "more keeps sharp edges denser"),
                Parameter("noisy", bool, False, "judge the points by a smoothed cloud"),
            ),
            uses_normals=True,
            exact_count=True,
            total_order=True,
            reports_progress=True,
        ),
        Method(
            name="cluster-entropy",
            module=".cluster_entropy",
            summary="k-means clusters; those of lowest k-NN entropy are deleted whole",
            keeps="every point of the clusters of highest entropy",
            source="Mahdaoui and Sbai 2020, Advances in Multimedia 8825205, "
            "doi:10.1155/2020/8825205",
            parameters=(
                _CLUSTERS,
                Parameter(
                    "delete", float, None, "clusters to delete: a number, or a share below 1"
                ),
                _DENSITY_K,
                Parameter("init", str, "random", "start of k-means: random, k-means++ or spread"),
                Parameter("max_iter", int, 100, "most k-means iterations"),
                Parameter("tol", float, 1e-4, "k-means ends when centres move less, squared"),
                Parameter("definition", str, "normalized", "normalized, differential or raw"),
                Parameter("keep_representative", bool, False, "leave one point a deleted cluster"),
            ),
            reports_progress=True,
        ),
        Method(
            name="random",
            module=".random",
            summary="a uniform random permutation: the baseline every method has to beat",
            keeps="any point, each with the same chance",
            source="none needed",
            exact_count=True,
            total_order=True,
        ),
        Method(
            name="shi2011",
            module=".shi2011",
            summary="k-means from evenly spaced seeds; clusters of bent normals are split in two",
            keeps="in each cluster, the point nearest the centroid",
            source="Shi, Liang and Liu 2011, Computer-Aided Design 43(8):910-922, "
            "doi:10.1016/j.cad.2011.04.001",
            parameters=(
                Parameter(
                    "space_interval",
                    float,
                    None,
                    "seed distance; none: 1 % of the diagonal",
                ),
                Parameter(
                    "normal_threshold",
                    float,
                    None,
                    "normal deviation that splits; none: 0.13",
                ),
                Parameter(
                    "deviation", str, "half-cosine", "half-cosine (1 - cos)/2 or cosine 1 - cos"
                ),
                Parameter("iterations", int, 10, "most k-means iterations"),
            ),
            uses_normals=True,
        ),
        Method(
            name="lee2001",
            module=".lee2001",
            summary="non-uniform 3D grid: a cell is split in eight while its normals spread",
            keeps="in each cell, the point whose normal is nearest the mean normal",
            source="Lee, Woo and Suk 2001, Int. J. Adv. Manuf. Technol. 17:735-743, "
            "doi:10.1007/s001700170119",
            parameters=(
                Parameter(
                    "space_interval",
                    float,
                    None,
                    "edge of first cells; none: 1 % of the diagonal",
                ),
                Parameter(
                    "normal_threshold",
                    float,
                    None,
                    "spread of normals that splits; none: 0.41",
                ),
            ),
            uses_normals=True,
        ),
        Method(
            name="pauly2002",
            module=".pauly2002",
            summary="hierarchical clustering: split regions while they are large or bent",
            keeps="in each region, the point nearest the centroid",
            source="Pauly, Gross and Kobbelt 2002, IEEE Visualization, pp. 163-170, "
            "doi:10.1109/VISUAL.2002.1183771",
            parameters=(
                Parameter("size", int, None, "most points in a region; none: 20"),
                Parameter(
                    "variation",
                    float,
                    1 / 3,
                    "most surface variation in a region; 1/3: no limit",
                ),
            ),
            exact_count=True,
        ),
        Method(
            name="linsen2001",
            module=".linsen2001",
            summary="take away the point of least local information, again and again",
            keeps="the points with far neighbours, off their plane, of differing normals",
            source="Linsen 2001, Point cloud representation, technical report, "
            "Universität Karlsruhe",
            parameters=(
                _NEIGHBORS,
                Parameter("weight_distance", float, 1.0, "weight of the neighbours' distance"),
                Parameter("weight_plane", float, 1.0, "weight of the tangent plane's distance"),
                Parameter("weight_normal", float, 1.0, "weight of the change of normals"),
            ),
            uses_normals=True,
            exact_count=True,
            total_order=True,
        ),
        Method(
            name="alexa2001",
            module=".alexa2001",
            summary="take away the point nearest its projection on the surface of the others",
            keeps="the points farthest from the moving least squares surface of the others",
            source="Alexa et al. 2001, Point set surfaces, IEEE Visualization, pp. 21-28, "
            "doi:10.1109/VISUAL.2001.964489",
            parameters=(_NEIGHBORS,),
            exact_count=True,
            total_order=True,
        ),
        Method(
            name="xuan2018",
            module=".xuan2018",
            summary="take away the point of lowest entropy of normal angles, again and again",
            keeps="the points whose angles to their neighbours' normals are most informative",
            source="Xuan et al. 2018, J. Indian Soc. Remote Sens. 46:581-589, "
            "doi:10.1007/s12524-017-0730-6",
            parameters=(_NEIGHBORS,),
            uses_normals=True,
            exact_count=True,
            total_order=True,
        ),
        Method(
            name="mahdaoui2018",
            module=".mahdaoui2018",
            summary="inside each cluster, take away the points that change its entropy least",
            keeps="in each cluster, the points its entropy hangs on",
            source="Mahdaoui, Marhraoui Hsaini, Bouazi and Sbai 2018, Entropic method for 3D "
            "point cloud simplification",
            parameters=(
                _CLUSTERS,
                _DENSITY_K,
                Parameter("threshold", float, None, "entropy change below which a point goes"),
            ),
            exact_count=True,
            total_order=True,
        ),
        Method(
            name="poisson-disk",
            module="..bridge.samplers",
            function="rank_poisson_disk",
            summary="MeshLab's Poisson disk sampling of the cloud's own points",
            keeps="points at least a radius apart, blue noise",
            source="Corsini, Cignoni and Scopigno 2012, IEEE TVCG 18(6):914-924, "
            "doi:10.1109/TVCG.2012.34; MeshLab's generate_sampling_poisson_disk",
            seeded=False,
        ),
        Method(
            name="clustered-vertex",
            module="..bridge.samplers",
            function="rank_clustered_vertex",
            summary="MeshLab's clustered vertex sampling: one point a grid cell",
            keeps="in each cell, the point nearest the centre",
            source="MeshLab's generate_sampling_clustered_vertex",
        ),
    )
}
