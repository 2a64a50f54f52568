"""What a filter script will do, for people to read."""

from __future__ import annotations

from .mlx import Filter, FilterScript, Param, format_number
from .recipe import QUALITIES, Recipe

# What the filters of the presets do with their parameters; any other filter's are listed.
_SENTENCES = {
    "Duplicate Current layer": "copy the current layer and go on with the copy",
    "Conditional Vertex Selection": "select the vertices with {condSelect}",
    "Delete Selected Vertices": "delete the selected vertices",
    "Compute normals for point sets": "estimate normals from {K} neighbours",
    "Surface Reconstruction: Ball Pivoting": "build faces with a ball of radius {BallRadius} "
    "(0: chosen by MeshLab)",
    "Hausdorff Distance": "measure every vertex of layer {SampledMesh} against layer "
    "{TargetMesh}, leaving out what is farther than {MaxDist}",
}


def explain(script: FilterScript) -> list[str]:
    """Return lines that say what the script does, step by step.

    Parameters
    ----------
    script : FilterScript

    Returns
    -------
    list of str

    Raises
    ------
    PresetError
        If its instruction is wrong.

    Examples
    --------
    >>> from meshlab_filter.presets import PRESETS
    >>> for line in explain(PRESETS["bunny"].script())[-7:-3]:
    ...     print(line.strip())
    rank: cluster-entropy, clusters 807, delete 60, init random, seed 0; quality is the rank
    1. Duplicate Current layer: copy the current layer and go on with the copy
    2. Conditional Vertex Selection: select the vertices with (q < 60)
    3. Delete Selected Vertices: delete the selected vertices
    """
    lines = [paragraph for paragraph in script.comment.split("\n\n") if paragraph]
    if lines:
        lines.append("")
    if script.instruction is not None:
        recipe = Recipe.of(script.instruction, source=script.source)
        own = [f"{name} {text}" for name, text in recipe.instruction().options.items()
               if name not in ("method", "quality")]  # fmt: skip
        quality = QUALITIES[recipe.quality]
        lines.append(f"   rank: {', '.join([recipe.method, *own])}; quality is the {quality}")
    else:
        lines.append("   no instruction <?meshlab-filter …?>: the filters run as they stand")
    for number, filter_ in enumerate(script, start=1):
        lines.append(f"{number}. {filter_.name}: {_sentence(filter_)}")
    return lines


def _sentence(filter_: Filter) -> str:
    texts = {param.name: _text(param) for param in filter_.params}
    if filter_.name in _SENTENCES:
        try:
            return _SENTENCES[filter_.name].format(**texts)
        except KeyError:
            pass  # the file leaves a parameter out, so MeshLab takes its default
    return ", ".join(f"{name} = {text}" for name, text in texts.items()) or "no parameters"


def _text(param: Param) -> str:
    if isinstance(param.value, bool):
        return "true" if param.value else "false"
    if param.choices and isinstance(param.value, int):
        return param.choices[param.value]
    if isinstance(param.value, tuple):
        return f"({', '.join(map(format_number, param.value))})"
    return param.value if isinstance(param.value, str) else f"{param.value:g}"
