"""Builds the measured programs of bench/drivers and runs them, each run in a process of its own."""
import json
import os
import pathlib
import platform
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BIN = ROOT / "build" / "release" / "bin"
CLOUDS = ROOT / "build" / "bench" / "clouds"


class Failed(Exception):
    """A program could not be run, or its result is wrong."""


def build(target):
    """Installs missing packages of Debian and builds `target` as Wellspace ships."""
    subprocess.run([ROOT / "deploy" / "install-deps.sh", "build", "bench"], check=True)
    configure = ["cmake", "--preset", "release", "-DWELLSPACE_BENCH=ON"]
    subprocess.run(configure, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", "--preset", "release", "--target", target], cwd=ROOT, check=True)


def run(folder, program, path, *arguments):
    """Runs bench_PROGRAM on the points in `path` and returns its report."""
    command = [str(pathlib.Path(folder) / f"bench_{program}"), str(path), *map(str, arguments)]
    try:
        result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    except OSError as error:
        raise Failed(f"{error}; bench/compare builds it") from error
    if result.returncode != 0:
        reason = result.stderr.strip() or f"it ended with {result.returncode}"
        raise Failed(f"{' '.join(command)}: {reason}")
    return json.loads(result.stdout)


def first_line(*command):
    """The first line of a command's output, or an empty string."""
    try:
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True,
                              check=True).stdout.partition("\n")[0].strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def machine():
    """The machine, the time and the programs of a measurement."""
    model = ""
    for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            model = line.partition(":")[2].strip()
            break
    peers = ["libtet1.5", "libcgal-dev", "voro++-dev"]
    versions = {peer: first_line("dpkg-query", "--show", "--showformat=${Version}", peer) for peer in peers}
    return {"time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), "processor": model, "cores": os.cpu_count(),
            "load": os.getloadavg()[0], "kernel": platform.release(), "compiler": first_line("c++", "--version"),
            "commit": first_line("git", "-c", "safe.directory=*", "describe", "--always", "--dirty"), "peers": versions}
