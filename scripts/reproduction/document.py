"""The document: docs/REPRODUCTION.md, written from what was measured."""

from __future__ import annotations

from meshlab_filter.methods.registry import METHODS

from . import tables
from .subjects import SUBJECTS
from .summary import summary, verdict
from .tables import Results

TEXT = """\
# Mahdaoui and Sbai 2020, reproduced

{summary}
A. Mahdaoui and E. H. Sbai, "3D Point Cloud Simplification Based on k-Nearest Neighbor and
Clustering", Advances in Multimedia 2020, 8825205, doi:10.1155/2020/8825205. Written by
`python scripts/reproduce_paper.py` with {seeds} and MeshLab {version};
± is one standard deviation over the seeds. Every error is that of *all* original points to
the rebuilt surface, divided by the diagonal of their bounding box. **Cut** leaves out samples
farther than 1 % of it, **uncut** leaves out none. The **floor** is the same chain on the untouched
cloud: what ball pivoting costs before any point is gone. Models with a † are other meshes or
samplings than the paper's.

## Points removed (Table 1, Fig. 7)

{removed}
{neighbours}## Errors, ball pivoting with the automatic radius, as in the paper (Table 1)

{errors_paper}
The last column removes as many points at random and measures them in the same way. The automatic
radius leaves holes in irregular clouds even where nothing was deleted: see the floor.

## Errors, ball pivoting in passes of growing radius

{errors_passes}
Passes of 1, 1.5, 2.5 and 4 times the median spacing close the surface, so that what is left is the
error of the deletion. All that follows is measured with them.

## Compact triangles (Figs 3 and 4)

Triangles whose compactness 4√3·area / (a² + b² + c²) is 0.6 and above, in %.

{compact}
{figures}
## All methods at the same count

What the paper compares in Fig. 8 are different numbers of points. Here every method keeps the same
number, as nearly as it can ("points missed", in the order of the columns; positive: too many), with
the same normals, the same reconstruction and uncut errors. ± is over {compared}; where it is
missing, the points that stay do not depend on the seed. Maxima are means over the seeds, and of the
points missed the most is given. `poisson-disk` has no seed and is run as often.
[METHODS.md](METHODS.md) says what each method is.

{verdict}
{comparison}
## Models

None is part of this project; `meshlab_filter/models.py` pins their addresses and checksums.

{models}"""

FIGURES = {
    "compactness": ("Figures 3 and 4: compactness of Bimba's triangles (automatic radius)", ""),
    "clouds": ("Figure 5: original and simplified clouds", ""),
    "surfaces": ("Figure 6: surfaces of the original and simplified clouds", ""),
    "levels": ("Figure 7: levels of detail of Bunny", ""),
    "fig8": (
        "Figure 8: Fandisk under several methods at the same count",
        "The paper sets 9759 points of its own beside 9682 and 9694 of the others, but its 9759 "
        "are the points removed. With as many points kept, and the error of every original point "
        "in colour:",
    ),
    "error": (
        "Figure 9: error in colour",
        "The original surface of Bunny, each point in the colour of its distance to the surface "
        "rebuilt without the deleted clusters.",
    ),
    "entropy": (
        "Clusters and entropy of Bunny",
        "A cluster of m points has an entropy of at most ln m, so that it says above all how many "
        "points a cluster has: the rank correlation of the two is {correlation:.2f}. What goes are "
        "small clusters, not those that the shape needs least.",
    ),
}


def _seeds(count: int) -> str:
    return f"the seeds 0 … {count - 1}" if count > 1 else "the seed 0"


def write(
    results: Results, images: dict[str, str], *, seeds: int, compared: int, version: str
) -> str:
    """Return the document.

    Parameters
    ----------
    results : dict
        By subject: "floor", "runs", and where measured "compared", "shares", "fig8" and "readings".
    images : dict
        Path of each picture relative to the document, by its key in ``FIGURES`` or, for the plots,
        the subject's name.
    seeds, compared : int
        How many seeds, of Table 1 and of the comparison.
    version : str
        Of pymeshlab.
    """
    parts = []
    for key, (title, text) in FIGURES.items():
        if key in images:
            if key == "entropy":
                runs = results["bunny"]["runs"]
                text = text.format(correlation=tables.mean_of(runs, lambda run: run["correlation"]))
            extra = f"{text}\n\n" if text else ""
            if key == "fig8":
                extra += tables.fig8(results) + "\n"
            tail = f"\n{tables.readings(results)}" if key == "fig8" else ""
            parts.append(f"## {title}\n\n{extra}![{title}]({images[key]})\n{tail}")
    compare = [
        f"### {SUBJECTS[name].label}\n\n{tables.comparison(results, name)}\n"
        f"![Mean error of all methods on {SUBJECTS[name].title}]({images[name]})\n"
        for name in results
        if "compared" in results[name]
    ]
    absent = [
        name
        for name, method in METHODS.items()
        if not any(name in results[subject].get("compared", {}) for subject in results)
    ]
    if absent:
        compare.append(f"Not run here: {', '.join(absent)}.\n")
    return TEXT.format(
        summary=summary(results),
        seeds=_seeds(seeds),
        compared=_seeds(compared),
        version=version,
        removed=tables.removed(results),
        neighbours=tables.neighbours(results) if tables.by_neighbour(results) else "",
        errors_paper=tables.errors(results, "paper"),
        errors_passes=tables.errors(results, "passes"),
        compact=tables.compact(results),
        figures="\n".join(parts),
        verdict=verdict(results),
        comparison="\n".join(compare),
        models=tables.models(results),
    )
