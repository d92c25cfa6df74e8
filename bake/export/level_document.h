// SPDX-License-Identifier: MIT
// A glTF that is edited: its JSON as it was read, with all that nobody knows, and its bytes with what is added to them.
// Written as one .glb.
#pragma once

#include "bake/import/gltf_document.h"
#include "relume/bake/context.h"
#include "relume/result.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace relume {

// What bufferView.target says.
enum class ViewTarget { none = 0, vertices = 34962, indices = 34963 };

class LevelDocument {
 public:
  // Errors of importGltf(). The JSON's buffers are one after, views and images lie in it; images that are not there
  // to be read keep their URI, with a warning.
  static Result<LevelDocument> read(const std::filesystem::path& path, Context& context);

  nlohmann::json root;
  const GltfDocument& source() const { return source_; }                      // as it was before
  const std::vector<std::filesystem::path>& files() const { return files_; }  // that were read

  // Append bytes, at a multiple of 4; returns the new bufferView.
  int addView(std::span<const std::uint8_t> bytes, ViewTarget target, std::size_t stride = 0);
  int addAccessor(nlohmann::json accessor);

  // Whether its writer says 3.0 for 3. Known numbers of elements are whole in `root` all the same.
  bool wholeAsFloats() const { return wholeAsFloats_; }
  // The JSON's meshes as they were read.
  const nlohmann::json& meshesBefore() const { return meshesBefore_; }
  // Leave bytes out of the one buffer, in order and of the source alone; returns how many. The JSON already says so.
  std::uint64_t cut(std::vector<ByteRange> ranges);

  // unsupported: the .glb would have 4 GiB or more, which its header cannot say; io as writeFileAtomically().
  Status write(const std::filesystem::path& path) const;

 private:
  Status embedBuffers();
  void embedImages(Context& context);

  GltfDocument source_;
  std::vector<std::filesystem::path> files_;
  std::vector<std::uint64_t> base_;  // [byte] where each source buffer's slice lies in the new one
  bool wholeAsFloats_ = false;
  nlohmann::json meshesBefore_;
  std::vector<ByteRange> cuts_;
  std::uint64_t cutBytes_ = 0;
  std::uint64_t sourceBytes_ = 0;    // of all slices with what is between them
  std::vector<std::uint8_t> added_;  // follows them
};

}  // namespace relume
