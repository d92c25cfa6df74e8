// SPDX-License-Identifier: MIT
// relume_make_spirv OUTPUT GLSLANG BANDS [SPIRV_OPT [SPIRV_VAL]]: run by the build. Compiles every program of the
// passes for the bands ("2,1 3,1", or "all") with glslangValidator, makes it smaller with spirv-opt and checks it with
// spirv-val where they are given, and writes all of it as C++ for spirv.h. Exit status: 0; 1: a program that does not
// compile, named; 2: wrong arguments, or a file that cannot be written.
#include "runtime/passes/programs.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <thread>

namespace relume::gpu {
namespace {

std::optional<std::vector<CacheBands>> readBands(const std::string& text) {
  std::vector<CacheBands> bands;
  if (text == "all") {
    for (int luma = 1; luma <= kMaxBands; ++luma) {
      for (int chroma = 1; chroma <= luma; ++chroma) bands.push_back({luma, chroma});
    }
    return bands;
  }
  std::istringstream in(text);
  for (std::string pair; in >> pair;) {
    const CacheBands each{pair[0] - '0', pair.size() == 3 ? pair[2] - '0' : 0};
    if (each.chromaBands < 1 || each.lumaBands > kMaxBands || each.chromaBands > each.lumaBands) {
      std::fprintf(stderr, "RELUME_VULKAN_BANDS: \"%s\", expected luma,chroma of 1 to %d, chroma at most luma\n",
                   pair.c_str(), kMaxBands);
      return std::nullopt;
    }
    bands.push_back(each);
  }
  return bands;
}

std::string inQuotes(const std::filesystem::path& path) { return "\"" + path.string() + "\""; }

struct Tools {
  std::string glslang, optimizer, validator;
  std::filesystem::path folder;
};

// The words of a program; nothing, and said why, where it does not compile. number: of its files.
std::optional<std::vector<std::uint32_t>> compile(const Tools& tools, const ProgramSource& source, std::size_t number) {
  const Result<std::string> text = vulkanGlsl(source);
  const auto failed = [&](const std::string& what) {
    std::fprintf(stderr, "%s: %s\n", spirvKey(source).c_str(), what.c_str());
    return std::nullopt;
  };
  if (!text) return failed(text.error().message);
  const auto file = [&](const char* kind) { return tools.folder / (std::to_string(number) + kind); };
  const auto shader = file(".comp"), spirv = file(".spv"), log = file(".log");
  std::ofstream(shader) << *text;
  const auto run = [&](const std::string& command) {
    return std::system((command + " > " + inQuotes(log) + " 2>&1").c_str()) == 0;
  };
  const auto logged = [&log] {
    std::ifstream in(log);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  if (!run(inQuotes(tools.glslang) + " -g0 --target-env vulkan1.1 -o " + inQuotes(spirv) + " " + inQuotes(shader)))
    return failed(logged());
  if (!tools.optimizer.empty() &&
      !run(inQuotes(tools.optimizer) + " --target-env=vulkan1.1 -Os " + inQuotes(spirv) + " -o " + inQuotes(spirv)))
    return failed(logged());
  if (!tools.validator.empty() && !run(inQuotes(tools.validator) + " --target-env vulkan1.1 " + inQuotes(spirv)))
    return failed(logged());
  std::ifstream in(spirv, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(in), {});
  if (bytes.empty() || bytes.size() % 4 != 0) return failed("no SPIR-V came of it");
  std::vector<std::uint32_t> words(bytes.size() / 4);
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(words.data()));
  return words;
}

int makeSpirv(const std::filesystem::path& output, const Tools& tools, const std::string& bandList) {
  const auto bands = readBands(bandList);
  if (!bands) return 2;
  std::vector<ProgramSource> programs = programsOf(*bands);
  std::sort(programs.begin(), programs.end(),
            [](const ProgramSource& a, const ProgramSource& b) { return spirvKey(a) < spirvKey(b); });
  std::filesystem::create_directories(tools.folder);
  std::vector<std::optional<std::vector<std::uint32_t>>> compiled(programs.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < programs.size(); i = next++) compiled[i] = compile(tools, programs[i], i);
  };
  std::vector<std::thread> threads;
  for (unsigned i = 1; i < std::max(std::thread::hardware_concurrency(), 1u); ++i) threads.emplace_back(work);
  work();
  for (std::thread& each : threads) each.join();
  std::ostringstream text, table;
  text << "// Made from shaders/ by relume_make_spirv.\n#include \"runtime/passes/spirv.h\"\n\n"
          "namespace relume::gpu {\nnamespace {\n\n";
  for (std::size_t i = 0; i < programs.size(); ++i) {
    if (!compiled[i]) return 1;
    text << "constexpr std::uint32_t kWords" << i << "[] = {";
    for (std::size_t k = 0; k < compiled[i]->size(); ++k)
      text << (k % 20 == 0 ? "\n" : "") << (*compiled[i])[k] << "u,";
    text << "};\n";
    table << "    {\"" << spirvKey(programs[i]) << "\", kWords" << i << "},\n";
  }
  text << "\nconstexpr EmbeddedSpirv kAll[] = {\n"
       << table.str()
       << "};\n\n}  // namespace\n\nstd::span<const EmbeddedSpirv> embeddedSpirv() { return kAll; }\n\n"
          "}  // namespace relume::gpu\n";
  std::ofstream file(output);
  file << text.str();
  file.close();
  std::filesystem::remove_all(tools.folder);
  if (!file) std::fprintf(stderr, "%s: cannot be written\n", output.c_str());
  return file ? 0 : 2;
}

}  // namespace
}  // namespace relume::gpu

int main(int count, char** arguments) {
  if (count < 4) {
    std::fprintf(stderr, "relume_make_spirv OUTPUT GLSLANG BANDS [SPIRV_OPT [SPIRV_VAL]]\n");
    return 2;
  }
  const std::filesystem::path output = arguments[1];
  const relume::gpu::Tools tools{arguments[2], count > 4 ? arguments[4] : "", count > 5 ? arguments[5] : "",
                                 output.string() + ".work"};
  return relume::gpu::makeSpirv(output, tools, arguments[3]);
}
