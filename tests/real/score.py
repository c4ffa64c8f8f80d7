"""The published figure of a bench, for the model that hyd fitted and for the one that it discovered.

Usage: score.py BENCH REPORT HYD   (prints one JSON object; standard library only)

Fitted numbers are those of report.json; nothing is fitted here.
- tanks: RMSE (V) of the level over the whole test record in free simulation.  The benchmark says that both records begin in the same state, so the levels at the
  first sample are those fitted to the beginning of the training record.
- positioning: 100 |F - F_s|/|F| (%) of the force in closed-loop simulation at 1 kHz from the 50th sample on, as the benchmark's own scripts have it, on both records.
  State at the first sample: position and voltage as measured, speed as fitted to the beginning of the training record.
- silverbox: RMSE (mV) of the position over the whole test record in free simulation from rest, the force a spline through its samples.
"""

import csv
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import tomllib

HERE = os.path.dirname(os.path.abspath(__file__))


def nominal(bench, name):
    """The value of a parameter in the texts of the base model."""
    for file in sorted(os.listdir(os.path.join(HERE, bench))):
        if file.endswith((".hyd", ".mo")):
            with open(os.path.join(HERE, bench, file), encoding="utf-8") as text:
                found = re.search(rf"parameter Real {name}(?:\([^)]*\))? = ([-+.0-9e]+)", text.read())
            if found:
                return float(found.group(1))
    raise SystemExit(f"{bench}: no parameter `{name}`")


def fitted(bench, report, when):
    """Parameters of the model, and offset and gain by channel; numbers of one shot alone are those of shot 1."""
    with open(os.path.join(HERE, bench, "bench.toml"), "rb") as file:
        study = tomllib.load(file)
    nuisances, initial = study["nuisances"], study.get("initial", {})
    values, chains = {}, {}
    for entry in report["parameters"]:
        name, shot = re.fullmatch(r"(.*?)(?: \(shot (\d+)\))?", entry["name"]).groups()
        if entry[when] is None or shot not in (None, "1"):
            continue
        value = entry[when]["value"]
        state = name.removesuffix(" at the beginning")
        if state != name and state in initial:
            values[f"{state}.start"] = value
        elif entry["kind"] in ("offset", "gain"):
            chains[name] = value
        elif name in nuisances:
            nuisance = nuisances[name]
            parameter = nuisance if isinstance(nuisance, str) else nuisance["parameter"]
            values[parameter] = value * nominal(bench, parameter) if entry["kind"] == "factor" else value
    return values, chains


def simulated(hyd, bench, text, base, values, run, inputs=None, hold="zero"):
    """Columns of a run of the model that extends `base` with these values; `inputs` are columns that it is driven by, held like this."""
    def modifier(name, value):
        state = name.removesuffix(".start")
        return f"{name} = {value}" if state == name else f"{state}(start = {value}, fixed = true)"

    modifiers = ", ".join(modifier(name, value) for name, value in values.items())
    start, stop, interval, tolerance = run
    text += (
        f"\nmodel Scored\n  extends {base}({modifiers});\n  annotation(experiment(StartTime = {start}, StopTime = {stop}, "
        f"Interval = {interval}, Tolerance = {tolerance}));\nend Scored;\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        model, result = os.path.join(folder, "scored.hyd"), os.path.join(folder, "result.csv")
        with open(model, "w", encoding="utf-8") as file:
            file.write(text)
        command = [hyd, "simulate", model, "--model", "Scored", "--library", os.path.join(HERE, bench), "--result", result]
        if inputs:
            command += ["--input", os.path.join(folder, "inputs.csv"), "--hold", hold]
            with open(command[-3], "w", encoding="utf-8") as file:
                file.write(",".join(inputs) + "\n")
                file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*inputs.values()))
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(done.stdout + done.stderr)
        return table(result)


def table(path):
    """A CSV file as columns of numbers."""
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    columns = zip(*[[float(field) for field in row] for row in rows[1:]])
    return dict(zip(rows[0], columns))


def at_instants(times, values, wanted):
    """Values at these instants; where an event left several rows at one instant, the last."""
    found = {round(t * 1e5): v for t, v in zip(times, values)}
    return [found[round(t * 1e5)] for t in wanted]


def tanks(hyd, text, base, values, chains):
    record = table(os.path.join(HERE, "tanks", "data", "test.csv"))
    times = record["time_s"]
    span = (times[0], times[-1], times[1] - times[0], 1e-7)
    run = simulated(hyd, "tanks", text, base, values, span, {"time": times, "u": record["u_V"]})
    level = at_instants(run["time"], run["sensor_y.y"], times)
    level = [chains.get("gain of y_V", 1) * y + chains.get("offset of y_V", 0) for y in level]
    return {"test": math.sqrt(sum((a - b) ** 2 for a, b in zip(level, record["y_V"])) / len(level))}


def positioning(hyd, text, base, values, _):
    raw = table(os.path.join(HERE, "positioning", "data", "force_1kHz.csv"))
    with open(os.path.join(HERE, "positioning", "set.json"), encoding="utf-8") as file:
        first = json.load(file)["experiments"][0]
    errors = {}
    for record in ("train", "test"):
        measured = raw[f"v_{record}_V"]
        own = table(os.path.join(HERE, "positioning", "data", f"{record}.csv"))
        start = {"r0": first["r0_m"], "dr0": first["dr0_mps"], "q0": own["q_m"][0], "v0": measured[0]}
        start["with_pulses"] = "true" if record == "test" else "false"
        run = simulated(hyd, "positioning", text, base, values | start, (0, 24.84, 1e-3, 1e-8))
        shown = at_instants(run["time"], run["u"], [k * 1e-3 for k in range(len(measured))])
        pairs = list(zip(measured, shown))[49:]
        errors[record] = 100 * math.sqrt(sum((a - b) ** 2 for a, b in pairs) / sum(a * a for a, _ in pairs))
    return errors


def silverbox(hyd, text, base, values, _):
    record = table(os.path.join(HERE, "silverbox", "data", "test.csv"))
    with open(os.path.join(HERE, "silverbox", "set.json"), encoding="utf-8") as file:
        rate = json.load(file)["sampling_Hz"]
    times = [k / rate for k in range(len(record["u_V"]))]
    values = {name: value for name, value in values.items() if not name.endswith(".start")}
    run = simulated(hyd, "silverbox", text, base, values, (0, times[-1], 1 / rate, 1e-8), {"time": times, "u": record["u_V"]}, "smooth")
    shown = at_instants(run["time"], run["y"], times)
    return {"test": 1000 * math.sqrt(sum((a - b) ** 2 for a, b in zip(shown, record["y_V"])) / len(shown))}


def grey_box(hyd):
    """RMSE (V) on the whole test record of the tanks' grey box, fitted by `hyd fit` to the training record."""
    place = os.path.join(HERE, "tanks")
    with tempfile.TemporaryDirectory() as folder:
        fitted_file = os.path.join(folder, "fitted.toml")
        command = [hyd, "fit", os.path.join(place, "greybox.toml"), "--bench", os.path.join(place, "set.json"), "--library", place]
        done = subprocess.run(command + ["--json", "--write-parameters", fitted_file], capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(done.stdout + done.stderr)
        offset = sum(entry["value"] for entry in json.loads(done.stdout)["unknowns"] if entry["name"] == "offset of y_V")
        with open(fitted_file, "rb") as file:
            values = tomllib.load(file)
    return tanks(hyd, "", "Tanks.GreyBox", values, {"offset of y_V": offset})["test"]


SCORES = {"tanks": (tanks, "Tanks.Plant"), "positioning": (positioning, "Positioning.Recorded"), "silverbox": (silverbox, "Oscillator")}


def score(bench, folder, hyd):
    """Errors of the base model and, where one was written, of the discovered one; none without a published figure."""
    if bench not in SCORES:
        return {}
    of_bench, base = SCORES[bench]
    with open(os.path.join(folder, "report.json"), encoding="utf-8") as file:
        report = json.load(file)
    errors = {"before": of_bench(hyd, "", base, *fitted(bench, report, "before"))}
    discovered = os.path.join(folder, "discovered.hyd")
    if os.path.exists(discovered):
        with open(discovered, encoding="utf-8") as file:
            errors["after"] = of_bench(hyd, file.read(), "Discovered", *fitted(bench, report, "after"))
    return errors


if __name__ == "__main__":
    print(json.dumps(score(*sys.argv[1:4])))
