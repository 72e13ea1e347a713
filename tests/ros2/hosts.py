"""hosts.py FOLDER EYES BRAIN [ARGUMENT…]: runs the programs of two hosts in two network namespaces that a cable joins, and fails where one
of them does not go on without the other. What both say is in FOLDER, with the time stamps that EYES sends and BRAIN sees in `ages`.

The present namespace is that of `eyes`; it and the other end with the processes that are in them."""

import os
import re
import signal
import subprocess
import sys
import time

FOLDER, EYES, BRAIN, *ARGUMENTS = sys.argv[1:]
# Cyclone takes a host for dead after 10 s.
PATIENCE = 30


def ip(*arguments):
    subprocess.run(["ip", *arguments], check=True)


def cable():
    """Joins this namespace and a new one, and returns the process that keeps that one."""
    other = subprocess.Popen(["unshare", "--net", "sleep", "300"])
    wait_for(lambda: os.readlink(f"/proc/{other.pid}/ns/net") != os.readlink("/proc/self/ns/net"), "a namespace")
    ip("link", "add", "eyes", "type", "veth", "peer", "name", "brain", "netns", str(other.pid))
    inside = ["nsenter", "--net", f"--target={other.pid}"]
    for prefix, name, address in ([], "eyes", "10.53.0.1/24"), (inside, "brain", "10.53.0.2/24"):
        for arguments in ("link", "set", "lo", "up"), ("addr", "add", address, "dev", name), ("link", "set", name, "up"):
            subprocess.run([*prefix, "ip", *arguments], check=True)
    return other, inside


def wait_for(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"not in {PATIENCE} s: {what}"
        time.sleep(0.02)


class Program:
    """A program of a host; what it says goes to files of its name."""

    def __init__(self, name, prefix, program):
        self.error, self.output = (f"{FOLDER}/{name}.{end}" for end in ("err", "out"))
        environment = {**os.environ, "AGES": f"{FOLDER}/ages"}
        for variable in "CYCLONEDDS_URI", "ROS_DOMAIN_ID":
            environment.pop(variable, None)
        with open(self.error, "w") as error, open(self.output, "w") as output:
            self.process = subprocess.Popen([*prefix, program, *ARGUMENTS], env=environment, stdout=output, stderr=error)

    def said(self):
        return open(self.error).read()

    def wait_for(self, text, count=1):
        def has_said():
            assert self.process.poll() is None, f"ended: {self.said()}"
            return self.said().count(text) >= count

        wait_for(has_said, f"{count} times `{text}` in: {self.said()}")

    def end(self, number=signal.SIGINT):
        self.process.send_signal(number)
        self.process.wait(PATIENCE)
        return open(self.output).read()


def numbers():
    """The numbers of the samples that arrived, in their order."""
    path = FOLDER + "/ages"
    whole = re.findall(r"(\d+) \d+\n", open(path).read()) if os.path.exists(path) else []
    return [int(number) for number in whole]


def data_flows():
    """More samples arrive, each of them, once."""
    before = len(numbers())
    wait_for(lambda: len(numbers()) >= before + 100, "100 samples")
    new = numbers()[before:]
    assert new == list(range(new[0], new[0] + len(new))), new


def main():
    other, inside = cable()
    gone, back = "warning: tracker.frame: no publisher (host eyes)", "tracker.frame: there is a publisher (host eyes)"
    try:
        brain = Program("brain", inside, BRAIN)
        brain.wait_for(gone)
        eyes = Program("eyes", [], EYES)
        brain.wait_for(back)
        data_flows()
        eyes.end(signal.SIGKILL)
        brain.wait_for(gone, 2)
        eyes = Program("eyes", [], EYES)
        brain.wait_for(back, 2)
        data_flows()
        report = brain.end()
        eyes.wait_for("warning: camera.frame: no subscription (host brain)")
        report += eyes.end()
        print(report)
        for instance in "tracker", "controller", "camera":
            # A machine that does something else makes a few jobs late; to wait for the other host would make nearly all late.
            (row,) = re.findall(rf"^ *{instance} .*[✓!✗].*$", report, re.MULTILINE)
            missed = re.search(r"✗ (\d+) missed", row)
            assert missed is None or int(missed[1]) * 10 < int(row.split()[4]), row
        assert "was without a publisher (host eyes), 2 times" in report, report
    finally:
        other.kill()


main()
