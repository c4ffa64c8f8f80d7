#!/usr/bin/env python3
"""Builds the peers, runs them and `hyd` on the same equations, prints the tables of docs/performance.md.

usage: run.py [--sundials PREFIX] [--work DIR] [--tolerances 1e-4,1e-6,1e-8]

Needs a C compiler, SUNDIALS 6.4 with KLU (Debian: libsundials-dev, libsuitesparse-dev; PREFIX if unpacked elsewhere than /usr)
and cargo.  What is missing is left out with a note.  Times are CPU seconds of the process, best of up to 20 runs in one process, the making
of the solver and the samples included; the error is
the largest difference from the reference over all samples and variables, each relative to its largest value.  The reference
is CVODE at 1e-12 (drive), IDA at 1e-11 (line), the closed form (cord).
"""

import argparse
import csv
import json
import math
import os
import subprocess
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
CELLS = 1000
LIBRARIES = [
    "sundials_ida", "sundials_cvode", "sundials_nvecserial", "sundials_sunlinsolklu", "sundials_sunlinsoldense",
    "sundials_sunmatrixsparse", "sundials_sunmatrixdense", "sundials_generic", "klu", "amd", "colamd", "btf",
    "suitesparseconfig",
]


def build_sundials(prefix, work):
    lib = prefix / "lib" / "x86_64-linux-gnu"
    archives = [str(lib / f"lib{name}.a") for name in LIBRARIES if (lib / f"lib{name}.a").exists()]
    program = work / "peers"
    include = prefix / "include"
    command = ["gcc", "-O2", "-march=native", f"-I{include}", f"-I{include}/suitesparse",
               str(HERE / "sundials/peers.c"), "-o", str(program), *archives, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        print("SUNDIALS is left out:", done.stderr.splitlines()[0] if done.stderr else "no compiler")
        return None
    return program


def build_diffsol(work):
    target = work / "diffsol"
    environment = dict(os.environ, CARGO_TARGET_DIR=str(target))
    done = subprocess.run(["cargo", "build", "--release", "--locked"], cwd=HERE / "diffsol", env=environment)
    return target / "release/peer-diffsol" if done.returncode == 0 else None


def table(path):
    return [[float(x) for x in row] for row in csv.reader(open(path))]


def peer(program, arguments, file):
    """Seconds, steps, rejected steps and samples of a peer, or None."""
    environment = dict(os.environ, RAYON_NUM_THREADS="1")
    done = subprocess.run([program, *arguments, file], capture_output=True, text=True, env=environment)
    if done.returncode:
        return None
    seconds, steps, rejected = done.stdout.split()
    return float(seconds), int(steps), int(rejected), table(file)


def build_own():
    """Path of the benchmark that runs `hyd` as a peer."""
    command = ["cargo", "bench", "-q", "-p", "hyd-tests", "--bench", "beside_peers", "--no-run", "--message-format", "json"]
    for line in subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["target"]["name"] == "beside_peers":
            return message["executable"]
    raise SystemExit("cargo names no benchmark `beside_peers`")


def cord_exact():
    m = CELLS + 1
    omega = 2 * m * math.sin(math.pi / (2 * m))
    shape = [math.sin(math.pi * k / m) for k in (1, CELLS // 2, CELLS)]
    return [[t, *(s * math.cos(omega * t) for s in shape)] for t in (5.0 * k / 50 for k in range(1, 51))]


def error(samples, reference):
    worst = 0.0
    for column in range(1, len(reference[0])):
        size = max(abs(row[column]) for row in reference)
        worst = max(worst, max(abs(a[column] - b[column]) for a, b in zip(samples, reference)) / size)
    return worst


def at_error(points, level):
    """CPU seconds at an error, on the line through log error and log time of neighbouring runs; None outside them."""
    points = sorted(points)
    for (e0, s0), (e1, s1) in zip(points, points[1:]):
        if e0 <= level <= e1 and e1 > e0:
            part = (math.log(level) - math.log(e0)) / (math.log(e1) - math.log(e0))
            return math.exp(math.log(s0) + part * (math.log(s1) - math.log(s0)))
    return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--sundials", default="/usr")
    parser.add_argument("--work", default=str(HERE / "work"))
    parser.add_argument("--tolerances", default="1e-4,1e-5,1e-6,1e-7,1e-8")
    options = parser.parse_args()
    work = Path(options.work).resolve()
    work.mkdir(parents=True, exist_ok=True)
    own, sundials, diffsol = build_own(), build_sundials(Path(options.sundials), work), build_diffsol(work)
    tolerances = options.tolerances.split(",")
    for problem, levels in [("drive", [1e-2, 1e-3, 1e-4]), ("line", [1e-2, 1e-3, 1e-4]), ("cord", [1e-3, 1e-4, 1e-5])]:
        if problem == "cord":
            reference = cord_exact()
        elif sundials:
            code, tolerance = ("cvode", "1e-12") if problem == "drive" else ("ida", "1e-11")
            reference = peer(sundials, [code, problem, tolerance, str(CELLS), "5"], work / "reference.csv")[3]
        else:
            print(f"{problem}: no reference without SUNDIALS")
            continue
        methods = {f"hyd {s}": (lambda t, f, s=s: peer(own, [s, problem, t, str(CELLS)], f)) for s in ("auto", "bdf", "esdirk")}
        if sundials:
            for name, code, order in [("IDA", "ida", "5"), ("IDA, order 2", "ida", "2"), ("CVODE", "cvode", "5")]:
                methods[name] = lambda t, f, c=code, o=order: peer(sundials, [c, problem, t, str(CELLS), o], f)
        if diffsol:
            for name in ("bdf", "esdirk34", "tr_bdf2"):
                methods[f"diffsol {name}"] = lambda t, f, n=name: peer(diffsol, [n, problem, t, str(CELLS)], f)
        print(f"\n### {problem}\n\n| method | " + " | ".join(f"{t}: ms (steps) error" for t in tolerances)
              + " | " + " | ".join(f"ms at error {level:g}" for level in levels) + " |")
        print("|---|" + "---:|" * (len(tolerances) + len(levels)))
        for name, method in methods.items():
            cells, points = [], []
            for tolerance in tolerances:
                result = method(tolerance, work / f"{problem}.csv")
                if result is None:
                    cells.append("failed")
                    continue
                seconds, steps, _, samples = result
                worst = error(samples, reference)
                points.append((worst, seconds))
                cells.append(f"{1e3 * seconds:.3g} ({steps}) {worst:.0e}")
            found = [at_error(points, level) for level in levels]
            cells += ["" if s is None else f"{1e3 * s:.3g}" for s in found]
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
