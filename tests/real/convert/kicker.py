"""Kicker solenoid: seven oscilloscope traces to one table for each shot.

Usage: kicker.py BARE_GIT_DIRECTORY   (of RoboJackets/robocup-software; standard library only)

A trace has two lines of 4000 numbers at 200 kHz: the voltage across the 10 mOhm shunt (V; divided by 0.01 Ohm it is the current), and the voltage
at the coil (V).  The clock is set to zero one sample before the first voltage above 10 V.  The number in the name of a trace is taken for
the voltage of the bank before the shot; `tube` in the name for a tube in the coil.
"""

import os
import sys

from common import blob, noise, rounded, table, write_set

REVISION = "e46f835bbc57cdc8407df5add4cc614a03e4b973"
FOLDER = "firmware/robot2011/cpu/data/kicker-solenoids"
RATE = 200e3
SHUNT = 0.01
STEP_I = 0.04 / SHUNT
STEP_U = 2.0
BEGINS, ENDS = -1e-3, 9e-3
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "kicker")

experiments, currents, voltages = [], [], []
for name in ("empty-118", "empty-162", "empty-194", "empty-250", "tube-114", "tube-150", "tube-250"):
    lines = blob(sys.argv[1], REVISION, f"{FOLDER}/trace-{name}.txt").decode().splitlines()
    shunt, voltage = ([float(word) for word in line.split()] for line in lines)
    first = next(k for k, u in enumerate(voltage) if u > 10) - 1
    rows = []
    for k, (s, u) in enumerate(zip(shunt, voltage)):
        t = (k - first) / RATE
        if BEGINS <= t <= ENDS:
            rows.append((f"{t:.6f}", f"{s / SHUNT:.0f}", f"{u:.0f}"))
    file = f"data/{name.replace('-', '_')}.csv"
    table(os.path.join(HERE, file), ["time_s", "i_A", "u_V"], rows)
    currents.append([float(row[1]) for row in rows])
    voltages.append([float(row[2]) for row in rows])
    kind, charged = name.split("-")
    experiments.append(
        {
            "file": file,
            "shot": len(experiments) + 1,
            "U0_V": float(charged),
            "tube": 1 if kind == "tube" else 0,
            "trigger_time_s": 0.0,
        }
    )
sigma_i, sigma_u = noise(currents, STEP_I), noise(voltages, STEP_U)
write_set(
    os.path.join(HERE, "set.json"),
    {
        "set": "kicker solenoid",
        "base_model": "kicker",
        "sampling_Hz": RATE,
        "channels": ["i_A", "u_V"],
        "noise_std": {"i_A": rounded(sigma_i), "u_V": rounded(sigma_u)},
        "quantisation": {"i_A": STEP_I, "u_V": STEP_U},
        "sensor_offset_1sigma": {"i_A": 5.0, "u_V": 1.0},
        "sensor_gain_1sigma": 0.02,
        "parameter_tolerance_1sigma": {"R": 0.3, "L": 0.3, "C": 0.2},
        "experiments": experiments,
    },
)
print("noise:", sigma_i, "A", sigma_u, "V")
