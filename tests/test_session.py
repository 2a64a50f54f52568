"""The door to pymeshlab: what it says when something is missing."""

import importlib

import pytest

from meshlab_filter.bridge import session
from meshlab_filter.bridge.samples import sample_mesh
from meshlab_filter.errors import FileFormatError, MeshLabError


@pytest.mark.parametrize("library", sorted(session.SYSTEM_LIBRARIES))
def test_a_missing_system_library_is_named(monkeypatch, library):
    """On minimal Debian the message says what to install."""

    def fail(name):
        raise ImportError(f"{library}: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(importlib, "import_module", fail)
    with pytest.raises(MeshLabError, match="apt-get install libgl1 libopengl0"):
        session.import_pymeshlab()


def test_a_missing_package_is_named(monkeypatch):
    """Without pymeshlab the message says how to get it."""

    def fail(name):
        raise ImportError("No module named 'pymeshlab'")

    monkeypatch.setattr(importlib, "import_module", fail)
    with pytest.raises(MeshLabError, match="pip install pymeshlab"):
        session.import_pymeshlab()


class Unwilling:
    """A MeshSet that refuses to load."""

    def __init__(self, sentence):
        self.sentence = sentence

    def load_new_mesh(self, path):
        """Refuse with the sentence."""
        raise session.import_pymeshlab().PyMeshLabException(self.sentence)


def test_missing_readers_are_named():
    """A pymeshlab whose readers did not load knows none of the formats."""
    with pytest.raises(MeshLabError, match="apt-get install libgl1 libopengl0"):
        session.load(Unwilling("Unknown format for load: obj"), sample_mesh("bunny.obj"))


def test_a_refusal_is_one_sentence():
    """MeshLab's lines become one."""
    with pytest.raises(FileFormatError, match=r"^[^\n]*\(Malformed file\)\. Given: a\.stl\.$"):
        session.load(Unwilling("Unable to open file\nError details: Malformed file"), "a.stl")
