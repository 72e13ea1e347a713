"""peer.py CASE FOLDER: runs the programs in FOLDER beside programs of others, and fails where one of them sees what it should not."""

import os
import random
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time

CASE, FOLDER = sys.argv[1:3]
os.environ["CYCLONEDDS_URI"] = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
)

import numpy  # noqa: E402
from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402

from messages import DEFINITIONS, All, Float64, HalfTwist, Header, Inner, LaserScan, OtherTwist, Time, Twist, Vector3  # noqa: E402

RELIABLE = Policy.Reliability.Reliable(duration(seconds=2))
QOS = Qos(RELIABLE, Policy.History.KeepLast(10))
PATIENCE = 10


class Robot:
    """The program of the robot, until the end of a `with` statement: `report` and `warnings` are what it says."""

    def __init__(self, *arguments, **environment):
        arguments = arguments or ("--allow-non-realtime",)
        environment = {**os.environ, **environment, "LD_LIBRARY_PATH": FOLDER}
        environment.pop("CYCLONEDDS_URI")
        self.log = tempfile.NamedTemporaryFile("w+")
        self.process = subprocess.Popen([FOLDER + "/robot", *arguments], env=environment, stdout=subprocess.PIPE, stderr=self.log, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.report, _ = self.process.communicate(timeout=PATIENCE)
        self.warnings = self.said()

    def said(self):
        """The warnings so far."""
        with open(self.log.name) as log:
            return log.read()

    def threads(self):
        """The priority and the CPU of each real-time thread but the supervisor."""
        folder, found = f"/proc/{self.process.pid}/task", {}
        for thread in os.listdir(folder):
            name = open(f"{folder}/{thread}/comm").read().strip()
            if name != "robot" and os.sched_getscheduler(int(thread)) == os.SCHED_FIFO:
                (cpu,) = os.sched_getaffinity(int(thread))
                found[name] = (os.sched_getparam(int(thread)).sched_priority, cpu)
        return found

    def topic(self, name):
        return next(line for line in self.report.splitlines() if line.startswith(f"  {name} "))

    def samples(self, name):
        return int(re.search(r": (\d+) samples", self.topic(name)).group(1))

    def dropped(self, name, why):
        found = re.search(r"dropped: (\d+) " + why, self.topic(name))
        return int(found.group(1)) if found else 0


def wait_for(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"not in {PATIENCE} s: {what}"
        time.sleep(0.01)


def reader(participant, name, kind, qos=QOS):
    return DataReader(participant, Topic(participant, "rt" + name, kind), qos=qos)


def writer(participant, name, kind, qos=QOS):
    made = DataWriter(participant, Topic(participant, "rt" + name, kind), qos=qos)
    wait_for(lambda: made.get_matched_subscriptions(), f"a subscription of {name}")
    return made


def taken(source, count, what):
    found = []

    def has_all():
        found.extend(source.take(100))
        return len(found) >= count

    wait_for(has_all, what)
    return found


RANDOM = random.Random(52)


def text(most):
    return "".join(RANDOM.choice("ab c0é") for _ in range(RANDOM.randrange(most // 2)))


def floats(count):
    return [RANDOM.uniform(-1e9, 1e9) for _ in range(count)]


def integer(bits, is_signed):
    return RANDOM.randrange(-(2 ** (bits - 1)), 2 ** (bits - 1)) if is_signed else RANDOM.randrange(2**bits)


def inner():
    return {"kind": integer(8, False), "name": text(20)}


def values():
    some = lambda: RANDOM.randrange(5)  # noqa: E731
    numbers = {f"{'iu'[sign]}{bits}": integer(bits, not sign) for bits in (8, 16, 32, 64) for sign in (0, 1)}
    flags = lambda count: [RANDOM.random() < 0.5 for _ in range(count)]  # noqa: E731
    return {
        **numbers,
        "flag": RANDOM.random() < 0.5,
        "f32": struct.unpack("f", struct.pack("f", RANDOM.uniform(-1e9, 1e9)))[0],
        "f64": RANDOM.uniform(-1e99, 1e99),
        "text": text(100),
        "short_text": text(10),
        "numbers": floats(3),
        "flags": flags(3),
        "sequence": [integer(16, True) for _ in range(some())],
        "bounded": floats(some()),
        "many_flags": flags(some()),
        "texts": [text(30) for _ in range(some())],
        "short_texts": [text(10) for _ in range(RANDOM.randrange(4))],
        "inner": inner(),
        "inners": [inner(), inner()],
        "many_inners": [inner() for _ in range(some())],
        "last": integer(8, False),
    }


def for_cyclone(of):
    made = {**of, "inner": Inner(**of["inner"])}
    for key in ("inners", "many_inners"):
        made[key] = [Inner(**it) for it in of[key]]
    return All(**made)


def catalogue():
    """Random values, encoded by rosbags in both byte orders, and broken in all ways."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    for name, definition in DEFINITIONS.items():
        store.register(get_types_from_msg(definition, name))
    every, nested = store.types["rig/msg/All"], store.types["rig/msg/Inner"]

    def encoded(of, is_little):
        made = {**of, "inner": nested(**of["inner"])}
        for key in ("inners", "many_inners"):
            made[key] = [nested(**it) for it in of[key]]
        for key, kind in (("numbers", "f8"), ("bounded", "f8"), ("sequence", "i2"), ("flags", "?"), ("many_flags", "?")):
            made[key] = numpy.array(of[key], kind)
        return bytes(store.serialize_cdr(every(**made), "rig/msg/All", little_endian=is_little))

    lines, expected = [], []
    for _ in range(300):
        of = values()
        little, big = encoded(of, True), encoded(of, False)
        for sample in (little, big):
            lines.append(sample.hex())
            expected.append(little.hex())
        # Cut, longer, with a flag that is none, and with what nobody has written.
        cut = RANDOM.randrange(len(little) - 4)
        for sample in (little[:cut], little + bytes(4), little[:4] + b"\x02" + little[5:], b"\x01" + little[1:]):
            lines.append(sample.hex())
            expected.append("-")
        broken = bytearray(RANDOM.choice((little, big)))
        for _ in range(1 + RANDOM.randrange(4)):
            broken[RANDOM.randrange(4, len(broken))] = RANDOM.choice((0, 1, 0x7F, 0x80, 0xFF))
        lines.append(broken.hex())
        expected.append(None)
    # An empty string is smaller than in the memory, where it has 32 bytes, and such a message 40.
    for texts, inners, fits in ((0, 25, True), (0, 26, False), (31, 0, True), (32, 0, False), (20, 9, True), (20, 10, False)):
        nothing = {"kind": 1, "name": ""}
        little = encoded({**values(), "short_texts": [], "texts": [""] * texts, "many_inners": [nothing] * inners}, True)
        lines.append(little.hex())
        expected.append(little.hex() if fits else "+")
    said = subprocess.run([FOLDER + "/catalogue", "1000"], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True)
    found = said.stdout.splitlines()
    assert len(found) == len(expected), said.stderr
    for line, one, other in zip(lines, expected, found):
        assert one is None or one == other, f"{line}\nexpected {one}\nfound    {other}"


def both_ways():
    """A peer of another implementation sends values of all types, and gets the same ones back."""
    with Robot() as robot:
        participant = DomainParticipant()
        twists, alls = reader(participant, "/rig/twist", Twist), reader(participant, "/rig/all_out", All)
        for topic in ("/rig/twist", "/rig/all_out"):
            source = twists if topic == "/rig/twist" else alls
            wait_for(lambda: source.get_matched_publications(), f"a publisher of {topic}")
        to_twists, to_alls = writer(participant, "/cmd_vel", Twist), writer(participant, "/rig/all_in", All)
        time.sleep(0.2)
        for count in range(20):
            sent = [Twist(Vector3(float(10 * count + n), 0.5, -1.0), Vector3(*floats(3))) for n in range(5)]
            for it in sent:
                to_twists.write(it)
            assert taken(twists, 5, "twists") == sent
        for _ in range(50):
            of = for_cyclone(values())
            to_alls.write(of)
            assert taken(alls, 1, "messages of all types") == [of]
        kept = reader(DomainParticipant(), "/rig/all_out", All, Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(10)))
        assert taken(kept, 10, "samples that are kept for late subscriptions")[-1] == of
        scans = reader(participant, "/rig/scan", LaserScan)
        assert taken(scans, 20, "scans of a late subscription")[0].ranges == [1.5] * 360
    ended = time.monotonic()
    wait_for(lambda: not scans.get_matched_publications(), "the end of the robot, seen by others")
    # Otherwise its lease has ended.
    assert time.monotonic() - ended < 3
    assert robot.samples("/cmd_vel") == robot.samples("/rig/twist") == 100, robot.report
    assert "warning" not in robot.warnings, robot.warnings


def generated():
    """The program that `mauve run --ros2` builds of a model: messages both ways, and a number as a message of std_msgs."""
    with Robot() as robot:
        participant = DomainParticipant()
        twists, speeds = reader(participant, "/rig/pilot/twist", Twist), reader(participant, "/speed", Float64)
        wait_for(twists.get_matched_publications, "a publisher of twists")
        to_twists, to_scans = writer(participant, "/cmd_vel", Twist), writer(participant, "/scan", LaserScan)
        time.sleep(0.2)
        for _ in range(20):
            sent = Twist(Vector3(*floats(3)), Vector3(*floats(3)))
            to_twists.write(sent)
            assert taken(twists, 1, "a twist") == [sent]
            to_scans.write(LaserScan(Header(Time(1, 2), "laser"), 0.0, 1.0, 0.5, 0.0, 0.0, 0.0, 9.0, [1.0, 2.0, 3.0], []))
        assert taken(speeds, 1, "a speed")[0].data == 1.5
    assert robot.samples("/cmd_vel") == robot.samples("/rig/pilot/twist") == 20, robot.report
    assert robot.samples("/scan") > 0 and "malformed" not in robot.topic("/scan"), robot.report
    assert "warning" not in robot.warnings, robot.warnings


def fast():
    """The same with Fast DDS."""
    with Robot() as robot:
        said = subprocess.run([FOLDER + "/fast"], capture_output=True, text=True, timeout=3 * PATIENCE)
    assert said.returncode == 0, (said.stdout, said.stderr, robot.report)
    count = 100 + int(said.stdout.split()[0])
    assert robot.samples("/rig/all_in") == robot.samples("/rig/all_out") == count, robot.report


def strangers():
    """Peers that are killed, that have another domain, type, definition or QoS, and samples that are too large or malformed."""
    warnings = (
        "topic /cmd_vel: a publisher of another program has type stranger::msg::dds_::Twist_",
        "topic /cmd_vel: a publisher of another program offers best-effort, and twist.in wants reliable",
        "topic /rig/scan: a subscription of another program wants transient-local, and laser.ranges offers volatile",
    )
    with Robot() as robot:
        participant = DomainParticipant()
        killed = subprocess.Popen([sys.executable, __file__, "reads", FOLDER], stdout=subprocess.PIPE, text=True)
        assert killed.stdout.readline() == "reads\n"
        killed.kill()
        killed.wait()
        scans = reader(participant, "/rig/scan", LaserScan)
        taken(scans, 20, "scans beside a peer that was killed")
        elsewhere = reader(DomainParticipant(1), "/rig/scan", LaserScan)
        other_qos = reader(participant, "/rig/scan", LaserScan, Qos(RELIABLE, Policy.Durability.TransientLocal))
        other_type = DataWriter(participant, Topic(participant, "rt/cmd_vel", OtherTwist), qos=QOS)
        best_effort = DataWriter(participant, Topic(participant, "rt/cmd_vel", Twist), qos=Qos(Policy.Reliability.BestEffort))
        half = writer(DomainParticipant(), "/cmd_vel", HalfTwist)
        alls, to_alls = reader(participant, "/rig/all_out", All), writer(participant, "/rig/all_in", All)
        wait_for(lambda: alls.get_matched_publications(), "a publisher")
        large, fine = values(), for_cyclone(values())
        large["text"] = "x" * 5000
        for _ in range(3):
            half.write(HalfTwist(1.0))
            to_alls.write(for_cyclone(large))
        to_alls.write(fine)
        assert taken(alls, 1, "a sample after those that are dropped") == [fine]
        wait_for(lambda: all(warning in robot.said() for warning in warnings), "the warnings of the robot")
        time.sleep(1.5)
        assert not elsewhere.take(1) and not other_qos.take(1)
        assert not other_type.get_matched_subscriptions() and not best_effort.get_matched_subscriptions()
    assert robot.dropped("/cmd_vel", "malformed") == 3, robot.report
    assert robot.dropped("/rig/all_in", "greater than max_bytes") == 3, robot.report
    for warning in warnings:
        assert robot.warnings.count(warning) == 1, robot.warnings


def reads():
    scans = reader(DomainParticipant(), "/rig/scan", LaserScan)
    taken(scans, 1, "a scan")
    print("reads", flush=True)
    time.sleep(60)


def scheduling():
    """All threads are scheduled as modelled, and those of components neither lock nor allocate, while a peer floods the robot."""
    names = ("gc", "recv", "tev", "dq.builtins", "dq.user")
    expected = {"Laser": (40, 0), "TwistEcho": (39, 0), "ImageEcho": (10, 0), "AllEcho": (9, 0), "ros2": (20, 1)}
    expected.update({name: (19, 1) for name in names})
    counting = {"MAUVE_INTERPOSE_FROM": "1.5", "MAUVE_INTERPOSE_TO": "3.5", "MAUVE_INTERPOSE_THREADS": "Laser TwistEcho"}
    with Robot("--log-level", "error", LD_PRELOAD=FOLDER + "/libinterposer.so", **counting) as robot:
        participant = DomainParticipant()
        flooded = writer(participant, "/cmd_vel", Twist, Qos(RELIABLE, Policy.History.KeepLast(1)))
        malformed = writer(DomainParticipant(), "/cmd_vel", HalfTwist, Qos(RELIABLE, Policy.History.KeepLast(1)))
        assert robot.threads() == expected, robot.threads()
        end = time.monotonic() + 4
        count = 0
        while time.monotonic() < end:
            flooded.write(Twist(Vector3(float(count), 0.0, 0.0), Vector3()))
            malformed.write(HalfTwist(0.0))
            count += 1
    assert robot.process.returncode == 0, robot.report
    assert robot.samples("/cmd_vel") > 1000 and robot.dropped("/cmd_vel", "malformed") > 1000, robot.report
    assert "interposer: 0 allocations, 0 locks," in robot.warnings, robot.warnings
    print(f"{count} samples of each kind\n{robot.report}")


def junk():
    """Packets that nobody can read take all of a CPU: its activities go on."""
    with Robot("--log-level", "error") as robot:
        time.sleep(1)
        senders = [subprocess.Popen([FOLDER + "/flood", "3"]) for _ in range(2)]
        assert [sender.wait() for sender in senders] == [0, 0]
        wait_for(lambda: robot.threads().get("recv") == (19, 1), "the priority after the flood")
        scans = reader(DomainParticipant(), "/rig/scan", LaserScan)
        taken(scans, 20, "scans after the flood")
    assert robot.process.returncode == 0, robot.report


def refusals():
    """What cannot be: a message, and nothing runs."""

    def refused(said, **environment):
        robot = Robot("--for", "1s", "--allow-non-realtime", **environment)
        (out, _), errors = robot.process.communicate(timeout=PATIENCE), robot.said()
        assert robot.process.returncode == 2 and said in errors and "nothing runs" in errors and out == "", (out, errors)

    refused("ROS_DOMAIN_ID is `233`", ROS_DOMAIN_ID="233")
    refused("ROS_DOMAIN_ID is `one`", ROS_DOMAIN_ID="one")
    subprocess.run(["ip", "link", "set", "lo", "down"], check=True)
    refused("the loopback interface `lo`")
    virtual = Robot("--for", "1s", "--simulate-time")
    (out, _), errors = virtual.process.communicate(timeout=PATIENCE), virtual.said()
    assert out.count("no topics of ROS 2 with --simulate-time") == 1 and "ros2 " not in out, (out, errors)


globals()[CASE]()
