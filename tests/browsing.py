"""A real Chromium without a screen, for the tests of pages."""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

FLAGS = (
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars",
)  # fmt: skip


@contextmanager
def browser(profile: Path, *flags: str, width: int = 1400, height: int = 1000) -> Iterator:
    """Start Chromium with an empty profile and software WebGL, or skip where it is absent.

    Further flags can be given.
    """
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    driver_path = shutil.which("chromedriver")
    if not chromium or not driver_path:
        pytest.skip("no chromium with chromedriver on this machine")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in (*FLAGS, *flags, f"--user-data-dir={profile}", f"--window-size={width},{height}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver_path))
    try:
        # The window of a headless browser does not get narrower than 500 pixels.
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        yield driver
    finally:
        driver.quit()


def open_page(driver, path: Path, *, seconds: int = 180) -> None:
    """Open a file and wait until its script says that all is drawn."""
    from selenium.webdriver.support.ui import WebDriverWait

    driver.get("about:blank")
    for log in ("performance", "browser"):
        driver.get_log(log)
    driver.get(path.resolve().as_uri())
    WebDriverWait(driver, seconds).until(
        lambda browser: browser.execute_script("return document.body.dataset.ready") == "yes"
    )


def requests(driver) -> list[str]:
    """Return the addresses asked for since the last call, the page's own left out."""
    entries = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
    urls = [
        entry["params"]["request"]["url"]
        for entry in entries
        if entry["method"] == "Network.requestWillBeSent"
    ]
    return [url for url in urls if url != driver.current_url and not url.startswith("data:")]


def complaints(driver) -> list[str]:
    """Return what the console says of level warning and above."""
    # Hints on the speed of reading pixels back, which the plotting library and screenshots do.
    hints = ("GPU stall", "willReadFrequently")
    return [
        entry["message"]
        for entry in driver.get_log("browser")
        if entry["level"] in ("SEVERE", "WARNING")
        and not any(hint in entry["message"] for hint in hints)
    ]


def pixels(element) -> np.ndarray:
    """Return what is seen of an element, shape (height, width, 3), 0 … 255."""
    from PIL import Image

    return np.asarray(Image.open(BytesIO(element.screenshot_as_png)).convert("RGB")).astype(int)
