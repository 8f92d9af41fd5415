"""An installed distribution in a folder, as pip would leave it, with entry points for laws."""


def install(folder, name, version, laws, **modules):
    """`laws`: name of a law to `module:attribute`; `modules`: name of a module to its source."""
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = [f"{law} = {value}" for law, value in laws.items()]
    (info / "entry_points.txt").write_text("[mirotwin.laws]\n" + "\n".join(lines) + "\n")
    for module, source in modules.items():
        (folder / f"{module}.py").write_text(source)
