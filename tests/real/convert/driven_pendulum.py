"""Driven pendulum: three records of a motor that swings a weight up to one table for each.

Usage: driven_pendulum.py BARE_GIT_DIRECTORY   (of dfki-ric-underactuated-lab/torque_limited_simple_pendulum; standard library only)

Numbers are rounded to six decimals.  Taken are the three records that follow a trajectory planned beforehand: differential dynamic programming, direct collocation,
and the position control that the authors identified their model from.
"""

import csv
import io
import os
import sys

from common import blob, noise, rounded, table, write_set

REVISION = "ed17ea2d32a35ad944944ca03ef57693e2986732"
RECORDS = [
    ("ddp", "control_method_ddp"),
    ("collocation", "control_method_direct_collocation"),
    ("position_control", "control_method_pd/system_identification"),
]
COLUMNS = ["time", "position", "velocity", "torque"]
# Steps of the motor's own measurements (rad, rad/s).
STEP_Q, STEP_W = 0.00291, 0.022
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "driven_pendulum")

experiments, angles, speeds = [], [], []
for name, folder in RECORDS:
    text = blob(sys.argv[1], REVISION, f"results/{folder}/data_measured.csv").decode()
    rows = [[float(row[column]) for column in COLUMNS] for row in csv.DictReader(io.StringIO(text))]
    file = f"data/{name}.csv"
    table(os.path.join(HERE, file), ["time_s", "q_rad", "w_radps", "tau_Nm"], [[f"{value:.6f}" for value in row] for row in rows])
    angles.append([row[1] for row in rows])
    speeds.append([row[2] for row in rows])
    experiments.append({"file": file, "shot": len(experiments) + 1})
sigma_q, sigma_w = noise(angles, STEP_Q), noise(speeds, STEP_W)
write_set(
    os.path.join(HERE, "set.json"),
    {
        "set": "driven pendulum",
        "base_model": "pendulum",
        "channels": ["q_rad", "w_radps"],
        "noise_std": {"q_rad": rounded(sigma_q, 3), "w_radps": rounded(sigma_w, 3)},
        "quantisation": {"q_rad": STEP_Q, "w_radps": STEP_W},
        "experiments": experiments,
    },
)
print("noise:", sigma_q, "rad", sigma_w, "rad/s;", [len(record) for record in angles], "samples")
