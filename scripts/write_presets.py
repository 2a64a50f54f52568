"""Write mlx_presets/ from the one table of the models' parameters in meshlab_filter.presets."""

from __future__ import annotations

import sys
from pathlib import Path

from meshlab_filter import mlx
from meshlab_filter.presets import PRESETS

FOLDER = Path(__file__).parents[1] / "mlx_presets"


def main(folder: Path) -> None:
    """Write one file a preset."""
    folder.mkdir(exist_ok=True)
    for preset in PRESETS.values():
        mlx.write(preset.script(), folder / f"{preset.name}.mlx")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
