// SPDX-License-Identifier: MIT
// How much of a record a point reads (RCS Eqs. (2) to (4)).
#pragma once

#include "bake/preview/receiver.h"
#include "bake/preview/record.h"

#include <cstdint>

namespace relume {

// smooth: Ward's, less what it is at the border of its reach, so that it ends in 0. ward: the paper's, which jumps
// there. tabellion: by the nearest distance and the angle (Tabellion and Lamorlette 2004, Eqs. (2) to (4)).
enum class RecordWeight { smooth, ward, tabellion };

// printed: RCS Eqs. (2) to (4) alone. guarded: records in addition reach no farther than the light's own slope and what
// pixels show in front of surfaces allow, and no point reads a record that it lies behind.
enum class RecordReach { guarded, printed };

struct Interpolation {
  RecordWeight weight = RecordWeight::smooth;
  float accuracy = 0.15f;  // [> 0] a: how far records reach, and the largest error of position and angle together
  bool gradients = true;
  float maxPixels = 64.0f;  // [pixel] a guarded record reaches no farther
  bool limits = true;       // nor than Record::limit
  float minPixels = 1.5f;   // [pixel] every record reaches as far
  RecordReach reach = RecordReach::guarded;
};

// The distance [m] within which a record has a weight at all: a R_k, between minPixels and maxPixels widths of a pixel.
float reachOf(const Record& record, const Interpolation& options);

// R_k of a record that a receiver reads is at most so many times the distance to it and on to what is in front of the
// receiver: neighbour clamping (Krivanek et al. 2006). In a corner of two walls R_k is two to four times as much.
inline constexpr float kNear = 4.0f;

// Share of a record's gradient of translation that counts: less than all where minPixels lets the record reach farther
// than its light can be taken for linear, which would make holes (Krivanek et al. 2006).
float gradientShare(const Record& record, float reach, const Interpolation& options);

// Weight of a record at a receiver: [0..]. reach: of the record.
float weightOf(const Record& record, float reach, const PixelReceiver& receiver, const Interpolation& options);

}  // namespace relume
