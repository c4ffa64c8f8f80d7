#!/usr/bin/env python3
"""Small known problems by `hyd` and its peers, at equal error: prints a table of docs/performance.md.

usage: known.py [--work DIR]

Builds SUNDIALS' and diffsol's programs as run.py does.  Equations, ends, nominal values and references are those of tests/numerics;
the error is that of the worst variable at the end, relative to its size.  Times are CPU seconds of the process, best of up to 50 runs in
one process, the making of the solver included.
"""

import argparse
import json
import math
import os
import subprocess
from pathlib import Path

from run import HERE, LIBRARIES, ROOT, at_error

PROBLEMS = ["robertson", "hires", "akzo_nobel", "ring_modulator", "squeezing_mechanism"]
NAMES = {
    "robertson": ["a", "b", "c"],
    "hires": [f"y[{k}]" for k in range(1, 9)],
    "akzo_nobel": [f"y[{k}]" for k in range(1, 6)],
    "ring_modulator": [f"u[{k}]" for k in range(1, 8)] + [f"i[{k}]" for k in range(1, 9)],
    "squeezing_mechanism": ["beta", "theta", "gamma", "phi", "delta", "omega", "epsilon"] + [f"w[{k}]" for k in range(1, 8)],
}
TOLERANCES = ["1e-4", "1e-5", "1e-6", "1e-7", "1e-8"]


def build(work):
    program = work / "known"
    libraries = [f"-l{name}" for name in LIBRARIES if name.startswith("sundials") and "klu" not in name and "sparse" not in name]
    command = ["gcc", "-O2", "-march=native", str(HERE / "sundials/known.c"), "-o", str(program), *libraries, "-lm"]
    sundials = program if subprocess.run(command).returncode == 0 else None
    target = work / "diffsol"
    environment = dict(os.environ, CARGO_TARGET_DIR=str(target))
    done = subprocess.run(["cargo", "build", "--release", "--locked"], cwd=HERE / "diffsol", env=environment)
    return sundials, target / "release/known" if done.returncode == 0 else None


def peer(program, method, problem, tolerance):
    """Error, seconds, steps; None where it gives up."""
    done = subprocess.run([program, method, problem, tolerance], capture_output=True, text=True)
    if done.returncode:
        return None
    seconds, steps, *values = done.stdout.split()
    data = json.loads((ROOT / "tests/numerics" / f"{problem}.json").read_text())
    pairs = [(float(v), data["values"][name], name) for v, name in zip(values, NAMES[problem])]
    worst = max(abs(v - exact) / data.get("scale", {}).get(name, abs(exact)) for v, exact, name in pairs)
    return worst, float(seconds), int(steps)


def ours():
    command = ["cargo", "bench", "-q", "-p", "hyd-tests", "--bench", "work_precision", "--", "--best", *PROBLEMS]
    found = {}
    for line in subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines():
        name, tolerance, seconds, steps, error = line.split()
        found[name, float(tolerance)] = (float(error), float(seconds), int(steps))
    return found


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", default=str(HERE / "work"))
    work = Path(parser.parse_args().work).resolve()
    work.mkdir(parents=True, exist_ok=True)
    sundials, diffsol = build(work)
    own = ours()
    for problem in PROBLEMS:
        methods = {"hyd auto": [own.get((problem, float(t))) for t in TOLERANCES]}
        for program, names in [(sundials, ["ida", "cvode"]), (diffsol, ["bdf", "esdirk34", "tr_bdf2"])]:
            for name in names if program else []:
                title = name.upper() if program == sundials else f"diffsol {name}"
                methods[title] = [peer(program, name, problem, t) for t in TOLERANCES]
        levels = [1e-3, 1e-4, 1e-5]
        print(f"\n### {problem}\n\n| method | " + " | ".join(f"{t}: ms (steps) error" for t in TOLERANCES) + " | "
              + " | ".join(f"ms at error {level:g}" for level in levels) + " |\n|---|" + "---:|" * (len(TOLERANCES) + len(levels)))
        for title, runs in methods.items():
            cells = ["failed" if r is None else f"{1e3 * r[1]:.3g} ({r[2]}) {r[0]:.0e}" for r in runs]
            points = [(r[0], r[1]) for r in runs if r is not None and math.isfinite(r[0])]
            found = [at_error(points, level) for level in levels]
            cells += ["" if s is None else f"{1e3 * s:.3g}" for s in found]
            print(f"| {title} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
