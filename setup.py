"""Compiles the hot modules: every `x.py` (or `x.pyx`) that has an `x.pxd` beside it.

Every extension is optional: with no C compiler the package installs all the same and runs from source,
slowly and with the same bits. With MIROTWIN_PURE=1 in the environment nothing is compiled, and the wheel is one for
every machine (py3-none-any). Each compiled module checks its stamp when it is imported
(`miro_exact.engine`), so one that no longer matches its source is refused.
"""

import gc
import importlib.util
import os
import platform
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py

HERE = Path(__file__).parent
ROOTS = {
    "miro_exact": "exact",
    "miro_protocol": "protocol",
    "miro_robot": "robot_fw",
    "miro_host": "host",
    "miro_sim": "sim",
    "mirotwin": ".",
}
STAMP = """

from miro_exact.engine import refuse_if_stale as _refuse_if_stale
__source_sha256__ = "{sha}"
_refuse_if_stale(__name__, __source_sha256__)
"""

DIRECTIVES = {
    "language_level": 3,
    "annotation_typing": False,  # C types come from the .pxd
    "infer_types": True,  # ... and those of locals that it does not name from what is assigned to them
    "boundscheck": False,
    "wraparound": False,
    "initializedcheck": False,
    "cdivision": False,  # // and % as Python has them
    "auto_pickle": False,  # nothing of ours is pickled: state is saved from its tables
}
# Python's own flags ask for debug information, which takes a quarter of the time; CFLAGS=-g keeps it.
X86 = ("x86_64", "AMD64", "i686", "i586", "i386", "x86")  # a 32-bit Python may run on a 64-bit processor
NO_DEBUG = [] if "-g" in os.environ.get("CFLAGS", "") else ["-g0"]
# No contraction to FMA, no reassociation: the same doubles on every machine.
# 32-bit x86 would compute in x87 registers, which round twice.
SSE = ["-msse2", "-mfpmath=sse"] if sys.maxsize < 1 << 32 and platform.machine() in X86 else []
# No packing of scalars: two doubles that were stored apart and are read as one vector wait for the cache.
SCALAR = ["-fno-tree-slp-vectorize", *SSE]
HOTTEST = re.compile(
    r"miro_exact\.(dmath|memory|rng)|miro_host\.eye\.regions"
    r"|miro_robot\.(board|wired_board|parts\.(led|lm629|nets|part))"
    r"|miro_robot\.(harness\.(fast_oracle|harness)|lm629\.(bus_timing|chip|encoder|pid))"
    r"|miro_robot\.mcs51\.(chip|cpu|interrupts|line|peripherals|timers|uart)"
    r"|miro_sim\.pitch\.(camera|rays|scene|sensor)|miro_sim\.plant\.(car|chassis|dc_motor|differential_drive|drive|encoder|line_sensors|plane|rough)"
)
"""What takes half a percent of a run or more. The others are compiled with -Og, which takes a third of the time."""
QUICKLY = ["-Og", "-finline-small-functions"]  # among them those that count references
# Cython's name for what runs once, at import: it is compiled without optimizing.
ONCE = '-DCYTHON_SMALL_CODE=__attribute__((cold,optimize("O0")))'
FLAGS = {
    "unix": ["-O2", "-ffp-contract=off", "-fno-fast-math", "-w", ONCE, *SCALAR, *NO_DEBUG],
    "msvc": ["/O2", "/fp:strict"],
}


def from_file(name):
    """A module of the ground floor, loaded from its file: nothing is installed yet."""
    spec = importlib.util.spec_from_file_location(name, HERE / f"exact/miro_exact/{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def hot_modules():
    """The module that knows what is hot and how it is hashed."""
    return from_file("hot_modules")


def shaped(path):
    """The source of a hot module as it is compiled (unchanged for what has no uncompiled twin)."""
    source = path.read_text("utf-8")
    if path.suffix != ".py":
        return source
    places, layout = from_file("places"), path.with_suffix(".pxd").read_text("utf-8")
    return places.without_zeros(source, layout) + places.text(layout)


def package_dirs():
    return {name: HERE / root / name for name, root in ROOTS.items()}


def pure():
    """True if nothing is to be compiled."""
    wanted = os.environ.get("MIROTWIN_PURE", "")
    if wanted not in ("", "0", "1"):
        sys.exit(f"MIROTWIN_PURE={wanted}: give 1 (compile nothing), 0, or unset it")
    return wanted == "1"


def hot_extensions():
    dirs = package_dirs()
    hot = {name: [str(path.relative_to(HERE))] for name, path in hot_modules().hot_sources(dirs).items()}
    return [
        Extension(name, sources, optional=True) for name, sources in {hot_modules().SHARED: [], **hot}.items()
    ]


def remove_orphans():
    """Compiled twins in the tree of modules that are hot no more: Python would take them for the module itself."""
    hot = {hot_modules().SHARED, *hot_modules().hot_sources(package_dirs())}
    for package, folder in package_dirs().items():
        for built in [*folder.rglob("*.so"), *folder.rglob("*.pyd")]:
            relative = Path(package) / built.relative_to(folder).with_name(built.name.split(".")[0])
            if ".".join(relative.parts) not in hot:
                built.unlink()


INTERPRETER_ARMS = 64  # a loop around a choice of at least so many executes a program
SWITCH_OF_A_LOOP = re.compile(
    r"^(?P<indent> +)switch \((?P<value>\w+)\) {\n(?P<arms>(?:(?!}).*\n)*?)(?P=indent)  default: break;\n(?P=indent)}\n"
    r"(?P=indent)(?P<again>__pyx_L\w+):;\n",
    re.M,
)
"""Within one function: none of its lines begins with a brace."""


def threaded(c):
    """C in which every arm of an interpreter's loop fetches the next instruction and jumps to its arm by itself.

    Processors predict an indirect jump from where it is and what was jumped before: one jump for the whole loop mixes
    all instructions up. Compilers do not copy it, so the loop's head, from `while` to `switch`, is copied to the end of
    each arm (labels as values: GCC and Clang); what the head asks before each instruction is taken to be rare.
    Text that is not as Cython 3 writes it stays as it is: slower, the same bits. What was reshaped carries a mark, by
    which `mirotwin info` says so.
    """
    for switch in SWITCH_OF_A_LOOP.finditer(c):
        indent, value, arms, again = switch["indent"], switch["value"], switch["arms"], switch["again"]
        numbers = {int(number, 0) for number in re.findall(rf"^{indent}  case (\w+):", arms, re.M)}
        # The last `while` before the switch, one step to the left: that is the loop around it.
        before, loop, head = c[: switch.start()].rpartition(f"{indent[2:]}while (1) {{\n")
        # A brace in the first column ends a function: then the `while` is of another one.
        if len(numbers) < INTERPRETER_ARMS or max(numbers) > 0xFF or not loop or "\n}\n" in head:
            continue
        targets = (f"&&arm_{number}" if number in numbers else f"&&{again}" for number in range(0x100))
        table = f"static void *const arm_of[0x100] = {{{', '.join(targets)}}};\n"
        # Cython quotes the source in comments: they would stand in the file once for each arm.
        head = re.sub(r"/\*.*?\*/", "", head, flags=re.S)
        head = re.sub(r"if \((__pyx_t_\w+)\) {", r"if (unlikely(\1)) {", head)
        # Without the test a value of no arm would be an index outside of the table, where `switch` takes
        # `default`.
        step = f"{head}if ({value} < 0 || {value} > 0xFF) goto {again};\ngoto *arm_of[{value}];\n"
        arms = re.sub(
            rf"^{indent}  case (\w+):", lambda case: f"{case[0]} arm_{int(case[1], 0)}:;", arms, flags=re.M
        )
        # Doubled, because `re.sub` takes a backslash in its replacement for an escape, and C has some in its
        # texts.
        arms = re.sub(rf"^{indent}  break;\n", step.replace("\\", r"\\"), arms, flags=re.M)
        first, last = switch.span("arms")
        # `used`: nothing refers to the mark, and the compiler would leave it out.
        sign = f'static const char dispatch[] __attribute__((used)) = "{hot_modules().DISPATCH_MARK.decode()}";\n'
        # The table stands in the function: addresses of its labels are constants only there.
        return before + table + loop + head + c[switch.start() : first] + arms + c[last:] + sign
    return c


NUMBER = r"-?(?:0x[0-9A-Fa-f]+|\d+|\d*\.?\d+(?:e[+-]?\d+)?)"
SET = re.compile(r"\b(__pyx_v_\d\w+) = ")
SETTING = re.compile(rf"^  (__pyx_v_\d\w+) = ({NUMBER}|__pyx_t_\d+);\n", re.M)
DECLARED = re.compile(r"^static (int|PY_LONG_LONG|double|[\w ]*__pyx_t_\w+) (__pyx_v_\d\w+);\n", re.M)


def constants(c):
    """C in which a `static int NAME;` that is set once, to a number, is `static int const NAME = NUMBER;`.

    Cython makes variables of a module's typed names, which a compiler must load again and again. Those that are set
    together (`A, B = 1, 2`) go through temporaries. Text that is not as Cython 3 writes it stays as it is: slower, the
    same bits.
    """
    declared = {name for _, name in DECLARED.findall(c)}
    times = Counter(SET.findall(c))
    numbers = {}
    for setting in SETTING.finditer(c):
        name, value = setting.groups()
        # Set twice it is a variable: the first number would be taken for all time.
        if name in declared and times[name] == 1 and (literal := number(c, setting.start(), value)):
            numbers[name] = literal
    c = SETTING.sub(lambda setting: "" if setting[1] in numbers else setting[0], c)
    return DECLARED.sub(
        lambda m: f"static {m[1]} const {m[2]} = {numbers[m[2]]};\n" if m[2] in numbers else m[0],
        c,
    )


def number(c, end, value):
    """The number that `value` is; that of a temporary was set last before `end`. "" if it is none."""
    if value.startswith("__pyx_t_"):
        setting = f"  {value} = "
        # Backwards: Cython uses a temporary for many settings, and only the last one is this one's.
        place = c.rfind(setting, 0, end)
        value = c[place + len(setting) : c.find(";", place)] if place >= 0 else ""
    return value if re.fullmatch(NUMBER, value) else ""


class BuildHot(build_ext):
    """Translates stamped copies, so that the hash stands in the module and not in the source."""

    user_options = [*build_ext.user_options, ("only=", None, "build only the modules whose name starts so")]

    def initialize_options(self):
        super().initialize_options()
        self.only = ""
        self.parallel = True  # compile on all cores

    def run(self):
        super().run()
        if self.inplace or self.editable_mode:
            remove_orphans()

    def build_extensions(self):
        from Cython.Build import cythonize

        gc.set_threshold(1_000_000)  # a fifth of the time of translating is looking for garbage
        folder = Path(self.build_temp).absolute() / "stamped"
        stamped = self._stamp(folder)
        # After `_stamp`, which copies all: a module that is built includes the .pxd of others.
        self.extensions = [extension for extension in self.extensions if extension.name.startswith(self.only)]
        shared = hot_modules().SHARED
        translated = cythonize(
            [Extension(name, [str(stamped[name])]) for name in self._names() if name != shared],
            compiler_directives=DIRECTIVES,
            include_path=[str(folder)],
            shared_utility_qualified_name=shared,
            nthreads=len(os.sched_getaffinity(0)) if sys.platform == "linux" else 0,
        )
        sources = {extension.name: extension.sources for extension in translated}
        if shared in self._names():
            sources[shared] = [self._shared(folder)]
        for extension in self.extensions:
            extension.sources = sources[extension.name]
            for source in map(Path, extension.sources):
                self._write(source, constants(source.read_text(encoding="utf-8")))
            if self.compiler.compiler_type == "unix":
                extension.sources = [self._thread(Path(source)) for source in extension.sources]
            hottest = HOTTEST.fullmatch(extension.name)
            less = QUICKLY if self.compiler.compiler_type == "unix" and not hottest else []
            extension.extra_compile_args = FLAGS.get(self.compiler.compiler_type, []) + less
        # The longest first, so that no core waits for the last one.
        self.extensions.sort(key=lambda extension: -sum(map(os.path.getsize, extension.sources)))
        super().build_extensions()

    def _names(self):
        return [extension.name for extension in self.extensions]

    def _shared(self, folder):
        """C of the module with Cython's own code for memoryviews, which all others import."""
        target = folder / Path(*hot_modules().SHARED.split(".")).with_suffix(".c")
        if not target.exists():
            subprocess.run([sys.executable, "-m", "cython", f"--generate-shared={target}"], check=True)
        return str(target)

    def _thread(self, source):
        c = source.read_text(encoding="utf-8")
        target = source
        if (shaped := threaded(c)) != c:
            target = source.with_suffix(".threaded.c")
            self._write(target, shaped)
        return str(target)

    def _write(self, target, text):
        """Writes a file that is to hold this; an unchanged one keeps its time, and is not compiled again."""
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")

    def _stamp(self, target):
        """Copies packages to `target` , hot modules with their stamp; unchanged files keep their time."""
        hashes = hot_modules().source_hashes(package_dirs(), hot_modules().hot_sources(package_dirs()))
        hot = {}
        for package, folder in package_dirs().items():
            for path in sorted([*folder.rglob("*.py"), *folder.rglob("*.pyx"), *folder.rglob("*.pxd")]):
                relative = Path(package) / path.relative_to(folder)
                name = ".".join(relative.with_suffix("").parts)
                is_hot = path.suffix != ".pxd" and name in hashes
                # Cython needs each package's `__init__.py` to know that the folder is one.
                if path.suffix == ".py" and not is_hot and path.name != "__init__.py":
                    continue
                copy = target / relative
                text = path.read_text(encoding="utf-8")
                if is_hot:
                    text = shaped(path) + STAMP.format(sha=hashes[name])
                    hot[name] = copy
                copy.parent.mkdir(parents=True, exist_ok=True)
                self._write(copy, text)
        return hot


CARRIED = {"robot_fw/firmware": "miro_robot/firmware/source", "examples": "mirotwin/testing/examples"}
"""Folders outside of the packages that a wheel carries, and where: `mirotwin init` and `examples` write them."""
LEFT_BEHIND = {"build", "runs", "__pycache__", ".pytest_cache", "GNUmakefile"}
"""What tools leave, and the firmware's make file of this tree, which writes outside of its folder."""


class BuildCarrying(build_py):
    """Adds what no package folder holds."""

    def run(self):
        super().run()
        if not self.editable_mode:
            for path, target in self._carried():
                self.mkpath(str(target.parent))
                self.copy_file(str(path), str(target))

    def get_outputs(self, include_bytecode=1):
        carried = [] if self.editable_mode else [str(target) for _, target in self._carried()]
        return [*super().get_outputs(include_bytecode), *carried]

    def _carried(self):
        for folder, place in CARRIED.items():
            for path in sorted((HERE / folder).rglob("*")):
                inner = path.relative_to(HERE / folder)
                left_behind = any(part in LEFT_BEHIND or part.endswith(".egg-info") for part in inner.parts)
                if path.is_file() and not left_behind:
                    yield path, Path(self.build_lib) / place / inner


if __name__ == "__main__":
    extensions = [] if pure() else hot_extensions()
    setup(ext_modules=extensions, cmdclass={"build_ext": BuildHot, "build_py": BuildCarrying})
