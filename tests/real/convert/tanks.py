"""Cascaded tanks: dataBenchmark.csv to a training record and a test record.

Usage: tanks.py BARE_GIT_DIRECTORY   (of forgi86/sysid-neural-continuous; standard library only)

Numbers are copied as they stand.  Sample k is at the time 4 k s; the clock of the test record begins at 10000 s.  The pump holds its voltage
for a sample period.
"""

import csv
import io
import os
import sys

from common import blob, noise, rounded, table, write_set

REVISION = "956aa7ecd73061b0321c6f6098d74c9e4a7ce67a"
PERIOD = 4
TEST_BEGINS = 10000
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "tanks")

text = blob(sys.argv[1], REVISION, "examples/CTS/data/dataBenchmark.csv").decode()
rows = [row for row in csv.DictReader(io.StringIO(text)) if row["uEst"]]
assert len(rows) == 1024
train = [(PERIOD * k, row["uEst"], row["yEst"]) for k, row in enumerate(rows)]
test = [(TEST_BEGINS + PERIOD * k, row["uVal"], row["yVal"]) for k, row in enumerate(rows)]
header = ["time_s", "u_V", "y_V"]
table(os.path.join(HERE, "data", "train.csv"), header, train)
table(os.path.join(HERE, "data", "test.csv"), header, test)
sigma = noise([[float(y) for _, _, y in train]])
write_set(
    os.path.join(HERE, "set.json"),
    {
        "set": "cascaded tanks",
        "base_model": "tanks",
        "sampling_Hz": 1 / PERIOD,
        "channels": ["y_V"],
        "noise_std": {"y_V": rounded(sigma)},
        "sensor_offset_1sigma": {"y_V": 0.5},
        "parameter_tolerance_1sigma": {"k_1": 0.5, "k_2": 0.5, "k_p": 0.5},
        "experiments": [{"file": "data/train.csv"}],
    },
)
print("noise of y_V:", sigma, "V")
