// SPDX-License-Identifier: MIT
// Where edits of a baked level count, and what they change: EditBlend::share() and blendEdited() of
// runtime/edit_blend.cpp, line by line. Needs nothing that OpenGL ES 3.00 lacks.
uniform int relumeEditBoxes;
uniform float relumeEditVoxel;  // [m]
uniform vec4 relumeEditBox[2 * RELUME_EDIT_BOXES];  // two a box: least corner, reach; greatest corner, 1 / fade

vec2 relumeEditSmooth(vec2 t) {
  t = clamp(t, vec2(0.0), vec2(1.0));
  return t * t * (vec2(3.0) - 2.0 * t);
}

// Change, contact.
vec2 relumeEditShare(vec3 positionWorld) {
  vec2 share = vec2(0.0);
  for (int i = 0; i < relumeEditBoxes; ++i) {
    vec4 low = relumeEditBox[2 * i], high = relumeEditBox[2 * i + 1];
    float away = length(max(max(low.xyz - positionWorld, positionWorld - high.xyz), vec3(0.0)));
    share = max(share, relumeEditSmooth(vec2(1.0 - (away - low.w) * high.w, 1.5 - 0.5 * away / relumeEditVoxel)));
  }
  return share;
}

vec3 relumeBlendEdited(vec3 baked, vec3 before, vec3 after, vec2 share) {
  if (!(share.x > 0.0)) return baked;
  vec3 least = RELUME_EDIT_LEAST * baked;
  vec3 kept = min((after + least) / max(before + least, vec3(1e-30)), vec3(1.0));
  vec3 changed = baked * (vec3(1.0) + share.x * (kept - vec3(1.0))) + share.x * max(after - before, vec3(0.0));
  return changed * (1.0 - share.y) + share.y * after;
}
