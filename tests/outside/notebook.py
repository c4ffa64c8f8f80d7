"""A model, a run, a table of a sweep and a finding in a notebook of marimo, looked at in a headless Chromium.

Runs with the package installed; `marimo run` serves the notebook to the browser, which must show what the objects say of themselves.
"""
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import time

from playwright.sync_api import sync_playwright

import hyd

WORK = pathlib.Path(sys.argv[1]).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync"]
# Effects that stay in the search, so that it is short.
KEPT = {"ChamberLeakage", "PistonFriction", "SensorLag"}
NOTEBOOK = '''import marimo
app = marimo.App()

@app.cell
def _():
    import hyd
    model = hyd.load("models/single_acting_drive/drive.hyd")
    model
    return hyd, model

@app.cell
def _(model):
    run = model.simulate(stop=0.02)
    run
    return (run,)

@app.cell
def _(run):
    run.plot("x", "y", title="lifts in a notebook")
    return

@app.cell
def _(hyd):
    found = hyd.study({study!r}, bench={bench!r}, allow_outside=True).discover()
    found
    return

if __name__ == "__main__":
    app.run()
'''


def study():
    """A study with few effects, as its file."""
    drive = ROOT / "models/single_acting_drive"
    effects = [path.stem for path in (ROOT / "stdlib/Hyd/Effects").glob("*.hyd") if path.stem != "package"]
    without = ", ".join(f'"Hyd.Effects.{name}"' for name in sorted(set(effects) - KEPT))
    text = (drive / "bench.toml").read_text()
    text = text.replace('file = "drive.hyd"', f'file = "{drive / "drive.hyd"}"\nwithout = [{without}]')
    file = WORK / "notebook_study.toml"
    file.write_text(text)
    return str(file)


def free_port():
    with socket.socket() as own:
        own.bind(("127.0.0.1", 0))
        return own.getsockname()[1]


def look(page):
    """What the cells show; cells may stand in shadow trees, which locators see through."""
    page.get_by_role("cell", name="p0", exact=True).first.wait_for(timeout=120_000)
    text = page.locator(".hyd-model").first.inner_text()
    assert "Pa" in text and "10000000" in text.replace("1e+07", "10000000"), text[:500]
    page.locator(".hyd-run svg").first.wait_for(timeout=120_000)
    rows = len(hyd.load("models/single_acting_drive/drive.hyd").simulate(stop=0.02).time)
    assert f"{rows} rows" in page.locator(".hyd-run").first.inner_text()
    box = page.locator(".hyd-run svg").first.bounding_box()
    assert box["width"] > 300 and box["height"] > 200, box
    page.get_by_text("lifts in a notebook").first.wait_for(timeout=120_000)
    frame = page.locator("iframe.hyd-finding").first
    frame.wait_for(timeout=300_000)
    inside = frame.content_frame
    inside.locator("canvas").first.wait_for(timeout=60_000)
    assert "leak" in inside.locator("body").inner_text().lower()


if __name__ == "__main__":
    notebook = WORK / "notebook.py"
    notebook.write_text(NOTEBOOK.format(study=study(), bench=str(ROOT / "tests/data/bench/B03.json")))
    port = free_port()
    command = [sys.executable, "-m", "marimo", "run", str(notebook), "--headless", "--no-token", "--port", str(port)]
    with open(WORK / "notebook.log", "w") as log:
        server = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=log, env={**os.environ, "MARIMO_SKIP_UPDATE_CHECK": "1"})
    browser_path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))))
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=browser_path, args=ARGUMENTS)
            page = browser.new_page()
            for _ in range(100):
                try:
                    page.goto(f"http://127.0.0.1:{port}/")
                    break
                except Exception:
                    time.sleep(0.3)
            try:
                look(page)
            finally:
                page.screenshot(path=WORK / "notebook.png", full_page=True)
            browser.close()
    finally:
        server.terminate()
        server.wait()
    print("notebook: a model, a run, a picture and a finding are shown")
