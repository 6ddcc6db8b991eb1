"""A Debian of its own in a folder, for tests of what is installed there. Wants root, debootstrap, unshare and a
mirror."""

import os
import pathlib
import shutil
import subprocess

TOOLS = ["debootstrap", "unshare"]
# A mount namespace of its own for all that is started there, with its own /proc, which is gone with the process.
_IN_ROOT = 'mount -t proc proc "$0/proc" && exec chroot "$0" "$@"'
_LONG = 3000


def is_possible(*tools):
    """Whether this user and machine can have such a root, and have `tools`."""
    return os.geteuid() == 0 and all(map(shutil.which, [*TOOLS, *tools]))


def run_here(*command):
    """Runs a command, which must succeed; returns what it prints."""
    done = subprocess.run(list(map(str, command)), stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=_LONG, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout[-8000:]}\n{done.stderr[-8000:]}"
    return done.stdout


class Root:
    """The smallest system of a release, with a folder /work; programs run in it by chroot."""

    def __init__(self, path, suite="bookworm"):
        self.path = pathlib.Path(path)
        run_here("debootstrap", "--variant=minbase", suite, self.path)
        (self.path / "work").mkdir(exist_ok=True)
        # Maintainers' scripts start nothing there.
        (self.path / "usr/sbin/policy-rc.d").write_text("#!/bin/sh\nexit 101\n")
        (self.path / "usr/sbin/policy-rc.d").chmod(0o755)
        self.run("apt-get", "update", "-q")

    def command(self, *command):
        """The command that runs `command` there."""
        return ["unshare", "--mount", "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "HOME=/root", "LC_ALL=C.UTF-8",
                "DEBIAN_FRONTEND=noninteractive", "sh", "-c", _IN_ROOT, str(self.path), *map(str, command)]

    def run(self, *command):
        return run_here(*self.command(*command))

    def apt(self, *command):
        return self.run("apt-get", "-q", "-y", "--no-install-recommends", *command)
