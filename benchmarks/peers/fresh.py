#!/usr/bin/env python3
"""The drive and the line as a user writes them, without nominal values, each run in a process of its own, beside the peers.

usage: fresh.py HYD [--sundials PREFIX] [--work DIR] [--tolerances 1e-2,...] [--repeat 9]

`hyd simulate` on the texts of run.py without their `nominal` attributes; its time is what it says of its run (CPU seconds, the making of the
solver and the rows of the compared variables included, translation not).  The peers' programs make one run (`ONCE`), with an absolute
tolerance of a hundredth of the relative one.  Medians; the error is that of run.py; times at equal error are interpolated.
"""

import argparse
import csv
import json
import os
import re
import statistics
import subprocess
from pathlib import Path

from run import CELLS, ROOT, at_error, build_diffsol, build_sundials, error, table

LEVELS = [1e-2, 1e-3, 1e-4, 1e-5]
STATES = ["q", "i", "x", "v", "p", "y", "w", "p_s"]
PROBLEMS = {
    "drive": ("benchmarks/peers/models/drive.hyd", "0.08", 80, [], [(name, 1.0) for name in STATES]),
    "line": ("models/hydraulic_line/line.hyd", "0.1", 50, ["--set", f"N={CELLS}"],
             [("q[1]", 1e3), (f"p[{CELLS // 2}]", 1e-6), (f"p[{CELLS}]", 1e-6)]),
}


def plain(file, work):
    """The text without nominal values, in a folder of its own."""
    text = (ROOT / file).read_text()
    text, count = re.subn(r", (each )?nominal = [^,)]+", "", text)
    assert count, f"{file} has no nominal values"
    text = re.sub(r"^within .*;\n", "", text)
    path = work / ("plain_" + Path(file).name)
    path.write_text(text)
    return path


def own(hyd, problem, tolerance, work):
    file, stop, samples, more, variables = PROBLEMS[problem]
    result = work / "own.csv"
    pattern = "^(" + "|".join(re.escape(name) for name, _ in variables) + ")$"
    command = [hyd, "simulate", plain(file, work), "--stop", stop, "--intervals", str(samples), "--tolerance", tolerance,
               "--variables", pattern, "--result", result, "--json", *more]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        return None
    rows = list(csv.reader(open(result)))
    places = [(rows[0].index(name), factor) for name, factor in variables]
    values = [[float(row[0])] + [float(row[k]) * factor for k, factor in places] for row in rows[2 if rows[1][0] == "s" else 1:]]
    # The rows of events stand beside those of the points.
    wanted = [float(stop) * k / samples for k in range(1, samples + 1)]
    kept = [min(values, key=lambda row: abs(row[0] - t)) for t in wanted]
    told = json.loads(done.stdout)
    return told["simulate_s"], told["counters"]["steps"], kept


def peer(program, arguments, file):
    environment = dict(os.environ, RAYON_NUM_THREADS="1", ONCE="1")
    done = subprocess.run([program, *arguments, file], capture_output=True, text=True, env=environment)
    if done.returncode:
        return None
    seconds, steps, _ = done.stdout.split()
    return float(seconds), int(steps), table(file)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("hyd")
    parser.add_argument("--sundials", default="/usr")
    parser.add_argument("--work", default=str(Path(__file__).resolve().parent / "work"))
    parser.add_argument("--tolerances", default="1e-2,1e-3,1e-4,1e-5,1e-6,1e-7,1e-8")
    parser.add_argument("--repeat", type=int, default=9)
    options = parser.parse_args()
    work = Path(options.work).resolve()
    work.mkdir(parents=True, exist_ok=True)
    sundials, diffsol = build_sundials(Path(options.sundials), work), build_diffsol(work)
    if not sundials:
        raise SystemExit("no reference without SUNDIALS")
    for problem in PROBLEMS:
        code, tight = ("cvode", "1e-12") if problem == "drive" else ("ida", "1e-11")
        reference = peer(sundials, [code, problem, tight, str(CELLS), "5"], work / "reference.csv")[2]
        methods = {"hyd": lambda t: own(options.hyd, problem, t, work)}
        for name, solver, order in [("CVODE", "cvode", "5"), ("IDA, order 2", "ida", "2")]:
            methods[name] = lambda t, s=solver, o=order: peer(sundials, [s, problem, t, str(CELLS), o], work / "peer.csv")
        if diffsol:
            for name in ("bdf", "esdirk34", "tr_bdf2"):
                methods[f"diffsol {name}"] = lambda t, n=name: peer(diffsol, [n, problem, t, str(CELLS)], work / "peer.csv")
        print(f"\n### {problem}\n\n| method | " + " | ".join(f"{t}: ms (steps) error" for t in options.tolerances.split(","))
              + " | " + " | ".join(f"ms at error {level:g}" for level in LEVELS) + " |")
        print("|---|" + "---:|" * (len(options.tolerances.split(",")) + len(LEVELS)))
        for name, method in methods.items():
            cells, points = [], []
            for tolerance in options.tolerances.split(","):
                runs = [method(tolerance)]
                if runs[0] is None:
                    cells.append("failed")
                    continue
                # What takes long scatters less.
                runs += [method(tolerance) for _ in range(options.repeat - 1 if runs[0][0] < 0.5 else 0)]
                seconds, worst = statistics.median(run[0] for run in runs), error(runs[0][2], reference)
                points.append((worst, seconds))
                cells.append(f"{1e3 * seconds:.3g} ({runs[0][1]}) {worst:.0e}")
            levels = [at_error(points, level) for level in LEVELS]
            print(f"| {name} | " + " | ".join(cells) + " | " + " | ".join("" if s is None else f"{1e3 * s:.3g}" for s in levels) + " |",
                  flush=True)


if __name__ == "__main__":
    main()
