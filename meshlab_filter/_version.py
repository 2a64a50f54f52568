"""The version, read by the build and by ``meshlab-filter --version``."""

__version__ = "0.1.0"
