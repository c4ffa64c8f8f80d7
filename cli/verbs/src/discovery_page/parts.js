"use strict";
// What pages of fits and searches are put together of: sections, tables, values with their errors.

const main = document.getElementById("main");
const ESCAPES = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
const safe = (text) => String(text ?? "").replace(/[&<>"]/g, (c) => ESCAPES[c]);
const fixed = (value, digits = 2) => (value === null || value === undefined ? "" : value.toFixed(digits));

function section(title, inside, { wide = false, note = "" } = {}) {
  const part = document.createElement("section");
  if (wide) part.className = "wide";
  part.innerHTML = "<h2>" + safe(title) + "</h2>" + (note ? "<p>" + note + "</p>" : "") + inside;
  main.append(part);
  return part;
}

// Columns: [title, cell, numeric].
function table(rows, columns, mark = () => false) {
  const head = columns.map(([title, , numeric]) => `<th class="${numeric ? "n" : ""}">${safe(title)}</th>`).join("");
  const body = rows.map((row, k) => `<tr class="${mark(row, k) ? "best" : ""}">` +
    columns.map(([, cell, numeric]) => `<td class="${numeric ? "n" : ""}">${cell(row)}</td>`).join("") + "</tr>").join("");
  return `<div class="scroll" tabindex="0"><table><thead><tr>${head}</tr></thead><tbody>${body}</tbody></table></div>`;
}

// A value as far as its error goes, and two digits of that; with its unit where it has one.
function measured(own) {
  const unit = own.unit && own.unit !== "1" ? " " + safe(own.unit) : "";
  if (!(own.stderr > 0)) return short(own.value) + unit;
  const last = Math.floor(Math.log10(own.stderr)) - 1, digits = own.value === 0 ? 1 : Math.floor(Math.log10(Math.abs(own.value))) - last + 1;
  return `${short(Number(own.value.toPrecision(Math.min(12, Math.max(1, digits)))))} &plusmn; ${short(Number(own.stderr.toPrecision(2)))}${unit}`;
}

// The 95 % interval of a size, which also leaves room for what its law idealises.
function interval(own) {
  if (!own.interval || own.interval.some((end) => end === null)) return "";
  const width = own.interval[1] - own.interval[0], size = Math.max(...own.interval.map(Math.abs));
  const digits = width > 0 && size > 0 ? Math.min(12, Math.max(2, Math.ceil(Math.log10(size / width)) + 2)) : 6;
  const form = own.form ? `, with ${fixed(100 * own.form, 0)} % for the form of the law` : "";
  return ` <small>95 %: ${own.interval.map((end) => short(Number(end.toPrecision(digits)))).join(" to ")}${form}</small>`;
}

// The shot held out, if there is one, and the channel with the largest gap in it.
function firstView(gaps) {
  const shot = Math.max(0, DATA.shots.findIndex((own) => own.held_out));
  const gap = (gaps.heldout || gaps.train).channels, has = (name) => gap[name] && gap[name].before !== null;
  const names = DATA.shots[shot].channels.map((own) => own.name);
  const worst = names.filter(has).sort((a, b) => gap[b].before - gap[a].before)[0];
  return { shot, channel: worst || names[0] };
}
