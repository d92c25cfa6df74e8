// SPDX-License-Identifier: MIT
// relume_live.h over the C++ API: edits of a baked level.
#include "relume/edit_blend.h"
#include "runtime/c_setup.h"

#include <glm/gtc/type_ptr.hpp>

#include <span>
#include <string>
#include <vector>

struct relume_edit_blend : relume::c::Handle {
  relume_edit_blend(std::shared_ptr<relume::c::Host> shared, relume::EditBlend created)
      : Handle(std::move(shared)), blend(std::move(created)), glsl(relume::EditBlend::glsl()) {}

  relume::EditBlend blend;
  std::string glsl;
};

namespace {

using relume::Result;
using relume::Status;
using namespace relume::c;

}  // namespace

relume_status relume_edit_blend_create(relume_context* context, const relume_edit_blend_desc* desc,
                                       relume_edit_blend** blend) {
  return runToMake(context, blend, "blend", [&]() -> Status {
    relume_edit_blend_desc read{};
    if (Status ok = readStruct(desc, sizeof read.struct_size + 1, "desc", read); !ok) return ok;
    if (read.boxes == nullptr && read.box_count > 0) return nullPointer("desc.boxes");
    std::vector<relume::EditBounds> boxes;
    boxes.reserve(read.box_count);
    for (std::size_t i = 0; i < read.box_count; ++i)
      boxes.push_back(
          {vec3(read.boxes[i].min), vec3(read.boxes[i].max), read.box_reaches == nullptr ? 0.0f : read.box_reaches[i]});
    Result<relume::EditBlend> made = relume::EditBlend::create(boxes, {read.voxel, read.reach, read.fade});
    if (!made) return made.error();
    *blend = makeHandle<relume_edit_blend>(context->host, std::move(*made)).release();
    return relume::done();
  });
}
void relume_edit_blend_destroy(relume_edit_blend* blend) { destroyHandle(blend); }
const char* relume_edit_blend_error(const relume_edit_blend* blend) {
  return blend == nullptr ? "" : blend->error.text();
}

relume_status relume_edit_blend_share(const relume_edit_blend* blend, size_t count, const float* positions,
                                      float* shares) {
  return run(blend, [&]() -> Status {
    if (count == 0) return relume::done();
    if (positions == nullptr) return nullPointer("positions");
    if (shares == nullptr) return nullPointer("shares");
    for (std::size_t i = 0; i < count; ++i) {
      const relume::EditShare share = blend->blend.share(vec3(positions + 3 * i));
      shares[2 * i] = share.change;
      shares[2 * i + 1] = share.contact;
    }
    return relume::done();
  });
}

relume_status relume_edit_blend_irradiance(const relume_edit_blend* blend, size_t count, const float* shares,
                                           const float* baked, const float* before, const float* after,
                                           float* irradiance) {
  return run(blend, [&]() -> Status {
    if (count == 0) return relume::done();
    if (shares == nullptr) return nullPointer("shares");
    if (baked == nullptr) return nullPointer("baked");
    if (before == nullptr) return nullPointer("before");
    if (after == nullptr) return nullPointer("after");
    if (irradiance == nullptr) return nullPointer("irradiance");
    const auto found = vectors(irradiance, count);
    for (std::size_t i = 0; i < count; ++i)
      found[i] = relume::blendEdited(vec3(baked + 3 * i), vec3(before + 3 * i), vec3(after + 3 * i),
                                     {shares[2 * i], shares[2 * i + 1]});
    return relume::done();
  });
}

const char* relume_edit_blend_glsl(const relume_edit_blend* blend) {
  return blend == nullptr ? nullptr : blend->glsl.c_str();
}

relume_status relume_edit_blend_get_info(const relume_edit_blend* blend, relume_edit_blend_info* info) {
  return run(blend, [&]() -> Status {
    const std::span<const glm::vec4> boxes = blend->blend.boxes();
    return fillStruct(info, {0, static_cast<unsigned int>(boxes.size() / 2), blend->blend.voxel(),
                             boxes.empty() ? nullptr : glm::value_ptr(boxes[0])});
  });
}
