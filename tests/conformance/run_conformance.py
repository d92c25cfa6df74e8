#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Bake every .glb and .gltf under a folder at the draft preset and write the outcome as a Markdown table.

    tests/conformance/run_conformance.py --relume build/release/tools/cli/relume --scenes FOLDER \\
        [--output docs/notes/conformance.md] [--timeout 900] [--only PART] [--jobs 1]

A file passes when it bakes, or when it is refused with one of the documented exit codes and a message that names the
file. Exit status: 0 all pass; 1 wrong arguments; 7 some file crashed, hung, was refused without a name, or was not
baked or refused as EXPECTED_REFUSED says.
"""
import argparse
import concurrent.futures
import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

# Exit codes of the command line: docs of `relume --help`.
REFUSALS = {2: "input/output", 3: "invalid file", 4: "failed while running", 5: "unsupported"}

# Parts of paths that must be refused, never baked.
EXPECTED_REFUSED = ["IndexOutOfRange", "MissingBin", "RecursiveNodes", "SchemaFailures", "wrongTypes",
                    "IncorrectVertexArrays", "BoxWithInfinites", "invalid", "notfound", "encoded-uris",
                    "escaped-strings", "/bad_"]


def scene_files(folder, only):
    files = sorted(p for p in folder.rglob("*") if p.suffix in (".glb", ".gltf") and p.is_file())
    return [p for p in files if only in str(p.relative_to(folder))]


def triangles_of(report):
    """The figure `triangles` of the stage `import`, wherever the report keeps its stages; None without one."""
    if isinstance(report, dict):
        if report.get("stage") == "import" or report.get("name") == "import":
            figures = report.get("figures", {})
            pairs = figures.items() if isinstance(figures, dict) else [
                (f.get("name"), f.get("value")) if isinstance(f, dict) else tuple(f) for f in figures]
            for name, value in pairs:
                if name == "triangles":
                    return int(value)
        children = report.values()
    elif isinstance(report, list):
        children = report
    else:
        return None
    for child in children:
        found = triangles_of(child)
        if found is not None:
            return found
    return None


def last_message(stderr):
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    errors = [line for line in lines if re.search(r"error", line, re.IGNORECASE)]
    return (errors or lines or [""])[-1]


def bake(relume, scene, timeout):
    """One row: what happened, exit code, triangles, seconds, message."""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        command = [str(relume), "bake", str(scene), "-o", str(pathlib.Path(folder) / "out.relume"), "--preset", "draft",
                   "--progress", "none", "--report", str(report)]
        begin = time.monotonic()
        try:
            run = subprocess.run(command, capture_output=True, timeout=timeout)
        except subprocess.TimeoutExpired:
            return {"what": "HANG", "code": None, "triangles": None, "seconds": timeout, "message": "no end in sight"}
        seconds = time.monotonic() - begin
        stderr = run.stderr.decode("utf-8", "replace")
        triangles = None
        if report.exists():
            try:
                triangles = triangles_of(json.loads(report.read_text()))
            except (ValueError, TypeError):
                pass
        left = sorted(p.name for p in pathlib.Path(folder).iterdir() if p != report)
        if run.returncode == 0:
            what = "baked" if left == ["out.relume"] else "NO OUTPUT"
        elif run.returncode in REFUSALS:
            what = "refused" if not left else "HALF-WRITTEN " + ", ".join(left)
        else:
            what = "CRASH"
        message = "" if what == "baked" else last_message(stderr)
        if what == "refused" and scene.name not in message:
            what = "UNNAMED"
        return {"what": what, "code": run.returncode, "triangles": triangles, "seconds": seconds, "message": message}


def judge(name, row):
    expected = any(part in "/" + name for part in EXPECTED_REFUSED)
    if row["what"] == "baked" and expected:
        row["what"] = "BAKED, should be refused"
    return row


def table(rows, folder_name, program):
    def cell(text):
        return str(text).replace("|", "\\|").replace("\n", " ")

    counts = {}
    for _, row in rows:
        counts[row["what"]] = counts.get(row["what"], 0) + 1
    bad = sum(n for what, n in counts.items() if what not in ("baked", "refused"))
    verdict = "Every test scene bakes or is refused by name" if bad == 0 else f"{bad} of the test scenes fail"
    out = ["# Conformance", "", f"**Verdict.** {verdict}.", "",
           f"*Measured {datetime.date.today()}; {program}; {os.cpu_count()} cores; `tests/conformance/run_conformance.py`.*", "",
           "Every `.glb` and `.gltf` of the test scenes, baked by `relume bake FILE -o OUT --preset draft` or refused by",
           "name. Made by `tests/conformance/run_conformance.py`; do not edit.", "",
           f"{len(rows)} files of `{folder_name}`: " + ", ".join(f"{n} {what}" for what, n in sorted(counts.items())) + ".",
           "", "| file | result | triangles | seconds | message |", "|---|---|---:|---:|---|"]
    for name, row in rows:
        result = row["what"] if row["what"] == "baked" else f"{row['what']} ({row['code']})"
        triangles = "" if row["triangles"] is None else f"{row['triangles']:,}"
        message = re.sub(r"^(relume: )?error: ", "", row["message"])
        out.append(f"| {cell(name)} | {result} | {triangles} | {row['seconds']:.1f} | {cell(message)} |")
    return "\n".join(out) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--relume", type=pathlib.Path, required=True, help="the relume binary")
    parser.add_argument("--scenes", type=pathlib.Path, required=True, help="folder with .glb and .gltf files")
    parser.add_argument("--output", type=pathlib.Path, help="Markdown file to write; standard output without it")
    parser.add_argument("--timeout", type=float, default=900.0, help="seconds a file may take (900)")
    parser.add_argument("--only", default="", help="only files whose path holds this")
    parser.add_argument("--jobs", type=int, default=1, help="files at a time (1); seconds are honest with 1 only")
    options = parser.parse_args()
    if not options.relume.is_file() or not options.scenes.is_dir():
        print("run_conformance.py: no such binary or folder", file=sys.stderr)
        return 1

    files = scene_files(options.scenes, options.only)
    if not files:
        print(f"run_conformance.py: no scenes under {options.scenes}", file=sys.stderr)
        return 1
    with concurrent.futures.ThreadPoolExecutor(max_workers=max(options.jobs, 1)) as pool:
        baked = list(pool.map(lambda f: bake(options.relume, f, options.timeout), files))
    rows = []
    for file, row in zip(files, baked):
        name = str(file.relative_to(options.scenes))
        rows.append((name, judge(name, row)))
    version = subprocess.run([options.relume, "--version"], capture_output=True, text=True, check=True).stdout
    text = table(rows, options.scenes.name, version.strip().splitlines()[-1])
    if options.output:
        options.output.write_text(text)
    else:
        print(text, end="")
    bad = [(name, row) for name, row in rows if row["what"] not in ("baked", "refused")]
    for name, row in bad:
        print(f"{name}: {row['what']} (exit {row['code']}): {row['message']}", file=sys.stderr)
    return 7 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
