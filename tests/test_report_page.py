"""The HTML report in a real browser: it draws, it obeys, it asks the network for nothing."""

import itertools

import numpy as np
import numpy.testing as npt
import pytest
from browsing import browser, complaints, open_page, pixels, requests

import meshlab_filter as mf

pytest.importorskip("plotly")
pytest.importorskip("jinja2")
pytest.importorskip("selenium")
By = pytest.importorskip("selenium.webdriver.common.by").By
Keys = pytest.importorskip("selenium.webdriver.common.keys").Keys

pytestmark = pytest.mark.slow

BACKGROUND = (0xB9, 0xC0, 0xCA)


@pytest.fixture(scope="module")
def page_path(tmp_path_factory):
    """Write the report of a run with clusters on a cloud of a shape without symmetry."""
    folder = tmp_path_factory.mktemp("page")
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points = directions * [1.0, 0.6, 0.4] * (1 + 0.3 * directions[:, :1])
    np.savetxt(folder / "scan.xyz", points)
    mf.run(folder / "scan.xyz", folder / "out", delete=20, html=True)
    return folder / "out" / "report.html"


@pytest.fixture(scope="module")
def page(page_path, tmp_path_factory):
    """Open the report in a wide window."""
    with browser(tmp_path_factory.mktemp("profile")) as driver:
        open_page(driver, page_path)
        yield driver


@pytest.fixture(autouse=True)
def fresh(page):
    """Put the controls back after each test."""
    yield
    page.execute_script("document.getElementById('reset').click()")
    choose(page, "error")
    settle(page)


def choose(driver, colour):
    """Choose a colouring."""
    driver.execute_script(f"document.querySelector('input[value={colour}]').click()")
    settle(driver)


def settle(driver):
    """Wait until what was asked for has been drawn."""
    driver.set_script_timeout(120)
    driver.execute_async_script(
        "const done = arguments[0];"
        "const wait = () => setTimeout(() => moving || busy.size ? wait() :"
        " requestAnimationFrame(() => requestAnimationFrame(done)), 400);"
        "wait();"
    )


def views(driver):
    """Return the elements of the three views."""
    return driver.find_elements(By.CSS_SELECTOR, ".view .plot")


def cameras(driver):
    """Return where the eye is in each view, shape (3, 3)."""
    eyes = driver.execute_script(
        "return plots.map(({plot}) => {"
        "const {x, y, z} = plot._fullLayout.scene._scene.getCamera().eye; return [x, y, z];})"
    )
    return np.array(eyes)


def covered(element):
    """Return the share of the element that does not have the colour of the background."""
    return float((np.abs(pixels(element) - BACKGROUND).max(axis=2) > 12).mean())


def test_views_are_drawn(page):
    """Each of the three views shows something, on its background, in many colours."""
    assert len(views(page)) == 3
    for view in views(page):
        assert 0.03 < covered(view) < 0.9
        assert len(np.unique(pixels(view).reshape(-1, 3), axis=0)) > 20


def test_histograms_are_drawn(page):
    """There are four histograms, each with bars."""
    plots = page.find_elements(By.CSS_SELECTOR, ".histogram")
    assert len(plots) == 4
    for plot in plots:
        assert len(plot.find_elements(By.CSS_SELECTOR, ".bars .point")) > 10


@pytest.mark.parametrize("colour", ["rank", "entropy"])
def test_colour_can_be_chosen(page, colour):
    """Another colouring changes every view and the scale's title and ends."""
    before = [pixels(view) for view in views(page)]
    scale = page.find_element(By.CSS_SELECTOR, ".scale").text
    choose(page, colour)
    assert colour.title() in page.find_element(By.ID, "scale-title").text
    assert page.find_element(By.CSS_SELECTOR, ".scale").text != scale
    for view, old in zip(views(page), before):
        assert (np.abs(pixels(view) - old).max(axis=2) > 20).mean() > 0.02


def drag(driver, element):
    """Drag from the middle of the element to the right."""
    from selenium.webdriver import ActionChains

    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
    ActionChains(driver, duration=300).move_to_element(element).click_and_hold().move_by_offset(
        60, 10
    ).move_by_offset(60, 10).release().perform()
    settle(driver)


def test_cameras_are_linked(page):
    """Dragging one view turns all three alike."""
    before = cameras(page)
    drag(page, views(page)[0])
    after = cameras(page)
    assert np.abs(after[0] - before[0]).max() > 0.1
    npt.assert_allclose(after[1:], np.tile(after[0], (2, 1)), atol=1e-3)


def test_cameras_can_be_unlinked(page):
    """Without the link only the view that is dragged turns; linking again aligns the others."""
    page.find_element(By.ID, "linked").click()
    before = cameras(page)
    drag(page, views(page)[1])
    after = cameras(page)
    assert np.abs(after[1] - before[1]).max() > 0.1
    npt.assert_allclose(after[[0, 2]], before[[0, 2]], atol=1e-6)
    page.find_element(By.ID, "linked").click()
    settle(page)
    aligned = cameras(page)
    npt.assert_allclose(aligned, np.tile(aligned[1], (3, 1)), atol=1e-3)


def test_keyboard_reaches_and_turns_a_view(page):
    """Tab goes through the controls to a view, which shows its focus; arrows and + move it."""
    body = page.find_element(By.TAG_NAME, "body")
    page.execute_script("window.scrollTo(0, 0)")
    page.find_element(By.TAG_NAME, "h1").click()
    seen = []
    for _ in range(30):
        page.switch_to.active_element.send_keys(Keys.TAB)
        active = page.switch_to.active_element
        seen.append(active.get_attribute("id") or active.get_attribute("name"))
        if active.get_attribute("role") == "application":
            break
    assert {"colour", "up", "size", "linked", "reset"} <= set(seen)
    assert active != body
    assert active.value_of_css_property("outline-style") == "solid"
    before = cameras(page)
    active.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP)
    settle(page)
    turned = cameras(page)
    assert (np.abs(turned - before).max(axis=1) > 0.05).all()
    active.send_keys("+", "+")
    settle(page)
    near = np.linalg.norm(cameras(page), axis=1)
    npt.assert_allclose(near, np.linalg.norm(turned, axis=1) / 1.21, rtol=1e-2)
    active.send_keys("0")
    settle(page)
    npt.assert_allclose(cameras(page), before, atol=1e-3)


def test_up_and_size_change_the_picture(page):
    """The other axis up, and larger points, give another picture."""
    first = views(page)[0]
    before, area = pixels(first), covered(first)
    page.execute_script(
        "const size = document.getElementById('size'); size.value = 5;"
        "size.dispatchEvent(new Event('input'))"
    )
    settle(page)
    assert covered(first) > area
    page.execute_script(
        "const size = document.getElementById('size'); size.value = 2;"
        "size.dispatchEvent(new Event('input'));"
        "const up = document.getElementById('up'); up.value = 'z';"
        "up.dispatchEvent(new Event('change'))"
    )
    settle(page)
    assert (np.abs(pixels(first) - before).max(axis=2) > 20).mean() > 0.02
    page.execute_script(
        "const up = document.getElementById('up'); up.value = 'y';"
        "up.dispatchEvent(new Event('change'))"
    )


def test_no_request_leaves_the_page_and_the_console_is_quiet(page_path, tmp_path):
    """From opening to using every control nothing is asked for and nothing is complained of.

    The window is as small as a telephone's, and nothing sticks out of it.
    """
    with browser(tmp_path / "profile", width=390, height=844) as driver:
        open_page(driver, page_path)
        for colour in ("rank", "entropy", "error"):
            choose(driver, colour)
        driver.execute_script("document.getElementById('reset').click()")
        settle(driver)
        assert requests(driver) == []
        assert complaints(driver) == []
        assert driver.execute_script("return document.documentElement.scrollWidth") <= 390
        boxes = [view.rect for view in views(driver)]
        for above, below in itertools.pairwise(boxes):
            assert below["y"] > above["y"] + above["height"]
        assert all(250 < box["width"] <= 390 for box in boxes)
        driver.execute_script("arguments[0].scrollIntoView()", views(driver)[2])
        assert covered(views(driver)[2]) > 0.03


def test_sweep_page_draws_its_curve(tmp_path):
    """The page of a sweep shows three curves and the floor, on a telephone too, and is quiet."""
    from test_htmlreport import write_sphere

    from meshlab_filter.sweep import sweep

    sweep(write_sphere(tmp_path / "scan.ply", 600), tmp_path, keep=[0.5, 0.2, 0.1], html=True)
    with browser(tmp_path / "profile", width=390, height=844) as driver:
        open_page(driver, tmp_path / "sweep.html")
        assert len(driver.find_elements(By.CSS_SELECTOR, ".curve .scatterlayer .trace")) == 4
        assert len(driver.find_elements(By.CSS_SELECTOR, ".curve .points path")) == 9
        assert driver.execute_script("return document.documentElement.scrollWidth") <= 390
        assert requests(driver) == []
        assert complaints(driver) == []


def test_without_webgl_the_rest_is_there(page_path, tmp_path):
    """A browser that cannot draw the views is told so, and has the histograms and figures."""
    with browser(tmp_path / "profile", "--disable-3d-apis") as driver:
        open_page(driver, page_path)
        assert driver.find_element(By.ID, "no-webgl").is_displayed()
        assert len(driver.find_elements(By.CSS_SELECTOR, ".histogram .barlayer")) == 4
        assert views(driver) == []
