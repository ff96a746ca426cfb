#!/usr/bin/env python3
"""Fails on a citation in brackets, as Key2000, whose key is not in docs/references.bib."""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
KEY = re.compile(r"\[([A-Z][A-Za-z]+(?:19|20)\d\d)(?:[,\];])")


def main():
    known = set(re.findall(r"@\w+\{(\w+),", (ROOT / "docs/references.bib").read_text()))
    files = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    wrong = cited = 0
    for name in files:
        path = ROOT / name
        if path.suffix not in {".h", ".cpp", ".md", ".toml", ".xml", ".py"} or not path.exists():
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            for key in KEY.findall(line):
                cited += 1
                if key not in known:
                    wrong += 1
                    print(f"{name}:{number}: [{key}] is not in docs/references.bib")
    print(f"citations: {cited}, {wrong} unknown")
    return wrong > 0


sys.exit(main())
