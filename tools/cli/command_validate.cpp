// SPDX-License-Identifier: MIT
// relume validate FILE [--json]: every numbered finding of formats/validation_messages.h. Exit status 3 when one of
// them is an error.
#include "formats/validate.h"
#include "relume/bake_file.h"
#include "tools/base/printable.h"
#include "tools/cli/commands.h"
#include "tools/cli/describe.h"
#include "tools/cli/reserve_bake.h"
#include "tools/cli/terminal.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>

namespace relume {
namespace {

struct ValidateArguments {
  std::string file;
  std::uint64_t maxMemory = 0;
  bool json = false;
};

using Json = nlohmann::json;

int validateJson(const std::string& file, const Result<Bake>& bake, const std::vector<Finding>& findings, int status) {
  Json list = Json::array();
  for (const Finding& f : findings)
    list.push_back({{"number", static_cast<int>(f.check)},
                    {"severity", f.severity == FindingSeverity::error ? "error" : "warning"},
                    {"what", f.what},
                    {"where", f.where},
                    {"expected", f.expected},
                    {"found", f.found},
                    {"count", f.count}});
  Json report = {{"file", file}, {"valid", status == 0}, {"findings", list}};
  if (!bake) report["unreadable"] = bake.error().message;
  if (bake && status == 0) report["certificate"] = describeCertificate(*bake);
  std::printf("%s\n", jsonText(report).c_str());
  return status;
}

int runValidate(const ValidateArguments& arguments) {
  Terminal terminal(arguments.maxMemory);
  if (Status ok = reserveBake(terminal.context(), "validate", arguments.file); !ok) return fail(ok.error());
  const Result<Bake> bake = mapBake(arguments.file);
  const std::vector<Finding> findings = bake ? validateBake(*bake) : std::vector<Finding>{};
  const bool broken = std::any_of(findings.begin(), findings.end(),
                                  [](const Finding& f) { return f.severity == FindingSeverity::error; });
  const int status = !bake ? exitCode(bake.error().code) : broken ? exitCode(ErrorCode::invalidFile) : 0;
  if (arguments.json) return validateJson(arguments.file, bake, findings, status);
  if (!bake) return fail(bake.error());
  for (const Finding& f : findings) std::printf("%s\n", printable(toString(f)).c_str());
  std::printf("%s: %s, %zu finding%s\n", printable(arguments.file).c_str(), broken ? "invalid" : "valid",
              findings.size(), findings.size() == 1 ? "" : "s");
  if (const std::string text = broken ? "" : certificateText(*bake); !text.empty()) std::printf("%s\n", text.c_str());
  return status;
}

}  // namespace

void addValidateCommand(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("validate", "Check every invariant of a bake; exit status 3 when one is broken");
  auto arguments = std::make_shared<ValidateArguments>();
  command->add_option("FILE", arguments->file, "Bake (.relume)")->type_name("FILE")->required();
  command->add_flag("--json", arguments->json, "Print JSON");
  addMemoryOption(*command, arguments->maxMemory);
  command->callback([arguments, &action] { action = [arguments] { return runValidate(*arguments); }; });
}

}  // namespace relume
