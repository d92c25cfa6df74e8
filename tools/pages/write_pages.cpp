// SPDX-License-Identifier: MIT
// See write_pages.h.
#include "tools/pages/write_pages.h"

#include "formats/file_io.h"
#include "tools/pages/completion.h"
#include "tools/pages/manual.h"

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

namespace fs = std::filesystem;

Status writePage(const fs::path& path, const std::string& text) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error) return Error{ErrorCode::io, path.parent_path().string() + ": " + error.message()};
  return writeFileAtomically(path, [&](const ByteSink& sink) { return sink(std::as_bytes(std::span(text))); });
}

}  // namespace

Status writePages(const CommandLine& line, const fs::path& folder) {
  const std::string& name = line.program.name;
  const fs::path manuals = folder / "man/man1", reference = folder / "reference";
  std::vector<std::pair<fs::path, std::string>> pages = {
      {folder / "completion/bash" / name, bashCompletion(line)},
      {folder / "completion/zsh" / ("_" + name), zshCompletion(line)},
      {folder / "completion/fish" / (name + ".fish"), fishCompletion(line)},
      {manuals / (name + ".1"), programManual(line)}};
  for (const CommandText& command : line.commands)
    pages.emplace_back(manuals / (name + "-" + command.name + ".1"), commandManual(line, command));
  if (line.commands.empty()) {
    pages.emplace_back(reference / (name + ".md"), programMarkdown(line));
  } else {
    pages.emplace_back(reference / "commands.md", commandsMarkdown(line));
    pages.emplace_back(reference / "options.md", optionsMarkdown());
  }
  for (const auto& [path, text] : pages) {
    if (const Status status = writePage(path, text); !status) return status;
  }
  return done();
}

}  // namespace relume
