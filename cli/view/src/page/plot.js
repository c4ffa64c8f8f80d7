// Plots: a panel for each unit, a curve for each chosen variable and run.  Move: values.  Click: time.  Drag: zoom.  Double click: whole.

const plots = {
  // Names of the variables that are drawn over time.
  chosen: [],
  // Figures of the model: the one that is shown, or none.
  figure: null,
  zoom: null, drag: null, panels: [],
};
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3], [12, 5], [4, 6]];
const COLORS = 8;

// A colour of the style; asked for once, as each question costs the browser a look at all styles.
const colors = new Map();
function color(name) {
  if (!colors.has(name)) colors.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return colors.get(name);
}

// What the panels hold: a title, what is drawn over what.
function wantedPanels() {
  if (plots.figure) {
    return plots.figure.plots.map((plot) => ({
      title: plot.title, unit: unitOf(plot.curves[0].y), x: plot.curves[0].x === "time" ? null : plot.curves[0].x,
      curves: plot.curves.map((own) => ({ y: own.y, x: own.x === "time" ? null : own.x, label: own.legend || own.y })),
    }));
  }
  const panels = [];
  for (const name of plots.chosen) {
    const own = byName.get(name) || {}, unit = own.k ? String(own.k) : own.u || "?" + name;
    let panel = panels.find((other) => other.key === unit);
    if (!panel) { panel = { key: unit, title: "", unit: own.u || "", x: null, curves: [] }; panels.push(panel); }
    panel.curves.push({ y: name, x: null, label: name });
  }
  return panels;
}

function unitOf(name) {
  return (byName.get(name) || {}).u || "";
}

// Each variable that is drawn has a colour of its own, whatever the panel.
function colorOf(curve, k) {
  const place = plots.figure ? k : plots.chosen.indexOf(curve.y);
  return "--c" + (place % COLORS);
}

// Rebuilds the panels whose curves have changed.
function layPanels() {
  const wanted = wantedPanels(), place = document.getElementById("panels");
  const key = JSON.stringify([wanted, allRuns().map((run) => run.label)]);
  document.getElementById("no-curves").hidden = wanted.length > 0;
  if (plots.key === key) return;
  plots.key = key;
  plots.panels = wanted.map((panel) => {
    const canvas = element("canvas", { role: "img" }), keys = element("ul", { class: "keys" });
    const curves = panel.curves.map((curve, k) => {
      const swatch = element("span", { class: "key", "aria-hidden": "true" }), value = element("span", { class: "v" });
      swatch.style.borderColor = "var(" + colorOf(curve, k) + ")";
      const item = element("li", {}, swatch, element("span", {}, curve.label), value);
      if (!plots.figure) item.append(element("button", { type: "button", "aria-label": "Do not draw " + curve.y, onclick: () => choose(curve.y, false) }, "×"));
      keys.append(item);
      return { ...curve, color: colorOf(curve, k), value };
    });
    const head = panel.title ? [element("h3", {}, panel.title)] : [];
    const box = element("div", { class: "panel" }, ...head, canvas, keys);
    const made = { ...panel, curves, canvas, box };
    listen(made);
    return made;
  });
  place.replaceChildren(...plots.panels.map((panel) => panel.box));
  const labels = allRuns(), legend = document.getElementById("legend");
  legend.replaceChildren(...(labels.length > 1 ? labels.map((run, k) => {
    const line = element("span", { class: "key", "aria-hidden": "true" });
    line.style.borderTopStyle = ["solid", "dashed", "dotted"][Math.min(k, 2)];
    return element("li", {}, line, " " + run.label);
  }) : []));
}

function drawPlots() {
  layPanels();
  // Sizes are asked for before anything is changed, so that nothing is laid out twice.
  const sizes = plots.panels.map(({ canvas }) => [canvas.clientWidth, canvas.clientHeight]);
  plots.panels.forEach((panel, k) => drawPanel(panel, sizes[k]));
}

// Points of a curve of a run.
function pointsOf(curve, run) {
  const y = run.find(run, curve.y);
  if (!y) return null;
  const x = curve.x ? run.find(run, curve.x) : { times: true };
  return x ? { x, y, times: run.times } : null;
}

function drawPanel(panel, [width, height]) {
  const { canvas } = panel;
  if (!width) return;
  const shown = [];
  allRuns().forEach((run, k) => panel.curves.forEach((curve) => {
    const points = pointsOf(curve, run);
    if (points) shown.push({ points, color: curve.color, dash: DASHES[k % DASHES.length], k });
  }));
  const [first, last] = span(), overTime = !panel.x;
  let [x0, x1] = overTime ? plots.zoom || [first, last] : [Infinity, -Infinity];
  let low = Infinity, high = -Infinity;
  for (const { points } of shown) {
    const { x, y, times } = points;
    for (let k = 0; k < times.length; k += 1) {
      const at = x.times ? times[k] : x.column ? x.sign * x.column[k] : x.constant;
      const value = y.column ? y.sign * y.column[k] : y.constant;
      if (overTime && (at < x0 || at > x1)) continue;
      if (!overTime && Number.isFinite(at)) { if (at < x0) x0 = at; if (at > x1) x1 = at; }
      if (Number.isFinite(value)) { if (value < low) low = value; if (value > high) high = value; }
    }
  }
  if (!(high >= low)) { low = 0; high = 1; }
  // What only rounding moves is a straight line.
  const least = 1e-6 * Math.max(Math.abs(low), Math.abs(high));
  if (high - low <= least) { const pad = high === 0 ? 1 : Math.abs(high) * 0.05; low -= pad; high += pad; }
  if (!(x1 > x0)) { x0 -= 0.5; x1 += 0.5; }
  const pad = 0.05 * (high - low); low -= pad; high += pad;
  const { pen, px, py, box } = framed(canvas, [width, height], [x0, x1], [low, high], panel.unit, panel.x);
  panel.map = { box, x0, x1, low, high, overTime };
  pen.save(); pen.beginPath(); pen.rect(box.x0, box.y0, box.x1 - box.x0, box.y1 - box.y0); pen.clip();
  for (const { points, color: name, dash, k } of [...shown].reverse()) {
    pen.strokeStyle = color(name); pen.lineWidth = k === 0 ? 1.8 : 1.3; pen.setLineDash(dash);
    line(pen, points, px, py, box);
  }
  pen.setLineDash([]);
  if (plots.drag && plots.drag.panel === panel) {
    pen.fillStyle = color("--accent"); pen.globalAlpha = 0.15;
    pen.fillRect(Math.min(plots.drag.from, plots.drag.to), box.y0, Math.abs(plots.drag.to - plots.drag.from), box.y1 - box.y0);
    pen.globalAlpha = 1;
  }
  const time = view.time;
  if (overTime && time >= x0 && time <= x1) {
    pen.strokeStyle = color("--ink"); pen.lineWidth = 1; pen.beginPath(); pen.moveTo(px(time), box.y0); pen.lineTo(px(time), box.y1); pen.stroke();
  } else if (!overTime) for (const { points, color: name } of shown) {
    const at = points.x.column ? points.x.sign * interpolated(points.times, points.x.column, time) : points.x.constant;
    const value = points.y.column ? points.y.sign * interpolated(points.times, points.y.column, time) : points.y.constant;
    pen.fillStyle = color(name); pen.beginPath(); pen.arc(px(at), py(value), 4, 0, 7); pen.fill();
  }
  pen.restore();
  const run = mainRun(), told = [];
  for (const curve of panel.curves) {
    const found = run && run.find(run, curve.y), words = withUnit(valueAt(run, curve.y, time), unitOf(curve.y), (byName.get(curve.y) || {}).k);
    const known = found || !run || !run.times.length || isServed;
    const said = known ? words : byName.has(curve.y) ? "not in this file" : "no such variable";
    if (curve.value.textContent !== said) curve.value.textContent = said;
    told.push(curve.label + " " + said);
  }
  canvas.setAttribute("aria-label", "Curves over " + (overTime ? "time from " + short(x0) + " s to " + short(x1) + " s" : panel.x) + ", between " + short(low) + " and " + short(high) + " " + panel.unit + "; now " + told.join(", "));
}

// A canvas with axes: from where to where, in which unit; over time, or over a variable. Gives the pen and how points become pixels.
function framed(canvas, [width, height], [x0, x1], [low, high], valueUnit, over = null) {
  const scale = window.devicePixelRatio || 1, overTime = !over;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) { canvas.width = Math.round(width * scale); canvas.height = Math.round(height * scale); }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  const box = { x0: 58, x1: width - 10, y0: 20, y1: height - 32 };
  const px = (at) => box.x0 + (box.x1 - box.x0) * (at - x0) / (x1 - x0), py = (value) => box.y1 - (box.y1 - box.y0) * (value - low) / (high - low);
  pen.font = "11px system-ui, sans-serif"; pen.lineWidth = 1; pen.setLineDash([]);
  const pale = color("--pale"), grid = color("--grid");
  pen.strokeStyle = grid; pen.fillStyle = pale; pen.textAlign = "right"; pen.textBaseline = "middle";
  const [factor, prefixed] = scaled(Math.max(Math.abs(low), Math.abs(high)), valueUnit);
  for (const tick of ticks(low / factor, high / factor, 4)) {
    const at = py(tick * factor);
    pen.beginPath(); pen.moveTo(box.x0, at); pen.lineTo(box.x1, at); pen.stroke();
    pen.fillText(short(tick), box.x0 - 6, at);
  }
  const [per, unit] = overTime ? perSecond(x0, x1) : [1, unitOf(over)];
  pen.textAlign = "center"; pen.textBaseline = "top";
  for (const tick of ticks(x0 * per, x1 * per, Math.max(2, Math.floor(width / 90)))) {
    pen.beginPath(); pen.moveTo(px(tick / per), box.y0); pen.lineTo(px(tick / per), box.y1); pen.stroke();
    // The last one would be cut at the edge.
    const words = short(tick), half = pen.measureText(words).width / 2 + 1;
    pen.fillText(words, Math.min(px(tick / per), width - half), box.y1 + 4);
  }
  pen.textAlign = "right"; pen.fillText((overTime ? "time" : over) + (unit ? " / " + unit : ""), box.x1, box.y1 + 18);
  pen.textAlign = "right"; pen.fillText(prefixed, box.x0 - 6, 2);
  return { pen, px, py, box };
}

// A curve; of many rows in a pixel their least and largest values are enough.
function line(pen, { x, y, times }, px, py, box) {
  const at = (k) => (x.times ? times[k] : x.column ? x.sign * x.column[k] : x.constant), value = (k) => (y.column ? y.sign * y.column[k] : y.constant);
  pen.beginPath();
  let begun = false;
  const isDense = x.times && times.length > 4 * (box.x1 - box.x0);
  let pixel = null, low = 0, high = 0, last = 0;
  const flush = () => { if (pixel !== null && low !== high) { pen.lineTo(pixel, low); pen.lineTo(pixel, high); pen.lineTo(pixel, last); } };
  for (let k = 0; k < times.length; k += 1) {
    const h = px(at(k)), v = py(value(k));
    if (!Number.isFinite(h) || !Number.isFinite(v)) { flush(); pixel = null; begun = false; continue; }
    if (isDense && pixel !== null && Math.floor(h) === Math.floor(pixel)) { low = Math.min(low, v); high = Math.max(high, v); last = v; continue; }
    flush();
    if (begun) pen.lineTo(h, v); else { pen.moveTo(h, v); begun = true; }
    pixel = h; low = high = last = v;
  }
  flush();
  pen.stroke();
}

function perSecond(from, to) {
  const length = to - from;
  return length >= 2 ? [1, "s"] : length >= 2e-3 ? [1e3, "ms"] : [1e6, "µs"];
}

function listen(panel) {
  const { canvas } = panel;
  const timeAt = (offset) => {
    const { box, x0, x1 } = panel.map, part = Math.min(1, Math.max(0, (offset - box.x0) / (box.x1 - box.x0)));
    return x0 + part * (x1 - x0);
  };
  canvas.onpointerdown = (event) => { if (panel.map && panel.map.overTime) { plots.drag = { panel, from: event.offsetX, to: event.offsetX }; canvas.setPointerCapture(event.pointerId); } };
  canvas.onpointermove = (event) => { if (plots.drag && plots.drag.panel === panel) { plots.drag.to = event.offsetX; redraw(); } };
  canvas.onpointerup = () => {
    const drag = plots.drag; plots.drag = null;
    if (!drag) return;
    if (Math.abs(drag.to - drag.from) > 6) plots.zoom = [timeAt(drag.from), timeAt(drag.to)].sort((a, b) => a - b);
    else setTime(timeAt(drag.to));
    redraw();
  };
  canvas.onpointercancel = () => { plots.drag = null; redraw(); };
  canvas.ondblclick = () => { plots.zoom = null; redraw(); };
}

// Draws a variable, or no longer.
function choose(name, wanted) {
  plots.chosen = plots.chosen.filter((own) => own !== name);
  if (wanted) plots.chosen.push(name);
  if (wanted && plots.figure) showFigure(null);
  for (const box of document.querySelectorAll("input[data-draw]")) if (box.dataset.draw === name) box.checked = wanted;
  fillIn();
  redraw();
}

function showFigure(figure) {
  plots.figure = figure;
  for (const button of document.querySelectorAll("#figures button")) button.setAttribute("aria-pressed", String(button.figure === figure));
  fillIn();
  redraw();
}

function beginPlots() {
  const figures = (DATA.model && DATA.model.figures) || [];
  const place = document.getElementById("figures");
  figures.forEach((figure, k) => {
    const button = element("button", { type: "button", "aria-pressed": "false", onclick: () => showFigure(plots.figure === figure ? null : figure) }, figure.title || "Figure " + (k + 1));
    button.figure = figure;
    place.append(button);
  });
  place.hidden = !figures.length;
  plots.chosen = DATA.model ? DATA.model.drawn.filter((name) => byName.has(name)) : DATA.variables.filter((own) => !own.v).slice(0, 3).map((own) => own.n);
  if (figures.length) { plots.figure = figures[0]; place.firstChild.setAttribute("aria-pressed", "true"); }
  document.getElementById("keep").hidden = !canRun;
  document.getElementById("forget").hidden = !canRun;
  document.getElementById("keep").onclick = keepRun;
  document.getElementById("forget").onclick = () => { runs.kept = []; redraw(); };
  document.getElementById("clear").onclick = () => { for (const name of [...plots.chosen]) choose(name, false); showFigure(null); };
}
