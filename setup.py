"""Compiles the hot modules: every `x.py` that has an `x.pxd` beside it.

What belongs here: finding them, stamping each with the hash of its source, handing them to Cython, and giving the
C of an interpreter's loop the shape that a processor predicts well.
What does not: anything about a single module (its types stand in its own `.pxd`).

Every extension is optional: with no C compiler the package installs all the same and runs from source,
slowly and with the same bits. Each compiled module checks its stamp when it is imported
(`miro_exact.engine`), so one that no longer matches its source is refused.
"""

import importlib.util
import re
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HERE = Path(__file__).parent
ROOTS = {
    "miro_exact": "exact",
    "miro_protocol": "protocol",
    "miro_robot": "robot_fw",
    "miro_host": "host",
    "miro_sim": "sim",
}
STAMP = """

from miro_exact.engine import refuse_if_stale as _refuse_if_stale
__source_sha256__ = "{sha}"
_refuse_if_stale(__name__, __source_sha256__)
"""

DIRECTIVES = {
    "language_level": 3,
    "annotation_typing": False,  # C types come from the .pxd alone
    "boundscheck": False,
    "wraparound": False,
    "initializedcheck": False,
    "cdivision": False,  # // and % as Python has them
}
# No contraction to FMA, no reassociation: the same doubles on every machine.
INTERPRETER_ARMS = 64  # a loop around a choice of at least so many executes a program
SWITCH_OF_A_LOOP = re.compile(
    r"^(?P<indent> +)switch \((?P<value>\w+)\) {\n(?P<arms>.*?)(?P=indent)  default: break;\n(?P=indent)}\n"
    r"(?P=indent)(?P<again>__pyx_L\w+):;\n",
    re.M | re.S,
)
FLAGS = {"unix": ["-O2", "-ffp-contract=off", "-fno-fast-math", "-w"], "msvc": ["/O2", "/fp:strict"]}


def hot_modules():
    """The module that knows what is hot and how it is hashed, loaded from its file: nothing is installed yet."""
    spec = importlib.util.spec_from_file_location("hot_modules", HERE / "exact/miro_exact/hot_modules.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["hot_modules"] = module
    spec.loader.exec_module(module)
    return module


def package_dirs():
    return {name: HERE / root / name for name, root in ROOTS.items()}


def hot_extensions():
    dirs = package_dirs()
    return [
        Extension(name, [str(path.relative_to(HERE))], optional=True)
        for name, path in hot_modules().hot_sources(dirs).items()
    ]


def remove_orphans():
    """Compiled twins in the tree of modules that are hot no more: Python would take them for the module itself."""
    hot = hot_modules().hot_sources(package_dirs())
    for package, folder in package_dirs().items():
        for built in [*folder.rglob("*.so"), *folder.rglob("*.pyd")]:
            relative = Path(package) / built.relative_to(folder).with_name(built.name.split(".")[0])
            if ".".join(relative.parts) not in hot:
                built.unlink()


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
        before, loop, head = c[: switch.start()].rpartition(f"{indent[2:]}while (1) {{\n")
        if len(numbers) < INTERPRETER_ARMS or max(numbers) > 0xFF or not loop or "\n}\n" in head:
            continue
        targets = (f"&&arm_{number}" if number in numbers else f"&&{again}" for number in range(0x100))
        table = f"static void *const arm_of[0x100] = {{{', '.join(targets)}}};\n"
        head = re.sub(r"/\*.*?\*/", "", head, flags=re.S)
        head = re.sub(r"if \((__pyx_t_\w+)\) {", r"if (unlikely(\1)) {", head)
        step = f"{head}if ({value} < 0 || {value} > 0xFF) goto {again};\ngoto *arm_of[{value}];\n"
        arms = re.sub(
            rf"^{indent}  case (\w+):", lambda case: f"{case[0]} arm_{int(case[1], 0)}:;", arms, flags=re.M
        )
        arms = re.sub(rf"^{indent}  break;\n", step.replace("\\", r"\\"), arms, flags=re.M)
        first, last = switch.span("arms")
        mark = f'static const char dispatch[] __attribute__((used)) = "{hot_modules().DISPATCH_MARK.decode()}";\n'
        return before + table + loop + head + c[switch.start() : first] + arms + c[last:] + mark
    return c


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

        folder = Path(self.build_temp).absolute() / "stamped"
        stamped = self._stamp(folder)
        self.extensions = [extension for extension in self.extensions if extension.name.startswith(self.only)]
        translated = cythonize(
            [Extension(extension.name, [str(stamped[extension.name])]) for extension in self.extensions],
            compiler_directives=DIRECTIVES,
            include_path=[str(folder)],
        )
        sources = {extension.name: extension.sources for extension in translated}
        for extension in self.extensions:
            extension.sources = sources[extension.name]
            if self.compiler.compiler_type == "unix":
                extension.sources = [self._thread(Path(source)) for source in extension.sources]
            extension.extra_compile_args = FLAGS.get(self.compiler.compiler_type, [])
        super().build_extensions()

    def _thread(self, source):
        c = source.read_text(encoding="utf-8")
        shaped = threaded(c)
        if shaped == c:
            return str(source)
        target = source.with_suffix(".threaded.c")
        if not target.exists() or target.read_text(encoding="utf-8") != shaped:
            target.write_text(shaped, encoding="utf-8")
        return str(target)

    def _stamp(self, target):
        """Copies packages to `target` , hot modules with their stamp; unchanged files keep their time."""
        hashes = hot_modules().source_hashes(package_dirs())
        hot = {}
        for package, folder in package_dirs().items():
            for path in sorted([*folder.rglob("*.py"), *folder.rglob("*.pxd")]):
                relative = Path(package) / path.relative_to(folder)
                name = ".".join(relative.with_suffix("").parts)
                is_hot = path.suffix == ".py" and name in hashes
                if path.suffix == ".py" and not is_hot and path.name != "__init__.py":
                    continue
                text = path.read_text(encoding="utf-8")
                copy = target / relative
                if is_hot:
                    text += STAMP.format(sha=hashes[name])
                    hot[name] = copy
                copy.parent.mkdir(parents=True, exist_ok=True)
                if not copy.exists() or copy.read_text(encoding="utf-8") != text:
                    copy.write_text(text, encoding="utf-8")
        return hot


if __name__ == "__main__":
    setup(ext_modules=hot_extensions(), cmdclass={"build_ext": BuildHot})
