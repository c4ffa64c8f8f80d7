"use strict";
// Draws DATA: a section of what stands out, one of the shots, and one for each channel with curves and findings.
const COLOURS = ["#2f6db3", "#c4581d", "#2d7d46", "#8a4fa3", "#b08a1e", "#1d8a8a", "#b33a5e", "#5b6675", "#6a8f1f", "#3f4fb0"];
const colour = (k) => COLOURS[k % COLOURS.length];
const hidden = new Set();
const charts = [];

function add(parent, tag, text, attributes = {}) {
  const own = document.createElement(tag);
  if (text !== undefined && text !== null) own.textContent = text;
  for (const [name, value] of Object.entries(attributes)) own.setAttribute(name, value);
  parent.append(own);
  return own;
}

function number(value, digits = 3) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e-3 && size < 1e5 ? String(Number(value.toPrecision(digits))) : value.toExponential(digits - 1);
}

const withUnit = (value, unit) => value === null || value === undefined ? "–" : `${number(value)} ${unit}`.trim();

function table(parent, heads, rows) {
  const own = add(add(parent, "div", null, { class: "scroll" }), "table");
  const head = add(add(own, "thead"), "tr");
  heads.forEach((text, k) => add(head, "th", text, { class: k > 0 ? "n" : "" }));
  const body = add(own, "tbody");
  for (const row of rows) {
    const line = add(body, "tr");
    row.forEach((cell, k) => {
      const [text, bad] = Array.isArray(cell) ? cell : [cell, false];
      add(line, "td", text, { class: `${k > 0 ? "n" : ""} ${bad ? "bad" : ""}` });
    });
  }
}

// Round numbers between two ends.
function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw) ?? raw;
  const all = [];
  for (let k = Math.ceil(low / step); k * step <= high * (1 + 1e-12) + 1e-12 * step; k += 1) all.push(k * step);
  return all;
}

class Chart {
  constructor(parent, channel) {
    this.channel = channel;
    this.svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    parent.append(this.svg);
    this.hover = add(parent, "div", "", { class: "hover" });
    this.whole();
    this.svg.addEventListener("pointerdown", (event) => { this.from = this.time(event); });
    this.svg.addEventListener("pointermove", (event) => this.point(event));
    this.svg.addEventListener("pointerup", (event) => {
      const to = this.time(event), [a, b] = [Math.min(this.from, to), Math.max(this.from, to)];
      if (b - a > 0.01 * (this.t1 - this.t0)) charts.forEach((chart) => { [chart.t0, chart.t1] = [a, b]; chart.draw(); });
    });
    this.svg.addEventListener("dblclick", () => charts.forEach((chart) => { chart.whole(); chart.draw(); }));
  }

  whole() {
    this.t0 = Math.min(...DATA.shots.map((shot) => shot.from));
    this.t1 = Math.max(...DATA.shots.map((shot) => shot.to));
  }

  time(event) {
    const box = this.svg.getBoundingClientRect();
    return this.t0 + (event.clientX - box.left - this.left) / (this.width - this.left - 8) * (this.t1 - this.t0);
  }

  shown() {
    return this.channel.shots.filter((shot) => !hidden.has(shot.number));
  }

  make(tag, attributes, text) {
    const own = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) own.setAttribute(name, value);
    if (text !== undefined) own.textContent = text;
    this.svg.append(own);
  }

  draw() {
    this.width = this.svg.clientWidth || 900;
    const height = 260, below = 34;
    this.left = 64;
    this.svg.setAttribute("height", height);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${height}`);
    this.svg.replaceChildren();
    let low = Infinity, high = -Infinity;
    for (const shot of this.shown()) {
      shot.values.forEach((value, k) => {
        if (value === null || shot.times[k] < this.t0 || shot.times[k] > this.t1) return;
        low = Math.min(low, value);
        high = Math.max(high, value);
      });
    }
    if (!(high >= low)) return;
    const margin = 0.05 * (high - low) || Math.abs(high) || 1;
    [low, high] = [low - margin, high + margin];
    const x = (t) => this.left + (t - this.t0) / (this.t1 - this.t0) * (this.width - this.left - 8);
    const y = (value) => 8 + (high - value) / (high - low) * (height - below - 8);
    for (const tick of ticks(low, high, 5)) {
      this.make("line", { x1: this.left, x2: this.width - 8, y1: y(tick), y2: y(tick), class: "grid" });
      this.make("text", { x: this.left - 6, y: y(tick) + 4, "text-anchor": "end" }, number(tick, 4));
    }
    for (const tick of ticks(this.t0, this.t1, 8)) {
      this.make("line", { x1: x(tick), x2: x(tick), y1: 8, y2: height - below, class: "grid" });
      this.make("text", { x: x(tick), y: height - below + 15, "text-anchor": "middle" }, number(tick, 4));
    }
    this.make("text", { x: this.width - 8, y: height - 4, "text-anchor": "end" }, "s");
    this.make("text", { x: 4, y: height - 4 }, this.channel.unit);
    if (this.t0 < 0 && this.t1 > 0) this.make("line", { x1: x(0), x2: x(0), y1: 8, y2: height - below, class: "zero" });
    for (const shot of this.shown()) {
      let path = "", open = false;
      shot.times.forEach((t, k) => {
        const inside = shot.values[k] !== null && t >= this.t0 && t <= this.t1;
        if (inside) path += `${open ? "L" : "M"}${x(t).toFixed(1)} ${y(shot.values[k]).toFixed(1)}`;
        open = inside;
      });
      const place = DATA.shots.findIndex((own) => own.number === shot.number);
      if (path) this.make("path", { d: path, stroke: colour(place), class: "curve" });
      for (const mark of shot.marks.filter((own) => own.time >= this.t0 && own.time <= this.t1)) {
        const near = shot.times.reduce((best, t, k) => Math.abs(t - mark.time) < Math.abs(shot.times[best] - mark.time) ? k : best, 0);
        if (shot.values[near] !== null) this.make("circle", { cx: x(mark.time), cy: y(shot.values[near]), r: 5, class: "spike" });
      }
    }
  }

  point(event) {
    const t = this.time(event);
    if (t < this.t0 || t > this.t1) return;
    const parts = this.shown().map((shot) => {
      const k = shot.times.reduce((best, own, at) => Math.abs(own - t) < Math.abs(shot.times[best] - t) ? at : best, 0);
      return `${shot.number}: ${number(shot.values[k], 5)}`;
    });
    this.hover.textContent = `${number(t, 5)} s  –  shot ${parts.join(",  ")}`;
  }
}

function standsOut(main) {
  const own = add(main, "section", null, { class: "wide", id: "notes" });
  add(own, "h2", "What stands out");
  const list = add(own, "ul");
  for (const channel of DATA.channels) for (const note of channel.notes) add(list, "li", `${channel.name}: ${note}`);
  if (!list.children.length) add(own, "p", "Nothing: no drift, spikes, dropouts, gaps or clipping, no hum in records long enough to show it, and no noise other than what is stated.");
  const rows = DATA.channels.map((channel) => [channel.words ? `${channel.name} (${channel.words})` : channel.name,
    withUnit(channel.stated, channel.unit), withUnit(channel.noise, channel.unit), withUnit(channel.quiet, channel.unit)]);
  table(own, ["noise", "stated, with rounding", "by differences of neighbours", "before the trigger"], rows);
}

function repeats(main) {
  const own = add(main, "section", null, { class: "wide", id: "repeats" });
  add(own, "h2", "Repeats");
  if (!DATA.groups.length) {
    add(own, "p", "No two shots have the same recorded conditions, so nothing shows how well the bench repeats itself.");
    return;
  }
  add(own, "p", "Shots of the same recorded conditions: how far they scatter about their mean, against the noise of single samples.");
  const rows = DATA.channels.flatMap((channel) => channel.repeats.map((group) => [
    `${channel.name}, shots ${group.shots.join(", ")}`, [withUnit(group.sigma, channel.unit), group.sigma > 2 * channel.noise],
    withUnit(group.level, channel.unit), withUnit(channel.noise, channel.unit),
    `${withUnit(group.largest, channel.unit)} at ${number(group.time)} s`]));
  table(own, ["", "from shot to shot", "of that the level", "noise", "largest"], rows);
}

function shots(main) {
  const own = add(main, "section", null, { class: "wide", id: "shots" });
  add(own, "h2", "Shots");
  add(own, "p", "A shot is hidden or shown by its button. Drag in a picture to look closer, double-click to see all.");
  const bar = add(own, "div", null, { class: "bar" });
  DATA.shots.forEach((shot, k) => {
    const button = add(bar, "button", `shot ${shot.number}`);
    const show = () => { button.style.borderBottom = `3px solid ${hidden.has(shot.number) ? "var(--line)" : colour(k)}`; };
    show();
    button.addEventListener("click", () => {
      if (!hidden.delete(shot.number)) hidden.add(shot.number);
      show();
      charts.forEach((chart) => chart.draw());
    });
  });
  const names = [...new Set(DATA.shots.flatMap((shot) => Object.keys(shot.conditions)))].filter((name) => name !== "shot");
  const rows = DATA.shots.map((shot) => [`${shot.number}  ${shot.file}`, shot.samples, `${number(shot.from)} to ${number(shot.to)}`,
    shot.period ? number(1 / shot.period, 4) : "–", [`${number(100 * shot.uneven)} %`, shot.uneven > 0.01],
    ...names.map((name) => number(shot.conditions[name], 6))]);
  table(own, ["shot", "samples", "s", "Hz", "uneven steps", ...names], rows);
}

function channels(main) {
  for (const channel of DATA.channels) {
    const own = add(main, "section", null, { class: "wide channel" });
    const unit = channel.unit ? ` in ${channel.unit}` : "";
    add(own, "h2", `${channel.name}${channel.words ? ", " + channel.words : ""}${unit}`);
    const chart = new Chart(own, channel);
    charts.push(chart);
    const hum = (shot) => shot.hum ? [`${number(shot.hum.amplitude)} at ${shot.hum.frequency} Hz`, true] : shot.hum_seen ? "none" : "too short";
    const clipped = (shot) => shot.clipped.length ? [shot.clipped.map((own) => `${own.samples} at ${number(own.value)}`).join(", "), true] : "none";
    table(own, ["shot", "smallest", "largest", "noise by differences", "before the trigger", "step", "level before", "drift before", "hum",
      "spikes", "dropouts", "missing", "clipped"], channel.shots.map((shot) => [`shot ${shot.number}`, number(shot.low), number(shot.high),
      number(shot.noise), number(shot.quiet), number(shot.step), number(shot.level, 5),
      shot.drift === null ? "none" : [number(shot.drift), true], hum(shot), [shot.spikes, shot.spikes > 0], [shot.stuck.length, shot.stuck.length > 0], [shot.gaps, shot.gaps > 0],
      clipped(shot)]));
  }
}

const main = document.getElementById("main");
document.getElementById("sentence").textContent = DATA.title ? `${DATA.title}: ${DATA.set}` : DATA.set;
document.getElementById("about").textContent =
  `${DATA.shots.length} shots, ${DATA.channels.length} channels, as they were recorded: no model is involved.`;
standsOut(main);
shots(main);
repeats(main);
channels(main);
const drawAll = () => charts.forEach((chart) => chart.draw());
drawAll();
window.addEventListener("resize", drawAll);
