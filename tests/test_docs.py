"""The documentation says what the code does: keys, messages, names; and the site builds."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import meshlab_filter as mf
from meshlab_filter import errors

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
ANY = "…"


def keys_of(values, prefix=""):
    """Yield the dotted names of everything in a nested dict."""
    for name, value in values.items():
        if isinstance(value, dict) and value:
            yield from keys_of(value, f"{prefix}{name}.")
        else:
            yield prefix + name


def documented_keys():
    """Return the keys in the table of docs/report.md."""
    text = (DOCS / "report.md").read_text(encoding="utf-8")
    return re.findall(r"^\| `([^`]+)` \|", text, re.MULTILINE)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Return the keys of the reports of runs of every kind."""
    folder = tmp_path_factory.mktemp("keys")
    rng = np.random.default_rng(0)
    points = rng.normal(size=(400, 3))
    np.savetxt(folder / "scan.xyz", points / np.linalg.norm(points, axis=1)[:, None])
    scan, out = folder / "scan.xyz", folder / "out"
    reports = [
        mf.run(scan, out, delete=2),
        mf.run(scan, out, count=100),
        mf.run(scan, out, count=100, order="surface-first", move=True),
        mf.run_preset(scan, out, "default"),
    ]
    return {key for report in reports for key in keys_of(report)}


def test_every_key_of_the_report_is_documented(written):
    """Each key that a run writes has its line in docs/report.md, or a group's."""
    documented = documented_keys()
    exact = {key for key in documented if not key.endswith(".*")}
    groups = tuple(key.removesuffix("*") for key in documented if key.endswith(".*"))
    # Empty or absent groups stand by themselves.
    missing = {
        key
        for key in written
        if key not in exact and not key.startswith(groups) and f"{key}." not in groups
    }
    assert not missing


def test_every_documented_key_is_written(written):
    """No line of docs/report.md speaks of a key that no run writes."""
    for key in documented_keys():
        if key.endswith(".*"):
            assert any(found.startswith(key.removesuffix("*")) for found in written), key
        else:
            assert key in written, key


def test_every_public_name_is_in_the_reference():
    """docs/reference.md has a directive for each name of the package."""
    text = (DOCS / "reference.md").read_text(encoding="utf-8")
    for name in mf.__all__:
        if name != "__version__":
            assert re.search(rf"auto\w+:: meshlab_filter\.{name}\b", text), name


def template(node):
    """Return a message as text with the sign for anything where values are put in, or None."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(
            part.value if isinstance(part, ast.Constant) else ANY for part in node.values
        )
    if isinstance(node, ast.BinOp):
        left, right = template(node.left), template(node.right)
        return None if left is None or right is None else left + right
    return None


def messages():
    """Yield (place, message) for everything raised on purpose in the package."""
    own = {name for name in vars(errors) if name.endswith("Error")}
    names = own | {"BadParameter", "UsageError", "ModelError"}
    for path in sorted((ROOT / "meshlab_filter").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not node.args:
                continue
            if getattr(node.func, "id", getattr(node.func, "attr", "")) in names:
                text = template(node.args[0])
                # What hands on another message has no words of its own.
                if text is not None and text.replace("Given:", "").strip(ANY + " ."):
                    yield f"{path.name}:{node.lineno}", text


def test_every_message_is_in_troubleshooting():
    """Each message that can end a command has its line, with its cause."""
    page = (DOCS / "troubleshooting.md").read_text(encoding="utf-8")
    patterns = [
        re.compile(".*".join(map(re.escape, pattern.split(ANY))), re.DOTALL)
        for pattern in re.findall(r"^\| `([^`]+)` \|", page, re.MULTILINE)
    ]
    found = list(messages())
    assert len(found) > 100
    missing = [
        f"{place}: {text}"
        for place, text in found
        if not any(pattern.match(text.replace("`", "")) for pattern in patterns)
    ]
    assert not missing, "\n".join(missing)


def test_citation_and_changelog_have_the_version():
    """CITATION.cff and CHANGELOG.md speak of the version there is."""
    assert f"version: {mf.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"## [{mf.__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_map_of_modules_is_of_modules_that_exist():
    """Every file that CONTRIBUTING.md maps is there."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = text[text.index("## A map") : text.index("## Changes")]
    for name in re.findall(r"`([\w/]+(?:\.py|/))`", table):
        places = (
            ROOT / name,
            ROOT / "meshlab_filter" / name,
            ROOT / "meshlab_filter/methods" / name,
        )
        assert any(place.exists() for place in places), name


def test_every_module_is_on_the_map():
    """CONTRIBUTING.md says of each module what it is for."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    for path in (ROOT / "meshlab_filter").glob("*.py"):
        assert f"`{path.name}`" in text or path.name in ("__init__.py", "_version.py"), path.name


def test_links_between_pages_lead_to_pages():
    """What a page of the site links to, without an address, is in docs/ and there."""
    for page in sorted(DOCS.rglob("*.md")):
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        for target in re.findall(r"\]\(([^)#\s]+)", text):
            if "://" not in target:
                found = (page.parent / target).resolve()
                assert found.is_relative_to(DOCS), f"{page.name}: {target}"
                assert found.exists(), f"{page.name}: {target}"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the site, every warning an error."""
    for needed in ("sphinx", "myst_parser", "numpydoc", "furo"):
        pytest.importorskip(needed)
    out = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html",
         "-d", str(out / "doctrees"), str(DOCS), str(out / "html")],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return out / "html"


@pytest.mark.slow
def test_site_has_every_page(site):
    """Each page of docs/ is built, equations as MathML."""
    for page in DOCS.glob("*.md"):
        assert (site / f"{page.stem}.html").exists()
    assert (site / "method.html").read_text(encoding="utf-8").count("<math") > 20


@pytest.mark.slow
def test_site_loads_nothing_from_elsewhere(site, tmp_path):
    """No page asks the network for anything, nor complains, in a real browser."""
    from browsing import browser, complaints, requests

    with browser(tmp_path / "profile") as driver:
        driver.get("about:blank")
        for log in ("performance", "browser"):
            driver.get_log(log)
        for page in sorted(site.glob("*.html")):
            driver.get(page.as_uri())
            asked = [url for url in requests(driver) if not url.startswith("file://")]
            assert asked == [], page.name
            assert complaints(driver) == [], page.name
