"""Public models to try things on: fetched once and checked, or taken from a folder at hand.

None of them is part of this package; each stays under the terms of its source.
"""

from __future__ import annotations

import difflib
import hashlib
import os
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from .errors import FileFormatError, InvalidParameterError, MeshlabFilterError

#: Environment variable with the folder of models at hand; nothing is downloaded then.
MODELS_VARIABLE = "MESHLAB_FILTER_MODELS"
_TIMEOUT = 30.0  # seconds without an answer


@dataclass(frozen=True, kw_only=True)
class Model:
    """A public model, pinned to one state of its source.

    Attributes
    ----------
    name : str
        What :func:`fetch_model` takes.
    file : str
        Name of the file.
    points : int
        How many vertices it has.
    sha256 : str
        Of the file, in hexadecimal.
    address : str
        Where it is downloaded from, pinned to a commit; of a zip archive that holds the file where
        it ends in ".zip".
    stands_for : str
        Which model of the paper it takes the place of, and how near it comes; empty if none.
    licence : str
        As its source states it.
    """

    name: str
    file: str
    points: int
    sha256: str
    address: str
    stands_for: str
    licence: str


_GITHUB = "https://raw.githubusercontent.com/"

MODELS: dict[str, Model] = {
    model.name: model
    for model in (
        Model(
            name="bunny",
            file="bunny16k.pts",
            points=16130,
            sha256="69c64804068c9be3f91c7b7e163305638624a8bf6eed7564af297d8c0c57cc77",
            address=_GITHUB + "cnr-isti-vclab/meshlab/"
            "684885ade5e0075c0156f7120751e6a0fa1cf8a7/sample/bunny16k.pts",
            stands_for="Bunny; the same number of points",
            licence="MeshLab sample folder, 'intended for internal testing only; taken from "
            "various public repositories'; Stanford bunny: free for research, mirror and "
            "redistribute, not commercial without permission",
        ),
        Model(
            name="fandisk",
            file="fandisk.obj",
            points=6475,
            sha256="ea5bab2fbf545b1915f0d9faf6cc61ff8c18e0d8174ad61f8e35de15d8f6e3f8",
            address=_GITHUB + "alecjacobson/common-3d-test-models/"
            "8a4f8642acaf43f9cd7b67858a1502e1055ef202/data/fandisk.obj",
            stands_for="Fandisk (103568 points); two midpoint subdivisions give 103570",
            licence="no licence file; source README credits Pratt & Whitney / Hughes Hoppe",
        ),
        Model(
            name="genus3",
            file="genus3.off",
            points=6652,
            sha256="961db430c22ff72163a3031b7129e796af688841cb3c207b77ebf4399d19dda9",
            address=_GITHUB + "dakk/BSPTree/"
            "abaaa4fe20ce996555c3f6c2ca6a2eede2e0e497/models/genus3.off",
            stands_for="Genus; quadric decimation to 5000 faces gives its 2496 points",
            licence="none stated",
        ),
        Model(
            name="bimba",
            file="bimba.ply",
            points=80002,
            sha256="d844de630ff91bdd841e7502033bd23d2c61cd1931dc14eea038d2d910106511",
            address=_GITHUB + "houfei0801/ipsr/"
            "0cf59329d1fe3ec7b4a1882f19b4fd67d61190fa/data/bimba.ply",
            stands_for="Bimba (74764 points); another sampling",
            licence="none stated in the repository; AIM@SHAPE model",
        ),
        Model(
            name="max_planck",
            file="maxplanck.obj",
            points=45045,
            sha256="af48b712fa29aee290384e3d76ef491ff03b42e40b1d2c2ae4d911fb52689386",
            address=_GITHUB + "ivelascog/PGATR6/"
            "aba524011ed6479d0d693615f2e6ead3fa4d74f5/maxplanck.obj",
            stands_for="Max Planck (49089 points); another mesh",
            licence="none stated; AIM@SHAPE / MPI model",
        ),
        Model(
            name="david",
            file="david.ply",
            points=30690,
            sha256="23a5b6c326fc057aaf46511042ad2992efd9461dcd5d31867d3e1e699cf651d6",
            address=_GITHUB + "UTS-RI/SDF_cuda/"
            "150cae65af1abd2471b1c81934823bbcd0f6739b/data/david.ply",
            stands_for="David (182996 points); the full statue, much coarser",
            licence="repository MIT (code); Digital Michelangelo model: research use",
        ),
        Model(
            name="horse",
            file="horse.ply",
            points=48485,
            sha256="89ec844c36725d727d94b156fa18d695c5af8ddcd9db1ebedea83fb0d8a889a1",
            address=_GITHUB + "alecjacobson/common-3d-test-models/"
            "8a4f8642acaf43f9cd7b67858a1502e1055ef202/data/horse.zip",
            stands_for="",
            licence="no licence file; Cyberware scan",
        ),
        Model(
            name="lucy",
            file="lucy.ply",
            points=50002,
            sha256="3d3af90643c36b2ccd9e039960daf28cb0159c0880c78edd410fa95ae959328f",
            address=_GITHUB + "UTS-RI/SDF_cuda/"
            "150cae65af1abd2471b1c81934823bbcd0f6739b/data/Lucy100k.ply",
            stands_for="",
            licence="repository MIT (code); Stanford model terms",
        ),
        Model(
            name="autzen",
            file="autzen_trim.las",
            points=110000,
            sha256="3d351885f3aa03d5ac92358037ba0b850ea4f56f644ffcc56d57cd5d830aaf75",
            address=_GITHUB + "PDAL/PDAL/"
            "ccf0ab7046072f68cab78734e90d0d3149f3af10/test/data/las/autzen_trim.las",
            stands_for="",
            licence="BSD (PDAL)",
        ),
    )
}


class ModelError(MeshlabFilterError, OSError):
    """A model cannot be had: no network, a server that fails, a wrong checksum (exit code 8)."""

    exit_code = 8


def get_model(name: str) -> Model:
    """Return the entry of a model.

    Raises
    ------
    InvalidParameterError
        If there is none of that name.

    Examples
    --------
    >>> get_model("bunny").points
    16130
    """
    if name in MODELS:
        return MODELS[name]
    near = difflib.get_close_matches(str(name), MODELS, n=2) or list(MODELS)
    raise InvalidParameterError(
        f"Invalid model. Must be one of the public ones, such as {', '.join(near)}. "
        f"Given: {name!r}."
    )


def fetch_model(
    model: str | Model,
    *,
    directory: str | os.PathLike[str] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> Path:
    """Return the path of a model's file, downloading it on first use.

    Parameters
    ----------
    model : str or Model
        A name among ``MODELS``, or an entry of one's own.
    directory : path-like, optional
        A folder with the files at hand; nothing is downloaded. The environment variable
        MESHLAB_FILTER_MODELS does the same.
    cache : path-like, optional
        Where downloads are kept; the user's cache folder by default.

    Returns
    -------
    Path

    Raises
    ------
    FileFormatError
        If a file at hand is missing or has another checksum.
    InvalidParameterError
        If the name is unknown.
    ModelError
        If the download fails, breaks off or has another checksum, or pooch is not installed.
        Nothing is left in the cache then.

    Examples
    --------
    >>> path = fetch_model("bunny")  # doctest: +SKIP
    """
    entry = model if isinstance(model, Model) else get_model(model)
    at_hand = directory or os.environ.get(MODELS_VARIABLE)
    if at_hand:
        return _at_hand(entry, Path(at_hand))
    return _download(entry, cache)


def _at_hand(entry: Model, directory: Path) -> Path:
    path = directory / entry.file
    if not path.is_file():
        raise FileFormatError(
            f"The model {entry.name} must be in the folder of models as {entry.file}; it can be "
            f"had from {entry.address}. Given: {directory}."
        )
    found = _sha256(path)
    if found != entry.sha256:
        raise FileFormatError(
            f"The model {entry.name} must be the file with SHA-256 {entry.sha256}. "
            f"Given: {path} with {found}."
        )
    return path


def _download(entry: Model, cache: str | os.PathLike[str] | None) -> Path:
    try:
        import pooch
    except ImportError as error:
        raise ModelError(
            f"Downloading needs pooch ({error}); run: python -m pip install "
            "'meshlab-filter[models]', or name a folder with the models in "
            f"{MODELS_VARIABLE}."
        ) from error
    import requests

    folder = Path(cache) if cache is not None else Path(pooch.os_cache("meshlab-filter"))
    final = folder / entry.file
    if final.is_file() and _sha256(final) == entry.sha256:
        return final
    archive = entry.address.endswith(".zip")
    extract = _extract(entry, final) if archive else None
    pooch.get_logger().setLevel("WARNING")
    try:
        pooch.retrieve(
            entry.address,
            # Of an archive the file inside is checked, once it is out.
            known_hash=None if archive else f"sha256:{entry.sha256}",
            fname=f"{entry.file}.zip" if archive else entry.file,
            path=folder,
            processor=extract,
            downloader=pooch.HTTPDownloader(timeout=_TIMEOUT),
        )
    except ValueError as error:  # what pooch raises for a wrong checksum
        raise ModelError(
            f"The model {entry.name} must have SHA-256 {entry.sha256}, and the download from "
            f"{entry.address} has not; it was thrown away."
        ) from error
    except (requests.RequestException, OSError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split()).rstrip(".")
        raise ModelError(
            f"The model {entry.name} could not be downloaded from {entry.address} ({reason}); try "
            f"again, or name a folder with the models in {MODELS_VARIABLE}."
        ) from error
    return final


def _extract(entry: Model, final: Path) -> Callable[[str, str, object], str]:
    """Return a processor for pooch that takes the model's file out of an archive."""

    def extract(archive: str, action: str, pooch_itself: object) -> str:
        try:
            with zipfile.ZipFile(archive) as members:
                names = [name for name in members.namelist() if Path(name).name == entry.file]
                content = members.read(names[0]) if names else b""
        finally:
            Path(archive).unlink()
        if hashlib.sha256(content).hexdigest() != entry.sha256:
            raise ValueError(entry.file)
        partial = final.with_name(f"{final.name}.part")
        partial.write_bytes(content)
        partial.replace(final)
        return str(final)

    return extract


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()
