"""Rotary pendulum: three free swings to one table for each.

Usage: rotary_pendulum.py BARE_GIT_DIRECTORY   (of jensen-benard/rotary-inverted-pendulum; standard library only)

A record begins while a hand still raises the pendulum past the angle of the trigger, and does not say when the hand lets go.  So each begins here as the
pendulum hangs straight down for the second time.  Every fifth sample is kept (200 Hz), degrees became rad.
"""

import math
import os
import sys

from common import blob, noise, rounded, table, write_set

REVISION = "1f3bb8046d5af4cc32c2965cad34336f1e13e43a"
FOLDER = "software/modelling/experiment/damping_coefficient"
RATE = 1000
KEPT = 5
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "rotary_pendulum")

experiments, records = [], []
for number in (1, 2, 3):
    lines = blob(sys.argv[1], REVISION, f"{FOLDER}/pendulum_free_swing_data_0{number}.txt").decode().splitlines()
    angles = [math.radians(float(line)) for line in lines[2:] if line.strip()]
    passages = [k for k in range(1, len(angles)) if angles[k - 1] != 0 and angles[k - 1] * angles[k] <= 0]
    first = passages[1] // KEPT * KEPT
    kept = angles[first::KEPT]
    file = f"data/swing_{number}.csv"
    table(os.path.join(HERE, file), ["time_s", "theta_rad"], [(f"{k * KEPT / RATE:.3f}", f"{q:.6f}") for k, q in enumerate(kept)])
    records.append(kept)
    experiments.append({"file": file, "shot": number})
sigma = noise(records)
write_set(
    os.path.join(HERE, "set.json"),
    {
        "set": "rotary pendulum",
        "base_model": "pendulum",
        "sampling_Hz": RATE / KEPT,
        "channels": ["theta_rad"],
        "noise_std": {"theta_rad": rounded(sigma, 3)},
        "experiments": experiments,
    },
)
print("noise of theta_rad:", sigma, "rad;", [len(record) for record in records], "samples")
