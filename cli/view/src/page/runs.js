// Runs: that of the model as its parameters are now, those of files, those that were kept.

const byName = new Map(DATA.variables.map((own) => [own.n, own]));
const isServed = Boolean(DATA.token);
const canRun = isServed && Boolean(DATA.model && DATA.model.runs);

const runs = {
  // What is set, as text by name.
  set: {},
  // What may be off in the shots of a study, as numbers by name, where no parameter alone says it.
  off: {},
  // A run: label, times, columns by number, and how a variable is found in it.
  own: null,
  files: [],
  kept: [],
  // The question that is under way, and whether another one waits; what got no run, and is not asked for again.
  flying: null, waiting: false, stuck: null,
  // For measurements: what each run took from the question to the picture.
  took: [],
};

// What the address of the page says: parameters for which the model was translated, and behind the hash those that were set before, which component
// and diagram were looked at, and which field was changed.
const address = { set: new Map(), left: {} };
if (isServed) {
  for (const own of new URLSearchParams(location.search).getAll("set")) { const cut = own.indexOf("="); address.set.set(own.slice(0, cut), own.slice(cut + 1)); }
  try { address.left = JSON.parse(decodeURIComponent(location.hash.slice(1))) || {}; } catch { address.left = {}; }
}

// Loads the page with the model translated for these parameters; the others stay as they are.
function load(set, changed) {
  const query = new URLSearchParams({ token: DATA.token });
  for (const [name, value] of set) query.append("set", name + "=" + value);
  const now = { set: runs.set, off: runs.off, shot: DATA.shots ? bench.chosen : 0, path: lists.path, shown: picture.shown ? picture.shown.path : "" };
  const left = JSON.stringify({ ...(DATA.failed ? address.left : now), field: changed });
  location.assign(location.pathname + "?" + query + "#" + encodeURIComponent(left));
}

function translateAgain(name, value) {
  document.getElementById("status").textContent = "the model is translated with " + name + " = " + value;
  load(new Map(address.set).set(name, value), name);
}

// How a variable is found in the run of the model.
function inModel(run, name) {
  const own = byName.get(name);
  if (!own) return null;
  if (own.o) { const column = run.columns.get(own.o[0]); return column ? { column, sign: own.o[1] } : null; }
  if (own.p && run.parameters.length > own.p[0]) return { constant: run.parameters[own.p[0]] * own.p[1] };
  return own.c === undefined ? null : { constant: own.c };
}

function inFile(file) {
  return (run, name) => {
    const k = entry(file.columns, name);
    if (k !== undefined) { const column = run.columns.get(k); return column ? { column, sign: 1 } : null; }
    const constant = entry(file.constants, name);
    return constant === undefined ? null : { constant };
  };
}

function allRuns() {
  return [runs.own, ...runs.kept, ...runs.files].filter(Boolean);
}

// The run whose values are shown: that of the model, else the first file.
function mainRun() {
  return runs.own || runs.files[0] || null;
}

function valueAt(run, name, time) {
  const found = run && run.find(run, name);
  if (!found) return NaN;
  return found.column ? found.sign * interpolated(run.times, found.column, time) : found.constant;
}

// From the first to the last time of all runs.
function span() {
  let from = Infinity, to = -Infinity;
  for (const run of allRuns()) if (run.times.length) { from = Math.min(from, run.times[0]); to = Math.max(to, run.times[run.times.length - 1]); }
  return from <= to ? [from, to] : [0, 1];
}

async function asked(body, path = "/run") {
  const answer = await fetch(path, { method: "POST", headers: { "X-Hyd-Token": DATA.token, "Content-Type": "application/json" }, body: JSON.stringify({ reading: DATA.reading, ...body }) });
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return decoded(await answer.arrayBuffer());
}

// Columns of the model's run that views need.
function wantedColumns() {
  const columns = new Set();
  for (const name of wantedNames()) { const own = byName.get(name); if (own && own.o) columns.add(own.o[0]); }
  return [...columns];
}

const GONE = "hyd view has ended: what is shown stays, nothing can be run";

// What a run depends on.
function question() {
  return JSON.stringify([runs.set, runs.off, conditions()]);
}

// True where something is not as the model says.
function isChanged() {
  return Object.keys(runs.set).length > 0 || Object.keys(runs.off).length > 0;
}

// Runs the model as its parameters are now; at most two questions are under way, and the last one counts.
async function runModel() {
  if (!canRun) return;
  if (runs.flying && performance.now() - runs.flying.begin < 120) { runs.waiting = true; return; }
  const own = { begin: performance.now(), key: question(), columns: wantedColumns() };
  runs.flying = own; runs.waiting = false;
  try {
    const found = await asked({ set: runs.set, off: runs.off, shot: conditions(), columns: own.columns });
    if (found.header.status !== "interrupted") takeRun(found, own);
    // Another page has taken its turn.
    else if (runs.flying === own) runs.waiting = true;
  } catch (error) {
    runs.stuck = own.key;
    say(isGone(error) ? GONE : String(error.message || error));
  }
  if (runs.flying === own) runs.flying = null;
  if (runs.waiting) { runs.waiting = false; runModel(); }
  else fillIn();
}

function isGone(error) {
  return error instanceof TypeError;
}

function takeRun(found, question) {
  // An older answer than the one that is shown.
  if (runs.own && runs.own.begin > question.begin) return;
  runs.stuck = found.header.status === "refused" ? question.key : null;
  if (runs.stuck !== null) { say(found.header.message); return; }
  const keep = runs.own && runs.own.key === question.key ? runs.own.columns : new Map();
  for (const [k, column] of found.columns) keep.set(k, column);
  // A run that ended before its first row has no columns.
  for (const k of question.columns) if (!keep.has(k)) keep.set(k, new Float32Array(found.times.length).fill(NaN));
  runs.own = { label: "this run", times: found.times, parameters: found.parameters, columns: keep, find: inModel, key: question.key, begin: question.begin, header: found.header };
  say(found.header.message);
  tellRun();
  redraw(() => runs.took.push({ from: question.begin, to: performance.now(), run: found.header.ms }));
}

// Columns that views came to need after their run.
async function fillIn() {
  const missing = (run, columns) => columns.filter((k) => !run.columns.has(k));
  const isStuck = runs.stuck === question();
  if (canRun && runs.own && !runs.flying && !isStuck && missing(runs.own, wantedColumns()).length) { runModel(); return; }
  if (!isServed) return;
  for (const [k, file] of runs.files.entries()) {
    const columns = [...wantedNames()].map((name) => entry(DATA.files[k].columns, name)).filter((column) => column !== undefined);
    const open = missing(file, columns).filter((column) => !file.asked.has(column));
    if (!open.length && file.times.length) continue;
    if (!open.length && file.asked.has("times")) continue;
    open.forEach((column) => file.asked.add(column));
    file.asked.add("times");
    try {
      const found = await asked({ file: k, columns: open });
      file.times = found.times; file.header = found.header;
      for (const [column, values] of found.columns) file.columns.set(column, values);
      tellRun();
      redraw();
    } catch (error) { say(String(error.message || error)); }
  }
}

function beginRuns() {
  const isSetHere = ([name, value]) => typeof value === "string" && byName.has(name) && byName.get(name).s === 1;
  if (canRun) runs.set = Object.fromEntries(Object.entries(address.left.set || {}).filter(isSetHere));
  const isOffHere = ([name, value]) => Number.isFinite(value) && DATA.shots && DATA.shots.slack.some((own) => own.name === name && !own.plain);
  if (canRun) runs.off = Object.fromEntries(Object.entries(address.left.off || {}).filter(isOffHere));
  const decode = (text) => decoded(bytesOf(text));
  const written = DATA.runs ? DATA.runs.map(decode) : [];
  if (DATA.model && DATA.model.runs && written.length > DATA.files.length) {
    const found = written.shift();
    runs.own = { label: "this run", ...found, find: inModel, key: question(), begin: 0 };
    if (found.header.message) say(found.header.message);
  }
  runs.files = DATA.files.map((file, k) => ({ label: file.label, find: inFile(file), asked: new Set(), ...(written[k] || { times: [], columns: new Map(), header: {} }) }));
}

// The run as it is now stays beside those to come.
function keepRun() {
  if (!runs.own) return;
  const changes = Object.entries({ ...runs.set, ...runs.off }).map(([name, value]) => name + " = " + value);
  const columns = new Map(runs.own.columns), shot = conditions() === undefined ? [] : ["shot " + chosenShot().number];
  runs.kept.push({ ...runs.own, columns, label: "kept: " + [...shot, changes.join(", ") || "as the model says"].join(", ") });
  if (runs.kept.length > 5) runs.kept.shift();
  redraw();
}

function tellRun() {
  const run = mainRun(), parts = [];
  if (runs.own && runs.own.header) {
    const { status, rows, ms } = runs.own.header;
    const words = { done: "run complete", terminated: "the model ended the run", failed: "the run failed" }[status] || status;
    parts.push(words + ", " + rows + " rows" + (isServed && ms ? ", " + short(ms, 2) + " ms" : ""));
  } else if (run) parts.push(run.times.length + " rows");
  if (!isServed && DATA.model && DATA.model.runs) parts.push("parameters are fixed in this file: hyd view without --output lets them vary");
  const wrong = runs.files.map((file) => file.header && file.header.message).filter(Boolean);
  for (const warning of (runs.own && runs.own.header && runs.own.header.warnings) || []) wrong.push("warning: " + warning.trim());
  document.getElementById("status").textContent = [...parts, ...wrong].join(" · ");
}

function say(words) {
  const place = document.getElementById("wrong");
  if (place.textContent !== (words || "")) place.textContent = words || "";
}
