// SPDX-License-Identifier: MIT
// Every option of a bake, one aggregate a stage, defaults inline. Checked once, by checkOptions(); stored in the bake.
#pragma once

#include "relume/links.h"
#include "relume/result.h"
#include "relume/vectors.h"

#include <cstdint>
#include <string>
#include <vector>

namespace relume {

// Where receivers can be: what they cannot see needs neither surfels nor caches.
struct PlaySpaceOptions {
  enum class Mode { seen, all };
  Mode mode = Mode::seen;          // seen: cameras, extras.relume volumes, free grid points; all: every surface
  std::uint32_t walks = 1u << 19;  // [1e3..1e9] random walks that find what is seen
  std::uint32_t maxBounces = 6;    // [1..64] length of a walk
};

struct SurfelOptions {
  enum class Placement { halton, relaxed, eliminated };
  std::uint32_t count = 131072;  // [2..16777216] n_S, PIC 4.2
  Placement placement = Placement::eliminated;
  std::uint32_t relaxIterations = 10;  // [0..1000] rounds of repulsion of `relaxed`
  float candidateFactor = 4.0f;        // [1.5..20] candidates a surfel of `eliminated`
};

struct ClusteringOptions {
  enum class Method { approximate, exact };
  Method method = Method::approximate;  // agglomerative clustering: cell by cell, by all threads, or PIC's own, by one
  float normalWeight = 0.1f;            // [0..1e6] C_n, PIC 4.3
  float balanceWeight = 0.02f;          // [0..1e6] C_b, PIC 4.3
  float outlookWeight = 4.0f;  // [0..1e6] C_o: keeps surfels apart that do not see the same; 0 = the paper's metric
};

struct CacheOptions {
  glm::uvec3 gridResolution{
      0};  // [0..1024 each] points along each axis of a uniform grid; 0 = two levels, from gridSpacing
  float gridSpacing = 0.0f;         // [m] [>= 0] of points where surfaces are, twice that in air; 0 = from gridCaches
  std::uint32_t gridCaches = 2304;  // [0..1e7] target when neither is given; 0 = no grid (PIC: 24 x 8 x 12)
  std::uint32_t lightmapSize = 0;   // [0, 16..16384] texels a side; 0 = what lightmapCaches needs
  std::uint32_t lightmapCaches = 16384;  // [0..1e8] target number of light-map caches; 0 = no light map
  float minChartTexels = 1.0f;     // [>= 0] charts smaller than this many texels of area share texels or use the grid
  bool useTexcoord1 = true;        // use TEXCOORD_1 as light-map coordinates where it is valid for that
  float maxBackFaceShare = 0.25f;  // [0..1] a cache whose rays hit more back faces than this is moved or dropped
  float gutterTexels = 0.0f;       // [0..8] texels between charts, for hosts that filter wider than bilinearly
};

struct LinkOptions {
  enum class CutKey { transfer, readError };
  enum class PullWeight { area, importance };
  LinkKind kind = LinkKind::oct6;      // how a link stores its transfer; docs/notes/links.md compares
  std::uint32_t linksPerCache = 128;   // [1..65535] n_L, on average: shared out by error, to about 1 % of the sum (the
                                       // share is found from every n-th cache)
  std::uint32_t maxLinksPerCache = 0;  // [0, linksPerCache..65535] the most a cache gets; 0 = 8 linksPerCache;
                                       // linksPerCache = as many for every cache, the paper's
  std::uint32_t linksTotal = 0;  // [0..4294967295] links of all caches together, in place of linksPerCache; 0 = not
  float maxError = 0.0f;  // [0..1] a cache whose expected relative error is this small gets no more links; 0 = never.
                          // Of key readError
  std::uint32_t raysPerCache = 2048;  // [16..1048576] K
  float emitterRays = 0.125f;         // [0..1] rays aimed at emitters, as a share of raysPerCache and beside them
  std::uint32_t bands = 4;            // [1..8] of SH links
  CutKey key = CutKey::readError;     // transfer: the paper's f; readError: how far a node's average is from what the
                                      // cache sees of it
  PullWeight pull = PullWeight::importance;  // weights of a node's children in its radiosity; area: the paper's
  std::uint32_t skyPatches = 64;             // [0..4096] sky senders; 0 = the sky gives no light
};

// What the bake may cost a game, and how wrong it may be: the baker chooses surfels, caches and links, in place of
// their counts in the options below. Costs are reckoned from counts (bake/budget/runtime_cost.h), not measured, so that
// a bake has the same bytes on all machines.
struct BudgetOptions {
  float memoryMiB = 0.0f;  // [MiB] [0..65536] of Relighter::bufferSizes() on the CPU; 0 = any
  float frameMs = 0.0f;    // [ms] [0..1000] of relight() by one thread of the reference processor; 0 = any
  float maxError = 0.0f;   // [0..1] what the certificate may say (certifiedError()): bakes grow until it does; 0 = any

  bool limitsCost() const { return memoryMiB > 0.0f || frameMs > 0.0f; }
  bool any() const { return limitsCost() || maxError > 0.0f; }
};

struct BakeOptions {
  PlaySpaceOptions playSpace;
  SurfelOptions surfels;
  ClusteringOptions clustering;
  CacheOptions caches;
  LinkOptions links;
  BudgetOptions budget;
  std::uint32_t lumaBands = 4;     // [1..8] recommended to the runtime
  std::uint32_t chromaBands = 2;   // [1..lumaBands] more cannot be seen (docs/notes/bands.md)
  std::uint64_t seed = 1;          // any
  std::string embreeIsa = "avx2";  // Embree's isa; hits differ where triangles overlap, rarely
};

enum class Preset { draft, medium, web, high, best, paper };

struct PresetInfo {
  Preset preset;
  const char* name;     // on the command line
  const char* comment;  // one line: what it is for
};
inline constexpr PresetInfo kPresets[] = {
    {Preset::draft, "draft", "to iterate: a second or two"},
    {Preset::medium, "medium", "about 9 MiB at run time"},
    {Preset::web, "web", "as medium, with fewer caches in the air: for relume pack --profile web"},
    {Preset::high, "high", "about 17 MiB"},
    {Preset::best, "best", "about 90 MiB"},
    {Preset::paper, "paper", "the sizes of PIC's high setting: as many links for every cache"},
};

BakeOptions presetOptions(Preset preset);

// Done, or usage: names the option, its range and the value found.
Status checkOptions(const BakeOptions& options);

// Every option as canonical JSON (sorted keys), for provenance and reports; and back. usage for unknown keys and wrong
// types, naming them.
std::string optionsToJson(const BakeOptions& options);
// Comments (// and /* */) are allowed. Keys that are absent keep the value of `base`; ranges are not checked.
Result<BakeOptions> optionsFromJson(const std::string& json, const BakeOptions& base);

// A row of the table of options, which help texts, options files and checks are made of.
struct OptionInfo {
  std::string name;     // path in the JSON: "surfels.count"
  std::string flag;     // of `relume bake`: "--surfels"; empty = settable by an options file only
  std::string range;    // "2..16777216" or "halton|relaxed|eliminated"
  std::string unit;     // "m"; empty = none
  std::string value;    // as JSON text
  std::string comment;  // one line
};
std::vector<OptionInfo> listOptions(const BakeOptions& options);

// Set the option with that name from text as a command line has it ("131072", "halton", "24,8,12"). usage: no such
// option, or text of the wrong type; the range is left to checkOptions().
Status setOption(BakeOptions& options, const std::string& name, const std::string& text);

}  // namespace relume
