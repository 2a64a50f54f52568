"""The public models: files at hand, and downloads from a server that behaves well or badly."""

import hashlib
import io
import re
import socket
import threading
import zipfile
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import ClassVar

import pytest

from meshlab_filter.errors import FileFormatError, InvalidParameterError
from meshlab_filter.models import MODELS, MODELS_VARIABLE, ModelError, fetch_model, get_model

CONTENT = b"0 0 0\n" * 5000
ENTRY = replace(
    MODELS["bunny"], name="test", file="test.xyz", sha256=hashlib.sha256(CONTENT).hexdigest()
)


def zipped(content):
    """Return an archive with the content in a folder."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("data/readme.txt", "not this one")
        archive.writestr("data/test.xyz", content)
    return stream.getvalue()


class Handler(BaseHTTPRequestHandler):
    """Serve the content whole, changed, halved, zipped or not at all."""

    asked: ClassVar[list[str]] = []

    def do_GET(self):
        """Answer by the path."""
        self.asked.append(self.path)
        body = {
            "/wrong.xyz": CONTENT.replace(b"0", b"1"),
            "/good.zip": zipped(CONTENT),
            "/wrong.zip": zipped(b"1 1 1"),
            "/none.zip": b"this is no archive",
        }.get(self.path, CONTENT)
        self.send_response(404 if "missing" in self.path else 200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if "half" in self.path:
            self.wfile.write(body[: len(body) // 2])
            self.wfile.flush()
            self.connection.shutdown(socket.SHUT_RDWR)
        else:
            self.wfile.write(body)

    def log_message(self, *arguments):
        """Say nothing."""


@pytest.fixture
def server(monkeypatch):
    """Run a server on this machine and return its address."""
    monkeypatch.delenv(MODELS_VARIABLE, raising=False)
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    Handler.asked = []
    running = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=running.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{running.server_port}"
    running.shutdown()
    running.server_close()
    thread.join()


@pytest.mark.parametrize("path", ["/good.xyz", "/good.zip"])
def test_download_is_kept(server, tmp_path, path):
    """The file, or the one inside the archive, arrives whole and is asked for only once."""
    entry = replace(ENTRY, address=server + path)
    for _ in range(2):
        assert fetch_model(entry, cache=tmp_path).read_bytes() == CONTENT
    assert Handler.asked == [path]
    assert [file.name for file in tmp_path.iterdir()] == ["test.xyz"]


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("/wrong.xyz", "must have SHA-256 .* it was thrown away"),
        ("/wrong.zip", "must have SHA-256 .* it was thrown away"),
        ("/none.zip", "could not be downloaded from .*zip"),
        ("/half.xyz", "could not be downloaded from .*half"),
        ("/missing.xyz", "could not be downloaded from .*404"),
    ],
)
def test_bad_downloads_are_refused(server, tmp_path, path, message):
    """What arrives changed, halved or not at all is one sentence, and nothing is kept."""
    with pytest.raises(ModelError, match=message) as caught:
        fetch_model(replace(ENTRY, address=server + path), cache=tmp_path)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_damaged_cache_is_replaced(server, tmp_path):
    """A file in the cache that has changed is downloaded again."""
    (tmp_path / "test.xyz").write_bytes(b"damaged")
    entry = replace(ENTRY, address=f"{server}/good.xyz")
    assert fetch_model(entry, cache=tmp_path).read_bytes() == CONTENT


def test_no_server_is_one_sentence(server, tmp_path):
    """An address where nobody listens is one sentence that says what to do."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"http://127.0.0.1:{free.getsockname()[1]}/a.xyz"
    with pytest.raises(ModelError, match=f"name a folder with the models in {MODELS_VARIABLE}"):
        fetch_model(replace(ENTRY, address=address), cache=tmp_path)


def test_file_at_hand_needs_no_network(tmp_path, monkeypatch):
    """A folder by argument or environment is used and nothing else."""
    (tmp_path / "test.xyz").write_bytes(CONTENT)
    entry = replace(ENTRY, address="http://127.0.0.1:9/unreachable")
    assert fetch_model(entry, directory=tmp_path) == tmp_path / "test.xyz"
    monkeypatch.setenv(MODELS_VARIABLE, str(tmp_path))
    assert fetch_model(entry) == tmp_path / "test.xyz"


def test_missing_file_at_hand_is_named(tmp_path):
    """A folder without the file is answered with the file's name and where to get it."""
    with pytest.raises(FileFormatError, match=r"as bunny16k\.pts; it can be had from https://"):
        fetch_model("bunny", directory=tmp_path)


def test_other_file_at_hand_is_refused(tmp_path):
    """A file of the right name and another content is refused with both checksums."""
    (tmp_path / "test.xyz").write_bytes(b"another")
    with pytest.raises(FileFormatError, match=ENTRY.sha256):
        fetch_model(ENTRY, directory=tmp_path)


def test_unknown_model_names_the_nearest():
    """A misspelt name is answered with the one that was meant."""
    with pytest.raises(InvalidParameterError, match="such as max_planck"):
        get_model("maxplanck")


@pytest.mark.parametrize("name", MODELS)
def test_addresses_are_pinned(name):
    """Every address names a commit, every checksum has 64 digits."""
    assert re.search(r"/[0-9a-f]{40}/", MODELS[name].address)
    assert re.fullmatch(r"[0-9a-f]{64}", MODELS[name].sha256)


@pytest.mark.parametrize("name", MODELS)
def test_files_at_hand_are_those_named(name, models_dir):
    """The folder of models, where there is one, holds the files that the registry names."""
    if not (models_dir / MODELS[name].file).exists():
        pytest.skip("this model is not at hand")
    assert fetch_model(name, directory=models_dir).name == MODELS[name].file
