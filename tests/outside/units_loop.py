"""A controller of another tool around our drive: two units in FMPy, and the same loop as one model in `hyd`.  Arguments as for `units.py`.

The controller (`controller.c`) regulates the current of the coil by its voltage.  FMPy steps both units in turn, each with what the other one had at
the last communication point; in `hyd` the controller is a block beside the drive, in model exchange.  The co-simulation is a method of first
order, so its distance from the whole must shrink with the step.
"""
import pathlib
import platform
import shutil
import subprocess
import zipfile

import numpy as np
import pandas as pd
from fmpy import extract, read_model_description
from fmpy.validation import validate_fmu
from units import HYD, MODELS, WORK, instance, start

FOLDER = WORK / "loop"
LIBRARY = MODELS / "single_acting_drive"
STOP = 15e-3
# Communication steps (s).
STEPS = (2e-5, 1e-5, 5e-6)
# The current is to rise to a peak, to be held, and to vanish (A, until s).
COURSE = ((5.0, 3e-3), (2.5, 10e-3), (0.0, STOP))

PACKAGE = """package Driven "The drive with a voltage from outside"
  model Circuit "A voltage that somebody gives, and the resistance of the coil"
    extends Hyd.Places.PartialCircuit;
    parameter Hyd.Units.Resistance R = 1.9 "resistance of the coil";
    input Hyd.Units.Voltage u "voltage";
    Hyd.Electrical.Components.Ground ground;
  equation
    p.v = u - R*i;
    i = -p.i;
    u_C = U0;
    connect(n, ground.p);
  end Circuit;
  model DrivenDrive "The drive as a unit for a controller"
    extends SingleActingDrive.Drive(ro(redeclare Circuit rlc(u = u)));
    input Real u(unit = "V", start = 0) "voltage";
    output Real i_coil(unit = "A") = i "current of the coil";
    output Real lift(unit = "m") = y "lift of the engine valve";
    annotation(experiment(StopTime = 0.015, Tolerance = 1e-8));
  end DrivenDrive;
  model Loop "Drive and controller as one model"
    DrivenDrive drive(u = controller.output_V);
    Controller controller;
  equation
    controller.measured = drive.i_coil;
    controller.reference = if time < 3e-3 then 5 elseif time < 10e-3 then 2.5 else 0;
    annotation(experiment(StopTime = 0.015, Tolerance = 1e-9));
  end Loop;
end Driven;
"""


def controller():
    """The controller's archive."""
    library = FOLDER / "controller.so"
    subprocess.run(["gcc", "-O1", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", "tests/outside/controller.c", "-lm", "-o", library], check=True)
    names = [
        ("reference", 'causality="input"', 'start="0" unit="A"'),
        ("measured", 'causality="input"', 'start="0" unit="A"'),
        ("output_V", 'causality="output"', 'unit="V"'),
        ("x", 'initial="exact"', 'start="0" unit="V"'),
        ("der(x)", "", 'derivative="4"'),
        ("k_p", 'causality="parameter" variability="fixed"', 'start="20"'),
        ("k_i", 'causality="parameter" variability="fixed"', 'start="4000"'),
        ("limit", 'causality="parameter" variability="fixed"', 'start="48" unit="V"'),
    ]
    variables = "".join(f'<ScalarVariable name="{n}" valueReference="{k}" {c}><Real {a}/></ScalarVariable>' for k, (n, c, a) in enumerate(names))
    description = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Controller" guid="controller" generationTool="a hand" numberOfEventIndicators="0">
<ModelExchange modelIdentifier="controller"/>
<CoSimulation modelIdentifier="controller" canHandleVariableCommunicationStepSize="true"/>
<UnitDefinitions><Unit name="A"/><Unit name="V"/></UnitDefinitions>
<ModelVariables>{variables}</ModelVariables>
<ModelStructure><Outputs><Unknown index="3"/></Outputs><Derivatives><Unknown index="5"/></Derivatives>
<InitialUnknowns><Unknown index="3"/><Unknown index="5"/></InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""
    path = FOLDER / "controller.fmu"
    folder = "linux64" if platform.machine() == "x86_64" else f"{platform.machine()}-linux"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{folder}/controller.so")
    assert validate_fmu(str(path)) == []
    return path


def wanted(t):
    return next((value for value, until in COURSE if t < until - 1e-9), COURSE[-1][0])


def together(drive, control, step, version):
    """Times, currents and lifts of both units step by step."""
    ours, description, own_folder = instance(drive, "CS")
    other, other_description, other_folder = instance(control, "CS")
    own = {v.name: v.valueReference for v in description.modelVariables}
    foreign = {v.name: v.valueReference for v in other_description.modelVariables}
    get, set_to = (ours.getReal, ours.setReal) if version == "2.0" else (ours.getFloat64, ours.setFloat64)
    start(ours, version, STOP, kind="CS")
    start(other, "2.0", STOP, kind="CS")
    rows = []
    for k in range(round(STOP / step)):
        t = k * step
        current, lift = get([own["i_coil"], own["lift"]])
        rows.append((t, current, lift))
        other.setReal([foreign["reference"], foreign["measured"]], [wanted(t), current])
        set_to([own["u"]], other.getReal([foreign["output_V"]]))
        ours.doStep(t, step)
        other.doStep(t, step)
    for unit, folder in ((ours, own_folder), (other, other_folder)):
        unit.freeInstance()
        shutil.rmtree(folder)
    return np.array(rows).T


def main():
    if shutil.which("gcc") is None:
        print("no gcc: the controller of another tool is left out", flush=True)
        return
    FOLDER.mkdir(exist_ok=True)
    control = controller()
    block, package, table = FOLDER / "Controller.hyd", FOLDER / "Driven.hyd", FOLDER / "whole.csv"
    block.unlink(missing_ok=True)
    subprocess.run([HYD, "unit", control, "-o", block], check=True, stdout=subprocess.DEVNULL)
    package.write_text(PACKAGE)
    libraries = ["--library", LIBRARY, "--library", FOLDER]
    run = [HYD, "simulate", package, "--model", "Driven.Loop", *libraries, "--result", table, "--intervals", "3000"]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    whole = pd.read_csv(table)
    times = whole.iloc[:, 0].to_numpy()
    current, lift = whole["drive.i_coil"].to_numpy(), whole["drive.lift"].to_numpy()
    assert 4.5 < current.max() < 5.5 and lift.max() > 5e-3, f"the loop as one model: {current.max()} A, {lift.max()} m"
    held = (times > 7e-3) & (times < 9.9e-3)
    assert np.max(np.abs(current[held] - 2.5)) < 0.3, "the current is not held"
    for version in ("2.0", "3.0"):
        drive = FOLDER / f"drive-{version}.fmu"
        made = [HYD, "build", package, "--model", "Driven.DrivenDrive", *libraries[:2], "--fmu", version, "-o", drive]
        subprocess.run(made, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        apart = []
        for step in STEPS:
            t, i, y = together(drive, control, step, version)
            # The mean, because an instant of a jump is shifted by up to a step.
            far = [np.mean(np.abs(np.interp(t, times, values) - own)) / np.max(np.abs(values)) for values, own in ((current, i), (lift, y))]
            apart.append(max(far))
        assert apart[-1] < 5e-3, f"{version}: the two units lead elsewhere than the whole: {apart}"
        for coarse, fine in zip(apart, apart[1:]):
            assert 1.5 < coarse / fine < 3, f"{version}: the distance does not shrink with the step: {apart}"
        print(f"  a controller of another tool around the drive, {version}: apart from one model by {', '.join(f'{a:.1e}' for a in apart)} at {STEPS} s", flush=True)


main()
