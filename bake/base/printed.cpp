// SPDX-License-Identifier: MIT
// See printed.h.
#include "bake/base/printed.h"

#include <locale.h>
#include <clocale>
#include <cstdio>
#include <locale>

namespace relume {
namespace {

// Gives the calling thread, and no other, the C locale for as long as it lives.
class ClassicLocale {
 public:
  ClassicLocale() : before_(uselocale(classic())) {}
  ~ClassicLocale() { uselocale(before_); }
  ClassicLocale(const ClassicLocale&) = delete;
  ClassicLocale& operator=(const ClassicLocale&) = delete;

 private:
  static locale_t classic() {
    static const locale_t locale = newlocale(LC_ALL_MASK, "C", nullptr);
    return locale;
  }
  locale_t before_;
};

}  // namespace

std::string vprinted(const char* pattern, std::va_list arguments) {
  const ClassicLocale classic;
  std::va_list again;
  va_copy(again, arguments);
  const int size = std::vsnprintf(nullptr, 0, pattern, arguments);
  std::string text(size > 0 ? static_cast<std::size_t>(size) : 0, '\0');
  std::vsnprintf(text.data(), text.size() + 1, pattern, again);
  va_end(again);
  return text;
}

std::string printed(const char* pattern, ...) {
  std::va_list arguments;
  va_start(arguments, pattern);
  std::string text = vprinted(pattern, arguments);
  va_end(arguments);
  return text;
}

void useClassicLocale() {
  std::setlocale(LC_ALL, "C");
  std::locale::global(std::locale::classic());
}

}  // namespace relume
