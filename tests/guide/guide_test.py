#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Run the commands of the guide, of README.md and of docs/EXPORT.md: every ```sh block, in order, in a folder for each page.

What follows "sh" on the line that opens a block says how it is run:

    ```sh                       run; each command must succeed, or end as its comment "# exit status N [or M]" says
    ```sh needs: PROGRAM        skipped, with a line that says so, where there is no such program
    ```sh not run: REASON       never run

Links are followed as well, of all documents: files and headings of this repository must be there.

    guide_test.py --source DIR --work DIR --path DIR[:DIR...]
"""
import argparse
import concurrent.futures
import functools
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

BLOCK = re.compile(r"^```sh([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
MOST_NOT_RUN = 8  # of all pages together: a page whose commands are not run is a page that goes stale


def commands(text):
    """Lines of a block, continued ones joined, each with the exit statuses that it may have."""
    for line in text.replace("\\\n", " ").splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            said = re.search(r"#\s*exit status (\d+)(?: or (\d+))?", line)
            yield line, {int(status) for status in said.groups() if status} if said else {0}


def run_page(page, source, work, path, library):
    """What a page's commands said, its failures, and how many of its blocks were not run."""
    folder = work / page.relative_to(source).as_posix().replace("/", "_")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ("samples", "docs", "bindings"):
        (folder / name).symlink_to(source / name)
    # Debian's Blender takes the first python3 there is, and needs the numpy of the system's.
    environment = dict(os.environ, PATH=f"{path}:/usr/bin:{os.environ['PATH']}", RELUME_LIBRARY=library)
    log, failures, not_run = [], [], 0
    for how, text in BLOCK.findall(page.read_text()):
        how = how.strip()
        if how.startswith("not run: ") and len(how) > 20:
            not_run += 1
            continue
        if how.startswith("needs: "):
            if not shutil.which(how[7:], path=environment["PATH"]):
                log.append(f"{page.name}: skipped, there is no {how[7:]}")
                continue
        elif how:
            failures.append(f'{page.name}: "sh {how}" is none of what this test knows')
            continue
        for command, expected in commands(text):
            begin = time.monotonic()
            result = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=folder, env=environment, timeout=900,
                                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            log.append(f"{page.name}: {time.monotonic() - begin:5.2f} s  {command.strip()}")
            if result.returncode not in expected:
                failures.append(f"{page.name}: {command}\n  exit status {result.returncode}, expected {sorted(expected)}\n"
                                + result.stdout)
    return log, failures, not_run


def anchors(page):
    """Names of a page's headings as GitHub makes them."""
    heads = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def broken_links(page):
    failures = []
    for link in LINK.findall(page.read_text()):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name) if name else page
        if not target.exists():
            failures.append(f"{page.name}: {link}: no such file")
        elif anchor and anchor not in anchors(target):
            failures.append(f"{page.name}: {link}: no such heading")
    return failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", type=pathlib.Path, required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--path", required=True, help="folders of relume and relume-view")
    parser.add_argument("--library", default="", help="librelume.so, for the page on Python")
    arguments = parser.parse_args()
    source = arguments.source.resolve()
    pages = [source / "README.md", source / "docs/EXPORT.md", *sorted((source / "docs/guide").glob("*.md"))]
    failures, not_run = [], 0
    run = functools.partial(run_page, source=source, work=arguments.work.resolve(), path=arguments.path,
                            library=arguments.library)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for log, found, skipped in pool.map(run, pages):
            print("\n".join(log))
            failures += found
            not_run += skipped
    linked = {*pages, *source.glob("*.md"), *source.glob("docs/**/*.md"), *source.glob("bindings/*/*.md"), source / "formats/README.md"}
    for page in sorted(linked):
        failures += broken_links(page)
    for picture in sorted((source / "docs/guide/pictures").glob("*.png")):
        if picture.stat().st_size > 150 * 1024:
            failures.append(f"{picture.name}: more than 150 KiB")
        if not any(picture.name in page.read_text() for page in pages):
            failures.append(f"{picture.name}: on no page")
    if not_run > MOST_NOT_RUN:
        failures.append(f"{not_run} blocks are not run, expected at most {MOST_NOT_RUN}")
    print("\n".join(failures) or f"{len(pages)} pages hold")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
