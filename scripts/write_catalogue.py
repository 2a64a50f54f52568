"""Write meshlab_filter/bridge/catalogue.json: how filter scripts spell MeshLab's filters.

pymeshlab knows its filters by Python names; a filter script holds the names of MeshLab's menus and
parameter names in mixed case, which pymeshlab does not tell. Both stand in the sources of
PyMeshLab (docs/filter_list.rst) and MeshLab (src/meshlabplugins)::

    git clone https://github.com/cnr-isti-vclab/PyMeshLab
    git clone --branch MeshLab-2025.07 https://github.com/cnr-isti-vclab/meshlab
    python scripts/write_catalogue.py PyMeshLab meshlab
"""

from __future__ import annotations

import json
import keyword
import re
import sys
from collections.abc import Iterator
from pathlib import Path

TARGET = Path(__file__).parents[1] / "meshlab_filter" / "bridge" / "catalogue.json"

# The classes of MeshLab's parameters that a script calls by another name.
WRITTEN = {
    "RichPercentage": "RichAbsPerc",
    "RichMatrix44": "RichMatrix44f",
    "RichFileOpen": "RichOpenFile",
    "RichFileSave": "RichSaveFile",
}
# What PyMeshLab's documentation says of a type, for parameters whose name is put together in the
# source.
DOCUMENTED = {"bool": "RichBool", "int": "RichInt", "float": "RichFloat", "str": "RichString"}

# Filters that the documentation lacks.
UNDOCUMENTED = {"create_dodecahedron_sym": "Dodecahedron (symmetric)"}


def python_name(name: str) -> str:
    """Return PyMeshLab's spelling of a name (computePythonName in MeshLab's python_utils.cpp)."""
    plain = re.sub(r"[ /-]", "_", name.lower())
    plain = re.sub(r"[().,'\":+]+", "", plain)
    return plain + "_" if keyword.iskeyword(plain) else plain


def documented_filters(rst: str) -> Iterator[tuple[str, str, dict[str, str]]]:
    """Yield each filter's Python name, MeshLab name and parameters' documented types."""
    for block in re.split(r"^\.\. data:: ", rst, flags=re.MULTILINE)[1:]:
        name = re.search(r"\*MeshLab filter name\*: '(.*)'", block)
        if name is None:
            raise ValueError(f"No MeshLab name for the filter {block.split()[0]}.")
        parameters = dict(re.findall(r"^   ``(\w+) : ([^=`]*?) =", block, flags=re.MULTILINE))
        yield block.split()[0], name.group(1), parameters


class Plugin:
    """The names that one plugin's sources spell out."""

    def __init__(self, folder: Path) -> None:
        files = sorted(p for p in folder.rglob("*") if p.suffix in (".cpp", ".h"))
        code = "\n".join(file.read_text(encoding="utf-8", errors="replace") for file in files)
        code = re.sub(r"//[^\n]*", "", code)
        self.literals = set(re.findall(r'"([^"\n]{1,80})"', code))
        self.parameters: dict[str, dict[str, str]] = {}
        for kind, name in re.findall(r'\b(Rich[A-Z]\w+)\s*\(\s*(?:QString\()?"([^"]+)"', code):
            spelling = self.parameters.setdefault(python_name(name), {})
            spelling[name] = WRITTEN.get(kind, kind)

    def find(self, parameter: str, documented: str) -> dict[str, str]:
        """Return spelling → type of a parameter; two spellings if the plugin has both."""
        if parameter in self.parameters:
            return self.parameters[parameter]
        kind = DOCUMENTED[documented.split()[0]]
        return {text: kind for text in self.literals if python_name(text) == parameter}


def main() -> None:
    """Write the catalogue from the two source trees given."""
    pymeshlab, meshlab = (Path(argument) for argument in sys.argv[1:3])
    folders = sorted((meshlab / "src" / "meshlabplugins").iterdir())
    plugins = [Plugin(folder) for folder in folders if folder.is_dir()]
    rst = (pymeshlab / "docs" / "filter_list.rst").read_text(encoding="utf-8")
    catalogue = {}
    for name, label, documented in documented_filters(rst):
        homes = [plugin for plugin in plugins if name in plugin.literals]
        parameters: dict[str, str] = {}
        for parameter, kind in documented.items():
            found: dict[str, str] = {}
            for plugin in homes:
                found.update(plugin.find(parameter, kind))
            if not found:
                # The documentation is behind the source: take all that the plugin has.
                print(f"{name}: {parameter!r} is not in the source", file=sys.stderr)
                found = {k: v for plugin in homes for p in plugin.parameters.values()
                         for k, v in p.items()}  # fmt: skip
            parameters.update(sorted(found.items()))
        catalogue[label] = {"python": name, "parameters": parameters}
    for name, label in UNDOCUMENTED.items():
        catalogue[label] = {"python": name, "parameters": {}}
    text = json.dumps(dict(sorted(catalogue.items())), indent=1, ensure_ascii=False)
    TARGET.write_bytes((text + "\n").encode("utf-8"))


if __name__ == "__main__":
    main()
