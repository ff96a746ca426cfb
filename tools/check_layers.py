#!/usr/bin/env python3
"""Fails on an #include that goes against the layers (tools/layers.txt)."""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def allowed():
    """module -> modules it may include; and header -> modules that may include it."""
    modules, headers = {}, {}
    for line in (ROOT / "tools/layers.txt").read_text().splitlines():
        line = line.split("#")[0].strip()
        if not line:
            continue
        name, _, uses = line.partition(":")
        (headers if "<" in name else modules)[name.strip().strip("<>")] = uses.split()
    return modules, headers


def module_of(path):
    parts = path.split("/")
    return parts[1] if parts[0] == "traceur" else parts[0]


def main():
    modules, headers = allowed()
    files = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.h", "*.cpp"],
        cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    wrong = 0
    for name in files:
        if not (ROOT / name).exists():
            continue
        module = module_of(name)
        for number, line in enumerate((ROOT / name).read_text().splitlines(), 1):
            found = re.match(r'\s*#\s*include\s+(?:"traceur/(\w+)/|<([^>]+)>)', line)
            if not found:
                continue
            other, system = found.groups()
            ok = True
            if other and module in modules:
                ok = other == module or other in modules[module]
            if system and system in headers:
                ok = module in headers[system]
            if not ok:
                wrong += 1
                print(f"{name}:{number}: {module} must not include {other or system}")
    print(f"layers: {len(files)} files, {wrong} wrong includes")
    return wrong > 0


sys.exit(main())
