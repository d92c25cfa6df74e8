// SPDX-License-Identifier: MIT
// glTF 2.0 to a Scene. Each step checks what it reads: nothing in the file is trusted.
#include "bake/context.h"
#include "bake/scene/check_limits.h"
#include "bake/scene/find_solids.h"
#include "bake/scene/gltf_import.h"
#include "bake/scene/scene.h"

#include <exception>
#include <new>

namespace relume {
namespace {

Result<Scene> import(const std::filesystem::path& path, Context& context, const ImportOptions& options) {
  // 1. The document: container, JSON, buffers, compressed views
  Result<GltfDocument> document = loadGltfDocument(path, context);
  if (!document) return document.error();
  if (Status status = checkRanges(*document); !status) return status.error();
  Scene scene;
  scene.name = document->file;
  // 2. Materials and the images they use
  Result<std::vector<UvSets>> uvSets = importMaterials(*document, scene, context);
  if (!uvSets) return uvSets.error();
  // 3. The node graph, with the meshes it places
  MeshImporter meshes(*document, std::move(*uvSets), scene, context);
  if (Status status = importNodes(*document, meshes, scene, context); !status) return status.error();
  // 4. The lights' unit
  if (Status status = convertLights(*document, options.lightUnit, scene, context); !status) return status.error();
  // 5. Numbers that the baker can compute with
  if (Status status = checkLimits(scene); !status) return status.error();
  scene.files = std::move(document->files);
  // 6. Which two-sided surfaces enclose matter
  findSolids(scene, context);
  return scene;
}

}  // namespace

Result<Scene> importGltf(const std::filesystem::path& path, Context& context, const ImportOptions& options) {
  const Context::Stage stage(context, "import");
  if (!context.progress("import", 0.0)) return cancelledError();
  try {
    Result<Scene> scene = import(path, context, options);
    if (scene) {
      context.figure("triangles", scene->triangleCount());
      context.figure("instances", static_cast<double>(scene->instances.size()));
      context.progress("import", 1.0);
    }
    return scene;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::failed, path.filename().string() + ": out of memory"};
  } catch (const std::exception& e) {
    return Error{ErrorCode::invalidFile, path.filename().string() + ": " + e.what()};
  }
}

}  // namespace relume
