// SPDX-License-Identifier: MIT
// What links hold, RELUME_LINK_KIND (include/relume/links.h; repacked: runtime/shared/link_set.h), and what a cache's sum of them is:
// RELUME_WORDS vectors of four coefficients, those of Y (lib/sh.glsl), of Co and of Cg.
#define RELUME_LINKS_SH 0
#define RELUME_LINKS_CONE 1
#define RELUME_LINKS_OCT6 3
#define RELUME_LINKS_IRRADIANCE 5
#define RELUME_LINKS_REPACKED 6

#define RELUME_CHROMA_COUNT (RELUME_CHROMA_BANDS * RELUME_CHROMA_BANDS)
#define RELUME_CHROMA_WORDS ((RELUME_CHROMA_COUNT + 3) / 4)
#define RELUME_WORDS (RELUME_SH_WORDS + 2 * RELUME_CHROMA_WORDS)

// Coefficients past the bands of chroma are not stored.
const vec4 kRelumeLastChroma = vec4(1.0, RELUME_CHROMA_COUNT % 4 == 1 ? vec3(0.0) : vec3(1.0));
