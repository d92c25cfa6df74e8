#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How far one table of docs/ACCURACY.md is from another: geometric means over the views of both.

    git show REVISION:docs/ACCURACY.md > before.md; python3 tests/measure/accuracy_change.py before.md docs/ACCURACY.md

Prints for each section that both have the factor on `rmse` and on `t1`; rows below 0.3 % in either say nothing and are left out.
Reports of `accuracy --report` can be given as well.
"""
import math
import re
import sys

LEAST = 0.3  # [%]


def tables(path):
    """Of each section its rows: (view, quantity) -> (rmse, t1)."""
    found = {}
    for section in open(path, encoding="utf-8").read().split("\n## ")[1:]:
        title, *lines = section.split("\n")
        rows = {}
        for line in lines:
            row = re.match(r"\| `(\S+)` \| (\w+) \| ([0-9.]+) \| ([0-9.]+) \|", line)
            if row:
                rows[row[1], row[2]] = float(row[3]), float(row[4])
        if rows:
            found[title] = rows
    return found


def factor(before, after, column):
    logs = [math.log(after[view][column] / before[view][column]) for view in before
            if view in after and min(before[view][column], after[view][column]) >= LEAST]
    return (math.exp(sum(logs) / len(logs)), len(logs)) if logs else (math.nan, 0)


def main():
    before, after = tables(sys.argv[1]), tables(sys.argv[2])
    for title in before:
        if title in after:
            (rmse, rows), (t1, rows_t1) = factor(before[title], after[title], 0), factor(before[title], after[title], 1)
            print(f"{title}: rmse x {rmse:.2f} ({rows} rows), t1 x {t1:.2f} ({rows_t1})")


if __name__ == "__main__":
    main()
