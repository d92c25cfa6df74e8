// SPDX-License-Identifier: MIT
// See bake_arguments.h.
#include "tools/cli/bake_arguments.h"

#include "bake/base/read_json.h"
#include "formats/file_io.h"
#include "tools/base/printable.h"
#include "tools/cli/commands.h"
#include "tools/cli/depfile.h"

#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <span>
#include <system_error>

namespace relume {
namespace {

constexpr std::size_t kMaxOptionsBytes = 1 << 20;

Result<std::string> readText(const std::string& path) {
  const Result<FileBytes> file = readFile(path, kMaxOptionsBytes);
  if (!file) return Error{file.error().code == ErrorCode::io ? ErrorCode::io : ErrorCode::usage, file.error().message};
  return std::string(reinterpret_cast<const char*>(file->bytes.data()), file->bytes.size());
}

Status writeText(const std::string& path, const std::string& text) {
  return writeFileAtomically(path, [&](const ByteSink& sink) { return sink(std::as_bytes(std::span(text))); });
}

// Counts that an options file states, where a budget chooses them. A file that states them all is what --print-options
// wrote: those of the preset go without saying, of others a warning tells that they are not used. usage: it states
// some.
Status checkFileCounts(const std::string& file, const std::string& text, const BakeOptions& base,
                       const BakeOptions& chosen) {
  const Result<nlohmann::json> json = readJson(text, JsonComments::skip);
  if (!json) return json.error();
  std::map<std::string, std::string> stated;
  const nlohmann::json flat = json->flatten();
  for (const auto& [path, value] : flat.items()) {
    std::string name = path.substr(std::min<std::size_t>(path.size(), 1));  // "/surfels/count"
    std::replace(name.begin(), name.end(), '/', '.');
    if (std::find(kBudgetCounts.begin(), kBudgetCounts.end(), name) != kBudgetCounts.end()) stated[name] = value.dump();
  }
  const bool all = stated.size() == kBudgetCounts.size();
  for (const OptionInfo& info : listOptions(base)) {
    if (const auto count = stated.find(info.name); all && count != stated.end() && count->second == info.value)
      stated.erase(count);
  }
  const std::string count = countBesideBudget(chosen, stated);
  if (count.empty()) return done();
  if (!all) return Error{ErrorCode::usage, file + ": " + count + "; leave one out"};
  logMessage(Severity::warning, file + ": " + count + "; the file's is not used");
  return done();
}

// What a run depends on.
std::vector<std::filesystem::path> dependencies(const BakeArguments& arguments, const Scene& scene) {
  std::vector<std::filesystem::path> files = scene.files;
  if (!arguments.optionsFile.empty()) files.emplace_back(arguments.optionsFile);
  if (!arguments.shard.empty()) files.emplace_back(arguments.plan);
  return files;
}

}  // namespace

Result<BakeOptions> chooseOptions(const BakeArguments& arguments, const BakeOptions& base) {
  const BakeOptions preset = arguments.presetGiven ? presetOptions(arguments.preset) : base;
  if (arguments.optionsFile.empty()) return chooseBakeOptions(preset, arguments.flags);
  const Result<std::string> text = readText(arguments.optionsFile);
  if (!text) return text.error();
  const Result<BakeOptions> read = optionsFromJson(*text, preset);
  if (!read) return Error{read.error().code, arguments.optionsFile + ": " + read.error().message};
  Result<BakeOptions> chosen = chooseBakeOptions(*read, arguments.flags);
  if (!chosen) return chosen;
  if (const Status status = checkFileCounts(arguments.optionsFile, *text, preset, *chosen); !status)
    return status.error();
  return chosen;
}

MadeCounts countsOf(const Bake& bake) {
  return {bake.surfels.count(), bake.hierarchy.nodeCount(), bake.caches.count(), bake.links.count()};
}

double secondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double peakMemoryMiB() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return static_cast<double>(std::strtoull(line.c_str() + 6, nullptr, 10)) / 1024.0;
  }
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

std::string describeRun(const Context& context, const BakeOptions& options, const std::string& rayTracer,
                        const MadeCounts& made, double seconds, bool upToDate) {
  nlohmann::json stages = nlohmann::json::array();
  for (const StageReport& stage : context.report()) {
    nlohmann::json figures = nlohmann::json::object();
    for (const auto& [name, value] : stage.figures) figures[name] = value;
    stages.push_back({{"stage", stage.stage},
                      {"seconds", stage.seconds},
                      {"processorSeconds", stage.processorSeconds},
                      {"figures", figures}});
  }
  const nlohmann::json report = {{"seconds", seconds},
                                 {"upToDate", upToDate},
                                 {"peakMemoryMiB", peakMemoryMiB()},
                                 {"stages", stages},
                                 {"options", nlohmann::json::parse(optionsToJson(options))},
                                 {"surfels", made.surfels},
                                 {"nodes", made.nodes},
                                 {"caches", made.caches},
                                 {"links", made.links},
                                 {"rayTracer", rayTracer}};
  return jsonText(report) + "\n";
}

Status writeReport(const std::string& path, const std::string& report) {
  return path.empty() ? done() : writeText(path, report);
}

Status writeSideFiles(const BakeArguments& arguments, const std::string& output, const Scene& scene,
                      const std::string& report) {
  if (const Status status = writeReport(arguments.reportFile, report); !status) return status;
  if (arguments.depfile.empty()) return done();
  return writeText(arguments.depfile, makeDepfile(output, dependencies(arguments, scene)));
}

Status checkDepfile(const BakeArguments& arguments, const std::string& output, const Scene& scene, Context& context) {
  if (arguments.depfile.empty()) return done();
  const std::vector<std::filesystem::path> files = dependencies(arguments, scene);
  for (const std::string& warning : depfileWarnings(output, files)) context.message(Severity::warning, warning);
  return checkDepfileNames(output, files);
}

int endUpToDate(const BakeArguments& arguments, const std::string& output, const Scene& scene,
                const std::string& report, const std::string& what) {
  std::error_code ignored;
  std::filesystem::last_write_time(output, std::filesystem::file_time_type::clock::now(), ignored);
  if (const Status written = writeSideFiles(arguments, output, scene, report); !written) return fail(written.error());
  std::printf("%s: up to date, %s (--force makes it again)\n", printable(output).c_str(), what.c_str());
  return 0;
}

bool mayBeMade(const std::string& output, bool force) {
  std::error_code missing;
  return !force && std::filesystem::is_regular_file(output, missing) &&
         std::filesystem::file_size(output, missing) > 0 && !missing;
}

std::string listChanges(const std::vector<std::string>& changes, std::size_t max) {
  std::string text;
  for (std::size_t i = 0; i < std::min(max, changes.size()); ++i) text += (i > 0 ? "\n  " : "") + changes[i];
  if (changes.size() > max) text += "\n  and " + std::to_string(changes.size() - max) + " changes more";
  return text;
}

}  // namespace relume
