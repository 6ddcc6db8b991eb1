"""Servers that a benchmark starts on this machine, and stops."""
import os
import signal
import subprocess


class Daemon:
    """A wellspaced on a free port of the loopback, until it is stopped."""

    def __init__(self, binary, *arguments):
        self.process = subprocess.Popen([binary, "--listen", "127.0.0.1:0", "--log-level", "error",
                                         *map(str, arguments)], stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().split()[-1]

    def processor_seconds(self):
        """The processor's time of the process so far."""
        with open(f"/proc/{self.process.pid}/stat", encoding="utf-8") as stat:
            fields = stat.read().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def stop(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait()
        self.process.stdout.close()
