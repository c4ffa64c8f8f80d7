"""Result files of `hyd simulate` read back by the programs that people use: every number must be the same in all formats."""
import json
import pathlib
import subprocess
import sys

import DyMat
import numpy as np
import pandas as pd
import polars as pl
import pyarrow.parquet as parquet
import scipy.io

HYD, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
MODELS = pathlib.Path("models").resolve()
CASES = ["single_acting_drive/drive.hyd", "single_acting_drive/rlclocked.hyd", "hydraulic_line/line.hyd"]


def simulate(model, result, *options):
    command = [HYD, "simulate", MODELS / model, "--result", result, *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def check_mat(path, table):
    mat = DyMat.DyMatFile(str(path))
    names = set(mat.names())
    for name in table.columns[1:]:
        if name not in names:  # protected variables are left out
            continue
        values = mat.data(name)
        if mat.block(name) == 2:
            assert np.array_equal(values, table[name].to_numpy()), f"{path}: {name}"
        else:
            assert np.all(values[0] == table[name]), f"{path}: {name}"
    assert len(names) > 0.9 * len(table.columns), f"{path}: {len(names)} names"
    raw = scipy.io.loadmat(path)
    assert raw["Aclass"][3].strip() == "binTrans"
    assert np.array_equal(raw["data_2"][0], table["time"]), "the time is the first row of data_2"
    assert list(raw["data_1"][0]) == [table["time"].iloc[0], table["time"].iloc[-1]], "start and stop in data_1"
    # Names are stored by columns: the k-th letters of all names make one string.
    by_column = {"".join(letters).strip() for letters in zip(*raw["name"])}
    assert all(len(letters) == raw["dataInfo"].shape[1] for letters in raw["name"])
    assert names <= by_column, f"{path}: DyMat and scipy read different names"
    # Aliases are stored once: fewer rows than names.
    assert raw["data_1"].shape[0] + raw["data_2"].shape[0] < raw["dataInfo"].shape[1] + 2


def check_parquet(path, table):
    by_pandas, by_polars = pd.read_parquet(path), pl.read_parquet(path)
    assert list(by_pandas.columns) == list(table.columns) == by_polars.columns
    assert np.array_equal(by_pandas.to_numpy(), table.to_numpy(), equal_nan=True)
    assert np.array_equal(by_polars.to_numpy(), table.to_numpy(), equal_nan=True)
    metadata = parquet.read_metadata(path).metadata
    for key in (b"units", b"descriptions", b"parameters"):
        assert isinstance(json.loads(metadata[key]), dict)


def check_linear(model, time):
    """The linear model by scipy, and its eigenvalues by numpy's own solver."""
    paths = [WORK / f"linear.{kind}" for kind in ("json", "mat")]
    for path in paths:
        command = [HYD, "linearize", MODELS / model, "--at", str(time), "--result", path]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    linear, mat = json.loads(paths[0].read_text()), scipy.io.loadmat(paths[1])
    for name in ("A", "eigenvalues"):
        assert np.array_equal(mat[name], np.array(linear[name])), name
    assert [name.strip() for name in mat["xName"]] == linear["states"]
    ours = np.array([complex(re, im) for re, im in linear["eigenvalues"]])
    theirs = list(np.linalg.eigvals(mat["A"]))
    for value in ours:
        k = int(np.argmin(np.abs(np.array(theirs) - value)))
        assert abs(theirs.pop(k) - value) <= 1e-8 * max(abs(value), np.abs(ours).max() * 1e-6), f"{model}: {value}"
    print(f"{model}: {len(ours)} eigenvalues at {time} s agree with numpy")


def main():
    check_linear("single_acting_drive/drive.hyd", 0.004)
    check_linear("servo_drive/drive.hyd", 0.05)
    for model in CASES:
        files = {kind: WORK / f"{pathlib.Path(model).stem}.{kind}" for kind in ("csv", "mat", "parquet")}
        for path in files.values():
            simulate(model, path)
        table = pd.read_csv(files["csv"])
        check_mat(files["mat"], table)
        check_parquet(files["parquet"], table)
        print(f"{model}: {len(table)} rows of {len(table.columns)} columns agree in csv, mat and parquet")


main()
