"""What several test files share."""

import os
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="session")
def models_dir() -> Path:
    """Return the folder of larger models, which are not part of the project, or skip."""
    root = Path(__file__).resolve().parents[1]
    places = [root / "../shared/models"]
    if os.environ.get("MESHLAB_FILTER_MODELS"):
        places.insert(0, Path(os.environ["MESHLAB_FILTER_MODELS"]))
    for place in places:
        if place.is_dir():
            return place.resolve()
    pytest.skip("no folder of models; MESHLAB_FILTER_MODELS can name one")


@pytest.fixture(scope="session")
def bunny16k(models_dir: Path) -> np.ndarray:
    """Return MeshLab's sample with exactly the paper's number of points, shape (16130, 3)."""
    data = (models_dir / "bunny16k.pts").read_bytes()
    fields = [("position", "<f4", 3), ("radius", "<f4"), ("normal", "<f4", 3), ("color", "u1", 4)]
    start = data.index(b"\ndata\n") + len(b"\ndata\n")
    return np.frombuffer(data, dtype=fields, offset=start)["position"].astype(np.float64)
