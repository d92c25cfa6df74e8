// SPDX-License-Identifier: MIT
// A host whose locale writes decimal commas: for as long as it lives, C's functions and C++'s streams do so in the
// whole process. Nothing is installed: where the system has no such locale, localedef makes one in a temporary folder;
// where that cannot be done either, only C++'s streams follow (ofC() is false).
#pragma once

#include <unistd.h>

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <locale>
#include <string>

namespace relume::test {

// "1.234,5", as de_DE has it.
class CommaNumbers : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

class CommaLocale {
 public:
  CommaLocale()
      : streams_(std::locale::global(std::locale(std::locale::classic(), new CommaNumbers))),
        c_(std::setlocale(LC_ALL, nullptr)) {
    name_ = choose();
  }
  ~CommaLocale() {
    std::locale::global(streams_);
    std::setlocale(LC_ALL, c_.c_str());
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

  // Whether printf writes commas, too.
  bool ofC() const {
    char text[16];
    std::snprintf(text, sizeof text, "%.1f", 0.5);
    return std::string(text) == "0,5";
  }
  const std::string& name() const { return name_; }

 private:
  // The name of the locale that C now has; empty: there is none with commas.
  static std::string choose() {
    for (const char* name : {"de_DE.UTF-8", "de_DE", "fr_FR.UTF-8", "es_ES.UTF-8", "it_IT.UTF-8", "pt_BR.UTF-8"}) {
      if (std::setlocale(LC_ALL, name) != nullptr) return name;
    }
    const auto folder = std::filesystem::temp_directory_path() / ("relume_locale_" + std::to_string(::getpid()));
    std::error_code failed;
    std::filesystem::create_directories(folder, failed);
    const std::string command =
        "localedef -i de_DE -f UTF-8 '" + (folder / "de_DE.UTF-8").string() + "' >/dev/null 2>&1";
    std::string name;
    // localedef's status is 1 where it only warned.
    if (std::system(command.c_str()) != -1) {
      ::setenv("LOCPATH", folder.c_str(), 1);
      if (std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr) name = "de_DE.UTF-8";
      ::unsetenv("LOCPATH");
    }
    std::filesystem::remove_all(folder, failed);
    return name;
  }

  std::locale streams_;
  std::string c_, name_;
};

// What a test of C's functions says where it cannot run.
inline constexpr const char* kNoCommaLocale =
    "no locale with decimal commas here, and localedef cannot make one (package locales)";

}  // namespace relume::test
