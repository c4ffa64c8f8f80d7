"""Sweeps shared out to HyperQueue, Slurm and Dask on one machine; see `cluster` beside this file.

For each engine: 10,000 drives in 40 shards while workers are killed (SIGKILL) five times in the middle; the submitting process killed and resumed; a shard that
runs twice at the same time; a search of three processes. Once: all shards by hand, a file system that is full, one that shows files late, tasks cancelled, a program that no node can run.
"""
import contextlib
import hashlib
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

HYD = pathlib.Path(sys.argv[1]).resolve()
WORK = pathlib.Path(sys.argv[2]).resolve()
WANTED = sys.argv[3:] or ["hand", "hq", "slurm", "dask", "costs"]
BIN = pathlib.Path(sys.executable).parent
ROOT = pathlib.Path(__file__).resolve().parents[2]
DRIVE = ROOT / "models/single_acting_drive/drive.hyd"
SEARCH = [HYD, "discover", ROOT / "models/single_acting_drive/bench.toml", "--bench", ROOT / "tests/data/bench/B03.json"]
RUNS, SHARDS, KILLS = 10_000, 40, 5
ENVIRONMENT = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}:/usr/sbin:/sbin", "HYD_PYTHON": sys.executable}
IS_ROOT = hasattr(os, "geteuid") and os.geteuid() == 0
# Some draws lie outside of the limits, so that runs fail.
PLAN = f"""model = "{DRIVE}"
samples = {{runs}}
seed = 5
stop = 0.01
variables = "^(y|p_R)$"
rows = {{rows}}
measure = {{measure}}
[[vary]]
parameter = "p0"
values = "uniform(8e6, 12e6)"
[[vary]]
parameter = "C"
values = "normal(1e-3, 4e-4)"
"""


def run(*command, check=True, **options):
    """A command of the environment; what it printed and said."""
    done = subprocess.run([str(own) for own in command], capture_output=True, text=True, env=ENVIRONMENT, **options)
    if check and done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done


def start(*command, log, **options):
    """A process that goes on, in a group of its own."""
    options.setdefault("env", ENVIRONMENT)
    with open(WORK / log, "a") as file:
        return subprocess.Popen([str(own) for own in command], stdout=file, stderr=file, stdin=subprocess.DEVNULL, start_new_session=True, **options)


def wait_for(what, question, seconds=60):
    begin = time.monotonic()
    while True:
        with contextlib.suppress(AssertionError, OSError, json.JSONDecodeError, FileNotFoundError):
            if question():
                return
        if time.monotonic() - begin > seconds:
            raise AssertionError(f"{what}: not within {seconds} s")
        time.sleep(0.2)


def processes():
    return [int(entry.name) for entry in pathlib.Path("/proc").iterdir() if entry.name.isdigit()]


def parent_of(pid):
    with contextlib.suppress(OSError, ValueError, IndexError):
        return int(pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    return 0


def name_of(pid):
    with contextlib.suppress(OSError):
        return pathlib.Path(f"/proc/{pid}/comm").read_text().strip()
    return ""


def environment(pid):
    with contextlib.suppress(OSError):
        return pathlib.Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace")
    return ""


def children(pid):
    """Processes below one."""
    own = [child for child in processes() if parent_of(child) == pid]
    return own + [below for child in own for below in children(child)]


def kill(*pids):
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def end(process):
    """Ends a process with all that it has started."""
    kill(*children(process.pid), process.pid)
    process.wait()


def free_port():
    with socket.socket() as own:
        own.bind(("127.0.0.1", 0))
        return own.getsockname()[1]


def digest(folder):
    return [hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in ("members.parquet", "rows.parquet") if (folder / name).exists()]


def plan(name, runs, rows=False):
    # Small sweeps measure their runs as well.
    path, measure = WORK / f"{name}.toml", '["max(y)"]' if runs < 1000 else "[]"
    path.write_text(PLAN.format(runs=runs, rows=str(rows).lower(), measure=measure))
    return path


def there():
    """Engines that are installed."""
    programs = {"hq": "hq", "slurm": "slurmctld"}
    found = {name for name, program in programs.items() if shutil.which(program, path=ENVIRONMENT["PATH"])}
    return found | {"dask"}


class HyperQueue:
    """A server and three workers."""

    name = "hq"

    def __enter__(self):
        self.folder = WORK / "hq-server"
        self.on = f"hq={self.folder}"
        self.server = start("hq", "server", "start", "--server-dir", self.folder, log="hq-server.log")
        wait_for("HyperQueue", lambda: run("hq", "--server-dir", self.folder, "server", "info"))
        self.workers = [self.worker() for _ in range(3)]
        wait_for("workers", lambda: self.count() == 3)
        return self

    def count(self):
        return len(json.loads(run("hq", "--server-dir", self.folder, "--output-mode", "json", "worker", "list").stdout))

    def worker(self):
        return start("hq", "worker", "start", "--server-dir", self.folder, "--cpus", "1", log="hq-worker.log")

    def kill_one(self):
        place = random.randrange(3)
        old = self.workers[place]
        kill(old.pid)
        old.wait()
        self.workers[place] = self.worker()

    def __exit__(self, *_):
        for process in [*self.workers, self.server]:
            end(process)


class Dask:
    """A scheduler and three workers, which no nanny starts again."""

    name = "dask"

    def __enter__(self):
        self.port = free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.on = f"dask={self.address}"
        self.scheduler = start(sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard", log="dask-scheduler.log")
        self.workers = [self.worker() for _ in range(3)]
        ask = f"from distributed import Client; c = Client('{self.address}', timeout=5); print(len(c.scheduler_info(n_workers=-1)['workers']))"
        wait_for("Dask", lambda: run(sys.executable, "-c", ask).stdout.strip() == "3")
        return self

    def worker(self):
        return start(sys.executable, "-m", "distributed.cli.dask_worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", WORK / "dask", log="dask-worker.log")

    def kill_one(self):
        place = random.randrange(3)
        old = self.workers[place]
        kill(old.pid)
        old.wait()
        self.workers[place] = self.worker()

    def __exit__(self, *_):
        for process in [*self.workers, self.scheduler]:
            end(process)


class Slurm:
    """A controller and two node daemons of two processors each, with munge."""

    name = "slurm"
    on = "slurm"
    CONF = """ClusterName=loopback
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
AuthType=auth/munge
AuthInfo=socket={place}/munge.socket,cred_expire=10
CredType=cred/munge
SlurmUser={user}
SlurmdUser={user}
StateSaveLocation={place}/state
SlurmdSpoolDir={place}/%n
SlurmctldPidFile={place}/slurmctld.pid
SlurmdPidFile={place}/%n.pid
SlurmctldLogFile={place}/slurmctld.log
SlurmdLogFile={place}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,bf_interval=2,defer
SlurmdTimeout=5
KillWait=2
ReturnToService=2
MinJobAge=30
NodeName=node1 NodeHostname={host} NodeAddr=127.0.0.1 Port={first} CPUs=2 State=UNKNOWN
NodeName=node2 NodeHostname={host} NodeAddr=127.0.0.1 Port={second} CPUs=2 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""

    def __enter__(self):
        self.place = WORK / "slurm"
        for name in ("state", "node1", "node2"):
            (self.place / name).mkdir(parents=True, exist_ok=True)
        host = socket.gethostname().split(".")[0]
        user = run("id", "-un").stdout.strip()
        conf = self.CONF.format(host=host, place=self.place, user=user, port=free_port(), first=free_port(), second=free_port())
        (self.place / "slurm.conf").write_text(conf)
        # No processes are contained; older versions want a plugin nevertheless.
        version = [int(own) for own in run("slurmd", "-V").stdout.split()[1].split(".")[:2]]
        plugin = "disabled" if version >= [23, 2] else "cgroup/v1"
        (self.place / "cgroup.conf").write_text(f"CgroupPlugin={plugin}\n")
        ENVIRONMENT["SLURM_CONF"] = str(self.place / "slurm.conf")
        key = self.place / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        self.munge = start(
            "munged", "--foreground", "--force", f"--key-file={key}", f"--socket={self.place}/munge.socket", f"--pid-file={self.place}/munge.pid",
            f"--seed-file={self.place}/munge.seed", f"--log-file={self.place}/munge.log", log="munge.log",
        )
        wait_for("munge", lambda: (self.place / "munge.socket").exists())
        self.controller = start("slurmctld", "-D", "-c", log="slurmctld.log")
        wait_for("Slurm", lambda: run("sinfo"))
        self.nodes, self.returning = {name: self.node(name) for name in ("node1", "node2")}, []
        wait_for("nodes", lambda: run("sinfo", "-h", "-o", "%T %D").stdout.strip() == "idle 2")
        return self

    def node(self, name):
        return start("slurmd", "-D", "-N", name, log="slurmd.log")

    def kill_one(self):
        """The daemon of a node and all that it has started die together, as in a node without power; it comes back when it has been missed."""
        wait_for("a node that lives", lambda: any(self.nodes.values()))
        name = random.choice([name for name, process in self.nodes.items() if process])
        old, self.nodes[name] = self.nodes[name], None
        mine = [pid for pid in processes() if f"SLURMD_NODENAME={name}\0" in environment(pid) and str(self.place) in environment(pid)]
        steps = [parent for parent in map(parent_of, mine) if name_of(parent).startswith("slurmstepd")]
        kill(old.pid, *children(old.pid), *steps, *mine)
        old.wait()

        def come_back():
            wait_for("a node that is missed", lambda: run("sinfo", "-h", "-n", name, "-o", "%T").stdout.startswith("down"))
            self.nodes[name] = self.node(name)

        self.returning.append(threading.Thread(target=come_back))
        self.returning[-1].start()

    def __exit__(self, *_):
        for thread in self.returning:
            thread.join()
        for process in [*self.nodes.values(), self.controller, self.munge]:
            end(process)
        del ENVIRONMENT["SLURM_CONF"]


def local(name, runs, rows=False):
    """The sweep of one process: its plan, its digests, what it printed."""
    path, folder = plan(name, runs, rows), WORK / f"{name}-local"
    begin = time.monotonic()
    done = run(HYD, "sweep", path, "--allow-outside", "--result", folder)
    print(f"  one process, all cores: {time.monotonic() - begin:.1f} s; {done.stdout.splitlines()[0]}", flush=True)
    return path, digest(folder), done


def same_words(shared, alone):
    """Failures are counted and explained as on one machine."""
    told = lambda text: [line for line in text.splitlines() if not line.startswith("warning: shard")]
    assert shared.stdout.splitlines()[0] == alone.stdout.splitlines()[0], (shared.stdout, alone.stdout)
    assert told(shared.stderr) == told(alone.stderr), (shared.stderr, alone.stderr)


def killed_workers(engine, path, wanted, alone):
    """Workers are killed five times in the middle."""
    folder = WORK / f"{engine.name}-killed"
    parts = folder / "parts"
    done = lambda: len(list(parts.glob("members-*.parquet"))) if parts.is_dir() else 0
    kills = []

    def murderer():
        for k in range(KILLS):
            while not finished.is_set() and done() < (k + 1) * SHARDS // (KILLS + 2):
                time.sleep(0.02)
            if finished.is_set():
                return
            kills.append(done())
            engine.kill_one()

    finished = threading.Event()
    thread = threading.Thread(target=murderer)
    thread.start()
    begin = time.monotonic()
    shared = run(HYD, "sweep", path, "--allow-outside", "--on", engine.on, "--shards", SHARDS, "--settle", "5", "--result", folder)
    seconds = time.monotonic() - begin
    finished.set()
    thread.join()
    assert len(kills) == KILLS and all(0 < own < SHARDS for own in kills), kills
    assert digest(folder) == wanted, "the table is another one"
    same_words(shared, alone)
    failed = sum(line.startswith("warning: shard") for line in shared.stderr.splitlines())
    print(f"  {RUNS} runs, workers killed when {kills} of {SHARDS} shards were done: {seconds:.1f} s, the same bytes; {failed} shards submitted again", flush=True)


def killed_submitter(engine, path, wanted):
    """The submitting process is killed, and the command given again."""
    folder = WORK / f"{engine.name}-resumed"
    command = [HYD, "sweep", path, "--allow-outside", "--on", engine.on, "--shards", SHARDS, "--settle", "5", "--result", folder]
    process = start(*command, log="submitter.log")
    wait_for("the first shards", lambda: len(list((folder / "parts").glob("members-*.parquet"))) >= 3)
    end(process)
    refused = run(*command, check=False)
    assert refused.returncode == 1 and "--resume goes on with it" in refused.stderr, refused.stderr
    first = len(list((folder / "parts").glob("members-*.parquet")))
    assert first < SHARDS, first
    resumed = run(*command, "--resume")
    assert digest(folder) == wanted
    assert "of them before" in resumed.stdout, resumed.stdout
    jobs = [json.loads(line) for line in (folder / "submission/jobs.jsonl").read_text().splitlines()]
    print(f"  submitting process killed after {first} shards and resumed: the same bytes; tasks submitted: {[own['tasks'] for own in jobs]}", flush=True)


def cancelled(engine, path, wanted):
    """What is cancelled can be resumed."""
    folder = WORK / f"{engine.name}-cancelled"
    command = [HYD, "sweep", path, "--allow-outside", "--on", engine.on, "--shards", SHARDS, "--settle", "2", "--result", folder]
    process = start(*command, log="submitter.log")
    wait_for("the first shards", lambda: len(list((folder / "parts").glob("members-*.parquet"))) >= 2)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 3, process.returncode
    time.sleep(1)
    first = len(list((folder / "parts").glob("members-*.parquet")))
    time.sleep(2)
    assert len(list((folder / "parts").glob("members-*.parquet"))) <= first + 4, "tasks go on after the interrupt"
    assert first < SHARDS, first
    if engine.name != "dask":
        said = run(HYD, "sweep", "cancel", folder).stdout
        assert "were cancelled" in said, said
    run(*command, "--resume")
    assert digest(folder) == wanted
    print(f"  interrupted after {first} shards, tasks cancelled, resumed: the same bytes", flush=True)


def searched(engine, wanted):
    """A search that three processes make together, one of which is killed twice: the report of one process, but for its seconds."""
    folder = WORK / f"{engine.name}-search"
    answers = lambda: len(list(folder.glob("search/*/answers/" + "[0-9a-f]" * 16)))
    kills = []

    def murderer():
        for enough in (5, 30):
            while not finished.is_set() and answers() < enough:
                time.sleep(0.02)
            if not finished.is_set():
                kills.append(answers())
                engine.kill_one()

    finished = threading.Event()
    thread = threading.Thread(target=murderer)
    thread.start()
    begin = time.monotonic()
    run(*SEARCH, "--report", folder, "--on", engine.on, "--shards", "3", "--settle", "5", "--threads", "1")
    seconds = time.monotonic() - begin
    finished.set()
    thread.join()
    assert len(kills) == 2, kills
    assert found(folder) == wanted, "the report is another one"
    assert not (folder / "search").exists()
    print(f"  a search, workers killed when {kills} tasks were done: {seconds:.1f} s, the same report", flush=True)


def found(folder):
    """What a search has found, without what a clock says."""
    report = json.loads((folder / "report.json").read_text())
    assert report.pop("seconds") > 0
    return report, (folder / "discovered.hyd").read_text()


def rows_kept(engine):
    """All rows of some runs."""
    path, wanted, alone = local("rows", 200, rows=True)
    folder = WORK / f"{engine.name}-rows"
    shared = run(HYD, "sweep", path, "--allow-outside", "--on", engine.on, "--shards", "7", "--result", folder)
    assert digest(folder) == wanted and len(wanted) == 2
    same_words(shared, alone)
    print("  200 runs with all rows in 7 shards: the same bytes of both tables", flush=True)


def by_hand():
    """Without an engine: shards twice at once, a damaged file, a member missing, a full file system."""
    path, wanted, alone = local("hand", 800)
    folder = WORK / "hand"
    ready = json.loads(run(HYD, "sweep", path, "--allow-outside", "--shards", "8", "--result", folder, "--json").stdout)
    assert ready["status"] == "ready" and ready["shards"] == 8, ready
    again = [subprocess.Popen([*ready["command"], str(k % 8)], stdout=subprocess.DEVNULL, env={}) for k in (0, 0, 1, 1, 2)]
    assert [own.wait() for own in again] == [0] * 5
    early = run(HYD, "sweep", "merge", folder, check=False)
    assert early.returncode == 1 and "5 of 8 chunks have not been run" in early.stderr, early.stderr
    for k in range(3, 8):
        run(*ready["command"], str(k))
    part = folder / "parts/members-000004.parquet"
    whole = part.read_bytes()
    part.write_bytes((folder / "parts/members-000005.parquet").read_bytes())
    twice = run(HYD, "sweep", "merge", folder, check=False)
    assert twice.returncode == 1 and "does not hold the members" in twice.stderr, twice.stderr
    part.write_bytes(whole[: len(whole) // 2])
    cut = run(HYD, "sweep", "merge", folder, check=False)
    assert cut.returncode == 1 and "members-000004.parquet" in cut.stderr, cut.stderr
    part.unlink()
    run(*ready["command"], "4")
    assert part.read_bytes() == whole, "a shard that runs again leaves other bytes"
    run(HYD, "sweep", "merge", folder)
    assert digest(folder) == wanted
    print("  by hand: shards twice at once, exchanged, cut off, run again: refused or the same bytes", flush=True)


def full_disk(engine):
    """The file system of the results is full; then it is larger."""
    if not IS_ROOT:
        return print("  left out, needs root: a full file system", flush=True)
    path, wanted, _ = local("full", 200, rows=True)
    folder = WORK / "full"
    folder.mkdir()
    try:
        command = [HYD, "sweep", path, "--allow-outside", "--on", engine.on, "--shards", "6", "--settle", "2", "--result", folder]
        size = HYD.with_name("hyd-launcher").stat().st_size // 1024 + 400
        run("mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", folder)
        failed = run(*command, check=False)
        assert failed.returncode == 1 and "No space left on device" in failed.stderr and "were given up" in failed.stderr, failed.stderr
        assert not (folder / "members.parquet").exists()
        run("mount", "-o", "remount,size=200m", folder)
        run(*command, "--resume")
        assert digest(folder) == wanted
        left = [own.name for own in (folder / "parts").iterdir() if own.name.startswith(".")]
        assert left == [], left
    finally:
        run("umount", "-l", folder, check=False)
    print(f"  full file system: told ({failed.stderr.strip().splitlines()[-1][:100]}...), and resumed with the same bytes", flush=True)


def slow_files(engine):
    """The workers see another folder than the submitting process; files are carried over after some seconds, as by a slow file system."""
    if not IS_ROOT or run("unshare", "-m", "true", check=False).returncode != 0:
        return print("  left out, needs root: a file system that shows files late", flush=True)
    path, wanted, _ = local("slow", 200)
    near, far = WORK / "slow", WORK / "slow-far"
    near.mkdir()
    far.mkdir()
    stop = threading.Event()

    def carry():
        seen = {}
        while not stop.is_set():
            for source, target in ((near, far), (far, near)):
                for file in sorted(source.rglob("*")):
                    place = target / file.relative_to(source)
                    if file.is_dir():
                        place.mkdir(parents=True, exist_ok=True)
                        continue
                    since = seen.setdefault(file, time.monotonic())
                    if file.name.startswith(".") or place.exists() or time.monotonic() - since < 4:
                        continue
                    with contextlib.suppress(FileNotFoundError):
                        shutil.copy2(file, place.with_name(f".{place.name}.carried"))
                        place.with_name(f".{place.name}.carried").rename(place)
            time.sleep(0.2)

    thread = threading.Thread(target=carry)
    thread.start()
    server = WORK / "hq-far"
    own = [start("hq", "server", "start", "--server-dir", server, log="hq-far.log")]
    try:
        wait_for("HyperQueue", lambda: run("hq", "--server-dir", server, "server", "info"))
        script = f"mount --bind {far} {near} && exec hq worker start --server-dir {server} --cpus 2"
        own.append(start("unshare", "-m", "sh", "-c", script, log="hq-far.log"))
        begin = time.monotonic()
        shared = run(HYD, "sweep", path, "--allow-outside", "--on", f"hq={server}", "--shards", "6", "--settle", "20", "--result", near)
        seconds = time.monotonic() - begin
        assert digest(near) == wanted and "warning: shard" not in shared.stderr, shared.stderr
    finally:
        stop.set()
        thread.join()
        for process in reversed(own):
            end(process)
    print(f"  files seen after 4 s in both directions: {seconds:.1f} s, no shard twice, the same bytes", flush=True)


def not_runnable(engine):
    """A program that cannot run on the nodes is refused in words."""
    path, folder = plan("broken", 200), WORK / "broken"
    run(HYD, "sweep", path, "--allow-outside", "--shards", "3", "--result", folder)
    program = folder / "submission/model"
    good = program.read_bytes()
    program.write_bytes(b"#!/no/such/interpreter\n")
    changed = run(HYD, "sweep", path, "--allow-outside", "--on", engine.on, "--resume", "--result", folder, check=False)
    assert changed.returncode == 1 and "is not the file that was shipped" in changed.stderr, changed.stderr
    program.write_bytes(good)
    run(HYD, "sweep", path, "--allow-outside", "--on", engine.on, "--resume", "--result", folder)
    print("  a changed executable is refused; shards that were made ready by hand are taken over by an engine", flush=True)


def costs():
    """What a shard costs beside its runs, and what engines add."""
    cpu = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    times = {}
    for runs in (1000, 10_000):
        path, folder = plan(f"cost-{runs}", runs), WORK / f"cost-{runs}"
        ready = json.loads(run(HYD, "sweep", path, "--allow-outside", "--shards", "1", "--result", folder, "--json").stdout)
        samples = []
        for _ in range(5):
            shutil.rmtree(folder / "parts")
            (folder / "parts").mkdir()
            begin, used = time.monotonic(), cpu()
            run(*ready["command"], "0")
            samples.append((time.monotonic() - begin, cpu() - used))
        times[runs] = [min(own[k] for own in samples) for k in (0, 1)]
        size = sum(own.stat().st_size for own in (folder / "parts").iterdir())
        print(f"  a shard of {runs} runs: {1e3 * times[runs][0]:.1f} ms ({1e3 * times[runs][1]:.1f} ms of a processor), {size / runs:.0f} bytes a run", flush=True)
    path, folder = plan("cost-1", 1), WORK / "cost-1"
    ready = json.loads(run(HYD, "sweep", path, "--allow-outside", "--shards", "1", "--result", folder, "--json").stdout)
    samples = []
    for _ in range(30):
        shutil.rmtree(folder / "parts")
        (folder / "parts").mkdir()
        begin = time.monotonic()
        run(*ready["command"], "0")
        samples.append(time.monotonic() - begin)
    samples.sort()
    # A shard of one run is measured by itself: the difference of long ones is lost in what the speed of the machine changes meanwhile.
    one_run = (times[10_000][0] - times[1000][0]) / 9000
    beside = samples[15] - one_run
    print(f"  a run: {1e3 * one_run:.3f} ms; one run as a shard: median {1e3 * samples[15]:.1f} ms")
    print(f"  shard of 1000 runs, overhead of a run: {beside:.4f} ms", flush=True)
    # What the engine adds to a shard: many shards of one run, of which a worker does some at a time.
    many = 200
    path = plan("many", many)
    for engine, width in ((HyperQueue(), 3), (Dask(), 3), (Slurm(), 4)):
        if engine.name not in there():
            continue
        with engine:
            folder = WORK / f"many-{engine.name}"
            begin = time.monotonic()
            run(HYD, "sweep", path, "--allow-outside", "--on", engine.on, "--shards", str(many), "--result", folder)
            seconds = time.monotonic() - begin
            print(f"  {engine.name}: {many} shards of one run in {seconds:.1f} s, {1e3 * seconds / many:.1f} ms a shard with {width} at a time", flush=True)
    files = 1000
    path, folder = plan("merge", 10 * files), WORK / "merge"
    ready = json.loads(run(HYD, "sweep", path, "--allow-outside", "--shards", str(files), "--result", folder, "--json").stdout)
    run(HYD, "sweep", path, "--allow-outside", "--result", folder)
    begin = time.monotonic()
    run(HYD, "sweep", "merge", folder)
    print(f"  merge of {files} files of 10 runs: {1e3 * (time.monotonic() - begin) / files:.2f} ms a file", flush=True)


def main():
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    random.seed(11)
    missing = []
    if "hand" in WANTED:
        print("by hand", flush=True)
        by_hand()
    engines = {"hq": HyperQueue, "slurm": Slurm, "dask": Dask}
    chosen = [name for name in engines if name in WANTED]
    if chosen:
        print(f"{RUNS} drives", flush=True)
        path, wanted, alone = local("drives", RUNS)
        assert "failed" in alone.stderr
        begin = time.monotonic()
        run(*SEARCH, "--report", WORK / "search-local")
        print(f"  a search in one process, all cores: {time.monotonic() - begin:.1f} s", flush=True)
    for name in chosen:
        print(name, flush=True)
        if name not in there():
            print("  left out: it is not installed", flush=True)
            missing.append(name)
            continue
        with engines[name]() as engine:
            killed_workers(engine, path, wanted, alone)
            killed_submitter(engine, path, wanted)
            cancelled(engine, path, wanted)
            rows_kept(engine)
            searched(engine, found(WORK / "search-local"))
            if name == "hq":
                full_disk(engine)
                slow_files(engine)
                not_runnable(engine)
            for folder in WORK.glob("rows-local*"):
                shutil.rmtree(folder)
    if "costs" in WANTED:
        print("costs", flush=True)
        costs()
    if missing:
        sys.exit(f"not tried: {', '.join(missing)}")


if __name__ == "__main__":
    main()
