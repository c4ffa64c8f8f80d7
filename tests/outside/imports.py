"""Records as pandas, polars and scipy write them, taken up by `hyd bench import`: every number must arrive."""
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pandas as pd
import polars as pl
import scipy.io

HYD, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
TIMES = np.arange(400) * 1e-3
LIFT = 2e-3 + 1e-3 * np.sin(40 * TIMES) + np.random.default_rng(1).normal(0, 1e-6, 400)


def imported(name, write):
    """The table of a file and what was said about it."""
    source, target = WORK / f"raw_{name}", WORK / f"bench_{name}"
    for folder in (source, target):
        shutil.rmtree(folder, ignore_errors=True)
    source.mkdir()
    write(source)
    done = subprocess.run([HYD, "bench", "import", source, "-o", target], capture_output=True, text=True)
    tables = list(target.glob("*.csv"))
    return (pd.read_csv(tables[0]) if tables else None), done


def same(table, **columns):
    # What changes its unit is written with twelve digits.
    for name, values in columns.items():
        np.testing.assert_allclose(table[name], values, rtol=5e-12, atol=1e-15, err_msg=name)


def by_pandas():
    """Snappy, dictionaries, smaller types, gaps, a column of dates and one of words."""
    frame = pd.DataFrame({
        "stamp": pd.Timestamp("2026-03-01 08:00") + pd.to_timedelta(np.arange(400), unit="ms"),
        "lift [mm]": 1e3 * LIFT,
        "count": np.arange(400, dtype=np.int32),
        "even": np.arange(400) % 2 == 0,
        "u": pd.array([None if k == 7 else k / 8 for k in range(400)], dtype="Float32"),
        "note": ["first shot"] * 400,
        # A slower clock in other units begins 250 ms later and must keep that distance.
        "other": (pd.Timestamp("2026-03-01 08:00:00.250") + pd.to_timedelta(np.arange(400), unit="ms")).astype("datetime64[ms]"),
    })
    table, done = imported("pandas", lambda folder: frame.to_parquet(folder / "shot.parquet"))
    assert done.returncode == 0, done.stderr
    assert "texts, not numbers: `note`" in done.stderr, done.stderr
    gap = np.array([np.nan if k == 7 else k / 8 for k in range(400)])
    same(table, time_s=TIMES, lift=LIFT, count=np.arange(400), even=(np.arange(400) % 2 == 0).astype(float), u=gap,
         other=TIMES + 0.25)


def by_polars():
    frame = pl.DataFrame({"t": TIMES, "lift": LIFT})
    table, done = imported("polars", lambda folder: frame.write_parquet(folder / "shot.parquet", compression="snappy"))
    assert done.returncode == 0, done.stderr
    same(table, time_s=TIMES, lift=LIFT)
    table, done = imported("zstd", lambda folder: frame.write_parquet(folder / "shot.parquet", compression="zstd"))
    assert done.returncode == 0, done.stderr
    same(table, time_s=TIMES, lift=LIFT)
    table, done = imported("gzip", lambda folder: frame.write_parquet(folder / "shot.parquet", compression="gzip"))
    assert done.returncode == 1 and table is None and "compressed with gzip" in done.stderr, done.stderr


def by_scipy():
    """Structures, a log of Simulink with its signals, and a matrix with a signal in each row."""
    plain = {"bench": {"t": TIMES, "rig": {"lift": LIFT, "note": "first shot"}}}
    table, done = imported("structure", lambda folder: scipy.io.savemat(folder / "shot.mat", plain, do_compression=True))
    assert done.returncode == 0, done.stderr
    same(table, time_s=TIMES, rig_lift=LIFT)

    def log(values):
        signals = {"values": values[:, None], "dimensions": 1.0, "label": ""}
        return {"time": TIMES[:, None], "signals": signals, "blockName": "rig/To Workspace"}

    logs = {"Lift": log(LIFT), "Count": log(np.arange(400.0))}
    table, done = imported("simulink", lambda folder: scipy.io.savemat(folder / "shot.mat", logs))
    assert done.returncode == 0, done.stderr
    same(table, time_s=TIMES, Lift=LIFT, Count=np.arange(400))
    cells = np.empty(2, dtype=object)
    cells[:] = [TIMES, LIFT]
    own = {"runs": cells, "t": TIMES}
    table, done = imported("cells", lambda folder: scipy.io.savemat(folder / "shot.mat", own))
    assert done.returncode == 0, done.stderr
    same(table, time_s=TIMES, runs_1=TIMES, runs_2=LIFT)
    rows = {"t": TIMES, "log": np.vstack([LIFT, np.arange(400)])}
    table, done = imported("rows", lambda folder: scipy.io.savemat(folder / "shot.mat", rows))
    assert done.returncode == 0, done.stderr
    same(table, time_s=TIMES, log_1=LIFT, log_2=np.arange(400))


by_pandas()
by_polars()
by_scipy()
print("records of pandas, polars and scipy: every number arrived")
