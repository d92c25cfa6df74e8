// SPDX-License-Identifier: MIT
// See relume/bake/load_scene.h.
#include "relume/bake/load_scene.h"

#include "bake/import/check_mesh.h"

#include <map>
#include <vector>

namespace relume {
namespace {

// Log one line per kind of finding, with the worst mesh. `relume info` lists all.
void logFindings(const std::vector<MeshFinding>& findings, Context& context) {
  struct Total {
    std::uint64_t count = 0, meshes = 0;
    const MeshFinding* worst = nullptr;
  };
  std::map<MeshFinding::Kind, Total> totals;
  for (const MeshFinding& finding : findings) {
    Total& total = totals[finding.kind];
    total.count += finding.count;
    ++total.meshes;
    if (total.worst == nullptr || finding.count > total.worst->count) total.worst = &finding;
  }
  for (const auto& [kind, total] : totals) {
    context.figure(toString(kind), static_cast<double>(total.count));
    context.message(Severity::info, std::string("mesh report: ") + toString(kind) + ": " + std::to_string(total.count) +
                                        " in " + std::to_string(total.meshes) + " meshes, most in node \"" +
                                        total.worst->node + "\", " + std::to_string(total.worst->count) +
                                        " from triangle " + std::to_string(total.worst->triangle));
  }
}

Result<Scene> import(const std::string& path, Context& context, const ImportOptions& options) {
  const Context::Stage stage(context, "import");
  context.progress("import", 0.0);
  Result<Scene> scene = importGltf(path, context, options);
  if (scene && context.cancelled()) return cancelledError();
  return scene;
}

}  // namespace

Result<Scene> loadScene(const std::string& path, Context& context, const ImportOptions& options, MeshReport report) {
  Result<Scene> scene = import(path, context, options);
  if (!scene) return scene;
  const Context::Stage stage(context, "mesh report");
  if (report == MeshReport::log) logFindings(checkMeshes(*scene, context), context);
  logFindings(repairMeshes(*scene, context), context);
  if (context.cancelled()) return cancelledError();
  return scene;
}

}  // namespace relume
