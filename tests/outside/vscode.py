"""The extension in Visual Studio Code (code-server of npm) in a headless Chromium: messages and the change that heals one, hover, completion, renaming,
lenses, the commands that simulate, draw, serve a page, show equations and search with a study, and the schema of sets of shots.  Leaves screenshots."""

import json
import math
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import time
import urllib.request

from playwright.sync_api import sync_playwright

HYD, WORK, CODE = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
ROOT = pathlib.Path(__file__).resolve().parents[2]
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync"]
# An editor that starts on a busy machine takes its time.
SECONDS = float(os.environ.get("PATIENCE", "60"))
SWING = """model Swing "a mass on a spring"
  parameter Real m(unit = "kg") = 2 "mass";
  parameter Real c(unit = "N/m") = 100 "stiffness";
  Real x(start = 0.1, fixed = true, unit = "m") "position";
  Real v(start = 0, fixed = true) "velocity";
equation
  der(x) = v;
  m*der(v) = -c*x;
  annotation(experiment(StopTime = 2));
end Swing;
"""
TEXTS = {
    "swing.hyd": SWING,
    "faulty.hyd": SWING.replace("Swing", "Faulty").replace("-c*x;", "-c*xx;"),
    "use.hyd": "model Use\n  Swing swing(m = 3);\n  Real twice = 2*swing.x;\nend Use;\n",
    "set.json": "{\n  \"shotz\": []\n}\n",
}
# A vessel that empties, measured twice.
TANK = """model Tank "empties"
  parameter Real k(unit = "1/s", min = 0) = 0.8 "outlet";
  parameter Real h0(unit = "m") = 1 "level at the start";
  Real h(start = h0, fixed = true, unit = "m");
equation
  der(h) = -k*h;
  annotation(experiment(StopTime = 4));
end Tank;
"""
STUDY = """file = "tank.hyd"
[models]
default = "Tank"
[channels]
h_m = { variable = "h", unit = "m" }
[conditions]
h0 = "level"
[nuisances]
k = { parameter = "k", relative = 0.1 }
[shots]
time = "t"
"""
SETTINGS = {
    "security.workspace.trust.enabled": False, "workbench.startupEditor": "none", "telemetry.telemetryLevel": "off",
    "chat.disableAIFeatures": True, "extensions.autoUpdate": False, "extensions.autoCheckUpdates": False, "window.commandCenter": False,
    "workbench.secondarySideBar.defaultVisibility": "hidden", "editor.minimap.enabled": False, "editor.hover.delay": 100,
    "workbench.colorTheme": os.environ.get("THEME", "Default Light Modern"), "editor.acceptSuggestionOnEnter": "on",
}


def check(condition, words):
    if not condition:
        sys.exit(f"FAILED: {words}")


def until(holds, words, page=None):
    """Waits until something holds, and gives it."""
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        if found := holds():
            return found
        time.sleep(0.2)
    if page:
        page.screenshot(path=WORK / "failed.png")
    sys.exit(f"FAILED: {words}")


class Server:
    """code-server with the extension, and nothing else."""

    def __init__(self, folder):
        node = pathlib.Path(shutil.which("node"))
        user, extensions = WORK / "user", WORK / "extensions"
        # Where programs are is a setting of the machine that the server runs on.
        for kind, settings in [("User", SETTINGS), ("Machine", {"hyd.path": str(HYD)})]:
            (user / kind).mkdir(parents=True)
            (user / kind / "settings.json").write_text(json.dumps(settings))
        (WORK / "config.yaml").write_text("auth: none\n")
        self.command = [node, CODE / "out/node/entry.js", "--config", WORK / "config.yaml", "--user-data-dir", user, "--extensions-dir", extensions,
                        "--disable-telemetry", "--disable-update-check", "--disable-workspace-trust"]
        self.command = [str(word) for word in self.command]
        # No market of extensions is asked.
        self.environment = {**os.environ, "EXTENSIONS_GALLERY": "{}"}
        said = subprocess.run([*self.command, "--install-extension", str(WORK / "hyd.vsix")], env=self.environment, capture_output=True, text=True)
        check(said.returncode == 0 and "successfully installed" in said.stdout, f"the extension cannot be installed: {said.stdout}{said.stderr}")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.url = f"http://127.0.0.1:{port}/?folder={folder}"
        self.log = open(WORK / "server.log", "w")
        self.process = subprocess.Popen([*self.command, "--bind-addr", f"127.0.0.1:{port}", str(folder)], env=self.environment,
                                        stdout=self.log, stderr=subprocess.STDOUT)

        def answers():
            check(self.process.poll() is None, (WORK / "server.log").read_text())
            try:
                return urllib.request.urlopen(f"http://127.0.0.1:{port}/healthz", timeout=5).status == 200
            except OSError:
                return False
        until(answers, "code-server does not start")

    def __enter__(self):
        return self.url

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(timeout=60)
        self.log.close()


class Window:
    """The window, by its keys."""

    def __init__(self, page):
        self.page = page
        self.pictures = 0

    def picture(self, name):
        self.page.wait_for_timeout(500)
        self.pictures += 1
        self.page.screenshot(path=WORK / f"{self.pictures}-{name}.png")

    def press(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)

    def texts(self, selector):
        # Names in tabs and lists are broken where highlights begin.
        return [text.replace("\u00a0", " ").replace("\n", "") for text in self.page.locator(selector).all_inner_texts()]

    def wait(self, selector, word):
        """Waits until a place shows a word, and gives what it shows."""
        return until(lambda: [text for text in self.texts(selector) if word in text], f"{selector} never shows {word}: {self.texts(selector)}", self.page)

    def chosen(self, words, row):
        """Types into the box at the top, and takes the row that shows what is wanted."""
        self.page.keyboard.type(words)
        rows = self.page.locator(".quick-input-list .monaco-list-row").filter(has=self.page.locator(f'[aria-label^="{row}"], .label-name:text-is("{row}")'))
        labelled = self.page.locator(f'.quick-input-list .monaco-list-row[aria-label^="{row}"]')
        until(lambda: rows.count() or labelled.count(), f"no row {row} for {words}", self.page)
        (labelled if labelled.count() else rows).first.click()

    def open(self, name):
        self.press("Control+p")
        self.page.wait_for_selector(".quick-input-widget input")
        self.chosen(name, name.rsplit("/")[-1])
        self.wait(".tab.active", name.rsplit("/")[-1])
        until(lambda: self.texts(".editor-group-container.active .view-line"), f"{name} is not shown", self.page)

    def command(self, words):
        self.press("F1")
        self.page.wait_for_selector(".quick-input-widget input")
        self.chosen(words, words)

    def go(self, line, column):
        self.press("Control+g")
        self.page.wait_for_selector(".quick-input-widget input")
        self.page.keyboard.type(f"{line}:{column}")
        self.press("Enter")
        self.wait(".statusbar", f"Ln {line}, Col {column}")

    def text(self):
        """What the active editor shows."""
        lines = self.page.locator(".editor-group-container.active .view-line")
        rows = lines.evaluate_all("rows => rows.map(row => [parseFloat(row.style.top), row.innerText])")
        return "\n".join(text.replace("\u00a0", " ").rstrip() for _, text in sorted(rows))


def messages(window):
    """Problems, and the change that heals one."""
    window.open("faulty.hyd")
    window.command("View: Focus Problems")
    shown = window.wait(".markers-panel .monaco-list-row", "xx")
    check(any("hyd" in row and "E0201" in row for row in shown), f"the message has its source and its code: {shown}")
    window.picture("problems")
    window.open("faulty.hyd")
    window.go(8, 17)

    def offered():
        # Who asks before the editor has the message gets nothing, and asks again.
        window.press("Control+.")
        window.page.wait_for_timeout(3000)
        return [text for text in window.texts(".action-widget") if "`x`" in text]
    until(offered, "no change is offered", window.page)
    window.picture("fixes")
    window.press("Enter")
    until(lambda: "-c*x;" in window.text(), f"the change is not made: {window.text()}", window.page)
    until(lambda: not [row for row in window.texts(".markers-panel .monaco-list-row") if "xx" in row], "the message does not go", window.page)
    window.press("Control+s")


def understanding(window):
    """Hover, completion and renaming."""
    window.open("swing.hyd")
    window.go(8, 3)
    window.press("Control+k", "Control+i")
    [shown, *_] = window.wait(".monaco-hover:not(.hidden)", "kg")
    check("mass" in shown and "parameter Real m" in shown, f"hover says kind, unit and description: {shown}")
    window.picture("hover")
    window.press("Escape")
    window.open("use.hyd")
    window.go(3, 25)
    window.page.keyboard.type(" + swing.")
    window.page.wait_for_selector(".suggest-widget.visible .monaco-list-row")
    offered = until(lambda: window.texts(".suggest-widget.visible .monaco-list-row"), "nothing is offered", window.page)
    check(all(any(row.startswith(name) for row in offered) for name in "xvmc"), f"elements of the component are offered: {offered}")
    window.picture("completion")
    window.page.keyboard.type("v")
    window.press("Escape")
    # A length and a speed cannot be added.
    window.wait(".markers-panel .monaco-list-row", "E0301")
    window.press(*["Backspace"] * len(" + swing.v"))
    window.press("Control+s")
    window.open("swing.hyd")
    window.go(4, 8)
    window.press("F2")
    # The box is there before it is shown; the server says first what can be renamed.
    name = window.page.locator(".rename-box input")
    name.wait_for(state="visible")
    until(lambda: name.input_value() == "x", "the box does not have the old name", window.page)
    name.fill("height")
    name.press("Enter")
    until(lambda: "der(height) = v" in window.text(), f"the new name is not taken: {window.text()}", window.page)
    window.open("use.hyd")
    until(lambda: "2*swing.height" in window.text(), f"other files take the new name: {window.text()}", window.page)
    window.command("File: Save All Files")


def running(window):
    """Lenses and commands."""
    window.open("swing.hyd")
    lenses = window.wait(".codelens-decoration", "simulate")
    check("plot" in lenses[0] and "equations" in lenses[0], f"lenses above the model: {lenses}")
    hints = until(lambda: [text for text in window.texts(".view-line") if "[m/s]" in text], "no unit that follows is shown", window.page)
    check("v" in hints[0], f"the velocity has the hint: {hints}")
    window.picture("lenses")
    window.command("hyd: Show the Equations of the Model")
    until(lambda: "der(height)" in window.text() and "annotation" not in window.text(), f"equations beside the text: {window.text()}", window.page)
    tabs = window.texts(".tab")
    check(tabs.count("Swing (equations)") == 1 and not [tab for tab in tabs if "Untitled" in tab], f"one text, which nobody has to save: {tabs}")
    window.picture("equations")
    window.command("View: Close Editor")
    window.open("swing.hyd")
    window.command("hyd: Simulate the Model and Draw It")
    window.wait(".quick-input-widget", "Variables to draw")
    window.page.keyboard.type("height")
    window.press("Enter")
    window.wait(".tab.active", "Swing.png")
    window.page.wait_for_timeout(3000)
    frames = window.page.frames
    drawn = until(lambda: [size for frame in frames if (size := frame.evaluate("[...document.images].map(own => own.naturalWidth).find(own => own > 100)"))],
                  "the picture is not shown", window.page)
    check(drawn[0] >= 300, f"a picture of {drawn} pixels")
    window.picture("plot")
    window.command("View: Close Editor")
    window.open("swing.hyd")
    window.command("hyd: View the Model in a Browser")
    served = f"{HYD} view .*swing.hyd"
    until(lambda: subprocess.run(["pgrep", "-f", served], capture_output=True).stdout, "no page is served", window.page)
    window.picture("view")
    subprocess.run(["pkill", "-INT", "-f", served])
    # Messages of a run that cannot begin become problems.
    window.open("set.json")
    # The run has brought the terminal to the front.
    window.command("View: Focus Problems")
    [row, *_] = window.wait(".markers-panel .monaco-list-row", "experiments")
    check("Missing property" in row, f"the schema of sets checks: {row}")
    window.picture("schema")


def lab(folder):
    """A study with its set, of noise that repeats."""
    folder.mkdir()
    (folder / "tank.hyd").write_text(TANK)
    (folder / "study.toml").write_text(STUDY)
    for name, level in (("a", 1), ("b", 2)):
        rows = [f"{0.02*k},{level*math.exp(-0.85*0.02*k) + 1e-3*math.sin(12.9898*k*k + level)}" for k in range(200)]
        (folder / f"{name}.csv").write_text("t,h_m\n" + "\n".join(rows) + "\n")
    shots = [{"file": "a.csv", "level": 1}, {"file": "b.csv", "level": 2}]
    (folder / "tank_set.json").write_text(json.dumps({"noise_std": {"h_m": 7e-4}, "experiments": shots}))


def discovering(window):
    """A search with a study, chosen by its files."""
    window.open("lab/study.toml")
    window.command("hyd: Discover with a Study")
    window.wait(".quick-input-list .monaco-list-row", "study.toml")
    window.chosen("", "lab/study.toml")
    window.wait(".quick-input-list .monaco-list-row", "tank_set.json")
    window.picture("sets")
    window.chosen("", "lab/tank_set.json")
    window.wait(".quick-input-widget", "The folder of the report")
    window.press("Enter")
    window.wait(".notification-list-item", "The search has ended")
    window.picture("searched")
    report = json.loads((WORK / "workspace/lab/tank_set_report/report.json").read_text())
    check(report["status"] == "adequate", f"the vessel lacks nothing: {report['status']}")
    window.command("Notifications: Clear All Notifications")


def drive(window):
    """A package of files."""
    window.open("single_acting_drive/drive.hyd")
    window.command("View: Focus Problems")
    # What is wrong in the set stays; nothing comes from the drive.
    window.page.wait_for_timeout(3000)
    rows = window.texts(".markers-panel .monaco-list-row")
    check(not [row for row in rows if "drive.hyd" in row], f"the drive has no messages: {rows}")
    window.open("single_acting_drive/drive.hyd")
    window.wait(".codelens-decoration", "simulate")
    window.picture("drive")


def main():
    folder = WORK / "workspace"
    folder.mkdir()
    for name, text in TEXTS.items():
        (folder / name).write_text(text)
    shutil.copytree(ROOT / "models/single_acting_drive", folder / "single_acting_drive", ignore=lambda place, names: [
        name for name in names if not name.endswith(".hyd")])
    lab(folder / "lab")
    program = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome", "chrome"])), None)
    check(program, "there is no Chromium")
    with Server(folder) as url, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=program, args=ARGUMENTS, timeout=1e3 * SECONDS)
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.set_default_timeout(1e3 * SECONDS)
        page.goto(url)
        page.wait_for_selector(".monaco-workbench .explorer-folders-view .monaco-list-row")
        window = Window(page)
        begin = time.monotonic()
        try:
            for part in (messages, understanding, running, discovering, drive):
                part(window)
                print(f"   {part.__name__}: {time.monotonic() - begin:.0f} s", flush=True)
        except Exception:
            page.screenshot(path=WORK / "failed.png")
            raise
        # Nothing of the extension has complained.
        shown = window.texts(".notification-list-item")
        check(not [text for text in shown if "hyd" in text], f"notifications: {shown}")
        print(f"the extension in Visual Studio Code: all that was tried works ({time.monotonic() - begin:.0f} s); screenshots in {WORK}")
        browser.close()


main()
