"use strict";
// The proposed shots, the map of what a shot is worth over the conditions, and what the rivals would show.

const N = DATA.next, main = document.getElementById("main");
const ESCAPES = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
const safe = (text) => String(text ?? "").replace(/[&<>"]/g, (c) => ESCAPES[c]);
const short = (value) => {
  if (value === null || value === undefined) return "-";
  const size = Math.abs(value);
  return value === 0 ? "0" : size >= 1e5 || size < 1e-3 ? value.toExponential(3).replace(/\.?0+e/, "e") : String(Number(value.toPrecision(4)));
};

function section(title, inside, note = "", wide = false) {
  const part = document.createElement("section");
  if (wide) part.className = "wide";
  part.innerHTML = `<h2>${safe(title)}</h2>${note ? `<p>${note}</p>` : ""}${inside}`;
  main.append(part);
  return part;
}

function begin() {
  const aims = {
    "tell apart": `To tell apart: ${(N.models ?? []).join(", ")}`,
    reveal: `To show what could have hidden: ${(N.models ?? []).slice(1).join(", ")}`,
    narrow: "To know better how large it is",
  };
  const sentence = N.nothing ?? aims[N.aim];
  document.title = "The next shot: " + N.set;
  document.getElementById("sentence").textContent = sentence.charAt(0).toUpperCase() + sentence.slice(1);
  const points = (N.points ?? []).length;
  document.getElementById("about").textContent = `Set ${N.set}, ${N.status}.` + (points ? ` ${points} points were run.` : "");
}

// What no shot settles, and what was left out.
function beside() {
  const words = [
    ...(N.never ?? []).map((own) => `Within these ranges ${own}.`),
    ...(N.models_left_out ? [`${N.models_left_out} more rivals are left out, whose costs are larger.`] : []),
    ...((N.not_run ?? []).length ? [`The model does not run at the typical size of ${N.not_run.join(", ")}.`] : []),
    ...(N.failed?.points ? [`${N.failed.points} points cannot be run by every model; the first: ${N.failed.why}`] : []),
    ...(N.beyond ? [`At ${N.beyond} points a channel would leave what it may show.`] : []),
    ...(N.forbidden ? [`${N.forbidden} points are forbidden by the limits of the study.`] : []),
  ];
  if (words.length) section("Beside these", `<ul>${words.map((own) => `<li>${safe(own)}</li>`).join("")}</ul>`, "", true);
}

function shots() {
  N.shots.forEach((shot, k) => {
    const settings = shot.settings.map((own) => {
      const [name, value] = own.split(" = ");
      // With a prefix where there is one: the plain number stands in next.json.
      return `<div><b>${safe(/\((.*)\)$/.exec(value)?.[1] ?? value)}</b><span>${safe(name)}</span></div>`;
    });
    const pairs = (shot.evidence ?? []).map((own) => {
      const shows = own.shows ? `${own.shows.deviations.toFixed(1)} &sigma; in ${safe(own.shows.channel)} at ${short(own.shows.time)} s` : "";
      const against = N.aim === "tell apart" ? `<td>${safe(own.against)}</td>` : "";
      const size = own.size === null || own.size === undefined ? "" : ` of size ${short(own.size)}`;
      return `<tr><td>${safe(own.if)}${size}</td>${against}<td class="n">${short(own.expected)}</td><td class="n">${own.fitted === null ? "" : short(own.fitted)}</td>` +
        `<td class="n">${(100 * own.decides).toFixed(0)} %</td><td>${shows}</td></tr>`;
    });
    const sizes = (shot.narrows ?? []).map((own) => `<tr><td>${safe(own.size)}</td><td class="n">${own.interval_times.toFixed(2)}</td></tr>`);
    const head = N.aim === "tell apart"
      ? "<th>if it is</th><th>growth of the cost of</th><th class=n>expected</th><th class=n>fitted</th><th class=n>decides</th><th>differs the most by</th>"
      : "<th>if there is</th><th class=n>drop of the cost</th><th></th><th class=n>is seen</th><th>differs the most by</th>";
    const list = sizes.length
      ? `<table><thead><tr><th>size</th><th class="n">interval, times as wide</th></tr></thead><tbody>${sizes.join("")}</tbody></table>`
      : `<div class="scroll" tabindex="0"><table><thead><tr>${head}</tr></thead><tbody>${pairs.join("")}</tbody></table></div>`;
    const note = k === 0 ? "" : "Together with the shots before it.";
    section(`Shot ${k + 1}, like shot ${shot.like} in all else` + (shot.cost === 1 ? "" : `, cost ${short(shot.cost)}`), `<div class="figures">${settings.join("")}</div>${list}`, note, true);
  });
}

// What a single shot is worth over two of the conditions; a click on a title changes an axis.
function map() {
  const axes = N.vary ?? [], points = N.points ?? [];
  if (!points.length) return;
  const part = section("What a shot is worth", '<div class="bar"></div><div class="place"></div>',
    "Every point was run with every model; dark is worth most. Rings are the proposed shots, crosses those that were made.");
  const state = { x: 0, y: Math.min(1, axes.length - 1) };
  const best = Math.max(...points.map((own) => own.worth ?? 0), 1e-12);
  const draw = () => {
    const bar = part.querySelector(".bar");
    bar.replaceChildren(...["x", "y"].flatMap((side) => axes.length < 3 ? [] : axes.map((axis, k) => {
      const button = document.createElement("button");
      button.textContent = `${side}: ${axis.condition}`;
      button.className = state[side] === k ? "on" : "";
      button.onclick = () => { state[side] = k; draw(); };
      return button;
    })));
    const W = 560, H = 380, box = { x0: 64, x1: 546, y0: 12, y1: 336 };
    const scale = (axis, from, to) => (value) => from + (to - from) * (value - axis.low) / (axis.high - axis.low);
    const one = axes.length === 1, X = axes[state.x], x = scale(X, box.x0 + 8, box.x1 - 8);
    const y = one ? scale({ low: 0, high: best }, box.y1 - 8, box.y0 + 8) : scale(axes[state.y], box.y1 - 8, box.y0 + 8);
    const at = (values, worth) => [x(values[state.x]), one ? y(worth) : y(values[state.y])];
    const dots = [...points].sort((a, b) => a.worth - b.worth).map((own) => {
      const [cx, cy] = at(own.values, own.worth), part = Math.max(0, own.worth) / best;
      const words = axes.map((axis, k) => `${axis.condition} = ${short(own.values[k])}`).join(", ");
      return `<circle cx="${cx}" cy="${cy}" r="6" fill="hsl(22 78% ${(92 - 50 * part).toFixed(0)}%)"><title>${safe(words)}: ${short(own.worth)}</title></circle>`;
    });
    const crosses = (N.made ?? []).map((own) => {
      const [cx, cy] = at(own.values, 0), inside = cx >= box.x0 && cx <= box.x1 && cy >= box.y0 && cy <= box.y1;
      return inside ? `<path d="M${cx - 5} ${cy - 5}l10 10m0 -10l-10 10" fill="none" stroke="var(--ink)" stroke-width="1.5"><title>shot ${own.number}, which was made</title></path>` : "";
    });
    const rings = N.shots.map((shot, k) => {
      const values = axes.map((axis) => shot.conditions[axis.condition]);
      const same = points.find((own) => own.values.every((value, i) => value === values[i]));
      const [cx, cy] = at(values, same ? same.worth : 0);
      return `<circle cx="${cx}" cy="${cy}" r="10" fill="none" stroke="var(--ink)" stroke-width="2"/><text x="${cx + 13}" y="${cy + 4}" style="fill:var(--ink)">${k + 1}</text>`;
    });
    const label = one ? "worth" : axes[state.y].condition, low = one ? 0 : axes[state.y].low, high = one ? best : axes[state.y].high;
    part.querySelector(".place").innerHTML = `<svg class="map" viewBox="0 0 ${W} ${H}" role="img" aria-label="map of the worth of a shot">` +
      `<rect x="${box.x0}" y="${box.y0}" width="${box.x1 - box.x0}" height="${box.y1 - box.y0}" fill="none" stroke="var(--line)"/>${dots.join("")}${crosses.join("")}${rings.join("")}` +
      `<text x="${box.x0}" y="${box.y1 + 16}">${short(X.low)}</text><text x="${box.x1}" y="${box.y1 + 16}" text-anchor="end">${short(X.high)}</text>` +
      `<text x="${(box.x0 + box.x1) / 2}" y="${box.y1 + 32}" text-anchor="middle">${safe(X.condition)}</text>` +
      `<text x="${box.x0 - 6}" y="${box.y1}" text-anchor="end">${short(low)}</text><text x="${box.x0 - 6}" y="${box.y0 + 10}" text-anchor="end">${short(high)}</text>` +
      `<text transform="translate(14 ${(box.y0 + box.y1) / 2}) rotate(-90)" text-anchor="middle">${safe(label)}</text></svg>`;
  };
  draw();
}

// The record if one model is right, and another one fitted to all shots with it.
function predicted() {
  const all = DATA.curves;
  if (!all.length) return;
  const part = section("What they would show", '<div class="bar"><select aria-label="shot and pair"></select></div><div class="bar channels"></div><div class="place"></div>',
    "Points: the record if one is right, without noise. Line: the other one, fitted to all shots with this record. Band: two standard deviations of the noise.");
  const farthest = (own) => {
    let most = [0, own.channels[0].name];
    for (const channel of own.channels) channel.record.forEach((value, k) => {
      const apart = Math.abs(value - channel.fitted[k]) / channel.sigma;
      if (apart > most[0]) most = [apart, channel.name];
    });
    return most[1];
  };
  const state = { own: 0, channel: farthest(all[0]) };
  const choice = (where, list, pick) => part.querySelector(where).replaceChildren(...list.map(([label, on, value]) => {
    const button = document.createElement("button");
    button.textContent = label;
    button.className = on ? "on" : "";
    button.onclick = () => { pick(value); draw(); };
    return button;
  }));
  const select = part.querySelector("select");
  select.replaceChildren(...all.map((own, k) => new Option(`shot ${own.shot + 1}: if it is ${own.if}, ${own.against} fitted`, k)));
  select.onchange = () => { state.own = Number(select.value); state.channel = farthest(all[state.own]); draw(); };
  const draw = () => {
    const own = all[state.own];
    choice(".channels", own.channels.map((channel) => [channel.name, channel.name === state.channel, channel.name]), (name) => { state.channel = name; });
    const channel = own.channels.find((one) => one.name === state.channel), t = own.times;
    const values = [...channel.record, ...channel.fitted].filter((value) => value !== null);
    const low = Math.min(...values) - 2 * channel.sigma, high = Math.max(...values) + 2 * channel.sigma;
    const W = 640, H = 320, box = { x0: 70, x1: 632, y0: 8, y1: 286 };
    const x = (time) => box.x0 + (box.x1 - box.x0) * (time - t[0]) / (t[t.length - 1] - t[0]);
    const y = (value) => box.y1 - (box.y1 - box.y0) * (value - low) / (high - low);
    const line = (list, shift) => list.map((value, k) => `${x(t[k]).toFixed(1)},${y(value + shift).toFixed(1)}`);
    const band = [...line(channel.record, 2 * channel.sigma), ...line(channel.record, -2 * channel.sigma).reverse()].join(" ");
    const dots = channel.record.map((value, k) => `<circle cx="${x(t[k]).toFixed(1)}" cy="${y(value).toFixed(1)}" r="1.3" fill="var(--seen)"/>`).join("");
    part.querySelector(".place").innerHTML = `<svg class="curve" viewBox="0 0 ${W} ${H}" role="img" aria-label="predicted records">` +
      `<polygon points="${band}" fill="var(--noise)"/>${dots}<polyline points="${line(channel.fitted, 0).join(" ")}" fill="none" stroke="var(--more)" stroke-width="1.5"/>` +
      `<rect x="${box.x0}" y="${box.y0}" width="${box.x1 - box.x0}" height="${box.y1 - box.y0}" fill="none" stroke="var(--line)"/>` +
      `<text x="${box.x0 - 5}" y="${box.y1}" text-anchor="end">${short(low)}</text><text x="${box.x0 - 5}" y="${box.y0 + 10}" text-anchor="end">${short(high)}</text>` +
      `<text x="${box.x0}" y="${box.y1 + 16}">${short(t[0])} s</text><text x="${box.x1}" y="${box.y1 + 16}" text-anchor="end">${short(t[t.length - 1])} s</text>` +
      `<text x="${box.x0 + 6}" y="${box.y0 + 14}">${safe(channel.name)}</text></svg>`;
  };
  draw();
}

begin();
shots();
map();
predicted();
beside();
