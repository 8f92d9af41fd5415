"""An installed distribution in a folder, as pip would leave it, with entry points for parts."""


def install(folder, name, version, parts, kind="laws", **modules):
    """`parts`: name of a part to `module:attribute`; `modules`: name of a module to its source."""
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = [f"{part} = {value}" for part, value in parts.items()]
    (info / "entry_points.txt").write_text(f"[mirotwin.{kind}]\n" + "\n".join(lines) + "\n")
    for module, source in modules.items():
        (folder / f"{module}.py").write_text(source)
