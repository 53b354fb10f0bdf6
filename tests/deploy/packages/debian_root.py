"""Minimal Debian 12 roots for tests of the packages: made by mmdebstrap from this machine's Debian sources, cached as
archives, entered by chroot or booted with systemd as the first process. Needs root.
"""

import contextlib
import glob
import os
import re
import shutil
import signal
import subprocess
import time

SKIPPED = 77
CACHE_DAYS = 14
BOOT_SECONDS = 60
ENVIRONMENT = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/tmp", "LC_ALL": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive",
               **{name: os.environ[name] for name in ("http_proxy", "https_proxy", "no_proxy") if name in os.environ}}
# Makes a root the whole view of a new machine: its own processes, network (loopback only), devices and control groups.
BOOT = r"""
set -eu
mount --bind "$1" "$1"
cd "$1"
mount -t proc proc proc
mount -t sysfs -o ro sysfs sys
mount -t cgroup2 cgroup2 sys/fs/cgroup
mount -t tmpfs tmpfs run
mount -t tmpfs tmpfs tmp
mount -t tmpfs -o mode=0755 tmpfs dev
for device in null zero full random urandom tty; do touch "dev/$device"; mount --bind "/dev/$device" "dev/$device"; done
mkdir dev/pts dev/shm
mount -t devpts -o newinstance,ptmxmode=0666 devpts dev/pts
ln -s pts/ptmx dev/ptmx
ln -s /proc/self/fd dev/fd
pivot_root . mnt
umount -l /mnt
exec env -i container=other PATH=/usr/sbin:/usr/bin:/sbin:/bin /lib/systemd/systemd --log-target=null --show-status=no
"""


def run(*command, check=True, timeout=600, **more):
    """Runs a command in the locale C.UTF-8 and returns its output, both streams together."""
    more.setdefault("env", dict(os.environ, LC_ALL="C.UTF-8"))
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=timeout, check=False, **more)
    if check and done.returncode != 0:
        raise AssertionError(f"{' '.join(command)}\nexited with {done.returncode}\n{done.stdout[-8000:]}")
    return done.stdout


def missing(packages):
    """Returns why the packages of a folder cannot be tried in roots here, or None."""
    if not glob.glob(os.path.join(packages, "*.deb")):
        return "nothing was packed: ./deploy/packages.sh package docs"
    if os.geteuid() != 0:
        return "making a root needs root rights"
    if shutil.which("mmdebstrap") is None:
        return "mmdebstrap is not installed: ./deploy/packages.sh package"
    if subprocess.run(["unshare", "--net", "--mount", "--pid", "--fork", "true"], capture_output=True, check=False).returncode:
        return "namespaces cannot be made"
    if not all(line.startswith("deb http://") for line in sources() or [""]):
        return "apt does not fetch packages of Debian by http: run apt-get update"
    return None


def sources():
    """Returns this machine's Debian sources, and no others, as lines of apt."""
    shown = "$(ORIGIN) deb $(REPO_URI) $(RELEASE) $(COMPONENT)"
    lines = run("apt-get", "indextargets", "--format", shown, "Created-By: Packages")
    return sorted({line[len("Debian "):] for line in lines.splitlines() if line.startswith("Debian deb ")})


def archive(cache, *packages):
    """Returns the path of the archive of a minbase root with more packages, which is made if there is none of this week or
    the week before.
    """
    os.makedirs(cache, exist_ok=True)
    path = os.path.join(cache, "-".join(("minbase", *packages)) + ".tar")
    if not os.path.exists(path) or time.time() - os.path.getmtime(path) > CACHE_DAYS * 86400:
        lists = path + ".list"
        with open(lists, "w", encoding="utf-8") as file:
            file.write("\n".join(sources()) + "\n")
        more = [f"--include={','.join(packages)}"] if packages else []
        new = path.removesuffix(".tar") + ".new.tar"  # mmdebstrap makes a folder if the name does not end with .tar
        run("mmdebstrap", "--quiet", "--variant=minbase", *more, "bookworm", new, lists)
        os.remove(lists)
        os.rename(new, path)
    return path


def unpack(path, folder):
    """Unpacks a root into a new folder, with this machine's name servers."""
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    run("tar", "--extract", "--file", path, "--directory", folder)
    shutil.copy("/etc/resolv.conf", os.path.join(folder, "etc/resolv.conf"))


def inside(folder, *command, check=True, timeout=600, network=True):
    """Runs a command in a root, with this machine's network or with a network of its own."""
    prefix = [] if network else ["unshare", "--net", "sh", "-c", 'ip link set lo up && exec "$@"', "sh"]
    return run(*prefix, "chroot", folder, *command, check=check, timeout=timeout, env=ENVIRONMENT)


def add_packages(folder, debs):
    """Copies packages into /debs of a root and returns their paths there."""
    os.makedirs(os.path.join(folder, "debs"), exist_ok=True)
    for deb in debs:
        shutil.copy(deb, os.path.join(folder, "debs"))
    return ["/debs/" + os.path.basename(deb) for deb in debs]


def installed(folder):
    return set(inside(folder, "dpkg-query", "-W", "-f", "${Package}\n").split())


def newest(folder, *names):
    """Returns the paths of the packages of these names in a folder."""
    paths = []
    for name in names:
        (path,) = glob.glob(os.path.join(folder, name + "_*.deb"))
        paths.append(path)
    return paths


def control_groups():
    """Returns where control groups of version 2 are mounted, or None."""
    with open("/proc/self/mounts", encoding="utf-8") as file:
        found = re.search(r"^\S+ (\S+) cgroup2 ", file.read(), re.MULTILINE)
    return found.group(1) if found else None


def copy_sources(clone, folder):
    """Copies the files of a clone, with uncommitted changes, into a new folder."""
    listed = run("git", "-C", clone, "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    for name in filter(None, listed.split("\0")):
        if os.path.exists(os.path.join(clone, name)):
            os.makedirs(os.path.dirname(os.path.join(folder, name)), exist_ok=True)
            shutil.copy(os.path.join(clone, name), os.path.join(folder, name))


class Machine:
    """A root that has been booted with systemd as its first process."""

    def __init__(self, folder):
        self.folder = folder
        group = os.path.join(control_groups(), f"locus-test-{os.getpid()}")
        os.makedirs(group, exist_ok=True)
        self.group = group
        boot = 'echo $$ > "$1/cgroup.procs" && exec unshare --mount --propagation private --pid --fork --kill-child --net ' \
            '--uts --ipc --cgroup bash -c "$3" boot "$2"'
        self.parent = subprocess.Popen(["bash", "-c", boot, "boot", group, folder, BOOT], stdin=subprocess.DEVNULL,
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.init = self._first_process()
        try:
            self.wait_until("is-system-running", "running")
        except BaseException:
            self.power_off()
            raise

    def _first_process(self):
        deadline = time.monotonic() + BOOT_SECONDS
        while time.monotonic() < deadline:
            with contextlib.suppress(OSError, ValueError):
                with open(f"/proc/{self.parent.pid}/task/{self.parent.pid}/children", encoding="utf-8") as file:
                    (child,) = file.read().split()
                if os.readlink(f"/proc/{child}/exe").endswith("/systemd/systemd"):
                    return int(child)
            if self.parent.poll() is not None:
                break
            time.sleep(0.1)
        self.power_off()
        raise RuntimeError("the root did not boot")

    def command(self, *words):
        return ["nsenter", "--target", str(self.init), "--mount", "--uts", "--ipc", "--net", "--pid", "--cgroup", "--root",
                "--wd=/", *words]

    def run(self, *words, check=True, timeout=120):
        return run(*self.command(*words), check=check, timeout=timeout, env=ENVIRONMENT)

    def start(self, *words, **more):
        return subprocess.Popen(self.command(*words), stdin=subprocess.DEVNULL, env=ENVIRONMENT, **more)

    def wait_until(self, question, wanted, *words):
        """Waits until `systemctl QUESTION WORDS` prints the wanted line."""
        deadline = time.monotonic() + BOOT_SECONDS
        shown = ""
        while time.monotonic() < deadline:
            shown = self.run("systemctl", question, *words, check=False).strip()
            if shown == wanted:
                return
            time.sleep(0.2)
        raise AssertionError(f"systemctl {question} {' '.join(words)}: {shown}\n{self.run('systemctl', '--failed', check=False)}")

    def power_off(self):
        if self.parent.poll() is None and getattr(self, "init", None):
            subprocess.run(self.command("systemctl", "poweroff"), capture_output=True, check=False, timeout=60)
        try:
            self.parent.wait(timeout=40)
        except subprocess.TimeoutExpired:
            self.parent.send_signal(signal.SIGKILL)
            self.parent.wait()
        # Groups below are removed from the deepest up; systemd leaves them empty.
        for place, _, _ in sorted(os.walk(self.group), reverse=True):
            with contextlib.suppress(OSError):
                os.rmdir(place)
