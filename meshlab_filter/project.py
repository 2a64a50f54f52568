"""MeshLab project files (.mlp) that open several layers at once."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

_IDENTITY = "1 0 0 0 \n0 1 0 0 \n0 0 1 0 \n0 0 0 1 \n"


def write_project(path: Path, layers: Mapping[str, str]) -> None:
    """Write a project that opens the given files as layers, in the order given.

    Parameters
    ----------
    path : Path
        The project file; the layers' files lie beside it.
    layers : mapping of str to str
        Label of the layer → name of its file.
    """
    root = ET.Element("MeshLabProject")
    group = ET.SubElement(root, "MeshGroup")
    for label, filename in layers.items():
        layer = ET.SubElement(
            group, "MLMesh", {"label": label, "filename": filename, "visible": "1"}
        )
        ET.SubElement(layer, "MLMatrix44").text = "\n" + _IDENTITY
    ET.SubElement(root, "RasterGroup")
    ET.indent(root, " ")
    text = ET.tostring(root, encoding="unicode")
    path.write_text(f"<!DOCTYPE MeshLabDocument>\n{text}\n", encoding="utf-8")
