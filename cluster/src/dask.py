"""A client of Dask that answers questions on its standard input, a line of JSON each.

    {"submit": [0, 1], "name": ..., "script": ..., "folder": ..., "log": ...}   tasks, each a script of the shell with its number in HYD_TASK
    {"active": true}                                                            numbers of tasks that wait or run
    {"cancel": true}                                                            ends them

Answers are lines of JSON, too; {"error": ...} is a sentence. The end of the input ends the client.
"""
import json
import sys


def task(script, number, folder, log):
    """Runs on a worker, which needs nothing but Python and a shell."""
    import os
    import signal
    import socket
    import subprocess

    here = socket.gethostname()
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"there is no folder `{folder}` on {here}; it has to be on a file system that all machines share")
    environment = dict(os.environ, HYD_TASK=str(number))
    nothing = subprocess.DEVNULL
    process = subprocess.Popen(
        ["/bin/sh", "-c", script], cwd=folder, env=environment, stdin=nothing, stdout=nothing, stderr=nothing, start_new_session=True
    )
    try:
        return process.wait()
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


def say(**answer):
    print(json.dumps(answer), flush=True)


def keep_word(log, number, error):
    """What a task could not say itself, where the others do."""
    import os

    path = os.path.join(log, f"{number}.txt")
    if not os.path.exists(path):
        with open(path, "w", encoding="utf-8") as file:
            file.write(f"{type(error).__name__}: {error}\n")


def main():
    try:
        import dask
        from dask.distributed import Client
    except ImportError as error:
        return say(error=f"the package `dask.distributed` is missing in {sys.executable} ({error}); `pip install distributed` brings it")
    address = sys.argv[1] if len(sys.argv) > 1 else dask.config.get("scheduler-address", None)
    if not address:
        return say(error="no scheduler is named; write dask=ADDRESS, or set DASK_SCHEDULER_ADDRESS")
    try:
        client = Client(address, timeout=20)
    except Exception as error:
        return say(error=f"the scheduler at {address} cannot be reached: {error}")
    say(scheduler=client.scheduler.address)
    futures, attempts = {}, 0
    for line in sys.stdin:
        question = json.loads(line)
        try:
            if "submit" in question:
                attempts += 1
                log = question["log"]
                for number in question["submit"]:
                    key = f"{question['name']}-{number}-{attempts}"
                    future = client.submit(task, question["script"], number, question["folder"], log, key=key, pure=False)
                    futures[number] = (future, log)
                say(scheduler=client.scheduler.address)
            elif "active" in question:
                if client.status != "running":
                    raise ConnectionError(f"the connection to {address} is {client.status}")
                active = []
                for number, (future, log) in list(futures.items()):
                    if future.status == "pending":
                        active.append(number)
                        continue
                    if future.status == "error":
                        keep_word(log, number, future.exception(timeout=20))
                    del futures[number]
                say(active=active)
            else:
                client.cancel([future for future, _ in futures.values()], force=True)
                futures.clear()
                say(cancelled=True)
        except Exception as error:
            say(error=f"{type(error).__name__}: {error}")
    client.close(timeout=5)


main()
