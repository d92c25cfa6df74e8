// SPDX-License-Identifier: MIT
// A game whose level is being edited, by the installed headers and library: the C and the C++ API have one light.
#include <relume/edit_blend.h>
#include <relume/relume_live.h>

#include <cstdio>
#include <string>

int main() {
  const relume_edit_box box = {{0, 0, 0}, {1, 2, 1}};
  relume_edit_blend_desc desc = {};
  desc.struct_size = sizeof desc;
  desc.boxes = &box;
  desc.box_count = 1;
  desc.voxel = 0.1f;
  relume_context_desc describe = {};
  describe.struct_size = sizeof describe;
  describe.api_version = RELUME_API_VERSION;
  relume_context* context = nullptr;
  relume_edit_blend* blend = nullptr;
  if (relume_context_create(&describe, &context) != RELUME_OK) return 1;
  if (relume_edit_blend_create(context, &desc, &blend) != RELUME_OK)
    return std::fprintf(stderr, "%s\n", relume_context_error(context)), 2;
  const float place[] = {7, 1, 1}, baked[] = {1, 1, 1}, before[] = {2, 2, 2}, after[] = {1, 2, 3};
  float share[2], found[3];
  if (relume_edit_blend_share(blend, 1, place, share) != RELUME_OK) return 3;
  if (relume_edit_blend_irradiance(blend, 1, share, baked, before, after, found) != RELUME_OK) return 4;

  const relume::EditBounds bounds{{0, 0, 0}, {1, 2, 1}};
  const auto same = relume::EditBlend::create({&bounds, 1}, {.voxel = 0.1f, .reach = 0.0f, .fade = 0.0f});
  if (!same) return 5;
  const glm::vec3 e = relume::blendEdited(glm::vec3(1), glm::vec3(2), {1, 2, 3}, same->share({7, 1, 1}));
  if (e != glm::vec3(found[0], found[1], found[2])) return 6;
  if (relume_edit_blend_glsl(blend) != relume::EditBlend::glsl()) return 7;
  relume_edit_blend_destroy(blend);
  relume_context_destroy(context);
  std::printf("blended %.3f %.3f %.3f\n", e.x, e.y, e.z);
  return 0;
}
