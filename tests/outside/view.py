"""Opens pages of `hyd view` in a headless Chromium, served and written: sliders run the model, diagrams open, keys suffice, nothing leaves the machine,
and axe (accessibility, by Deque) finds nothing serious: in a served page at 1500 and 500 pixels, light and dark each, in the others wide and light, narrow and dark.  Says how many pictures a second a dragged slider gets."""

import importlib.resources
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys

from playwright.sync_api import sync_playwright

HYD, WORK = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
DRIVE = ROOT / "models/single_acting_drive/drive.hyd"
AXE = importlib.resources.files("axe_playwright_python") / "axe.min.js"
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync"]
# A model whose parts annotations place, with figures and kinds of parameters.
DRAWN = """package Drawn
  connector Output = output Real annotation(Icon(graphics = {Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {0, 0, 127},
    fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid)}));
  connector Input = input Real annotation(Icon(graphics = {Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {0, 0, 127},
    fillColor = {0, 0, 127}, fillPattern = FillPattern.Solid)}));
  partial block Base
    annotation(Icon(graphics = {Rectangle(extent = {{-100, -100}, {100, 100}}, lineColor = {0, 0, 127}, fillColor = {255, 255, 255},
      fillPattern = FillPattern.Solid), Text(extent = {{-150, 110}, {150, 150}}, textString = "%name", textColor = {0, 0, 255})}));
  end Base;
  block Wave
    extends Base;
    type Shape = enumeration(sine, square);
    parameter Real f(unit = "Hz", min = 0, max = 5) = 1 "frequency";
    parameter Shape shape = Shape.sine "form";
    parameter Boolean inverted = false;
    Output y annotation(Placement(transformation(extent = {{100, -10}, {120, 10}})));
    protected Real s = sin(6.283185307179586*f*time);
  equation
    y = (if inverted then -1 else 1)*(if shape == Shape.sine then s else sign(s));
  end Wave;
  block Lag
    extends Base;
    parameter Real T(unit = "s", min = 0.01) = 0.1 "time constant";
    Input u annotation(Placement(transformation(extent = {{-140, -20}, {-100, 20}})));
    Output y(start = 0, fixed = true) annotation(Placement(transformation(extent = {{100, -10}, {120, 10}})));
  equation
    T*der(y) = u - y;
  end Lag;
  model Chain "A wave behind a lag"
    Wave wave annotation(Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
    Lag lag annotation(Placement(transformation(extent = {{0, -10}, {20, 10}})));
  equation
    connect(wave.y, lag.u) annotation(Line(points = {{-39, 0}, {-2, 0}}, color = {0, 0, 127}));
    annotation(experiment(StopTime = 2), Documentation(info = "<p>A <b>lag</b> of first order.</p>",
      figures = {Figure(title = "Response", plots = {Plot(title = "In and out", curves = {Curve(y = wave.y, legend = "in"), Curve(y = lag.y, legend = "out")}),
        Plot(title = "Loop", curves = {Curve(x = wave.y, y = lag.y)})})}));
  end Chain;
end Drawn;
"""

# Parts that annotations place and no line connects; a parameter that decides how many variables there are.
PLACED = """package Placed
  connector Pin
    Real v;
    flow Real i;
  end Pin;
  model Resistor
    parameter Real R(min = 0) = 2 "resistance";
    parameter Integer n(min = 1) = 2 "pieces";
    Pin a annotation(Placement(transformation(extent = {{-110, -10}, {-90, 10}})));
    Pin b annotation(Placement(transformation(extent = {{90, -10}, {110, 10}})));
    Real part[n];
  equation
    a.i + b.i = 0;
    a.v - b.v = sum(part);
    for k in 1:n loop
      part[k] = R/n*a.i;
    end for;
  end Resistor;
  model Source
    Pin a annotation(Placement(transformation(extent = {{-10, -10}, {10, 10}})));
  equation
    a.v = sin(time);
  end Source;
  model Ground
    Pin a annotation(Placement(transformation(extent = {{-10, -10}, {10, 10}})));
  equation
    a.v = 0;
  end Ground;
  model Row
    Source source annotation(Placement(transformation(extent = {{-90, -10}, {-70, 10}})));
    Resistor one annotation(Placement(transformation(extent = {{-50, -10}, {-30, 10}})));
    Resistor two annotation(Placement(transformation(extent = {{-10, -10}, {10, 10}})));
    Ground ground annotation(Placement(transformation(extent = {{40, -10}, {60, 10}})));
    Resistor beside annotation(Placement(transformation(extent = {{-30, 30}, {-10, 50}})));
  equation
    connect(source.a, one.a);
    connect(one.b, two.a);
    connect(two.b, ground.a);
    connect(source.a, beside.b);
    connect(beside.a, ground.a);
    annotation(experiment(StopTime = 1));
  end Row;
end Placed;
"""


def check(condition, words):
    if not condition:
        sys.exit(f"FAILED: {words}")


def run(*arguments):
    subprocess.run([HYD, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


class Served:
    """A server, and a page of it with all that goes wrong and all that it asks for."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([HYD, "view", *map(str, arguments)], stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        self.url = re.search(r"http://127\.0\.0\.1:\d+/\?token=\w+", line).group(0)

    def __enter__(self):
        return self.url

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()


def until(page, condition):
    """Waits for what the page says; its policy forbids Playwright's own way, which is `eval`."""
    for _ in range(600):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    sys.exit(f"FAILED: not within half a minute: {condition}")


def open_page(browser, url, dark=False, width=1500, bypass=False):
    context = browser.new_context(viewport={"width": width, "height": 1000}, color_scheme="dark" if dark else "light", bypass_csp=bypass)
    page = context.new_page()
    page.wrong, page.asked = [], []
    page.on("console", lambda message: page.wrong.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto(url)
    until(page, "Boolean(mainRun() && mainRun().times.length > 0 && !view.due)")
    return page


def done(page, origin):
    check(not page.wrong, f"errors in the page: {page.wrong}")
    check(all(url.startswith((origin, "data:")) for url in page.asked), f"the page asked for {page.asked}")
    check(page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page is wider than its window")
    page.context.close()


def accessible(browser, url, name, looks=((False, 1500), (True, 500))):
    """axe with everything open, light and wide, dark and narrow."""
    for dark, width in looks:
        page = open_page(browser, url, dark, width, bypass=True)
        page.evaluate("document.querySelectorAll('details').forEach((own) => { own.open = true; })")
        page.wait_for_timeout(300)
        page.screenshot(path=WORK / f"view_{name}_{width}_{'dark' if dark else 'light'}.png", full_page=True)
        page.evaluate(AXE.read_text())
        found = page.evaluate("axe.run()")["violations"]
        serious = [(own["id"], own["nodes"][0]["html"][:200]) for own in found if own["impact"] in ("serious", "critical")]
        check(not serious, f"axe at {width} pixels: {serious}")
        page.context.close()


def last(page, name):
    return page.evaluate(f"valueAt(runs.own, {json.dumps(name)}, runs.own.times[runs.own.times.length - 1])")


def check_served(browser):
    with Served(DRIVE) as url:
        page = open_page(browser, url)
        check(page.locator(".part").count() == 13, "all parts are drawn")
        check("run complete" in page.inner_text("#status"), page.inner_text("#status"))
        # A slider runs the model; the field beside it, too.
        before = page.evaluate("Math.max(...runs.own.columns.get(byName.get('u_C').o[0]))")
        field = page.locator("input[id='p-U0']")
        field.fill("20")
        until(page, "runs.own.key.includes('U0') && !runs.flying")
        after = page.evaluate("Math.max(...runs.own.columns.get(byName.get('u_C').o[0]))")
        check(abs(before - 24) < 0.1 and abs(after - 20) < 0.1, f"the voltage of the run follows: {before}, {after}")
        slider = page.get_by_label("U0 by slider")
        slider.focus()
        page.keyboard.press("ArrowRight")
        until(page, "!runs.flying && Number(document.getElementById('p-U0').value) > 20")
        # Diagrams open, and lead back.
        page.locator(".part[data-part='1']").dblclick()
        check(page.evaluate("picture.shown.path") == "hy" and page.locator(".part").count() > 10, "the inside of hy")
        page.get_by_role("button", name="SingleActingDrive.Drive").click()
        check(page.evaluate("picture.shown.path") == "", "the way back")
        # By keys alone: a part, what it is, its inside.
        page.locator(".part[data-part='0']").focus()
        page.keyboard.press("Enter")
        check(page.inner_text("#component-title") == "ro", "the component that was chosen by keys")
        check(page.evaluate("document.activeElement.id") == "component-title", "the focus goes to what was chosen")
        page.get_by_role("button", name="look inside ro").press("Enter")
        check(page.evaluate("picture.shown.path") == "ro", "its inside")
        # Values over time, at connections and in lists.
        page.locator("#time").focus()
        page.keyboard.press("Home")
        until(page, "view.time === 0 && !view.due")
        check(any(text for text in page.locator("svg text.value").all_text_contents()), "values are written in the diagram")
        # The filter, and a variable that is drawn.
        page.locator("#filter").fill("velocity engine")
        check(page.locator("#tree li").count() >= 1, page.inner_text("#tree"))
        page.locator("#tree input").first.check()
        check(page.evaluate("plots.chosen.length") == 4, "a fourth curve")
        # What a run cannot do is said.
        page.get_by_role("button", name="SingleActingDrive.Drive").click()
        page.locator("input[id='p-C']").fill("-1")
        until(page, "document.getElementById('wrong').textContent !== ''")
        page.screenshot(path=WORK / "view_failed.png")
        page.get_by_role("button", name="all as the model says").click()
        until(page, "document.getElementById('wrong').textContent === '' && runs.own.key === question() && !Object.keys(runs.set).length")
        speed(page)
        done(page, url.split("/?")[0])
        accessible(browser, url, "served", [(dark, width) for dark in (False, True) for width in (1500, 500)])


def speed(page):
    """A slider that moves with every frame for two seconds."""
    found = page.evaluate("""async () => {
      const slider = [...document.querySelectorAll("input[type=range]")].find((own) => own.getAttribute("aria-label") === "p0 by slider");
      runs.took = [];
      const begin = performance.now();
      await new Promise((end) => {
        let k = 0;
        const step = () => {
          slider.value = 300 + (k += 7) % 400;
          slider.dispatchEvent(new Event("input"));
          if (performance.now() - begin < 2000) requestAnimationFrame(step); else end();
        };
        requestAnimationFrame(step);
      });
      const seconds = (performance.now() - begin) / 1000;
      const took = runs.took.map((own) => own.to - own.from).sort((a, b) => a - b);
      return [runs.took.length / seconds, took[took.length >> 1]];
    }""")
    print(f"   {found[0]:.0f} pictures a second while a slider is dragged, half of them within {found[1]:.0f} ms")
    # A machine that does other work is slower; a picture that waits for a whole second is a fault.
    check(found[0] > 3, f"{found[0]} pictures a second")


def check_drawn(browser):
    (WORK / "drawn.mo").write_text(DRAWN)
    with Served(WORK / "drawn.mo") as url:
        page = open_page(browser, url)
        check(page.locator("svg use").count() >= 4, "icons and their connectors are drawn")
        check(page.locator(".panel").count() == 2 and "In and out" in page.inner_text("#panels"), "the figure of the model")
        page.locator(".part[data-part='0']").click()
        before = last(page, "lag.y")
        page.locator("select[id='p-wave.shape']").select_option("square")
        until(page, "!runs.flying && runs.own.key.includes('square')")
        square = last(page, "lag.y")
        page.locator("input[id='p-wave.inverted']").check()
        until(page, "!runs.flying && runs.own.key.includes('inverted')")
        inverted = last(page, "lag.y")
        check(abs(square - before) > 0.05 and abs(square + inverted) < 1e-3, f"{before}, {square}, {inverted}")
        page.get_by_role("button", name="Drawn.Chain").click()
        page.locator("#info-part summary").click()
        check("first order" in page.inner_text("#info"), "the documentation of the model")
        done(page, url.split("/?")[0])
        accessible(browser, url, "drawn")


# Which parts a line runs through that does not end there, in the coordinates of the picture.
THROUGH = """picture.shown.wires.flatMap((wire, k) => {
  const line = [...document.querySelector(`[data-wire="${k}"] path`).getAttribute("d").matchAll(/(-?[\\d.]+) (-?[\\d.]+)/g)].map((own) => [+own[1], +own[2]]);
  const ends = wire.ends.map((own) => own.split(".")[0]);
  return picture.shown.parts.filter((part, n) => {
    if (ends.includes(part.name)) return false;
    const box = document.querySelector(`[data-part="${n}"] rect`).getBBox(), inset = 0.5;
    return line.slice(1).some(([x, y], m) => {
      const [u, v] = line[m];
      return Math.max(x, u) > box.x + inset && Math.min(x, u) < box.x + box.width - inset && Math.max(y, v) > box.y + inset && Math.min(y, v) < box.y + box.height - inset;
    });
  }).map((part) => wire.ends.join(" - ") + " through " + part.name);
})"""


def check_placed(browser):
    (WORK / "placed.mo").write_text(PLACED)
    with Served(WORK / "placed.mo") as url:
        page = open_page(browser, url)
        check(page.locator(".wire").count() == 5, "all connections are drawn")
        check(page.evaluate(THROUGH) == [], page.evaluate(THROUGH))
        page.screenshot(path=WORK / "view_placed.png")
        # A parameter that decides sizes: the model is translated again, and what was set stays.
        page.locator(".part[data-part='1']").click()
        page.locator("input[id='p-one.R']").fill("3")
        until(page, "runs.own.key.includes('one.R') && !runs.flying")
        count = "DATA.variables.filter((own) => own.n.startsWith('one.part[')).length"
        check(page.evaluate(count) == 2, "two pieces at first")
        with page.expect_navigation():
            page.locator("input[id='p-one.n']").fill("4")
            page.locator("input[id='p-one.n']").press("Enter")
        until(page, "Boolean(mainRun() && mainRun().times.length > 0 && !view.due)")
        check(page.evaluate(count) == 4, "four pieces then")
        check(page.evaluate("runs.own.key === question() && JSON.stringify(runs.set)") == '{"one.R":"3"}', "the resistance stays as it was set")
        check(page.evaluate("document.activeElement.id") == "p-one.n", "the focus stays")
        # What cannot be translated is said, with a way back.
        with page.expect_navigation():
            page.locator("input[id='p-one.n']").fill("0")
            page.locator("input[id='p-one.n']").press("Enter")
        check("one.n" in page.inner_text("#wrong") and "one.n = 0" in page.inner_text("#about"), page.inner_text("header"))
        with page.expect_navigation():
            page.get_by_role("button", name="translate it without").click()
        until(page, "Boolean(mainRun() && mainRun().times.length > 0 && !view.due)")
        check(page.evaluate(count) == 2, "two pieces again")
        done(page, url.split("/?")[0])


def planned():
    """What `hyd next` writes, for three conditions."""
    points = [{"values": [6e6 + 1e5*k, 24 + k % 5, 0.008 + 1e-4*(k % 40)], "worth": k % 17 + 0.1*k} for k in range(60)]
    evidence = [{"if": "coil_heating", "size": 2.3, "against": "lag", "expected": 30, "fitted": 41.5, "decides": 0.98, "shows": {"channel": "i_A", "time": 0.012, "deviations": 5.3}},
                {"if": "lag", "size": None, "against": "coil_heating", "expected": 8, "fitted": None, "decides": 0.4, "shows": None}]
    shot = {"conditions": {"p0_Pa": 7e6, "U0_V": 27, "pulse_s": 0.0085}, "settings": ["p0_Pa = 7000000 (7 MPa)", "U0_V = 27", "pulse_s = 0.0085 (8.5 ms)"], "cost": 1, "like": 2, "evidence": evidence}
    return {"set": "B", "status": "ambiguous", "aim": "tell apart", "models": ["coil_heating", "lag"], "models_left_out": 1, "never": ["no shot tells a from b"],
            "not_run": [], "shots": [shot], "points": points, "made": [{"number": 1, "values": [8e6, 25, 0.01]}, {"number": 2, "values": [13e6, 26, 0.011]}],
            "vary": [{"condition": "p0_Pa", "low": 6e6, "high": 12e6}, {"condition": "U0_V", "low": 24, "high": 28}, {"condition": "pulse_s", "low": 0.008, "high": 0.012}],
            "failed": {"points": 3, "why": "the valve chatters"}, "beyond": 0, "forbidden": 0}


def check_finding(browser):
    """What a search says, on the diagram."""
    report = {"model": "SingleActingDrive.Drive", "set": "B", "status": "ambiguous", "sentence": "named: missing is coil_heating",
              "effects": [{"component": "ro.rlc.coil", "effect": "coil_heating", "equation": "heating of the coil", "parameters": {"a": {"value": 2.345, "stderr": 0.0123}}}],
              "location": [{"component": "ro.rlc.coil", "equation": "in series with the coil", "effect": "coil_heating", "score": 400},
                           {"component": "sh", "equation": "m*der(w) = F", "coefficient": 3, "shape": "w", "unit": "N.s/m", "score": 100}]}
    folder = WORK / "finding"
    folder.mkdir(exist_ok=True)
    (folder / "report.json").write_text(json.dumps(report))
    (folder / "next.json").write_text(json.dumps(planned()))
    with Served(DRIVE, folder) as url:
        page = open_page(browser, url)
        # What to do next: what it would decide, and the map over two of three conditions.
        said = page.inner_text("#next")
        check("To tell apart: coil_heating, lag" in said and "7 MPa p0_Pa" in said and "lag is refuted with 98 %" in said and "in i_A" in said, said)
        check("no shot tells a from b" in said and "3 points cannot be run" in said, said)
        check(page.locator("svg.map .dot").count() == 60 and page.locator("svg.map .ring").count() == 1 and page.locator("svg.map .made").count() == 2, "points, rings and crosses of the map")
        place = "Number(document.querySelector('svg.map .ring').getAttribute('cx'))"
        page.get_by_label("across").select_option(label="p0_Pa")
        first = page.evaluate(place)
        page.get_by_label("across").select_option(label="U0_V")
        check(abs(page.evaluate(place) - first) > 20, "another condition lies across")
        page.locator("svg.map .dot").last.hover()
        check("100 % of the best point" in page.inner_text("#next-point"), page.inner_text("#next-point"))
        shares = page.evaluate("Object.fromEntries([...document.querySelectorAll('.part.lacking')].map((own) => [picture.shown.parts[own.dataset.part].path, own.style.getPropertyValue('--share')]))")
        check(shares == {"ro": "1.000", "sh": "0.500"}, f"parts are coloured by what would explain the gap: {shares}")
        said = page.inner_text("#finding")
        check("missing is coil_heating" in said and "a = 2.345 ± 0.012" in said and "3*w N.s/m in m*der(w) = F" in said, said)
        page.get_by_role("button", name="ro.rlc.coil").click()
        check(page.evaluate("picture.shown.path") == "ro.rlc" and page.inner_text("#component-title") == "ro.rlc.coil", "a place opens where it is")
        check("coil_heating" in page.inner_text("#finding") and "der(w)" not in page.inner_text("#finding"), page.inner_text("#finding"))
        done(page, url.split("/?")[0])
        accessible(browser, url, "finding")
    # Where nothing is missing, some place still explains most: that is chance, and no part is coloured for it.
    for status, score in (("adequate", 400), ("unknown", 1.28)):
        places = [{**own, "score": score} for own in report["location"]]
        (folder / "report.json").write_text(json.dumps({**report, "status": status, "needed": 25, "effects": [], "location": places}))
        with Served(DRIVE, folder) as url:
            page = open_page(browser, url)
            check(page.locator(".part.lacking").count() == 0, f"parts are coloured although the model is {status}")
            page.locator(".part[data-part='0']").click()
            check("What seems to be missing" not in page.inner_text("#finding"), page.inner_text("#finding"))
            done(page, url.split("/?")[0])


def check_wide(browser):
    """A long chain: its names can be read, and what is in view is known."""
    rods = range(1, 25)
    parts = "".join(f"    Rod rod{k};\n" for k in rods)
    joints = "".join(f"    connect(rod{k}.b, rod{k + 1}.a);\n" for k in rods if k + 1 in rods)
    (WORK / "wide.mo").write_text(f"""package Wide
  connector Pin
    Real T(unit = "K");
    flow Real Q(unit = "W");
  end Pin;
  model Rod
    parameter Real C(unit = "J/K", min = 0) = 10;
    parameter Real G(unit = "W/K", min = 0) = 10;
    Pin a;
    Pin b;
    Real T(start = 300, fixed = true, unit = "K");
  equation
    C*der(T) = a.Q + b.Q;
    a.Q = G*(a.T - T);
    b.Q = G*(b.T - T);
  end Rod;
  model Heat
    Pin a;
  equation
    a.T = 400;
  end Heat;
  model Chain
    Heat hot;
{parts}    Heat far;
  equation
    connect(hot.a, rod1.a);
    connect(rod24.b, far.a);
{joints}    annotation(experiment(StopTime = 20));
  end Chain;
end Wide;
""")
    folder = WORK / "far"
    folder.mkdir(exist_ok=True)
    place = {"component": "rod20", "equation": "C*der(T) = a.Q + b.Q", "coefficient": 3, "shape": "T", "unit": "W/K", "score": 100}
    others = [{**place, "shape": "tanh(T/2.4211629507708946e-5)", "score": 20 - k} for k in range(13)]
    (folder / "report.json").write_text(json.dumps({"model": "Wide.Chain", "sentence": "missing: a loss", "effects": [], "location": [place, *others]}))
    inside = """((name) => {
      const node = [...document.querySelectorAll("svg.diagram .part")].find((own) => picture.shown.parts[own.dataset.part].path === name);
      const own = node.getBoundingClientRect(), outer = document.getElementById("drawing").getBoundingClientRect();
      return own.left >= outer.left && own.right <= outer.right;
    })"""
    with Served(WORK / "wide.mo", folder) as url:
        for width in (1400, 500):
            page = open_page(browser, url, width=width)
            height = page.evaluate("document.querySelector('svg.diagram .name').getBoundingClientRect().height")
            check(height >= 10, f"names are {height} pixels high at {width}")
            check(page.evaluate(inside + "('rod20')") and not page.evaluate(inside + "('hot')"), "what would explain the most is in view")
            check(page.locator("#overview rect.lacking").count() == 1, "and is seen in the small picture")
            box = page.locator("#overview svg").bounding_box()
            page.mouse.click(box["x"] + 2, box["y"] + box["height"]/2)
            check(page.evaluate("document.getElementById('drawing').scrollLeft") < 5, "the small picture leads to the beginning")
            page.mouse.move(box["x"] + 5, box["y"] + box["height"]/2)
            page.mouse.down()
            page.mouse.move(box["x"] + box["width"]*0.6, box["y"] + box["height"]/2, steps=4)
            page.mouse.up()
            check(page.evaluate("document.getElementById('drawing').scrollLeft") > 300, "and where its frame is dragged")
            more = page.locator("#finding details")
            check(more.locator("summary").inner_text() == "2 more places" and not more.locator("li").first.is_visible(), "the rest of a long list is folded")
            more.locator("summary").click()
            check(more.locator("li").count() == 2 and "3*tanh(T/2.421e-5) W/K in" in more.inner_text(), more.inner_text())
            page.locator("#finding button").first.click()
            check(page.evaluate(inside + "('rod20')"), "a place in the list is scrolled into view")
            if width == 500:
                # What is said of a part stands far below: a way there and back.
                page.get_by_role("button", name="what rod20 is").press("Enter")
                check(page.evaluate("document.activeElement.id") == "component-title" and page.evaluate("document.getElementById('component-title').getBoundingClientRect().top < innerHeight"), "the way to what rod20 is")
                page.get_by_role("button", name="back to the diagram").press("Enter")
                check(page.evaluate("document.activeElement.id") == "drawing", "and back")
            page.get_by_role("button", name="whole").click()
            check(not page.locator("#overview").is_visible() and page.evaluate(inside + "('hot')"), "all of it")
            done(page, url.split("/?")[0])
        accessible(browser, url, "wide")


# A vessel through whose wall something seeps, which its model lacks.
VESSEL = """partial block PartialWall
  parameter Real s(min = 0) = 1 "share of the wall that is wet";
  input Real h;
  output Real q;
end PartialWall;
block Tight
  extends PartialWall;
equation
  q = 0;
end Tight;
model Vessel "empties"
  parameter Real k(unit = "1/s", min = 0) = 0.8 "outlet";
  parameter Real h0(unit = "m") = 1 "level at the start";
  Real h(start = h0, fixed = true, unit = "m") "level";
  replaceable Tight wall constrainedby PartialWall(h = h) annotation(__hyd(place(id = "wall")));
equation
  der(h) = -k*h - wall.q;
  annotation(experiment(StopTime = 4));
end Vessel;
"""
SEEP = """within;
package Extras
  block Seep "seeps through the wall"
    extends PartialWall;
    parameter Real c(unit = "1/(m2.s)") = 0.1 "seeping";
  equation
    q = s*c*h*h*h;
    annotation(__hyd(effect(id = "seeping", kind = "physics", at = {"wall"}, adds = c, zero = 0, probe = 0.05, prior = "lognormal(0.05, 1)")));
  end Seep;
end Extras;
"""
STUDY = """without = ["Hyd.Effects"]
file = "vessel.hyd"
[models]
default = "Vessel"
[channels]
h_mm = { variable = "h", scale = 1e3, unit = "mm" }
[conditions]
h0 = "level"
[nuisances]
k = { parameter = "k", relative = 0.1 }
[shots]
time = "t"
trigger_jitter = 0.002
"""


def searched():
    """The report of a search for what the vessel lacks."""
    lab = WORK / "lab"
    (lab / "Extras").mkdir(parents=True, exist_ok=True)
    (lab / "vessel.hyd").write_text(VESSEL)
    (lab / "Extras/package.hyd").write_text(SEEP)
    (lab / "study.toml").write_text(STUDY)
    shots = []
    for name, level in (("a", 0.6), ("b", 1.2), ("c", 2), ("d", 3)):
        rows, h, step = [], level, 1e-3
        for k in range(4001):
            if k % 20 == 0:
                rows.append(f"{k*step},{1e3*h + math.sin(12.9898*k*k + level)}")
            # By the midpoint.
            rate = lambda own: -0.85*own - 0.06*own**3
            h += step*rate(h + step/2*rate(h))
        (lab / f"{name}.csv").write_text("t,h_mm\n" + "\n".join(rows) + "\n")
        shots.append({"file": f"{name}.csv", "level": level})
    (lab / "set.json").write_text(json.dumps({"noise_std": {"h_mm": 0.7}, "experiments": shots}))
    run("discover", lab / "study.toml", "--bench", lab / "set.json", "--library", lab, "--report", lab / "report")
    return lab


def check_shots(browser):
    """The model that a search has written beside the shots, and that of the study."""
    lab = searched()
    report = lab / "report"
    run("next", lab / "study.toml", "--bench", lab / "set.json", "--library", lab, "--report", report)
    with Served(report / "discovered.hyd", report) as url:
        page = open_page(browser, url)
        rows = page.locator("#deviations tbody tr")
        check(rows.count() == 4 and "held out" in page.inner_text("#deviations"), page.inner_text("#deviations"))
        now = page.evaluate("bench.deviations.map((own) => own[0])")
        check(all(0.8 < own < 1.2 for own in now), f"the model is as far from the shots as noise: {now}")
        check("seeps through the wall" in page.inner_text("#sizes") and "1/(m2.s)" in page.inner_text("#sizes"), page.inner_text("#sizes"))
        # Without what was found the shots are farther away; the same parameter in the list of its component follows.
        page.locator(".part").first.click()
        field = page.locator("input[id='s-wall.c']")
        field.fill("0")
        field.press("Enter")
        until(page, "!bench.flying && bench.deviations.every((own) => own[0] > 2)")
        check(page.locator("input[id='p-wall.c']").count() == 0 or page.locator("input[id='p-wall.c']").input_value() == "0", "the other field follows")
        # A shot that is chosen by keys: its conditions, its run in plots and diagram.
        before = page.evaluate("runs.own.columns.get(byName.get('h').o[0])[0]")
        page.get_by_role("button", name="shot 4").press("Enter")
        until(page, "!runs.flying && !runs.waiting && runs.own.key === question() && !view.due")
        after = page.evaluate("runs.own.columns.get(byName.get('h').o[0])[0]")
        check(abs(before - 0.6) < 1e-6 and abs(after - 3) < 1e-6, f"the run begins at the level of the shot: {before}, {after}")
        check(page.evaluate("document.activeElement.textContent") == "shot 4", "the focus stays")
        page.locator(".part").first.click()
        page.get_by_role("button", name="Discovered", exact=True).click()
        check("as in shot 4" in page.inner_text("#parameters"), page.inner_text("#parameters"))
        page.get_by_role("button", name="as it was found").click()
        until(page, "!bench.flying && bench.deviations.every((own) => own[0] < 1.2) && !view.due")
        drawn = page.evaluate("""() => {
          const own = document.querySelector("#channels canvas"), data = own.getContext("2d").getImageData(0, 0, own.width, own.height).data;
          let count = 0;
          for (let k = 3; k < data.length; k += 4) if (data[k] > 0) count += 1;
          return count;
        }""")
        check(drawn > 1500, f"{drawn} pixels of the shot are drawn")
        page.screenshot(path=WORK / "view_shots.png", full_page=True)
        # The next shot, of one condition: the worth stands upwards.
        said = page.inner_text("#next")
        check("To know better how large it is: seeping." in said and "the interval of seeping.c becomes" in said and "times as wide" in said, said)
        check(page.locator("#next-axes select").count() == 0 and page.locator("svg.map .made").count() == 4, "one condition, four shots that were made")
        # From page to page.
        page.get_by_role("link", name="report").click()
        page.get_by_role("link", name="model and shots").click()
        until(page, "Boolean(mainRun() && mainRun().times.length > 0)")
        done(page, url.split("/?")[0])
        accessible(browser, url, "shots")
    with Served(lab / "study.toml", "--bench", lab / "set.json") as url:
        page = open_page(browser, url)
        before = [own[0] for own in page.evaluate("bench.deviations")]
        check(all(own > 3 for own in before), "as the drawings say the model is far from the shots")
        # What may be off, by keys: the table follows, and so does the parameter in the list of its component.
        said = page.inner_text("#slack")
        check("Parameters (1)" in said and "expected 0.8 1/s ± 10 %" in said, said)
        page.get_by_label("k, what may be off, by slider").focus()
        for _ in range(2):
            page.keyboard.press("PageUp")
        until(page, "!bench.flying && !bench.waiting && !runs.flying && runs.own.key === question() && !view.due")
        after = [own[0] for own in page.evaluate("bench.deviations")]
        check(all(0 < now < old - 1 for now, old in zip(after, before)), f"nearer to the shots: {before}, {after}")
        value = page.locator("input[id='o-k']").input_value()
        check(0.85 < float(value) < 0.95 and "σ above" in page.inner_text("#slack"), f"{value}: {page.inner_text('#slack')}")
        check(page.locator("input[id='p-k']").input_value() == value, "the other field follows")
        check(page.evaluate("document.activeElement.getAttribute('aria-label')") == "k, what may be off, by slider", "the focus stays")
        # Of one shot alone: it belongs to the shot that is chosen.
        check("Shot 1 alone" in page.inner_text("#slack"), page.inner_text("#slack"))
        page.get_by_role("button", name="shot 3").click()
        page.get_by_text("Shot 3 alone").click()
        field = page.get_by_label("trigger (shot 3)", exact=False).first
        field.fill("0.004")
        until(page, "!bench.flying && !bench.waiting && !runs.flying && runs.own.key === question()")
        moved = [own[0] for own in page.evaluate("bench.deviations")]
        check(moved[2] != after[2] and [moved[0], moved[1], moved[3]] == [after[0], after[1], after[3]], f"in its shot alone: {after}, {moved}")
        page.screenshot(path=WORK / "view_slack.png", full_page=True)
        page.get_by_role("button", name="all as expected").click()
        until(page, "!bench.flying && !bench.waiting && !isChanged()")
        again = [own[0] for own in page.evaluate("bench.deviations")]
        check(again == before, f"as it was: {before}, {again}")
        done(page, url.split("/?")[0])
        accessible(browser, url, "study")


def check_written(browser):
    run("simulate", DRIVE, "--set", "p0=8e6", "--result", WORK / "low.csv")
    run("view", DRIVE, WORK / "low.csv", "--output", WORK / "view.html")
    url = (WORK / "view.html").as_uri()
    page = open_page(browser, url)
    check("parameters are fixed in this file" in page.inner_text("#status"), page.inner_text("#status"))
    check(page.locator("#legend li").count() == 2, "the other run is beside")
    check(page.locator("input[type=range]").count() == 1, "no slider but that of the time")
    supply = page.evaluate("[valueAt(allRuns()[0], 'p_0', 0.02), valueAt(allRuns()[1], 'p_0', 0.02)]")
    check(abs(supply[0] - 10e6) < 1e4 and abs(supply[1] - 8e6) < 1e4, f"both runs have their values: {supply}")
    done(page, "file:")
    accessible(browser, url, "written")


with sync_playwright() as play:
    names = ("chromium", "chromium-browser", "google-chrome", "chrome")
    program = next((path for path in map(shutil.which, names) if path), None)
    check(program, "a Chromium is installed")
    browser = play.chromium.launch(executable_path=program, args=ARGUMENTS)
    check_served(browser)
    check_drawn(browser)
    check_placed(browser)
    check_finding(browser)
    check_wide(browser)
    check_shots(browser)
    check_written(browser)
    browser.close()
print("pages of hyd view in a browser: as they should be")
