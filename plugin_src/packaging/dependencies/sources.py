"""The pinned sources of sources.txt: fetched by apt's own client from the mirror that this system uses, kept in a cache, checked,
unpacked, patched as Debian patches them."""
import hashlib
import os
import re
import shutil
import subprocess
import tarfile
from pathlib import Path

LIST = Path(__file__).resolve().parents[1] / "sources.txt"
FETCHER = "/usr/lib/apt/apt-helper"
# Debian's patches that suit Debian's build alone: documentation left out of GMP's makefiles; assimp's Draco taken from the system.
NOT_APPLIED = {"Exclude-doc-Makefile.patch", "use-system-libdraco.patch"}


class Failed(Exception):
    """What cannot be had or built; the sentence says what to do."""


def pins():
    """[(name, SHA-256, path in the archive)]"""
    lines = (line.split() for line in LIST.read_text().splitlines() if line and not line.startswith("#"))
    return [tuple(words) for words in lines]


def fetch(cache):
    """Every file of the list, as {name: [path]}; what is in the cache already is not fetched again."""
    cache.mkdir(parents=True, exist_ok=True)
    there, mirror = {}, None
    for name, digest, path in pins():
        file = cache / path.rsplit("/", 1)[1]
        if not file.exists() or _digest(file) != digest:
            mirror = mirror or _mirror()
            _download(f"{mirror}/{path}", file)
        if not file.exists() or _digest(file) != digest:
            file.unlink(missing_ok=True)
            raise Failed(f"the source of {name} cannot be had: {mirror}/{path} is not there or is another file. Put a copy of "
                         f"{file.name} with SHA-256 {digest} into {cache}, or change plugin_src/packaging/sources.txt")
        there.setdefault(name, []).append(file)
    return there


def unpack(files, name, folder):
    """One source as a fresh folder, patched; of .deb files what they install."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file in files[name]:
        if file.suffix == ".deb":
            _run(["dpkg-deb", "-x", file, folder])
            _stay_within(folder)
            continue
        with tarfile.open(file) as archive:
            for member in archive:
                if ".orig." in file.name:  # without its one top folder
                    member.name = member.name.partition("/")[2]
                if member.name:
                    archive.extract(member, folder)
    series = folder / "debian/patches/series"
    for line in series.read_text().splitlines() if series.exists() else []:
        patch = line.partition("#")[0].strip()
        if patch and patch not in NOT_APPLIED:
            _run(["patch", "-s", "-p1", "-d", folder, "-i", folder / "debian/patches" / patch])


def _stay_within(folder):
    """Links to /lib and the like name what lies in the folder, not in this system."""
    for link in (path for path in folder.rglob("*") if path.is_symlink()):
        target = os.readlink(link)
        if target.startswith("/"):
            link.unlink()
            link.symlink_to(os.path.relpath(folder / target[1:], link.parent))


def _download(address, file):
    """Failing is told by the file not being there."""
    part = file.with_suffix(".part")
    done = subprocess.run([FETCHER, "-o", "Acquire::Retries=3", "-o", "APT::Sandbox::User=root", "download-file",
                           address.replace("+", "%2b").replace("~", "%7e"), str(part)], stdin=subprocess.DEVNULL,
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if done.returncode == 0 and part.exists():
        part.rename(file)


def _mirror():
    """Where this system's own packages come from."""
    told = _run(["apt-get", "indextargets", "--format", "$(REPO_URI) $(ORIGIN) $(LABEL)", "Created-By: Packages"])
    found = re.search(r"^(\S+?)/? Debian Debian$", told, re.M)
    if not found:
        raise Failed("apt knows no mirror of Debian: the sources of what is linked in cannot be fetched")
    return found[1]


def _digest(file):
    with open(file, "rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest() if hasattr(hashlib, "file_digest") else \
            hashlib.sha256(opened.read()).hexdigest()


def _run(words):
    done = subprocess.run([str(w) for w in words], text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)
    if done.returncode:
        raise Failed(f"{' '.join(map(str, words[:4]))} failed: {done.stdout.strip()[-400:]}")
    return done.stdout
