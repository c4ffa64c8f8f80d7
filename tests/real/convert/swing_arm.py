"""Swinging arm: the free swing of the single pendulum to one table.

Usage: swing_arm.py BARE_GIT_DIRECTORY   (of dynamicslab/MultiArm-Pendulum; needs scipy)

The six pieces of the authors' file follow one another without a gap at 1 kHz; put together they are 55 s.  The angle is counted from hanging (pi is taken off),
every tenth sample is kept and its speed, which the authors filtered, is left out.  The noise is that of third differences of the record of 1 kHz.
"""

import io
import math
import os
import sys

from scipy.io import loadmat

from common import blob, noise, rounded, table, write_set

REVISION = "e99a7e13fe2adc8fc647321a156b6cb59a48a698"
FILE = "ParameterEstimation/SinglePendulum/SinglePendulumDataForParameterEstimation.mat"
RATE = 1000
KEPT = 10
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "swing_arm")

content = loadmat(io.BytesIO(blob(sys.argv[1], REVISION, FILE)))
times, angles = [], []
for part in ("id", "vad"):
    for own, piece in zip(content[f"Time_{part}"].ravel(), content[f"Y_{part}"].ravel()):
        times += own.ravel().tolist()
        angles += [value - math.pi for value in piece[0].tolist()]
assert all(abs(t - k / RATE) < 1e-6 for k, t in enumerate(times))
rows = [(f"{k / RATE:.2f}", f"{angles[k]:.6f}") for k in range(0, len(angles), KEPT)]
table(os.path.join(HERE, "data", "swing.csv"), ["time_s", "theta_rad"], rows)
sigma = noise([angles])
write_set(
    os.path.join(HERE, "set.json"),
    {
        "set": "swinging arm",
        "base_model": "arm",
        "sampling_Hz": RATE / KEPT,
        "channels": ["theta_rad"],
        "noise_std": {"theta_rad": rounded(sigma)},
        "experiments": [{"file": "data/swing.csv"}],
    },
)
print("noise of theta_rad:", sigma, "rad;", len(rows), "samples")
