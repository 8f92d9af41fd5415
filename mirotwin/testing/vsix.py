"""Builds the VS Code extension file for `code --install-extension`, with reproducible bytes.

A .vsix is a zip with the types of its files, a manifest for the marketplace, and the extension in a folder. The
manifest has the data of package.json.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

BEGAN = (1980, 1, 1, 0, 0, 0)
"""The time of each file: the first that a zip has."""
TYPES = {"json": "application/json", "js": "application/javascript", "vsixmanifest": "text/xml"}
_TYPES = """<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
{types}
</Types>
"""
_MANIFEST = """<?xml version="1.0" encoding="utf-8"?>
<PackageManifest Version="2.0.0" xmlns="http://schemas.microsoft.com/developer/vsx-schema/2011">
  <Metadata>
    <Identity Language="en-US" Id={name} Version={version} Publisher={publisher} />
    <DisplayName>{title}</DisplayName>
    <Description xml:space="preserve">{description}</Description>
    <Categories>{categories}</Categories>
    <Properties>
      <Property Id="Microsoft.VisualStudio.Code.Engine" Value={engine} />
      <Property Id="Microsoft.VisualStudio.Code.ExtensionKind" Value={kind} />
    </Properties>
  </Metadata>
  <Installation>
    <InstallationTarget Id="Microsoft.VisualStudio.Code" />
  </Installation>
  <Dependencies />
  <Assets>
    <Asset Type="Microsoft.VisualStudio.Code.Manifest" Path="extension/package.json" Addressable="true" />
  </Assets>
</PackageManifest>
"""


def packed(files: Mapping[str, bytes]) -> bytes:
    """The .vsix of an extension's files by name, package.json among them. Raises KeyError without one."""
    about = json.loads(files["package.json"])
    manifest = _MANIFEST.format(
        name=quoteattr(about["name"]),
        version=quoteattr(about["version"]),
        publisher=quoteattr(about["publisher"]),
        title=escape(about["displayName"]),
        description=escape(about["description"]),
        categories=escape(",".join(about["categories"])),
        engine=quoteattr(about["engines"]["vscode"]),
        kind=quoteattr(",".join(about["extensionKind"])),
    )
    types = "\n".join(f'  <Default Extension=".{end}" ContentType="{kind}" />' for end, kind in TYPES.items())
    content = {
        "[Content_Types].xml": _TYPES.format(types=types).encode(),
        "extension.vsixmanifest": manifest.encode(),
        **{f"extension/{name}": files[name] for name in sorted(files)},
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, data in content.items():
            entry = zipfile.ZipInfo(name, BEGAN)  # stored: what deflates differs between machines
            entry.create_system, entry.external_attr = 3, 0o100644 << 16
            archive.writestr(entry, data)
    return packed.getvalue()
