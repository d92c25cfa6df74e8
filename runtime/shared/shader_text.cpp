// SPDX-License-Identifier: MIT
// See shader_text.h.
#include "runtime/shared/shader_text.h"

#include <algorithm>
#include <vector>

namespace relume {
namespace {

constexpr std::string_view kHostVisibility = "host_visibility.glsl";
constexpr std::string_view kNothingInShadow =
    "float relumeVisibility(uint light, vec3 positionWorld, vec3 normal) { return 1.0; }\n";

// One expansion: which files are in, and what the host gave.
struct Expansion {
  std::vector<std::string_view> included;
  std::string_view visibilityGlsl;
  std::string text;
};

// The path in `#include "path"`, or nothing.
std::string_view quotedInclude(std::string_view line) {
  constexpr std::string_view kDirective = "#include \"";
  if (line.substr(0, kDirective.size()) != kDirective) return {};
  const std::size_t end = line.find('"', kDirective.size());
  return end == std::string_view::npos ? std::string_view{} : line.substr(kDirective.size(), end - kDirective.size());
}

Status expandFile(Expansion& out, std::string_view path, std::string_view from) {
  if (std::find(out.included.begin(), out.included.end(), path) != out.included.end()) return done();
  out.included.push_back(path);
  if (path == kHostVisibility) {
    out.text += out.visibilityGlsl.empty() ? kNothingInShadow : out.visibilityGlsl;
    out.text += "\n";
    return done();
  }
  const auto all = embeddedShaders();
  const auto file = std::find_if(all.begin(), all.end(), [&](const EmbeddedShader& each) { return each.path == path; });
  if (file == all.end()) {
    return Error{ErrorCode::failed,
                 "shader " + std::string(from) + " includes " + std::string(path) + ", which does not exist"};
  }
  for (std::string_view rest = file->text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size() - 1);
    const std::string_view line = rest.substr(0, end + 1);
    rest.remove_prefix(line.size());
    const std::string_view include = quotedInclude(line);
    if (!include.empty()) {
      if (Status ok = expandFile(out, include, path); !ok) return ok;
    } else if (line.substr(0, 9) != "#include ") {
      out.text += line;
    }
  }
  return done();
}

}  // namespace

Result<std::string> expandShader(std::string_view path, Defines defines, std::string_view visibilityGlsl) {
  Expansion expansion;
  expansion.visibilityGlsl = visibilityGlsl;
  for (const auto& [name, value] : defines)
    expansion.text.append("#define ").append(name).append(" ").append(value).append("\n");
  if (Status ok = expandFile(expansion, path, path); !ok) return ok.error();
  return std::move(expansion.text);
}

}  // namespace relume
