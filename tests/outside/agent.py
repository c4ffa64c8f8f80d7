"""Every tool of `hyd mcp`, called by the client of the protocol's authors (mcp), in both kinds of versions, which checks the form of all answers."""
import asyncio
import json
import pathlib
import shutil
import subprocess
import sys
import time

import jsonschema
from mcp import Client, StdioServerParameters
from mcp.client.stdio import stdio_client
from mcp.shared.exceptions import MCPError

HYD, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve() / "agent"
TOOLS = ["check", "explain", "documentation", "equations", "simulate", "sweep", "fit", "discover"]
ENDLESS = ("model Endless\n  Real x(start = 1, fixed = true);\n  Real y(start = 0, fixed = true);\nequation\n  der(x) = 1e3*y;\n"
           "  der(y) = -1e3*x;\n  annotation(experiment(StopTime = 1e9));\nend Endless;\n")


def text(result):
    return result.content[0].text


async def done(client, tool, arguments, **more):
    """The data of a call that succeeds."""
    result = await client.call_tool(tool, arguments, **more)
    assert not result.is_error, (tool, text(result))
    json.dumps(result.structured_content, allow_nan=False)
    return result.structured_content


async def tools(client):
    listed = (await client.list_tools()).tools
    assert [tool.name for tool in listed] == TOOLS
    for tool in listed:
        jsonschema.Draft202012Validator.check_schema(tool.input_schema)
        assert tool.description and tool.annotations is not None
    return {tool.name: tool for tool in listed}


async def work(client, place):
    """From a check to a report."""
    listed = await tools(client)
    found = await done(client, "check", {"file": "drive.hyd"})
    assert found["status"] == "done" and found["counts"]["states"] > 0, found
    assert len((await done(client, "explain", {"code": "E0401"}))["explanation"]) > 50
    spring = await done(client, "documentation", {"name": "Hyd.Translational.Components.Spring"})
    assert {one["name"]: one.get("unit") for one in spring["parameters"]}, spring
    shown = await done(client, "equations", {"file": "drive.hyd", "stage": "sorted", "lines": 5})
    assert shown["text"].count("\n") == 5 and "from_line 6" in shown["note"], shown
    for shot, p0 in enumerate((10e6, 14e6), start=1):
        arguments = {"file": "drive.hyd", "parameters": {"p0": p0, "spring.k": 27e3}, "variables": "^(y|p)$", "result": f"bench/shot{shot}.csv"}
        jsonschema.validate(arguments, listed["simulate"].input_schema)
        run = await done(client, "simulate", arguments)
        assert {one["name"]: one["unit"] for one in run["variables"]} == {"y": "m", "p": "Pa"}, run
        assert (place / run["result"]).stat().st_size > 1000

    heard = []

    async def hear(progress, total, message):
        heard.append((progress, total, message))

    swept = await done(client, "sweep", {"file": "drive.hyd", "vary": {"p0": "8e6:16e6:5"}, "variables": "^y$", "result": "runs"}, progress_callback=hear)
    assert swept["members"] == 5 and swept["failed"] == 0, swept
    assert heard and heard[-1][:2] == (5, 5) and heard == sorted(heard), heard
    fitted = await done(client, "fit", {"study": "bench.toml", "bench": "bench/set.json", "write_parameters": "fitted.toml", "report": "fit"})
    assert {"fitted.toml", "fit/fit.html", "fit/fit.toml"} <= set(fitted["files"]) and (place / "fit/fit.html").stat().st_size > 10000, fitted["files"]
    stiffness = [one for one in fitted["unknowns"] if one["name"] == "k"][0]
    assert abs(stiffness["value"] / 1.08 - 1) < 0.02, stiffness
    # Runs with the parameters as fitted; what is given by itself overrides them.
    last = [(await done(client, "simulate", {"file": "drive.hyd", "parameter_file": "fitted.toml", "variables": "^y$", **more}))["variables"][0]
            for more in ({}, {"parameters": {"spring.k": 60e3}})]
    assert last[0] != last[1], last
    assert (await done(client, "sweep", {"file": "drive.hyd", "parameter_file": "fitted.toml", "vary": {"p0": "8e6:16e6:2"}, "result": "again"}))["failed"] == 0
    heard.clear()
    report = await done(client, "discover", {"study": "bench.toml", "bench": "bench/set.json", "report": "report"}, progress_callback=hear)
    assert report["status"] and "report/report.html" in report["files"] and (place / "report/report.html").exists()
    assert heard and [one[0] for one in heard] == sorted({one[0] for one in heard}), heard


async def mistakes(client):
    for tool, arguments, said in [
        ("check", {"file": "../secret.hyd"}, "lies outside"),
        ("check", {"file": "/etc/passwd"}, "lies outside"),
        ("simulate", {"file": "drive.hyd", "result": "bench/set.csv/../../../x.csv"}, "lies outside"),
        ("simulate", {"file": "drive.hyd", "result": "drive.hyd"}, "must end in"),
        ("fit", {"study": "bench.toml", "bench": "bench/set.json", "write_parameters": "bench.toml"}, "is there already"),
        ("fit", {"study": "bench.toml", "bench": "bench/set.json", "report": "bench"}, "holds no `fit.html`"),
        ("simulate", {"file": "drive.hyd", "parameter_file": "../fitted.toml"}, "lies outside"),
        ("simulate", {"file": "drive.hyd", "stpo": 1}, "did you mean `stop`?"),
        ("simulate", {"file": "drive.hyd", "parameters": {"spring.kk": 1}}, "did you mean `spring.k`?"),
    ]:
        result = await client.call_tool(tool, arguments)
        assert result.is_error and said in text(result), (tool, arguments, text(result))
    try:
        await client.call_tool("simulat", {})
        raise AssertionError("a tool that is none was called")
    except MCPError as error:
        assert "did you mean `simulate`?" in str(error), error


async def taken_back(client):
    """A call that its caller gives up is ended, so that the next one is answered."""
    began = time.monotonic()
    call = asyncio.create_task(client.call_tool("simulate", {"file": "endless.hyd"}))
    await asyncio.sleep(1)
    call.cancel()
    await asyncio.gather(call, return_exceptions=True)
    await done(client, "check", {"file": "drive.hyd"})
    assert time.monotonic() - began < 60


async def conversation(mode):
    place = WORK / mode
    subprocess.run([HYD, "new", mode], cwd=WORK, check=True, capture_output=True)
    (place / "drive.hyd").exists() or sys.exit("there is no drive")
    (place / "endless.hyd").write_text(ENDLESS)
    server = StdioServerParameters(command=str(HYD), args=["mcp", str(place)])
    async with Client(stdio_client(server), mode=mode) as client:
        assert client.server_info.name == "hyd" and "check" in client.instructions
        version = client.protocol_version
        await work(client, place)
        await mistakes(client)
        await taken_back(client)
    return version


shutil.rmtree(WORK, ignore_errors=True)
WORK.mkdir(parents=True)
(WORK / "secret.hyd").write_text("model Secret\nend Secret;\n")
versions = [asyncio.run(conversation(mode)) for mode in ("legacy", "auto")]
assert versions == ["2025-11-25", "2026-07-28"], versions
print(f"hyd mcp: every tool is called as a client of other people calls it, in the versions {' and '.join(versions)}")
