"""Simplifying files: a cloud in, a thinner cloud out."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .cloud import Cloud, check_readable, check_writable, read_cloud, write_cloud
from .noise import advice
from .provenance import comments, fingerprint, versions
from .simplification import Simplification, simplify


@dataclass(frozen=True, kw_only=True)
class FileSummary:
    """What became of a file.

    Attributes
    ----------
    source, target : Path
    cloud : Cloud
    result : Simplification
    """

    source: Path
    target: Path
    cloud: Cloud
    result: Simplification

    def lines(self) -> list[str]:
        """Say it in a few lines for people."""
        result, total = self.result, len(self.cloud.points)
        kept = len(result.indices)
        out = [f"{self.target}: kept {kept} of {total} points ({kept / total:.2%}), "
               f"method {result.method}."]  # fmt: skip
        if result.entropy is not None:
            out.append(f"Deleted {result.threshold} of {len(result.entropy)} clusters.")
        if result.missed:
            out.append(
                f"Asked for {result.asked} points: missed by {result.missed:+d}, "
                "as near as this method comes."
            )
        if (noise := advice(result.info)) is not None:
            out.append(noise)
        if self.cloud.dropped:
            out.append(f"Left out {self.cloud.dropped} points with NaN or infinite coordinates.")
        if self.cloud.faces:
            out.append(
                f"The {self.cloud.faces} faces of the input are not kept: the result is a cloud."
            )
        return out


def simplify_file(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    drop_invalid: bool = False,
    overwrite: bool = False,
    progress: Callable[[str, float | None], object] | None = None,
    **options: Any,
) -> FileSummary:
    """Simplify the cloud in a file and write the points that stay.

    Parameters
    ----------
    source, target : path-like
        The same format keeps every attribute; another keeps coordinates, normals and colours.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates instead of refusing the file.
    overwrite : bool
        Allow the target to be the source.
    progress : callable, optional
        Called with a stage and the share of it done.
    **options
        As for :func:`meshlab_filter.simplify`.

    Returns
    -------
    FileSummary

    Raises
    ------
    MeshlabFilterError
        A subclass, with one sentence that says what is wrong. Nothing is written then.
    """
    tell = progress or (lambda stage, share: None)
    source, target = check_readable(source), check_writable(target)
    tell("read", None)
    cloud = read_cloud(source, drop_invalid=drop_invalid)
    result = simplify(
        cloud.points,
        normals=cloud.normals,
        progress=lambda share: tell("simplify", share),
        **options,
    )
    tell("write", None)
    write_cloud(
        cloud,
        target,
        indices=result.indices,
        overwrite=overwrite,
        comments=comments(
            {
                "input": fingerprint(source),
                "parameters": {
                    "method": result.method, "asked": result.asked, **result.parameters
                },
                "versions": versions(),
            }
        ),
    )  # fmt: skip
    return FileSummary(source=source, target=target, cloud=cloud, result=result)
