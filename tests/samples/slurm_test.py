#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Bake a level by the command of docs/guide/farm.md on a real Slurm of two nodes, kill one of them midway, and compare the bytes.

Both nodes are slurmd of this machine, with a munged, a slurmctld, keys and ports of their own; nothing of the system's Slurm is
touched. While a shard is being traced on the second node, that slurmd and all it runs are killed: Slurm finds the node dead,
starts the shard again on the other one, and the merged bake must have the bytes of a bake by one process.

    slurm_test.py --relume FILE --source DIR --shared DIR

Exit status: 0 it holds; 1 it does not; 77 there is no Slurm, or this is not root's to do. Sponza is baked at
`draft`, with RELUME_LONG_TESTS=1 at `high`; where there is no Sponza the sample level is, at `high`.
"""
import argparse
import ctypes
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

NEEDED = ("slurmctld", "slurmd", "munged", "sbatch", "scontrol", "sinfo", "squeue")
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
LIBC = ctypes.CDLL(None, use_errno=True)

CONFIG = """
ClusterName=relume
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ctld}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
JobRequeue=1
KillWait=2
SlurmctldTimeout=10
SlurmdTimeout=6
MessageTimeout=5
BatchStartTimeout=5
SchedulerParameters=batch_sched_delay=1,sched_interval=2,bf_interval=2
NodeName=n1 NodeAddr=127.0.0.1 NodeHostname={host} Port={n1} CPUs=1 RealMemory=1024 State=UNKNOWN
NodeName=n2 NodeAddr=127.0.0.1 NodeHostname={host} Port={n2} CPUs=1 RealMemory=1024 State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
"""


class Failed(Exception):
    pass


def die_with_parent():
    """A daemon ends when this program does, however that ends."""
    os.setsid()
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def processes():
    """Process id -> parent's."""
    parents = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open(f"/proc/{entry}/stat") as stat:
                    parents[int(entry)] = int(stat.read().rpartition(")")[2].split()[1])
            except OSError:
                pass  # it has ended
    return parents


def descendants(root):
    parents = processes()
    found, more = set(), {root}
    while more:
        more = {child for child, parent in parents.items() if parent in more} - found
        found |= more
    return found


def read_list(pid, name):
    try:
        with open(f"/proc/{pid}/{name}", "rb") as file:
            return [each.decode(errors="replace") for each in file.read().split(b"\0")]
    except OSError:
        return []


def kill_all(pids, number=signal.SIGKILL):
    for pid in pids:
        try:
            os.kill(pid, number)
        except ProcessLookupError:
            pass


def end_descendants():
    """End every process that this one started, or has inherited of those that did."""
    for _ in range(200):
        kill_all(descendants(os.getpid()))
        try:
            while os.waitpid(-1, os.WNOHANG)[0] != 0:
                pass
        except ChildProcessError:
            return
        time.sleep(0.02)


def free_ports(count):
    """Ports that nobody listens at. Held together until all are known, so that they differ."""
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


def wait_for(what, seconds, found):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = found()
        if value:
            return value
        time.sleep(0.02)
    raise Failed(f"{what}: not within {seconds} s")


class Cluster:
    """Slurm in a folder of its own."""

    def __init__(self, folder):
        self.folder = folder
        self.environment = dict(os.environ, SLURM_CONF=f"{folder}/slurm.conf")
        self.slurmd = {}

    def daemon(self, name, *command):
        with open(f"{self.folder}/{name}.out", "ab") as out:
            return subprocess.Popen([name.partition("-")[0], *command], stdin=subprocess.DEVNULL, stdout=out,
                                    stderr=subprocess.STDOUT, env=self.environment, preexec_fn=die_with_parent)

    def run(self, *command):
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=300)

    def logs(self):
        text = ""
        for log in sorted(self.folder.glob("*.log")) + sorted(self.folder.glob("*.out")):
            text += f"--- {log.name}\n" + log.read_text(errors="replace")[-3000:]
        return text

    def start(self):
        folder = self.folder
        (folder / "state").mkdir()
        key = folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        self.daemon("munged", "--foreground", "--force", f"--socket={folder}/munge.socket", f"--key-file={key}",
                    f"--log-file={folder}/munge.log", f"--pid-file={folder}/munge.pid", f"--seed-file={folder}/munge.seed")
        wait_for("munged", 120, (folder / "munge.socket").exists)
        ctld, n1, n2 = free_ports(3)
        (folder / "slurm.conf").write_text(
            CONFIG.format(folder=folder, host=socket.gethostname().partition(".")[0], ctld=ctld, n1=n1, n2=n2))
        self.daemon("slurmctld", "-D", "-c", "-f", f"{folder}/slurm.conf")
        for node in ("n1", "n2"):
            (folder / f"spool-{node}").mkdir()
            self.slurmd[node] = self.daemon("slurmd-" + node, "-D", "-N", node, "-f", f"{folder}/slurm.conf")
        wait_for("two idle nodes", 300, lambda: self.run("sinfo", "-h", "-N", "-o", "%N %T").stdout.split() ==
                 ["n1", "idle", "n2", "idle"])

    def tracing(self, node):
        """Processes of `relume bake --shard` on a node."""
        return [pid for pid in descendants(os.getpid())
                if f"SLURMD_NODENAME={node}" in read_list(pid, "environ") and "--shard" in read_list(pid, "cmdline")
                and not read_list(pid, "cmdline")[0].endswith("bash")]

    def kill(self, node):
        """End a slurmd and all it runs at once, as a power cut would."""
        daemon = self.slurmd[node].pid
        of_node = {pid for pid in descendants(os.getpid()) if f"SLURMD_NODENAME={node}" in read_list(pid, "environ")}
        parents = processes()
        steps = {parents[pid] for pid in of_node if pid in parents} - {os.getpid(), 1}
        everything = {daemon} | descendants(daemon) | steps | of_node
        kill_all(everything, signal.SIGSTOP)  # a step that still ran would tell Slurm how its shard ended
        kill_all(everything)
        self.slurmd[node].wait()


def bake_and_kill(cluster, arguments, level, preset):
    folder = cluster.folder
    plain = folder / "plain.relume"
    begin = time.monotonic()
    made = subprocess.run([arguments.relume, "bake", level, "-o", plain, "--preset", preset, "--progress", "none"],
                          capture_output=True, text=True)
    if made.returncode != 0:
        raise Failed(f"the plain bake: {made.stderr}")
    print(f"{level.name} at {preset}: {time.monotonic() - begin:.1f} s by one process")

    begin = time.monotonic()
    cluster.start()
    print(f"two nodes are up after {time.monotonic() - begin:.1f} s")
    begin = time.monotonic()
    # The command of the guide, but for the preset.
    (folder / "samples").symlink_to(arguments.source.resolve() / "samples")
    (folder / "level.glb").symlink_to(level)
    merged = folder / "level.relume"
    page = (arguments.source / "docs/guide/farm.md").read_text()
    command = re.search(r"^samples/cluster/slurm\.sh level\.glb level\.relume 6 --preset high$", page, re.MULTILINE)
    if not command:
        raise Failed("docs/guide/farm.md has no command of slurm.sh that is known here")
    command = command[0].replace("--preset high", f"--preset {preset}")
    environment = dict(cluster.environment, RELUME=arguments.relume)
    script = subprocess.Popen(["bash", "-c", "exec " + command], cwd=folder, env=environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)
    shards = folder / "level.relume.shards"

    def victim():
        if script.poll() is not None:
            raise Failed(f"slurm.sh ended before a node was killed: {script.stdout.read()}")
        for pid in cluster.tracing("n2"):
            # Stop it, so that it cannot end meanwhile; unless it has done its work.
            try:
                os.kill(pid, signal.SIGSTOP)
                command = read_list(pid, "cmdline")
                number = command[command.index("--shard") + 1].partition("/")[0]
                if not (shards / f"shard-{number}.relume").exists():
                    return number
                os.kill(pid, signal.SIGCONT)
            except (ProcessLookupError, ValueError):
                pass  # it has ended
        return None

    number = wait_for("a shard on the second node", 900, victim)
    cluster.kill("n2")
    killed = time.monotonic()
    # Meanwhile, a bake that cannot be: its options are refused by the plan.
    refused = subprocess.Popen(["bash", "-c", "exec samples/cluster/slurm.sh level.glb refused.relume 2 --surfels 1"], cwd=folder,
                               env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(f"node n2 killed {killed - begin:.1f} s after the start, tracing shard {number}")
    try:
        said, _ = script.communicate(timeout=900)
    except subprocess.TimeoutExpired as slow:
        raise Failed("the bake has not ended 900 s after the kill:\n" + cluster.run("squeue").stdout) from slow
    print(f"merged {time.monotonic() - killed:.1f} s after the kill\n{said.strip()}")
    if script.returncode != 0:
        raise Failed(f"slurm.sh: exit status {script.returncode}")
    job = re.search(r"shards: job (\d+)", said)
    restarts = re.search(r"Restarts=(\d+)", cluster.run("scontrol", "show", "job", f"{job[1]}_{number}").stdout) if job else None
    if not restarts or int(restarts[1]) < 1:
        raise Failed(f"shard {number} was not started again by Slurm")
    if cluster.tracing("n2"):
        raise Failed("something still runs on the node that was killed")
    if merged.read_bytes() != plain.read_bytes():
        raise Failed("the merged bake has other bytes than the plain one")
    error, _ = refused.communicate(timeout=900)
    if refused.returncode != 4 or "expected 2..16777216" not in error or (folder / "refused.relume").exists():
        raise Failed(f"a bake that cannot be: exit status {refused.returncode}\n{error}")
    half = [path.name for path in shards.iterdir() if path.suffix not in (".relume", ".log", ".tmp")]
    if half:
        raise Failed(f"files of no known kind are left: {half}")
    print(f"six shards, {merged.stat().st_size} bytes: the same")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--relume", type=pathlib.Path, required=True)
    parser.add_argument("--source", type=pathlib.Path, required=True)
    parser.add_argument("--shared", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    os.environ["PATH"] += ":/usr/sbin:/sbin"
    missing = [name for name in NEEDED if not shutil.which(name)]
    if os.geteuid() != 0 or missing:
        print("skipped: " + (f"there is no {', '.join(missing)} (packages slurm-wlm and munge)" if missing else
                             "slurmd must be root to start jobs"))
        return 77
    is_long = os.environ.get("RELUME_LONG_TESTS") == "1"
    level, preset = arguments.shared / "scenes/sponza/sponza.glb", "high" if is_long else "draft"
    if not level.exists():
        print(f"no {level} (set RELUME_SHARED_DIR): the sample level is baked")
        level, preset = arguments.source / "samples/level/two_rooms.glb", "high"
    # A short name: paths of sockets have at most 107 characters. Not writable for others, as munged asks.
    folder = pathlib.Path(tempfile.mkdtemp(prefix="relume-slurm-", dir="/tmp"))
    # Steps of a slurmd outlive it, and become children of the nearest process that asks for them. There are two, so that
    # nothing stays behind where one of them is killed.
    LIBC.prctl(PR_SET_CHILD_SUBREAPER, 1)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by a signal"))
    worker = os.fork()
    try:
        if worker != 0:
            return os.waitstatus_to_exitcode(os.waitpid(worker, 0)[1])
        LIBC.prctl(PR_SET_CHILD_SUBREAPER, 1)
        LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
        cluster = Cluster(folder)
        try:
            bake_and_kill(cluster, arguments, level.resolve(), preset)
        except Failed as failure:
            print(f"{failure}\n{cluster.logs()}")
            return 1
        return 0
    finally:
        end_descendants()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
