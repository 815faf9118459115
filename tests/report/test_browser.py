"""The report in a real browser without a window: it renders, asks for nothing, and answers to mouse and keyboard."""

import shutil

import pytest

from curvematch_jax.datasets import creature
from curvematch_jax.report import Limits, report_page, write_report
from curvematch_jax.retrieval import Matching, SavedMatrix, dissimilarity_matrix, run_settings
from curvematch_jax.surface import Extraction, extract_parts

pytestmark = pytest.mark.slow

HOSTILE = "</script><img src=x onerror=\"document.title='taken'\">'&amp;$title"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(name="report", scope="module")
def fixture_report(tmp_path_factory):
    """Two classes of two, one object of a hostile name."""
    models = [creature(kind, pose, vertices=400) for kind in ("hand", "snake") for pose in (0, 1)]
    extraction = Extraction(samples=32, levels=8)
    parts = [extract_parts(model.mesh, extraction) for model in models]
    names = ("hand0", HOSTILE, "snake0", "snake1")
    saved = SavedMatrix(dissimilarity_matrix(parts), names, run_settings(extraction, Matching()))
    meshes = {name: model.mesh for name, model in zip(names, models, strict=True)}
    path = tmp_path_factory.mktemp("report") / "report.html"
    page = report_page(saved, ["hand", "hand", "<b>snake", "<b>snake"], parts, meshes, limits=Limits(vertices=300))
    write_report(page, path)
    return path


@pytest.fixture(name="browser", scope="module")
def fixture_browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright, the extra `browser`")
    installed = next(filter(None, map(shutil.which, BROWSERS)), None)
    with playwright.sync_playwright() as tools:
        try:
            browser = tools.chromium.launch(executable_path=installed, args=["--no-sandbox"])
        except playwright.Error:
            pytest.skip("no browser here: install chromium, or run `playwright install chromium`")
        yield browser
        browser.close()


@pytest.fixture(name="page", params=[1200, 390], ids=["wide", "narrow"])
def fixture_page(browser, report, request):
    """The report, opened; every message of the browser and every request but its own fails the test."""
    context = browser.new_context(viewport={"width": request.param, "height": 800}, offline=True)
    page, said, asked = context.new_page(), [], []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda made: asked.append(made.url))
    page.goto(report.as_uri())
    page.wait_for_selector("#row .tile")
    settle(page)
    yield page
    assert said == []
    assert [url for url in asked if url not in (report.as_uri(), "data:,")] == []
    context.close()


def settle(page):
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def pixels(page, selector):
    settle(page)
    return page.eval_on_selector(selector, "canvas => canvas.toDataURL()")


def painted(page, selector):
    """The share of a canvas that is painted."""
    settle(page)
    return page.eval_on_selector(
        selector,
        """canvas => {
          const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
          let count = 0;
          for (let k = 3; k < data.length; k += 4) count += data[k] > 0;
          return count / (data.length / 4);
        }""",
    )


def test_everything_is_drawn_and_fits_the_window(page):
    assert page.locator("#measures tbody tr").count() >= 3
    assert painted(page, "#matrix-view") > 0.5
    for view in ("#left", "#right", "#row canvas"):
        assert 0.03 < painted(page, view) < 0.9
    assert page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")


def test_names_are_text_and_nothing_else(page):
    assert page.title() == "Retrieval report"
    assert page.locator("img").count() == 0
    assert HOSTILE in page.locator("#row").inner_text() + page.locator("#query").inner_text()
    assert page.locator("#query optgroup").nth(0).get_attribute("label") == "<b>snake"


def test_a_query_is_chosen_and_a_pair(page):
    page.select_option("#query", label="snake1")
    tiles = page.locator("#row .tile")
    assert tiles.count() == 3
    assert tiles.nth(0).inner_text().startswith("1. snake0")
    assert "same class" in tiles.nth(0).inner_text()
    before = pixels(page, "#right")
    tiles.nth(2).focus()
    page.keyboard.press("Enter")
    assert page.locator("#row .tile[aria-pressed=true]").inner_text().startswith("3.")
    assert page.evaluate("() => document.activeElement.matches('.tile[aria-pressed=true]')")
    assert pixels(page, "#right") != before
    assert "snake1" in page.locator("#pair-facts").inner_text()


def test_meshes_turn_by_mouse_and_keyboard(page):
    for view in ("#left", "#right"):
        first = pixels(page, view)
        page.locator(view).scroll_into_view_if_needed()
        box = page.locator(view).bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 60, y + 20, steps=4)
        page.mouse.up()
        dragged = pixels(page, view)
        assert dragged != first
        page.locator(view).focus()
        page.keyboard.press("ArrowLeft")
        assert pixels(page, view) != dragged
        page.keyboard.press("0")
        assert pixels(page, view) == first
        page.keyboard.press("+")
        assert painted(page, view) > 0
        assert pixels(page, view) != first


def test_one_part_is_shown_alone_and_beliefs_are_listed(page):
    rows = page.locator("#matches tbody tr")
    assert rows.count() >= 4
    together = pixels(page, "#left")
    number = rows.nth(0).locator("button")
    number.focus()
    page.keyboard.press("Space")
    assert number.get_attribute("aria-pressed") == "true"
    assert pixels(page, "#left") != together
    page.keyboard.press("Space")
    assert pixels(page, "#left") == together
    masses = [float(text) for text in rows.locator(".mass span").all_inner_texts()]
    ignorance = [float(row.locator("td").nth(3).inner_text()) for row in rows.all()]
    assert all(0 <= mass <= 1 and 0 <= open_ <= 1 for mass, open_ in zip(masses, ignorance, strict=True))


def test_the_matrix_names_its_pairs_and_zooms(page):
    matrix = page.locator("#matrix-view")
    matrix.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    cell = page.locator("#matrix-cell").inner_text().splitlines()
    assert cell[:2] == ["query snake0 (<b>snake)", "object snake1 (<b>snake)"]
    assert cell[2].startswith("dissimilarity 0.")
    page.keyboard.press("Enter")
    assert page.locator("#query").input_value() == "2"
    box = matrix.bounding_box()
    page.mouse.move(box["x"] + 0.97 * box["width"], box["y"] + 0.97 * box["height"])
    assert HOSTILE in page.locator("#matrix-cell").inner_text()
    whole = pixels(page, "#matrix-view")
    page.locator("#zoom-in").click()
    assert pixels(page, "#matrix-view") != whole
    page.locator("#zoom-all").click()
    page.mouse.move(box["x"] + 0.97 * box["width"], box["y"] + 0.97 * box["height"])
    assert pixels(page, "#matrix-view") == whole


def test_every_control_has_a_name_and_the_keyboard_reaches_it(page):
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("button, select, canvas[tabindex]")]
          .filter((e) => !(e.getAttribute("aria-label") || e.textContent.trim() || (e.labels && e.labels.length)))
          .map((e) => e.outerHTML)"""
    )
    assert unnamed == []
    reached = []
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.append(page.evaluate("() => document.activeElement.id || document.activeElement.className"))
    places = [reached.index(each) for each in ("matrix-view", "zoom-in", "query", "tile", "left", "right", "number")]
    assert places == sorted(places)
