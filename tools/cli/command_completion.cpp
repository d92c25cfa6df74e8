// SPDX-License-Identifier: MIT
// relume completion SHELL prints a script for the shell; relume pages FOLDER (hidden: the build calls it) writes the
// scripts, the manual pages and docs/reference/*.md as they are installed and committed.
#include "tools/cli/commands.h"
#include "tools/pages/completion.h"
#include "tools/pages/write_pages.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>
#include <string>

namespace relume {
namespace {

struct CompletionArguments {
  std::string shell;
};

struct PagesArguments {
  std::string folder;
};

int runCompletion(const CLI::App& app, const CompletionArguments& arguments) {
  const CommandLine line = describeCommandLine(app);
  const std::string script = arguments.shell == "bash"  ? bashCompletion(line)
                             : arguments.shell == "zsh" ? zshCompletion(line)
                                                        : fishCompletion(line);
  std::fputs(script.c_str(), stdout);
  return 0;
}

int runPages(const CLI::App& app, const PagesArguments& arguments) {
  const Status status = writePages(describeCommandLine(app), arguments.folder);
  return status ? 0 : fail(status.error());
}

}  // namespace

void addCompletionCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("completion", "Print a script that lets a shell complete this command line");
  auto arguments = std::make_shared<CompletionArguments>();
  command->add_option("SHELL", arguments->shell, "Shell to write it for [bash|zsh|fish]")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}).description(""));
  command->callback(
      [&app, arguments, &action] { action = [&app, arguments] { return runCompletion(app, *arguments); }; });
}

void addPagesCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("pages", "Write manual pages, completion scripts and docs/reference");
  command->group("");
  auto arguments = std::make_shared<PagesArguments>();
  command->add_option("FOLDER", arguments->folder, "Folder to write them into")->type_name("FOLDER")->required();
  command->callback([&app, arguments, &action] { action = [&app, arguments] { return runPages(app, *arguments); }; });
}

}  // namespace relume
