"""The software bill of materials of an extension's archive: CycloneDX 1.6, as JSON."""

from __future__ import annotations

import hashlib
import json
import tomllib
import zipfile
from collections.abc import Sequence
from email.message import Message
from email.parser import Parser
from pathlib import Path
from typing import Any
from urllib.parse import quote

import gmsh_window
import warp_cpu
from slim import Slimmed

NAME = "sbom.cdx.json"
CHANGES = {library.FILE: library.CHANGE for library in (gmsh_window, warp_cpu)}
"""What is done to a file that the build replaces."""
_CLASSIFIER = "License :: "
# A name of a licence, and not its text.
_LONGEST_NAME = 60


def write_bill(source: Path, slimmed: Sequence[Slimmed] = ()) -> None:
    """Write the bill of a staged extension into it: what it is, and each wheel that it bundles.

    slimmed: the wheels that are not as published; each has the published one as its ancestor. The bill
    holds no time and no serial number, so that equal archives have equal bills.
    """
    manifest = tomllib.loads((source / "blender_manifest.toml").read_text(encoding="utf-8"))
    own = {
        "type": "application",
        "bom-ref": manifest["id"],
        "name": manifest["id"],
        "version": manifest["version"],
        "licenses": [{"license": {"id": name.removeprefix("SPDX:")}} for name in manifest["license"]],
    }
    changes = {change.name: change for change in slimmed}
    wheels = sorted((source / "wheels").glob("*.whl"))
    components = [_component(wheel, changes.get(wheel.name)) for wheel in wheels]
    bill = {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": own},
        "components": components,
        "dependencies": [{"ref": manifest["id"], "dependsOn": [c["bom-ref"] for c in components]}],
    }
    (source / NAME).write_text(json.dumps(bill, indent=2) + "\n", encoding="utf-8")


def _component(wheel: Path, change: Slimmed | None) -> dict[str, Any]:
    """A wheel as a component: package, version, licences as it states them, SHA-256, what was left out."""
    with zipfile.ZipFile(wheel) as package:
        # A package may have vendored others, whose own folders lie deeper.
        (path,) = (p for p in package.namelist() if p.count("/") == 1 and p.endswith(".dist-info/METADATA"))
        metadata = Parser().parsestr(package.read(path).decode(), headersonly=True)
    name, version = metadata["Name"], metadata["Version"]
    published = change.original if change else wheel.name
    purl = f"pkg:pypi/{name.lower().replace('_', '-')}@{version}?file_name={quote(published)}"
    return {
        "type": "library",
        "bom-ref": wheel.name,
        "name": name,
        "version": version,
        **({} if change else {"purl": purl}),
        "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(wheel.read_bytes()).hexdigest()}],
        **({"licenses": licences} if (licences := _licences(metadata)) else {}),
        **({"pedigree": _pedigree(name, version, purl, change)} if change else {}),
    }


def _pedigree(name: str, version: str, purl: str, change: Slimmed) -> dict[str, Any]:
    """The published wheel that a slimmed one was made from, and what was left out."""
    ancestor = {
        "type": "library",
        "name": name,
        "version": version,
        "purl": purl,
        "hashes": [{"alg": "SHA-256", "content": change.sha256}],
    }
    done = [f"{change.files} files, {change.bytes} bytes, left out: {', '.join(change.patterns)}"]
    done = done if change.patterns else ["compressed anew"]
    done += [f"{file} {CHANGES[file]}" for file in change.replaced]
    done += [f"{change.shortened} libraries without what no loader reads"] if change.shortened else []
    notes = "; ".join([*done, "all others unchanged but RECORD and the build tag in WHEEL"])
    return {"ancestors": [ancestor], "notes": notes}


def _licences(metadata: Message) -> list[dict[str, Any]]:
    """Licences in CycloneDX's terms: an SPDX expression, or the name that a package gives."""
    if metadata["License-Expression"]:
        return [{"expression": metadata["License-Expression"]}]
    names = [
        text.rpartition(" :: ")[2]
        for text in metadata.get_all("Classifier", [])
        if text.startswith(_CLASSIFIER) and text != "License :: OSI Approved"
    ]
    stated = (metadata["License"] or "").strip()
    if not names and stated and len(stated) <= _LONGEST_NAME and "\n" not in stated:
        names = [stated]
    return [{"license": {"name": name}} for name in names]
