// SPDX-License-Identifier: MIT
// The user's locale changes nothing that the commands read or write: numbers of options, JSON, text, HTML and bakes.
#include "tests/cli/cli_fixture.h"
#include "tests/comma_locale.h"

namespace relume {
namespace {

class CliLocale : public CliFixture {
 protected:
  // What a command writes where C and C++ write commas.
  ProgramResult runWithCommas(const std::vector<std::string>& arguments) {
    return runProgram(arguments, folder_, [this] {
      // Made once for all: without it, each run would make its own.
      if (std::filesystem::exists(folder_ / "de_DE.UTF-8")) ::setenv("LOCPATH", folder_.c_str(), 1);
      ::setenv("LD_PRELOAD", RELUME_COMMA_HOST, 1);
      ::setenv("LC_ALL", "de_DE.UTF-8", 1);
    });
  }
  void expectTheSame(const std::vector<std::string>& arguments, const std::string& hasNumber) {
    const ProgramResult plain = run(arguments), commas = runWithCommas(arguments);
    EXPECT_EQ(commas.status, plain.status) << commas.err;
    EXPECT_EQ(commas.out, plain.out) << arguments[0];
    EXPECT_EQ(commas.err.find("comma_host"), std::string::npos) << commas.err;
    EXPECT_NE((plain.out + plain.err).find(hasNumber), std::string::npos) << plain.out << plain.err;
  }
};

TEST_F(CliLocale, commandsReadAndWriteTheSameNumbers) {
  if (std::string(RELUME_SANITIZE) != "") GTEST_SKIP() << "sanitizers want to be loaded first";
  {
    const test::CommaLocale commas;
    if (!commas.ofC()) GTEST_SKIP() << test::kNoCommaLocale;
  }
  const std::string make = "localedef -i de_DE -f UTF-8 '" + at("de_DE.UTF-8") + "' >/dev/null 2>&1";
  EXPECT_NE(std::system(make.c_str()), -1);
  // Bakes, by an option with a point
  const std::string other = at("other.relume");
  bake(room_, out_, {"--link-error", "0.25"});
  const ProgramResult baked = runWithCommas(bakeArguments(room_, other, {"--link-error", "0.25"}));
  ASSERT_EQ(baked.status, 0) << baked.err;
  EXPECT_EQ(readAll(other), readAll(out_));

  expectTheSame({"bake", "--print-options", "--link-error", "0.25"}, "0.25");
  expectTheSame({"bake", "--help"}, "0.1");
  expectTheSame(bakeArguments(room_, other, {"--link-error", "0,25"}), "0,25");
  expectTheSame({"info", out_}, "0.25");
  expectTheSame({"info", out_, "--json"}, "0.25");
  expectTheSame({"info", room_}, "[4.0,4.0,4.0]");
  expectTheSame({"status", room_, out_, "--json"}, "\"");

  // Bakes of other links, told apart in text, JSON and HTML
  bake(room_, other, {"--link-error", "0.75"});
  expectTheSame({"compare", out_, other, "--max-rmse", "0.5"}, "0.75");
  expectTheSame({"compare", out_, other, "--json"}, "0.75");
  const std::string page = at("page.html");
  run({"compare", out_, other, "--html", page});
  const std::string plain = readAll(page);
  EXPECT_NE(plain.find("0.75"), std::string::npos);
  runWithCommas({"compare", out_, other, "--html", page});
  EXPECT_EQ(readAll(page), plain);
}

}  // namespace
}  // namespace relume
