"""Opens the pages that hyd writes in a headless Chromium: they draw, answer to the mouse, ask nothing of a network, and axe (accessibility, by Deque) finds
nothing serious in them."""

import importlib.resources
import json
import pathlib
import shutil
import subprocess
import sys

from playwright.sync_api import sync_playwright

HYD, WORK = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync"]
AXE = importlib.resources.files("axe_playwright_python") / "axe.min.js"
# Effects that stay in the search, so that it is short.
KEPT = {"ChamberLeakage", "PistonFriction", "SensorLag"}


def run(*arguments):
    subprocess.run([HYD, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def thinned(every=4):
    """The bench with a leak, one sample of so many of it: a search takes as long as it has samples."""
    source, folder = ROOT / "tests/data/bench", WORK / "thinned"
    folder.mkdir(exist_ok=True)
    text = (source / "B03.json").read_text()
    for shot in json.loads(text)["experiments"]:
        heading, *rows = (source / shot["file"]).read_text().splitlines()
        (folder / shot["file"]).write_text("\n".join([heading, *rows[::every]]) + "\n")
    (folder / "B03.json").write_text(text)
    return folder / "B03.json"


def report(name="leak", kept=KEPT):
    """A search with a few effects on the bench with a leak."""
    drive = ROOT / "models/single_acting_drive"
    effects = [path.stem for path in (ROOT / "stdlib/Hyd/Effects").glob("*.hyd") if path.stem != "package"]
    without = ", ".join(f'"Hyd.Effects.{name}"' for name in sorted(set(effects) - kept))
    study = (drive / "bench.toml").read_text()
    study = study.replace('file = "drive.hyd"', f'file = "{drive / "drive.hyd"}"\nwithout = [{without}]')
    (WORK / "study.toml").write_text(study)
    run("discover", WORK / "study.toml", "--allow-outside", "--bench", thinned(), "--report", WORK / name)
    return WORK / name / "report.html"


def coloured(page, canvas, colour):
    """Pixels of a canvas near a colour of the page."""
    return page.evaluate(
        """([canvas, colour]) => {
          const own = document.querySelector(canvas), pen = own.getContext("2d");
          const name = getComputedStyle(document.documentElement).getPropertyValue(colour).trim();
          const wanted = [1, 3, 5].map((k) => parseInt(name.slice(k, k + 2), 16));
          const pixels = pen.getImageData(0, 0, own.width, own.height).data;
          let count = 0;
          for (let k = 0; k < pixels.length; k += 4)
            if (pixels[k + 3] > 128 && wanted.every((value, j) => Math.abs(pixels[k + j] - value) < 24)) count += 1;
          return count;
        }""", [canvas, colour])


def check(condition, words):
    if not condition:
        sys.exit(f"FAILED: {words}")


def open_page(browser, path):
    """A page, with all that goes wrong in it and all that it asks for."""
    page = browser.new_page(viewport={"width": 1500, "height": 1100})
    wrong, asked = [], []
    page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(path.as_uri())
    return page, wrong, asked


def accessible(browser, path):
    """axe with everything open, light and wide, dark and narrow."""
    for scheme, width in (("light", 1500), ("dark", 500)):
        context = browser.new_context(viewport={"width": width, "height": 1100}, color_scheme=scheme, bypass_csp=True)
        page = context.new_page()
        page.goto(path.as_uri())
        page.evaluate("document.querySelectorAll('details').forEach((own) => { own.open = true; })")
        page.wait_for_timeout(300)
        page.evaluate(AXE.read_text())
        found = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")["violations"]
        serious = [(own["id"], own["nodes"][0]["html"][:200]) for own in found if own["impact"] in ("serious", "critical")]
        check(not serious, f"axe in {path.name} at {width} pixels: {serious}")
        context.close()


def check_library(browser):
    """The page of a library: words of a description find its class, and what opens is not inside of what leads elsewhere."""
    path = WORK / "library.html"
    run("doc", ROOT / "models/single_acting_drive", "--no-pictures", "-o", path)
    page, wrong, asked = open_page(browser, path)
    page.fill("#find", "power stage in place")
    shown = page.locator("nav a:visible").all_inner_texts()
    check("PeakAndHold" in shown and "DrivePaper" not in shown, f"found by its description: {shown}")
    page.fill("#find", "")
    page.locator("nav summary").nth(1).click()
    check(page.locator("nav details[open]").count() == 2, "a package opens")
    page.screenshot(path=WORK / "library.png")
    check(not wrong, f"errors in the page: {wrong}")
    check(all(url.startswith(("file:", "data:")) for url in asked), f"the page asked for {asked}")
    accessible(browser, path)


def check_report(browser, path):
    page, wrong, asked = open_page(browser, path)
    data = json.loads((path.parent / "report.json").read_text())
    check("chamber_leakage" in page.inner_text("#sentence"), "the sentence names the effect")
    check(page.locator("main section").count() >= 10, "all sections are there")
    for colour in ("--base", "--more", "--seen"):
        check(coloured(page, "canvas.above", colour) > 200, f"{colour} is drawn")
    page.screenshot(path=WORK / "report.png", full_page=True)
    # Another channel and shot, a closer look, and a value under the pointer.
    page.click(".channels button:text-is('pR_Pa')")
    page.click(".shots button:has-text('shot 3')")
    check(page.locator(".shots button.on").inner_text().startswith("shot 3"), "the shot is chosen")
    page.locator("canvas.above").scroll_into_view_if_needed()
    box = page.locator("canvas.above").bounding_box()
    whole = page.evaluate("document.querySelector('canvas.above').map.t1 - document.querySelector('canvas.above').map.t0")
    page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 100, steps=4)
    page.mouse.up()
    part = page.evaluate("document.querySelector('canvas.above').map.t1 - document.querySelector('canvas.above').map.t0")
    check(0.1 * whole < part < 0.35 * whole, f"dragging zooms ({part} of {whole})")
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 120)
    check("measured" in page.inner_text(".hover"), "values are shown under the pointer")
    page.screenshot(path=WORK / "report_zoomed.png")
    page.dblclick("canvas.above")
    # The likeliest place leads to its line.
    line = data["effects"][0]["line"]
    check(page.locator("pre div.mark .n").inner_text() == str(line), "the line of the effect is marked")
    page.locator("a[data-file]").nth(2).click()
    check(page.locator("pre div.mark").count() == 1, "a link marks a line")
    check(not wrong, f"errors in the page: {wrong}")
    check(all(url.startswith(("file:", "data:")) for url in asked), f"the page asked for {asked}")


def check_without_name(browser, path):
    """An answer without a name shows the nearest candidates, each with what it failed by, and only the base model."""
    page, wrong, asked = open_page(browser, path)
    data = json.loads((path.parent / "report.json").read_text())
    known = data["found_before"] + data["nearest"]
    check(data["status"] == "unknown" and data["nearest"], f"no name without the effect: {data['sentence']}")
    part = page.locator("section", has=page.locator("h2:text-is('What came nearest')"))
    rows = part.locator("tbody tr")
    check(rows.count() == len(known), f"{rows.count()} rows for {len(known)} candidates")
    for k, own in enumerate(known):
        row = rows.nth(k).inner_text()
        words = [own["effect"], own["words"], own["component"], f"{own['misfit']:.2f}", own.get("criterion", "earlier pass")]
        words += [name.split(".", 1)[1] + " = " for name in own["parameters"]]
        for word in words:
            check(word in row, f"`{word}` in: {row}")
    check(coloured(page, "canvas.above", "--base") > 200, "the base model is drawn")
    check(coloured(page, "canvas.above", "--more") == 0, "there is no other model to draw")
    page.locator("canvas.above").scroll_into_view_if_needed()
    box = page.locator("canvas.above").bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 120)
    check("base" in page.inner_text(".hover") and "extended" not in page.inner_text(".hover"), "values under the pointer")
    page.screenshot(path=WORK / "without_name.png", full_page=True)
    check(not wrong, f"errors in the page: {wrong}")
    check(all(url.startswith(("file:", "data:")) for url in asked), f"the page asked for {asked}")


def check_equations(browser):
    path = WORK / "equations.html"
    run("equations", ROOT / "models/single_acting_drive/drive.hyd", "--html", path)
    page, wrong, asked = open_page(browser, path)
    check(page.locator("canvas#matrix").count() == 1, "the matrix is there")
    check(coloured(page, "canvas#matrix", "--explicit") > 50, "the matrix is drawn")
    page.screenshot(path=WORK / "equations.png", full_page=True)
    check(not wrong, f"errors in the page: {wrong}")
    check(all(url.startswith(("file:", "data:")) for url in asked), f"the page asked for {asked}")


def check_profile(browser):
    path = WORK / "profile.html"
    run("simulate", ROOT / "models/single_acting_drive/drive.hyd", "--profile-page", path)
    for width, scheme in ((1500, "light"), (500, "dark")):
        page, wrong, asked = open_page(browser, path)
        page.set_viewport_size({"width": width, "height": 1100})
        page.emulate_media(color_scheme=scheme)
        titles = page.locator("h2").all_inner_texts()
        check({"Parts of the run", "Components", "Cost of the code"} <= set(titles), f"sections of the profile: {titles}")
        page.get_by_role("button", name="code").click()
        shares = [float(text.split()[0]) for text in page.locator("section:nth-of-type(2) td:last-child").all_inner_texts()]
        check(shares == sorted(shares, reverse=True) and 99 < sum(shares) < 101, f"components by their share of the code: {shares}")
        check(page.evaluate("document.documentElement.scrollWidth <= innerWidth"), f"the profile is wider than {width} pixels")
        page.screenshot(path=WORK / f"profile_{width}.png", full_page=True)
        check(not wrong, f"errors in the page: {wrong}")
        check(all(url.startswith(("file:", "data:")) for url in asked), f"the page asked for {asked}")


with sync_playwright() as play:
    names = ("chromium", "chromium-browser", "google-chrome", "chrome")
    program = next((path for path in map(shutil.which, names) if path), None)
    check(program, "a Chromium is installed")
    browser = play.chromium.launch(executable_path=program, args=ARGUMENTS)
    check_equations(browser)
    accessible(browser, WORK / "equations.html")
    check_profile(browser)
    accessible(browser, WORK / "profile.html")
    check_library(browser)
    check_report(browser, report())
    accessible(browser, WORK / "leak" / "report.html")
    check_without_name(browser, report("no_leak", KEPT - {"ChamberLeakage"}))
    browser.close()
print("pages in a browser: as they should be")
