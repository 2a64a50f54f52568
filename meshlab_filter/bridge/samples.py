"""The sample meshes that come with pymeshlab."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from ..errors import MeshLabError


def sample_mesh(name: str) -> Path:
    """Return the path of a mesh inside pymeshlab's wheel.

    Parameters
    ----------
    name : str
        Such as "bunny.obj" or "rangemaps/face000.ply".

    Returns
    -------
    Path

    Raises
    ------
    MeshLabError
        If this pymeshlab does not have it.

    Examples
    --------
    >>> sample_mesh("bunny.obj").name
    'bunny.obj'
    """
    spec = importlib.util.find_spec("pymeshlab")
    if spec is None or spec.origin is None:
        raise MeshLabError("pymeshlab is not installed; run: python -m pip install pymeshlab.")
    path = Path(spec.origin).parent / "tests" / "sample_meshes" / name
    if not path.exists():
        raise MeshLabError(f"This pymeshlab comes without its sample mesh. Given: {path}.")
    return path
