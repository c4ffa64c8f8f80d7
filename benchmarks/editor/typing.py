#!/usr/bin/env python3
"""Types in a library of 100,000 lines and measures what an editor waits for.

    benchmarks/editor/typing.py HYD [--lines N] [--keys N]

Writes a library into a temporary folder: packages of components with connectors, records and functions, each class a file, and a system that
connects some of them.  Starts `hyd lsp`, opens the system and a component, and types declarations and equations into both, character by
character, each key as soon as the messages of the one before have come.  Prints the time from key to messages (95 of 100 are below the second
number), from process to readiness, of questions asked between keys, and the largest memory that the server has held; and of keys the CPU time that the
server spent between them, which other programs on the machine do not lengthen.
"""
import argparse
import json
import os
import pathlib
import queue
import statistics
import subprocess
import tempfile
import threading
import time

COMPONENT = 95


def component(package, name):
    lines = [f"within Big.{package};", f"model {name} \"a component\"", "  extends Big.Interfaces.TwoPort;"]
    count = (COMPONENT - 12) // 3
    lines += [f"  parameter Real k{k}(unit = \"N/m\", min = 0) = {k + 1} \"stiffness {k}\";" for k in range(count)]
    lines += [f"  Real f{k}(unit = \"N\") \"force {k}\";" for k in range(count)]
    lines += ["equation", "  x = a.x - b.x;", "  a.f + b.f = 0;", f"  a.f = {' + '.join(f'f{k}' for k in range(count))};"]
    lines += [f"  f{k} = k{k}*x;" for k in range(count)]
    lines += [f"end {name};", ""]
    return "\n".join(lines)


def library(folder, wanted):
    big, lines = folder / "Big", 0
    texts = {big / "package.hyd": "package Big\nend Big;\n"}
    texts[big / "Interfaces" / "package.hyd"] = "within Big;\npackage Interfaces\nend Interfaces;\n"
    texts[big / "Interfaces" / "Flange.hyd"] = (
        "within Big.Interfaces;\nconnector Flange\n  Real x(unit = \"m\");\n  flow Real f(unit = \"N\");\nend Flange;\n")
    texts[big / "Interfaces" / "TwoPort.hyd"] = (
        "within Big.Interfaces;\npartial model TwoPort\n  Flange a;\n  Flange b;\n  Real x(unit = \"m\");\nend TwoPort;\n")
    texts[big / "Interfaces" / "Wall.hyd"] = (
        "within Big.Interfaces;\nmodel Wall\n  Flange a;\nequation\n  a.x = 0;\nend Wall;\n")
    texts[big / "Interfaces" / "Push.hyd"] = (
        "within Big.Interfaces;\nmodel Push\n  Flange a;\n  parameter Real F(unit = \"N\") = 3;\nequation\n  a.f = -F*sin(time);\nend Push;\n")
    p = 0
    while lines < wanted:
        package = f"Domain{p}"
        texts[big / package / "package.hyd"] = f"within Big;\npackage {package}\nend {package};\n"
        for k in range(25):
            text = texts[big / package / f"Part{k}.hyd"] = component(package, f"Part{k}")
            lines += text.count("\n")
        p += 1
    parts = [f"  Domain{k % p}.Part{k % 25} part{k};" for k in range(20)]
    links = [f"  connect(part{k}.b, part{k + 1}.a);" for k in range(19)]
    links += ["  connect(wall.a, part0.a);", "  connect(part19.b, push.a);"]
    ends = ["  Interfaces.Wall wall;", "  Interfaces.Push push;", "  Real sum(start = 0, fixed = true);"]
    system = ["within Big;", "model System", *parts, *ends, "equation", *links, "  der(sum) = part0.x;", "end System;", ""]
    texts[big / "System.hyd"] = "\n".join(system)
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return sum(text.count("\n") for text in texts.values())


class Client:
    def __init__(self, hyd, folder):
        self.start = time.perf_counter()
        self.process = subprocess.Popen([hyd, "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.incoming, self.count = queue.Queue(), 0
        threading.Thread(target=self.listen, daemon=True).start()
        self.ask("initialize", {"processId": os.getpid(), "capabilities": {},
                                "workspaceFolders": [{"uri": folder.as_uri(), "name": "big"}]})
        self.ready = time.perf_counter() - self.start
        self.tell("initialized", {})

    def listen(self):
        while True:
            length = None
            while (line := self.process.stdout.readline().strip()):
                if line.lower().startswith(b"content-length:"):
                    length = int(line.split(b":")[1])
            if length is None:
                return
            self.incoming.put((time.perf_counter(), json.loads(self.process.stdout.read(length))))

    def send(self, message):
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self.process.stdin.flush()

    def tell(self, method, params):
        self.send({"method": method, "params": params})

    def until(self, fits):
        while True:
            moment, message = self.incoming.get(timeout=120)
            if fits(message):
                return moment, message

    def ask(self, method, params):
        """The answer and the seconds that it took."""
        self.count += 1
        begin = time.perf_counter()
        self.send({"id": self.count, "method": method, "params": params})
        moment, message = self.until(lambda message: message.get("id") == self.count and "method" not in message)
        assert "error" not in message, message
        return message["result"], moment - begin

    def messages(self, uri, version, begin):
        def fits(message):
            params = message.get("params") or {}
            published = message.get("method") == "textDocument/publishDiagnostics"
            return published and params["uri"] == uri and params.get("version") == version
        moment, message = self.until(fits)
        return message["params"]["diagnostics"], moment - begin

    def spent(self):
        """Seconds of a processor that the server has had; none where the system does not say."""
        tasks = pathlib.Path(f"/proc/{self.process.pid}/task").glob("*/schedstat")
        return sum(int(task.read_text().split()[0]) for task in tasks) / 1e9

    def memory(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return {key: int(line.split()[1]) / 1024 for line in status.splitlines() for key in ("VmRSS", "VmHWM") if line.startswith(key)}


def typed(client, path, line, words, keys, times, answers):
    """Types lines before a line of a file, again and again, and deletes them."""
    uri, text, version = path.as_uri(), path.read_text(), 0
    begin = time.perf_counter()
    client.tell("textDocument/didOpen", {"textDocument": {"uri": uri, "languageId": "hyd", "version": 0, "text": text}})
    first, opened = client.messages(uri, 0, begin)
    assert not [one for one in first if one["severity"] == 1], first
    position = {"line": line, "character": 0}

    def change(start, end, new):
        nonlocal version
        version += 1
        before, begin = client.spent(), time.perf_counter()
        client.tell("textDocument/didChange", {"textDocument": {"uri": uri, "version": version},
                                               "contentChanges": [{"range": {"start": start, "end": end}, "text": new}]})
        said, seconds = client.messages(uri, version, begin)
        times.append((seconds, not [one for one in said if one["severity"] == 1], client.spent() - before))
        return said
    done = 0
    while done < keys:
        for word in words:
            for k, key in enumerate(word):
                here = {"line": line, "character": k}
                change(here, here, key)
                done += 1
                if key == ".":
                    params = {"textDocument": {"uri": uri}, "position": {"line": line, "character": k + 1}}
                    answers.setdefault("completion", []).append(client.ask("textDocument/completion", params)[1])
            change({"line": line, "character": len(word)}, {"line": line, "character": len(word)}, "\n")
            said = change(position, {"line": line + 1, "character": 0}, "")
            assert not [one for one in said if one["severity"] == 1], said
    for method in ("hover", "definition"):
        for k in range(20):
            params = {"textDocument": {"uri": uri}, "position": {"line": 2 + k, "character": 14}}
            answers.setdefault(method, []).append(client.ask(f"textDocument/{method}", params)[1])
    for method in ("documentSymbol", "semanticTokens/full", "foldingRange", "inlayHint"):
        whole = {"start": {"line": 0, "character": 0}, "end": {"line": 10_000, "character": 0}}
        for _ in range(5):
            params = {"textDocument": {"uri": uri}, "range": whole}
            answers.setdefault(method, []).append(client.ask(f"textDocument/{method}", params)[1])
    return opened


def shown(name, times):
    times = sorted(times)
    least, most = statistics.median(times), times[min(len(times) - 1, int(0.95 * len(times)))]
    print(f"{name:<34}{1e3 * least:>9.1f}{1e3 * most:>9.1f}{1e3 * times[-1]:>9.1f}{len(times):>7}")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("hyd")
    arguments.add_argument("--lines", type=int, default=100_000)
    arguments.add_argument("--keys", type=int, default=300)
    arguments = arguments.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place).resolve()
        lines = library(folder, arguments.lines)
        client = Client(arguments.hyd, folder)
        system, part, answers = folder / "Big" / "System.hyd", folder / "Big" / "Domain1" / "Part3.hyd", {}
        of_system, of_part = [], []
        opened = typed(client, system, 22, ["Real further = part3.f2;", "Domain2.Part9 extra(k1 = 2);"], arguments.keys, of_system, answers)
        typed(client, part, 3, ["parameter Real more(unit = \"m\") = 2;", "Real y = 2*k3*a.x;"], arguments.keys, of_part, answers)
        before = client.memory()["VmRSS"]
        position = {"textDocument": {"uri": (folder / "Big" / "Domain1" / "Part3.hyd").as_uri()}, "position": {"line": 2, "character": 28},
                    "context": {"includeDeclaration": True}}
        found, first = client.ask("textDocument/references", position)
        again = client.ask("textDocument/references", position)[1]
        symbols = client.ask("workspace/symbol", {"query": "part17"})[1]
        memory = client.memory()
        print(f"{lines} lines; milliseconds{'':<11}   median  95/100      max  count")
        for name, times in (("system", of_system), ("component", of_part)):
            shown(f"key to messages, {name}", [seconds for seconds, _, _ in times])
            shown("  CPU time of the server", [cpu for _, _, cpu in times])
            shown("  of these, texts without errors", [seconds for seconds, fine, _ in times if fine])
            shown("  CPU time of the server", [cpu for _, fine, cpu in times if fine])
        for name, times in answers.items():
            shown(name, times)
        print(f"process to readiness {1e3 * client.ready:.0f} ms; first messages of the system {1e3 * opened:.0f} ms")
        print(f"references of a base class, {len(found)} found: {1e3 * first:.0f} ms, again {1e3 * again:.0f} ms; symbols {1e3 * symbols:.0f} ms")
        print(f"memory after typing {before:.0f} MB, after the references {memory['VmRSS']:.0f} MB, at most {memory['VmHWM']:.0f} MB")
        client.ask("shutdown", None)
        client.tell("exit", None)
        client.process.wait(timeout=30)


main()
