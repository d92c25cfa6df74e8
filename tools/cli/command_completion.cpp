// SPDX-License-Identifier: MIT
// relume completion SHELL prints a script for the shell; relume pages FOLDER (hidden: the build calls it) writes the
// scripts, the manual pages and docs/reference/*.md as they are installed and committed.
#include "formats/file_io.h"
#include "tools/cli/commands.h"
#include "tools/pages/completion.h"
#include "tools/pages/manual.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

namespace relume {
namespace {

namespace fs = std::filesystem;

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

Status writePage(const fs::path& path, const std::string& text) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error) return Error{ErrorCode::io, path.parent_path().string() + ": " + error.message()};
  return writeFileAtomically(path, [&](const ByteSink& sink) { return sink(std::as_bytes(std::span(text))); });
}

int runPages(const CLI::App& app, const PagesArguments& arguments) {
  const CommandLine line = describeCommandLine(app);
  const fs::path folder = arguments.folder, manuals = folder / "man/man1";
  std::vector<std::pair<fs::path, std::string>> pages = {{folder / "completion/bash/relume", bashCompletion(line)},
                                                         {folder / "completion/zsh/_relume", zshCompletion(line)},
                                                         {folder / "completion/fish/relume.fish", fishCompletion(line)},
                                                         {folder / "reference/commands.md", commandsMarkdown(line)},
                                                         {folder / "reference/options.md", optionsMarkdown()},
                                                         {manuals / "relume.1", programManual(line)}};
  for (const CommandText& command : line.commands)
    pages.emplace_back(manuals / ("relume-" + command.name + ".1"), commandManual(line, command));
  for (const auto& [path, text] : pages) {
    if (const Status status = writePage(path, text); !status) return fail(status.error());
  }
  return 0;
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
  command->add_option("FOLDER", arguments->folder, "Folder to write them into")->required();
  command->callback([&app, arguments, &action] { action = [&app, arguments] { return runPages(app, *arguments); }; });
}

}  // namespace relume
