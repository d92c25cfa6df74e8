// SPDX-License-Identifier: MIT
// Bytes of an exported level that nothing refers to any more, because the primitives that did were split or decoded.
#pragma once

#include "bake/export/level_document.h"

#include <cstdint>

namespace relume {

// Cut them out of the buffer; returns how many. Only what a primitive of the source referred to is looked at, and only
// if nothing else can mean it: an integer anywhere in extras, or in an extension that is not known to name neither
// accessors nor views, counts as a reference to the accessor and to the view of that number. Numbers stay: what is left
// of an accessor is one element without data, of a view four bytes. To be called once, when nothing is added any more.
std::uint64_t pruneDocument(LevelDocument& document);

}  // namespace relume
