"""`hyd simulate X.fmu`: our own units given back, and a unit written in C that can misbehave.  Arguments as for `units.py`."""
import math
import os
import pathlib
import platform
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile

import numpy as np
import pandas as pd
from units import HYD, ONLY, OWN, POINTS, SLOW, VERSIONS, WITHOUT_END, WORK, build, check_against, large, reference

TROUBLES = ["none", "crash", "hang", "end", "discards", "complains", "prints", "step_events", "crash_at_start", "aborts", "terminates", "no_instance", "forks"]
TURN = math.log(2)


def simulate(path, *options, code=0, **more):
    """Runs a unit; gives its rows, or what was said where it must fail."""
    result = WORK / "unit.csv"
    for old in (result, WORK / "unit.partial.csv"):
        old.unlink(missing_ok=True)
    command = [HYD, "simulate", path, "--result", result, *map(str, options)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=120, **more)
    assert done.returncode == code, f"{pathlib.Path(path).name} {options}: {done.returncode} and not {code}: {done.stderr}"
    if code:
        assert "panicked" not in done.stderr and not result.exists(), done.stderr
        return done.stderr
    return pd.read_csv(result)


def records(frame, names):
    """Rows as `check_against` takes them."""
    frame = frame.rename(columns={frame.columns[0]: "time"})
    return frame[["time", *names]].astype(float).to_records(index=False)


def check_given_back(model, name):
    """A unit of ours has the results of the model that it was made of."""
    told = []
    tables = None
    for version in VERSIONS:
        path, made = build(model, version, name)
        kinds = ["co-simulation"] + (["model-exchange"] if made["model_exchange"] else [])
        for kind in kinds:
            begin = time.perf_counter()
            tolerance, stop = stated(model)
            tables = tables or reference(model, name, tolerance)
            step = ["--step", repr(stop / POINTS)] if kind == "co-simulation" else ["--intervals", str(POINTS)]
            result = simulate(path, "--as", kind, *step)
            names = [c for c in tables[1].columns[1:] if c in result.columns]
            assert len(names) >= 0.9 * (len(tables[1].columns) - 1), f"{name}: only {len(names)} of {len(tables[1].columns) - 1} variables"
            check_against(tables, records(result, names), tolerance, f"{name} {version} {kind}")
            told.append(f"{version} {kind} {time.perf_counter() - begin:.2f} s")
    print(f"  {name}: {', '.join(told)}", flush=True)


def stated(model):
    """Tolerance and stop of a model's annotation."""
    values = dict(re.findall(r"(Tolerance|StopTime)\s*=\s*([0-9.e+-]+)", model.read_text()))
    return float(values.get("Tolerance", "1e-6")), float(values["StopTime"])


def foreign():
    """The unit in C."""
    library = WORK / "foreign.so"
    subprocess.run(["gcc", "-O1", "-shared", "-fPIC", "tests/outside/foreign.c", "-lm", "-o", library], check=True)
    variable = '<ScalarVariable name="{}" valueReference="{}" {}><{}/></ScalarVariable>'.format
    description = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Foreign" guid="foreign" generationTool="a hand" numberOfEventIndicators="1">
<ModelExchange modelIdentifier="foreign"/>
<CoSimulation modelIdentifier="foreign" canHandleVariableCommunicationStepSize="true"/>
<DefaultExperiment startTime="0" stopTime="3" tolerance="1e-8" stepSize="0.01"/>
<ModelVariables>
{variable("x", 0, 'causality="output" initial="exact"', 'Real start="1"')}
{variable("der(x)", 1, '', 'Real derivative="1"')}
{variable("k", 2, 'causality="parameter" variability="fixed"', 'Real start="1" min="0" max="10"')}
{variable("u", 3, 'causality="input"', 'Real start="0"')}
{variable("told", 4, 'variability="discrete"', 'Real')}
{variable("count", 0, 'causality="output" variability="discrete"', 'Integer')}
{variable("trouble", 1, 'causality="parameter" variability="fixed"', 'Integer start="0"')}
{variable("label", 0, 'causality="parameter" variability="fixed"', 'String start="valve"')}
{variable("fixed", 9, 'variability="constant"', 'Real start="4"')}
</ModelVariables>
<ModelStructure><Derivatives><Unknown index="2"/></Derivatives></ModelStructure>
</fmiModelDescription>
"""
    path = WORK / "foreign.fmu"
    folder = "linux64" if platform.machine() == "x86_64" else f"{platform.machine()}-linux"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{folder}/foreign.so")
    return path, description


def check_foreign(path):
    """State events, parameters, inputs and both kinds of use against the closed form."""
    for kind in ("model-exchange", "co-simulation"):
        for k in (1.0, 2.5):
            rows = simulate(path, "--as", kind, "--set", f"k={k}")
            t, x, count = (rows[c].to_numpy(dtype=float) for c in ("time", "x", "count"))
            phase = (k * t) % TURN
            # Beside a turn the row may be that of either side.
            clear = (phase > 1e-5) & (phase < TURN - 1e-5)
            far = np.max(np.abs(x - np.exp(-phase))[clear])
            assert far < 1e-6, f"{kind} k={k}: {far}"
            assert np.all(count[clear] == np.floor(k * t / TURN)[clear]), f"{kind}: turns"
    source = WORK / "steps.csv"
    source.write_text("time,u\n0,0.7\n1,0.7\n3,0.9\n")
    rows = simulate(path, "--input", source, "--hold", "zero", "--stop", "2")
    t, x = rows["time"].to_numpy(), rows["x"].to_numpy()
    assert abs(x[-1] - (0.7 + 0.3 * math.exp(-2))) < 1e-6, x[-1]
    assert np.all(rows["u"] == 0.7)
    rows = simulate(path, "--set", "u=0.6", "--stop", "2")
    assert abs(rows["x"].iloc[-1] - (0.6 + 0.4 * math.exp(-2))) < 1e-6
    # A unit that asks for events at its steps, and one that prints, have the results of others.
    for trouble in ("step_events", "prints"):
        rows = simulate(path, "--set", f"trouble={TROUBLES.index(trouble)}", "--stop", "0.6")
        assert abs(rows["x"].iloc[-1] - math.exp(-0.6)) < 1e-7, trouble
    assert simulate(path, "--set", f"trouble={TROUBLES.index('prints')}", "--stop", "0.6").shape[0] > 50


def check_start(path):
    """The start value of a state is a parameter of the unit's block: the first turn comes at ln(2 x_start)."""
    block = WORK / "Foreign.hyd"
    block.unlink(missing_ok=True)
    subprocess.run([HYD, "unit", path, "-o", block], check=True, stdout=subprocess.DEVNULL)
    top = WORK / "started.hyd"
    top.write_text("model Started\n  Foreign a(x_start = 0.8);\n  Foreign b;\nequation\n  a.u = 0;\n  b.u = 0;\nend Started;\n")
    for value in (0.8, 0.7):
        rows = simulate(top, "--library", WORK, "--stop", "0.6", "--tolerance", "1e-9", "--set", f"a.x_start={value}")
        for name, start in (("a.x", value), ("b.x", 1.0)):
            t, x = rows["time"].to_numpy(dtype=float), rows[name].to_numpy(dtype=float)
            turn = math.log(2 * start)
            wanted = np.where(t < turn, start * np.exp(-t), np.exp(turn - t))
            clear = np.abs(t - turn) > 1e-5
            far = np.max(np.abs(x - wanted)[clear])
            assert far < 1e-6, f"{name} from {start}: {far}"


def unit_processes():
    """Processes of units that live in the folder of this check."""
    found = subprocess.run(["pgrep", "-f", f"{WORK}/hyd-unit-"], stdout=subprocess.PIPE, text=True)
    return found.stdout.split()


def check_trouble(path):
    """What a unit does wrong is a message with its name and the function, and ends in order."""
    def told(trouble, *words, kind="model-exchange", code=1, options=()):
        said = simulate(path, "--as", kind, "--set", f"trouble={TROUBLES.index(trouble)}", *options, code=code)
        for word in (path.name, *words):
            assert word in said, f"{trouble} {kind}: `{word}` is not in: {said}"
        assert (WORK / "unit.partial.csv").exists() == (trouble != "crash_at_start"), trouble

    told("crash", "crashed", "signal 11", "fmi2GetDerivatives")
    told("crash", "crashed", "signal 11", "fmi2DoStep", kind="co-simulation")
    told("crash_at_start", "crashed", "fmi2EnterInitializationMode")
    told("aborts", "crashed", "signal 6", "fmi2GetDerivatives")
    told("end", "ended its process (exit code 7)", "fmi2GetDerivatives")
    begin = time.perf_counter()
    told("hang", "hangs", "fmi2GetDerivatives", options=("--call-limit", "1"))
    told("hang", "hangs", "fmi2DoStep", kind="co-simulation", options=("--call-limit", "1"))
    assert time.perf_counter() - begin < 10
    told("complains", "valve: x is 0.6", "after 0 turns, 100%", "fmi2GetDerivatives")
    told("complains", "armature: x is", "fmi2DoStep", kind="co-simulation", options=("--set", "label=armature"))
    told("discards", "fmi2GetDerivatives", "no value", code=3)
    for kind in ("model-exchange", "co-simulation"):
        rows = simulate(path, "--as", kind, "--set", f"trouble={TROUBLES.index('terminates')}")
        assert abs(rows["time"].iloc[-1] - TURN) < 1e-5, f"{kind}: ends at {rows['time'].iloc[-1]}"
    # What the unit has begun for itself ends with it: a copy of its process has the same command line.
    for kind in ("model-exchange", "co-simulation"):
        forks = ("--as", kind, "--set", f"trouble={TROUBLES.index('forks')}", "--stop", "0.6")
        simulate(path, *forks, env={**os.environ, "TMPDIR": str(WORK)})
        assert not unit_processes(), kind
    left = [entry for entry in os.listdir("/dev/shm") if entry.startswith("hyd-area")] if os.path.isdir("/dev/shm") else []
    assert not left, left


def check_interruption(path):
    """Ctrl-C ends a run whose unit hangs, and leaves neither process nor folder."""
    command = [HYD, "simulate", path, "--set", f"trouble={TROUBLES.index('hang')}"]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, env={**os.environ, "TMPDIR": str(WORK)})
    time.sleep(1.5)
    os.killpg(running.pid, signal.SIGINT)
    _, said = running.communicate(timeout=10)
    assert running.returncode in (1, 3) and "interruption" in said, (running.returncode, said)
    assert not [entry for entry in os.listdir(WORK) if entry.startswith("hyd-unit")]
    # The end of the program at once ends the process of the unit, too.
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True, env={**os.environ, "TMPDIR": str(WORK)})
    time.sleep(1.5)
    running.kill()
    running.wait()
    time.sleep(2)
    assert not [entry for entry in os.listdir(WORK) if entry.startswith("hyd-unit")]
    assert not unit_processes()


def check_messages(path, description):
    """Wrong use and archives that are none of what they should be."""
    def told(words, *options, code, file=path):
        said = simulate(file, *options, code=code)
        assert words in said, f"`{words}` is not in: {said}"

    told("no parameter `kk`; did you mean `k`?", "--set", "kk=1", code=1)
    told("`x` cannot be set: it is a variable, not a parameter", "--set", "x=1", code=1)
    told("`fixed` cannot be set: it is a constant", "--set", "fixed=1", code=1)
    told("`k` is 11, above its `max` 10", "--set", "k=11", code=1)
    told("it is an Integer", "--set", "trouble=1.5", code=1)
    told("--step is the distance", "--step", "0.1", code=2)
    told("--solver is for the solver of hyd", "--as", "co-simulation", "--solver", "bdf", code=2)
    told("--model is about texts", "--model", "X", code=2)
    told("--intervals 7", "--as", "co-simulation", "--step", "0.1", "--intervals", "7", code=2)
    said = subprocess.run([HYD, "check", path], stderr=subprocess.PIPE, text=True)
    assert said.returncode == 2 and "is a unit of another tool" in said.stderr, said.stderr

    def broken(name, change, words):
        file = WORK / f"{name}.fmu"
        with zipfile.ZipFile(path) as old, zipfile.ZipFile(file, "w") as new:
            change(old, new)
        told(words, code=1, file=file)

    def with_text(text):
        def change(old, new):
            for entry in old.namelist():
                new.writestr(entry, text if entry == "modelDescription.xml" else old.read(entry))
        return change

    broken("first", with_text(description.replace('fmiVersion="2.0"', 'fmiVersion="1.0"')), "version 1.0 of the interface")
    broken("cut", with_text(description[:900]), "modelDescription.xml, line")
    broken("reference", with_text(description.replace('valueReference="2"', 'valueReference="two"')), "line 9: `valueReference` is `two`")
    broken("tool", with_text(description.replace("<ModelExchange ", '<ModelExchange needsExecutionTool="true" ')), "needs the program that made it, a hand")
    broken("alien", lambda old, new: [new.writestr(e.replace("linux", "win"), old.read(e)) for e in old.namelist()], "no library for this machine")
    broken("empty", lambda old, new: new.writestr("readme.txt", "nothing"), "there is no `modelDescription.xml`")

    def hostile(entry):
        def change(old, new):
            with_text(description)(old, new)
            new.writestr(entry, "x")
        return change

    broken("out", hostile("../out.txt"), "leads out of the folder")
    broken("root", hostile("/out.txt"), "leads out of the folder")
    broken("back", hostile("resources\\..\\..\\out.txt"), "leads out of the folder")
    link = zipfile.ZipInfo("resources/link")
    link.external_attr = 0o120777 << 16
    broken("link", hostile(link), "is a link")
    assert not (WORK / "out.txt").exists() and not (WORK.parent / "out.txt").exists()
    plain = WORK / "plain.fmu"
    plain.write_text("not an archive")
    told("not an archive", code=1, file=plain)
    assert "cannot be read" in simulate(WORK / "absent.fmu", code=1)


def main():
    print("units in hyd", flush=True)
    if shutil.which("gcc") is None:
        print("  no gcc: the unit in C is left out", flush=True)
    else:
        path, description = foreign()
        check_foreign(path)
        check_start(path)
        check_trouble(path)
        check_interruption(path)
        check_messages(path, description)
        print("  the unit in C: events, start values, crashes, hangs, interruption, messages", flush=True)
    for model in OWN:
        if model.stem not in WITHOUT_END and (not ONLY or model.stem in ONLY):
            check_given_back(model, model.stem)
    for model in large():
        if model.stem == "drive" and (not ONLY or "drive" in ONLY):
            check_given_back(model, "-".join(model.parts[-2:]).removesuffix(".hyd"))


if __name__ == "__main__":
    main()
