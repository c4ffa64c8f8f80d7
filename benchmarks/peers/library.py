"""Examples of the Modelica Standard Library beside CVODE through a unit of the same example.

    python benchmarks/peers/library.py HYD FOLDER [EXAMPLE...]

FOLDER is that of the library's package, HYD the program; FMPy must be installed. Each example is run by `hyd simulate` in a process of its own, and as a unit for
model exchange (`hyd build --fmu`) by FMPy with its CVODE, over the time of its annotation `experiment`, with a relative tolerance of 1e-6 and 500 intervals.
CPU seconds, the best of several runs: what `hyd` says of its run, and of FMPy what begins behind reading the unit (its calls from C to Python and back, once a residual,
are in it). The last column is by how much of its range the one variable that differs most is apart at the end.
"""
import argparse
import csv
import re
import subprocess
import tempfile
import time
from pathlib import Path

import fmpy

# Seconds that their annotations `experiment` say.
EXAMPLES = {
    "Blocks.Examples.PID_Controller": 4,
    "Electrical.Analog.Examples.CauerLowPassAnalog": 60,
    "Electrical.Analog.Examples.ChuaCircuit": 50000,
    "Electrical.Analog.Examples.HeatingNPN_NORGate": 200,
    "Electrical.Machines.Examples.InductionMachines.IMC_DOL": 1.5,
    "Electrical.PowerConverters.Examples.ACDC.RectifierBridge2Pulse.DiodeBridge2Pulse": 0.1,
    "Fluid.Examples.HeatingSystem": 6000,
    "Magnetic.FluxTubes.Examples.SolenoidActuator.ComparisonPullInStroke": 0.05,
    "Mechanics.MultiBody.Examples.Elementary.DoublePendulum": 3,
    "Mechanics.MultiBody.Examples.Loops.Fourbar1": 5,
    "Mechanics.MultiBody.Examples.Loops.EngineV6": 1.01,
    "Mechanics.Rotational.Examples.CoupledClutches": 1.5,
    "Mechanics.Rotational.Examples.First": 1,
    "Mechanics.Translational.Examples.Oscillator": 1,
    "Thermal.FluidHeatFlow.Examples.SimpleCooling": 1,
    "Thermal.HeatTransfer.Examples.TwoMasses": 1,
}
TOLERANCE, INTERVALS = 1e-6, 500
# What moves by less is zero but for rounding.
ROUNDING = 1e-9


def run(command):
    """Standard output of a command that must go well."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if "error" in line]
        raise RuntimeError(said[0] if said else done.stderr[-200:])
    return done.stdout


def beside(hyd, library, name, stop, folder):
    """CPU seconds of both and how far their ends are apart."""
    text = folder / "T.mo"
    text.write_text(f"model T\n  extends Modelica.{name};\nend T;\n")
    run([hyd, "build", text, "--library", library, "--fmu", "2.0", "-o", folder / "T.fmu"])
    unit = fmpy.extract(str(folder / "T.fmu"), unzipdir=str(folder / "unit"))
    description = fmpy.read_model_description(unit)
    own = []
    for _ in range(5):
        said = run([hyd, "simulate", text, "--library", library, "--tolerance", TOLERANCE, "--stop", stop, "--intervals", INTERVALS,
                    "--result", folder / "r.csv"])
        number, unit_of = re.search(r"simulated in ([0-9.]+) (m?s)", said).groups()
        own.append(float(number) * (1e-3 if unit_of == "ms" else 1))
        if own[-1] > 5:
            break
    with open(folder / "r.csv", newline="") as file:
        rows = list(csv.reader(file))
    columns = {name: [float(row[k]) for row in rows[1:]] for k, name in enumerate(rows[0])}
    shared = [v.name for v in description.modelVariables if v.type == "Real" and v.name in columns and v.variability == "continuous"][:200]
    theirs, result = [], None
    for _ in range(3):
        begin = time.process_time()
        result = fmpy.simulate_fmu(unit, fmi_type="ModelExchange", solver="CVode", stop_time=stop, relative_tolerance=TOLERANCE,
                                   output_interval=stop / INTERVALS, output=shared, model_description=description)
        theirs.append(time.process_time() - begin)
        if theirs[-1] > 5:
            break
    apart = max((abs(result[name][-1] - columns[name][-1]) / (max(columns[name]) - min(columns[name])) for name in shared
                 if max(columns[name]) - min(columns[name]) > max(1e-9 * max(map(abs, columns[name])), ROUNDING)), default=0.0)
    return min(own), min(theirs), apart


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("hyd", type=Path)
    parser.add_argument("library", type=Path)
    parser.add_argument("examples", nargs="*", default=list(EXAMPLES))
    arguments = parser.parse_args()
    print("| example | hyd, ms | CVODE through a unit, ms | hyd / CVODE | apart |\n|---|---:|---:|---:|---:|")
    for name in arguments.examples:
        with tempfile.TemporaryDirectory() as folder:
            try:
                own, theirs, apart = beside(arguments.hyd.resolve(), arguments.library.resolve(), name, EXAMPLES.get(name, 1), Path(folder))
                print(f"| {name} | {1e3 * own:.3g} | {1e3 * theirs:.3g} | {own / theirs:.2f} | {apart:.0e} |", flush=True)
            except Exception as error:
                print(f"| {name} | {error} | | | |", flush=True)


if __name__ == "__main__":
    main()
