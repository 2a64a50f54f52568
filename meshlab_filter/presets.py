"""Ready filter scripts: one for each model of the paper, and two for any cloud."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from .errors import OutputError, PresetError
from .mlx import FilterScript, format_number, read
from .recipe import Recipe
from .simplification import COUNT_METHOD, DEFAULT_DELETE
from .steps import ball_pivoting, hausdorff, point_normals, thinning


@dataclass(frozen=True, kw_only=True)
class Published:
    """What the paper reports for a model.

    Attributes
    ----------
    points, left : int
        Points of the model, and those that stay.
    mean, maximum : float or None
        Errors as shares of the diagonal; Fig. 7 gives none.
    place : str
        "Table 1" or "Fig. 7".
    """

    points: int
    left: int
    mean: float | None = None
    maximum: float | None = None
    place: str = "Table 1"


@dataclass(frozen=True, kw_only=True)
class Preset:
    """One preset: how the cloud is ranked, and where it is cut.

    Attributes
    ----------
    name : str
        Name of the file without ``.mlx``.
    title : str
        What it is for.
    cut : float
        Vertices whose quality is below are deleted.
    recipe : Recipe
    published : Published or None
    """

    name: str
    title: str
    cut: float
    recipe: Recipe = field(default_factory=Recipe)
    published: Published | None = None

    def comment(self) -> str:
        """Return what the file says about itself, in paragraphs."""
        paragraphs = [f"{self.title}."]
        paragraphs.append(
            f"On the command line: meshlab-filter run scan.ply -p {self.name} ranks the cloud as "
            "the instruction below says and runs these filters. In MeshLab: meshlab-filter "
            f"annotate scan.ply annotated.ply -p {self.name} writes a cloud whose vertex quality q "
            "is the rank; open it, then Filters, Show current filter script, Open Script, Apply "
            f"Script. Another number for {format_number(self.cut)} in the condition is another "
            "level of detail of the same cloud."
        )
        if self.published is not None:
            paper = self.published
            text = (
                f"The paper ({paper.place} of Mahdaoui and Sbai 2020, doi 10.1155/2020/8825205) "
                f"keeps {paper.left} of {paper.points} points"
            )
            if paper.mean is not None and paper.maximum is not None:
                text += (
                    f" and reports a mean error of {paper.mean:.6f} and a maximum of "
                    f"{paper.maximum:.6f} of the diagonal, cut off at 1 % of it; MaxDist below "
                    "cuts nothing off"
                )
            paragraphs.append(text + ".")
        return "\n\n".join(paragraphs)

    def script(self) -> FilterScript:
        """Return the filter script."""
        return FilterScript(
            (*thinning(self.cut), point_normals(), ball_pivoting(), hausdorff()),
            self.recipe.instruction(),
            self.comment(),
            source=f"{self.name}.mlx",
        )


def _model(name: str, model: str, clusters: int, delete: int, published: Published) -> Preset:
    return Preset(
        name=name,
        title=f"{model} as in the paper: {clusters} clusters, the {delete} of lowest entropy go",
        cut=delete,
        recipe=Recipe(parameters={"clusters": clusters, "delete": delete, "init": "random"}),
        published=published,
    )


_DEFAULT_CUT = round(100 * DEFAULT_DELETE, 6)
_BUNNY_40 = Published(points=16130, left=15684, place="Fig. 7")
_BUNNY_30 = Published(points=16130, left=15813, place="Fig. 7")

#: Every preset by its name.
PRESETS: dict[str, Preset] = {
    preset.name: preset
    for preset in (
        Preset(
            name="default",
            title="Any cloud, the paper's rule: clusters of 20 points on average (5 %), "
            f"{_DEFAULT_CUT:g} % of them go",
            cut=_DEFAULT_CUT,
            recipe=Recipe(
                parameters={"clusters": 0.05, "delete": _DEFAULT_CUT / 100, "init": "random"},
                quality="percent",
            ),
        ),
        Preset(
            name="adaptive",
            title="Any cloud, decimation in rounds: the 10 % of the points stay that tell most",
            cut=90,
            recipe=Recipe(method=COUNT_METHOD, quality="percent"),
        ),
        _model("david", "David", 458, 20, Published(
            points=182996, left=177454, mean=0.000690, maximum=0.009997)),
        _model("fandisk", "Fandisk", 2590, 310, Published(
            points=103568, left=93809, mean=0.000434, maximum=0.009989)),
        _model("bimba", "Bimba", 3739, 100, Published(
            points=74764, left=73458, mean=0.000002, maximum=0.005166)),
        _model("max_planck", "Max Planck", 2455, 50, Published(
            points=49089, left=48481, mean=0.000024, maximum=0.009972)),
        _model("bunny", "Bunny", 807, 60, Published(
            points=16130, left=15489, mean=0.0001, maximum=0.009988)),
        _model("bunny_40", "Bunny", 807, 40, _BUNNY_40),
        _model("bunny_30", "Bunny", 807, 30, _BUNNY_30),
        _model("genus", "Genus", 832, 30, Published(
            points=2496, left=2436, mean=0.000113, maximum=0.009878)),
    )
}  # fmt: skip


def folder() -> Path:
    """Return the folder of the presets: inside the installed package, or of the source tree.

    Raises
    ------
    PresetError
        If there is neither.

    Examples
    --------
    >>> (folder() / "bunny.mlx").exists()
    True
    """
    here = Path(__file__).parent
    for place in (here / "mlx_presets", here.parent / "mlx_presets"):
        if place.is_dir():
            return place
    raise PresetError(
        "The folder of presets is missing; reinstall meshlab-filter. "
        f"Given: {here / 'mlx_presets'}."
    )


def find(preset: str | os.PathLike[str]) -> Path:
    """Return the file of a preset given by its name, or by a path of a filter script.

    Parameters
    ----------
    preset : str or path
        A name of :data:`PRESETS`, or a path that ends in ``.mlx``.

    Returns
    -------
    Path

    Raises
    ------
    PresetError
        If there is no such preset or file, with the nearest names.

    Examples
    --------
    >>> find("bunny").name
    'bunny.mlx'
    """
    text = os.fspath(preset)
    name = text.removesuffix(".mlx")
    if name in PRESETS and not (name != text and Path(text).is_file()):
        return folder() / f"{name}.mlx"
    if text.lower().endswith(".mlx") or os.sep in text:
        path = Path(text)
        if path.is_file():
            return path
        raise PresetError(f"No such filter script. Must be an existing .mlx file. Given: {text}.")
    import difflib

    near = difflib.get_close_matches(text, PRESETS, n=3) or list(PRESETS)
    raise PresetError(
        f"Unknown preset. Must be a file ending in .mlx, or a name that `meshlab-filter presets` "
        f"lists, such as {', '.join(near)}. Given: {text!r}."
    )


def open_script(preset: str | os.PathLike[str] | FilterScript) -> FilterScript:
    """Return the filter script of a preset.

    Parameters
    ----------
    preset : str, path or FilterScript
        A name, the path of an .mlx file, or a script that is returned as it is.

    Raises
    ------
    PresetError
        As :func:`find` and :func:`meshlab_filter.mlx.read`.
    """
    if isinstance(preset, FilterScript):
        return preset
    path = find(preset)
    script = read(path)
    # Where the package lies has no place in messages and in the headers of outputs.
    return replace(script, source=path.name) if path.parent == folder() else script


def copy(
    names: Sequence[str], target: str | os.PathLike[str], *, overwrite: bool = False
) -> list[Path]:
    """Copy presets to a folder, which is made if it does not exist.

    Parameters
    ----------
    names : sequence of str
        All presets if empty.
    target : path-like
    overwrite : bool
        Replace files of the same name.

    Returns
    -------
    list of Path
        The copies.

    Raises
    ------
    PresetError
        If a name is unknown.
    OutputError
        If a file exists and may not be replaced, or the folder cannot be written to.
    """
    import shutil

    from .outputs import writing_folder

    sources = [find(name) for name in names or PRESETS]
    for source in sources:
        if (Path(target) / source.name).exists() and not overwrite:
            raise OutputError(
                f"The file exists; pass --overwrite to replace it. "
                f"Given: {Path(target) / source.name}."
            )
    with writing_folder(target) as staging:
        for source in sources:
            shutil.copyfile(source, staging / source.name)
    return [Path(target) / source.name for source in sources]
