"""Thin a dense 3D scan, keep what matters in it, rebuild its surface and know the error."""

from ._version import __version__

__all__ = ["__version__"]
