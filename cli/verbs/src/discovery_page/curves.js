"use strict";
// Measured, and two models over time, with residuals in standard deviations of the noise below.
// Drag across: zoom. Wheel: zoom about the pointer. Double click: whole record.

// Without an extended model its curves would cover those of the base.
const MODELS = { base: ["base model", "base"], more: ["extended model", "extended"] };
function curveView(root, shots, channels, first, isExtended, models = MODELS) {
  const state = { shot: first.shot, channel: first.channel, from: 0, to: 1, drag: null, at: null };
  root.innerHTML =
    '<div class="bar"><span class="shots"></span><span class="gap"></span><span class="channels"></span>' +
    '<span><span class="key" style="background:var(--seen)"></span>measured' +
    '<span class="key" style="background:var(--base)"></span>' + models.base[0] +
    (isExtended ? '<span class="key" style="background:var(--more)"></span>' + models.more[0] : "") + "</span></div>" +
    '<canvas class="above" style="height:330px"></canvas><canvas class="below" style="height:150px"></canvas>' +
    '<div class="hover">Drag: zoom. Wheel: zoom. Double click: whole record.</div>';
  const above = root.querySelector(".above"), below = root.querySelector(".below"), hover = root.querySelector(".hover");

  const choice = (where, list, now, label, pick) => {
    const bar = root.querySelector(where);
    bar.replaceChildren(...list.map((value) => {
      const button = document.createElement("button");
      button.textContent = label(value);
      button.className = value === now ? "on" : "";
      button.onclick = () => { pick(value); draw(); };
      return button;
    }));
  };
  const series = () => shots[state.shot].channels.find((own) => own.name === state.channel);
  const meta = () => channels.find((own) => own.name === state.channel);

  function span() {
    const times = shots[state.shot].times, length = times[times.length - 1] - times[0];
    return [times[0] + state.from * length, times[0] + state.to * length];
  }

  function draw() {
    choice(".shots", shots.map((_, k) => k), state.shot,
      (k) => "shot " + shots[k].number + (shots[k].held_out ? " (held out)" : ""),
      (k) => { state.shot = k; if (!series()) state.channel = shots[k].channels[0].name; });
    choice(".channels", shots[state.shot].channels.map((own) => own.name), state.channel, (name) => name,
      (name) => { state.channel = name; });
    const own = series(), info = meta(), times = shots[state.shot].times, [t0, t1] = span();
    const sigma = info.sigma, left = new Set(own.left_out);
    const keep = (values) => values.map((value, k) => (left.has(k) ? null : value));
    const residual = (values) => values.map((value, k) =>
      left.has(k) || own.measured[k] === null || value === null ? null : (own.measured[k] - value) / sigma);
    plot(above, times, t0, t1, [
      { values: keep(own.measured), color: "--seen", dots: true },
      { values: own.base, color: "--base" },
      ...(isExtended ? [{ values: own.extended, color: "--more" }] : []),
    ], info.name, info.unit, null);
    plot(below, times, t0, t1, [
      { values: residual(own.base), color: "--base" },
      ...(isExtended ? [{ values: residual(own.extended), color: "--more" }] : []),
    ], "residual / sigma", "", [-3, 3]);
  }

  function plot(canvas, times, t0, t1, lines, name, unit, band) {
    const scale = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = width * scale; canvas.height = height * scale;
    const pen = canvas.getContext("2d");
    pen.scale(scale, scale);
    const style = getComputedStyle(document.documentElement), color = (name) => style.getPropertyValue(name).trim();
    const box = { x0: 74, x1: width - 12, y0: 10, y1: height - 30 };
    let low = Infinity, high = -Infinity;
    const shown = times.map((time, k) => k).filter((k) => times[k] >= t0 && times[k] <= t1);
    for (const line of lines) for (const k of shown) {
      const value = line.values[k];
      if (value !== null && value !== undefined) { low = Math.min(low, value); high = Math.max(high, value); }
    }
    if (band) { low = Math.min(low, band[0] * 1.3); high = Math.max(high, band[1] * 1.3); }
    if (!(high > low)) { low -= 1; high += 1; }
    const pad = 0.04 * (high - low); low -= pad; high += pad;
    const x = (time) => box.x0 + (box.x1 - box.x0) * (time - t0) / (t1 - t0);
    const y = (value) => box.y1 - (box.y1 - box.y0) * (value - low) / (high - low);
    canvas.map = { box, t0, t1 };
    pen.font = "11px system-ui, sans-serif"; pen.fillStyle = color("--pale"); pen.strokeStyle = color("--grid"); pen.lineWidth = 1;
    if (band) { pen.fillStyle = color("--noise"); pen.fillRect(box.x0, y(band[1]), box.x1 - box.x0, y(band[0]) - y(band[1])); pen.fillStyle = color("--pale"); }
    const [factor, sized] = scaled(Math.max(Math.abs(low), Math.abs(high)), unit), title = name + (sized ? " / " + sized : "");
    for (const tick of ticks(low / factor, high / factor, 5)) {
      const at = y(tick * factor);
      pen.beginPath(); pen.moveTo(box.x0, at); pen.lineTo(box.x1, at); pen.stroke();
      pen.textAlign = "right"; pen.textBaseline = "middle"; pen.fillText(short(tick), box.x0 - 6, at);
    }
    const [per, second] = clock(t0, t1);
    for (const tick of ticks(t0 * per, t1 * per, 8)) {
      pen.beginPath(); pen.moveTo(x(tick / per), box.y0); pen.lineTo(x(tick / per), box.y1); pen.stroke();
      pen.textAlign = "center"; pen.textBaseline = "top"; pen.fillText(short(tick), x(tick / per), box.y1 + 5);
    }
    pen.textAlign = "right"; pen.fillText("time / " + second, box.x1, box.y1 + 17);
    pen.textAlign = "left"; pen.textBaseline = "top"; pen.fillText(title, box.x0 + 6, box.y0 + 2);
    pen.save(); pen.beginPath(); pen.rect(box.x0, box.y0, box.x1 - box.x0, box.y1 - box.y0); pen.clip();
    for (const line of lines) {
      pen.strokeStyle = pen.fillStyle = color(line.color); pen.lineWidth = 1.6;
      let begun = false;
      pen.beginPath();
      times.forEach((time, k) => {
        const value = line.values[k];
        if (value === null || value === undefined) { begun = false; return; }
        if (line.dots) { if (time >= t0 && time <= t1) pen.fillRect(x(time) - 1.2, y(value) - 1.2, 2.4, 2.4); }
        else if (begun) pen.lineTo(x(time), y(value));
        else { pen.moveTo(x(time), y(value)); begun = true; }
      });
      if (!line.dots) pen.stroke();
    }
    if (state.drag) {
      pen.fillStyle = "rgba(47,109,179,0.12)";
      pen.fillRect(Math.min(state.drag[0], state.drag[1]), box.y0, Math.abs(state.drag[1] - state.drag[0]), box.y1 - box.y0);
    }
    if (state.at !== null) {
      pen.strokeStyle = color("--pale"); pen.lineWidth = 0.7;
      pen.beginPath(); pen.moveTo(x(state.at), box.y0); pen.lineTo(x(state.at), box.y1); pen.stroke();
    }
    pen.restore();
  }

  function share(canvas, px) {
    const { box } = canvas.map, part = (px - box.x0) / (box.x1 - box.x0);
    return state.from + Math.min(1, Math.max(0, part)) * (state.to - state.from);
  }
  function zoom(from, to) {
    const least = 8 / shots[state.shot].times.length;
    if (to - from < least) return;
    state.from = Math.max(0, from); state.to = Math.min(1, to);
  }
  for (const canvas of [above, below]) {
    canvas.onpointerdown = (event) => { state.drag = [event.offsetX, event.offsetX]; canvas.setPointerCapture(event.pointerId); };
    canvas.onpointermove = (event) => {
      if (state.drag) state.drag[1] = event.offsetX;
      const times = shots[state.shot].times, time = times[0] + share(canvas, event.offsetX) * (times[times.length - 1] - times[0]);
      const k = nearest(times, time), own = series();
      state.at = times[k];
      const value = (list) => (list[k] === null ? "-" : withUnit(list[k], meta().unit));
      const [per, unit] = clock(times[0], times[times.length - 1]);
      hover.textContent = "t = " + short(times[k] * per) + " " + unit + "   measured " + value(own.measured) + "   " + models.base[1] + " " + value(own.base) +
        (isExtended ? "   " + models.more[1] + " " + value(own.extended) : "");
      draw();
    };
    canvas.onpointerup = () => {
      const drag = state.drag; state.drag = null;
      if (drag && Math.abs(drag[1] - drag[0]) > 4) zoom(...[share(canvas, drag[0]), share(canvas, drag[1])].sort((a, b) => a - b));
      draw();
    };
    canvas.onpointerleave = () => { if (!state.drag) { state.at = null; draw(); } };
    canvas.ondblclick = () => { state.from = 0; state.to = 1; draw(); };
    canvas.onwheel = (event) => {
      event.preventDefault();
      const about = share(canvas, event.offsetX), factor = event.deltaY > 0 ? 1.25 : 0.8;
      zoom(about - (about - state.from) * factor, about + (state.to - about) * factor);
      draw();
    };
  }
  window.addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  draw();
  return { show: (shot, channel) => { state.shot = shot; state.channel = channel; draw(); } };
}

// Units per second and their name for a record of this length.
function clock(from, to) {
  return to - from >= 2 ? [1, "s"] : [1e3, "ms"];
}

// Units that take prefixes; others keep powers of ten.
const PREFIXED = new Set(["Pa", "m", "V", "A", "N", "W", "J", "Hz", "F", "H", "Wb", "T", "C", "Ohm", "N.m", "rad/s"]);
const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];

// The factor and the name of a unit in which values up to a size are short.
function scaled(size, unit) {
  if (!unit || unit === "1") return [1, ""];
  const [factor, prefix] = (PREFIXED.has(unit) && PREFIXES.find(([own]) => size >= own * 0.9995)) || [1, ""];
  return [factor, prefix + unit];
}

function withUnit(value, unit) {
  const [factor, name] = scaled(Math.abs(value), unit);
  return short(value / factor) + (name ? " " + name : "");
}

function nearest(times, time) {
  let low = 0, high = times.length - 1;
  while (high - low > 1) { const middle = (low + high) >> 1; if (times[middle] > time) high = middle; else low = middle; }
  return time - times[low] < times[high] - time ? low : high;
}

function ticks(low, high, count) {
  const raw = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw), all = [];
  for (let tick = Math.ceil(low / step) * step; tick <= high; tick += step) all.push(Math.abs(tick) < step * 1e-9 ? 0 : tick);
  return all;
}

function short(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "-";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(3).replace(/\.?0+e/, "e") : String(Number(value.toPrecision(5)));
}
