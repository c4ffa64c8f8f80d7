"use strict";
// Numbers as people read them, and runs as bytes.

// Units that take prefixes; others keep powers of ten.
const PREFIXED = new Set(["Pa", "m", "s", "V", "A", "N", "W", "J", "Hz", "F", "H", "Wb", "T", "C", "Ohm", "N.m", "rad/s"]);
const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];

// A number with a few digits.
function short(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
  return String(Number(value.toPrecision(digits)));
}

// A number for a field, which takes it back: as short as it can be without a loss.
function typed(value) {
  const plain = String(value), power = value.toExponential().replace("e+", "e");
  return plain.length > 8 && power.length < plain.length ? power : plain;
}

// A text with its long numbers as people read them.
function rounded(text) {
  return text.replace(/(?<![\w.])\d+\.\d{5,}(e[+-]?\d+)?/g, (number) => short(Number(number)));
}

// A number with its unit, as `12.5 MPa`.
function withUnit(value, unit, kind) {
  if (!Number.isFinite(value)) return "–";
  if (kind === "Boolean") return value > 0.5 ? "true" : "false";
  if (Array.isArray(kind)) return kind[Math.round(value) - 1] || short(value);
  if (!unit || unit === "1") return short(value);
  if (!PREFIXED.has(unit) || value === 0) return short(value) + " " + unit;
  const size = Math.abs(value);
  // What is a rounding error is no picometre.
  const found = PREFIXES.find(([factor]) => size >= factor * 0.9995);
  return found ? short(value / found[0]) + " " + found[1] + unit : short(value) + " " + unit;
}

// A size as far as its error goes, two digits of that, and its unit.
function measured({ value, stderr, unit }) {
  const words = unit && unit !== "1" ? " " + unit : "";
  if (!(stderr > 0) || !Number.isFinite(value)) return short(value) + words;
  const last = Math.floor(Math.log10(stderr)) - 1, digits = value === 0 ? 1 : Math.floor(Math.log10(Math.abs(value))) - last + 1;
  return short(value, Math.min(12, Math.max(1, digits))) + " \u00b1 " + short(stderr, 2) + words;
}

// The factor and the name of a unit in which values up to a size are short.
function scaled(size, unit) {
  if (!unit || unit === "1") return [1, ""];
  if (!PREFIXED.has(unit) || !(size > 0) || !Number.isFinite(size)) return [1, unit];
  const [factor, prefix] = PREFIXES.find(([own]) => size >= own * 0.9995) || [1, ""];
  return [factor, prefix + unit];
}

// Ticks at round numbers.
function ticks(low, high, count) {
  const raw = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const inside = (s) => Math.floor(high / s + 1e-9) - Math.ceil(low / s - 1e-9) + 1, all = [];
  let step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * (1 - 1e-9));
  if (!(step > 0) || !Number.isFinite(step)) return all;
  // One number on an axis says nothing of its scale.
  if (inside(step) < 2) step = [5, 2, 1, 0.5, 0.2, 0.1].map((m) => m * power).find((s) => s < step && inside(s) > 1) || step;
  for (let tick = Math.ceil(low / step - 1e-9) * step; tick <= high + step * 1e-9 && all.length < 50; tick += step) all.push(Math.abs(tick) < step * 1e-9 ? 0 : tick);
  return all;
}

// The last row at a time or before; of two rows at an event the second.
function rowAt(times, time) {
  let low = 0, high = times.length;
  while (low < high) { const middle = (low + high) >> 1; if (times[middle] <= time) low = middle + 1; else high = middle; }
  return low - 1;
}

// The value of a column at a time, on a straight line between rows.
function interpolated(times, values, time) {
  if (!values || !times.length) return NaN;
  const k = rowAt(times, time);
  if (k < 0) return values[0];
  if (k >= times.length - 1 || times[k + 1] === times[k]) return values[Math.min(k, times.length - 1)];
  const part = (time - times[k]) / (times[k + 1] - times[k]);
  return part === 0 ? values[k] : values[k] + part * (values[k + 1] - values[k]);
}

// Bytes of a run: length and text of a header, times, parameters, columns.
function decoded(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const doubles = (count) => { const own = new Float64Array(buffer, at, count); at += 8 * count; return own; };
  const times = doubles(header.rows), parameters = doubles(header.parameters), columns = new Map();
  for (const k of header.columns) { columns.set(k, new Float32Array(buffer, at, header.rows)); at += 4 * header.rows; }
  return { header, times, parameters, columns };
}

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k += 1) bytes[k] = text.charCodeAt(k);
  return bytes.buffer;
}

// An entry of data by a name that a model gives, which may be that of a method of all objects.
function entry(object, name) {
  return Object.hasOwn(object, name) ? object[name] : undefined;
}

// An element with attributes and what is in it.
function element(name, attributes = {}, ...inner) {
  const own = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) own.addEventListener(key.slice(2), value);
    else if (value === true) own.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) own.setAttribute(key, value);
  }
  own.append(...inner);
  return own;
}
