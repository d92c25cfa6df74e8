// SPDX-License-Identifier: MIT
// Tables 1 and 2 of RCS, and its Fig. 9(b), once more, with ours beside them: docs/notes/preview.md.
//
//   bench_preview SCENES [table1|table2|fig9b|all] [POINTS of table 1] [LEVEL of table 1]
#include "tests/measure/preview_tables.h"

int main(int argc, char** argv) {
  const std::string which = argc > 2 ? argv[2] : "all";
  const unsigned long points = argc > 3 ? std::strtoul(argv[3], nullptr, 10) : 10000;
  const bool all = which == "all";
  if (argc < 2 || (which != "table1" && which != "table2" && which != "fig9b" && !all) || points == 0)
    return std::fprintf(stderr, "bench_preview SCENES [table1|table2|fig9b|all] [POINTS] [LEVEL]\n"), 1;
  if (all || which == "table1") relume::printTable1(argv[1], points, argc > 4 ? argv[4] : "");
  if (all || which == "table2") relume::printTable2(argv[1]);
  if (all || which == "fig9b") relume::printFigure9b(argv[1]);
  return 0;
}
