"""Our compiled modules with the address and the undefined-behaviour sanitizer, in a copy of the sources.

With clang and Atheris the modules also tell libFuzzer what they execute, and libFuzzer comes with the runtime of the
sanitizers, which Atheris brings. With GCC, or without Atheris, the compiler's own runtime is loaded.
"""

import hashlib
import importlib.util
import os
import shutil
import sys
from pathlib import Path
from typing import NamedTuple

from tests import children

ROOT = Path(__file__).parents[2]
_PACKAGES = ("exact", "protocol", "robot_fw", "host", "sim")
_COPIED = (*_PACKAGES, "setup.py", "pyproject.toml", "README.md", "LICENSE")
_SOURCES = (".py", ".pxd", ".pyx")
_CHECKS = "address,undefined"
_FLAGS = "-fno-sanitize=shift-base -fno-omit-frame-pointer -g1"
"""A negative number shifted to the left is what Python makes of it, with GCC and clang alike; C does not say so."""


class MissingError(Exception):
    """A tool that is not there, and how to get it."""


class Build(NamedTuple):
    """What a process needs that is to run it."""

    environment: dict[str, str]
    about: str


def built(folder, guided):
    """The build in `folder`, made again when the sources have changed. Raises MissingError."""
    guided = guided and shutil.which("clang") is not None
    compiler = "clang" if guided else "gcc" if shutil.which("gcc") else "clang"
    if shutil.which(compiler) is None:
        raise MissingError(
            "--sanitize needs gcc or clang: apt-get install gcc libc6-dev, or clang for guidance too"
        )
    folder = folder / ("guided" if guided else compiler)
    stamp = _hash()
    if not (folder / "stamp").exists() or (folder / "stamp").read_text() != stamp:
        _build(folder, compiler, guided)
        (folder / "stamp").write_text(stamp)
    environment = {
        "PYTHONPATH": os.pathsep.join(str(folder / package) for package in _PACKAGES),
        "PYTHONMALLOC": "malloc",
        "ASAN_OPTIONS": "detect_leaks=0:allocator_may_return_null=1:handle_segv=1",
        "UBSAN_OPTIONS": "halt_on_error=1:print_stacktrace=1",
        "LD_PRELOAD": _runtime(compiler, guided),
    }
    coverage = ", which tell what they execute" if guided else ""
    return Build(environment, f"modules compiled by {compiler} with -fsanitize={_CHECKS}{coverage}")


def _hash():
    found = hashlib.sha256(_FLAGS.encode())
    for package in _PACKAGES:
        for path in sorted((ROOT / package).rglob("*")):
            if path.suffix in _SOURCES:
                found.update(f"{path.relative_to(ROOT)}\0".encode() + path.read_bytes())
    return found.hexdigest()


def _build(folder, compiler, guided):
    """Minutes, the first time; what has not changed is not compiled again."""
    print(
        f"building the sanitized modules in {os.path.relpath(folder)}, which takes minutes", file=sys.stderr
    )
    folder.mkdir(parents=True, exist_ok=True)
    for name in _COPIED:
        if (ROOT / name).is_dir():
            left_out = shutil.ignore_patterns("*.so", "*.pyd", "__pycache__", "*.egg-info")
            shutil.copytree(ROOT / name, folder / name, dirs_exist_ok=True, ignore=left_out)
        else:
            shutil.copy2(ROOT / name, folder / name)
    checks = f"{_CHECKS},fuzzer-no-link" if guided else _CHECKS
    flags = {"CC": compiler, "LDSHARED": f"{compiler} -shared", "CFLAGS": f"-fsanitize={checks} {_FLAGS}"}
    if not guided:
        flags["LDFLAGS"] = f"-fsanitize={_CHECKS}" + (" -shared-libsan" if compiler == "clang" else "")
    written = folder / "flags"
    if not written.exists() or written.read_text() != flags["CFLAGS"]:
        for path in [*folder.rglob("*.so"), *folder.rglob("*.o")]:
            path.unlink()
    written.write_text(flags["CFLAGS"])
    command = [sys.executable, "setup.py", "-q", "build_ext", "--inplace"]
    made = children.run(command, cwd=folder, env={**os.environ, **flags}, capture_output=True, text=True)
    if made.returncode:
        raise MissingError(
            f"the sanitized modules cannot be built:\n{made.stdout[-1000:]}{made.stderr[-1000:]}"
        )


def _runtime(compiler, guided):
    if guided:
        spec = importlib.util.find_spec("atheris")
        assert spec is not None
        assert spec.origin is not None
        return str(Path(spec.origin).parents[1] / "asan_with_fuzzer.so")
    if compiler == "gcc":
        return ":".join(_file_of("gcc", name) for name in ("libasan.so", "libubsan.so"))
    return _file_of("clang", "libclang_rt.asan-x86_64.so")


def _file_of(compiler, name):
    found = children.run([compiler, f"-print-file-name={name}"], capture_output=True, text=True, check=True)
    return found.stdout.strip()
