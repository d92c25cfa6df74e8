// SPDX-License-Identifier: MIT
// Loaded before a program (LD_PRELOAD): the program starts in a locale that writes decimal commas, as it would beside a
// library that follows the user's.
#include "tests/comma_locale.h"

namespace {

[[gnu::constructor]] void chooseCommas() {
  // Programs that this one starts, localedef among them, are not meant.
  ::unsetenv("LD_PRELOAD");
  // Kept until the process ends.
  static auto* const commas = new relume::test::CommaLocale;
  if (!commas->ofC()) std::fprintf(stderr, "comma_host: %s\n", relume::test::kNoCommaLocale);
}

}  // namespace
