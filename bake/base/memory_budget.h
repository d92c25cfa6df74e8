// SPDX-License-Identifier: MIT
// What a stage is about to hold, against what the process may hold. A stage asks before it allocates and is refused by
// name, so that a level or an option that asks for too much ends in a sentence and not in a swapped-out machine. A
// budget only ever refuses: it changes no byte of what is made.
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"

#include <cstdint>
#include <string_view>

namespace relume {

// What a process may use of this machine: three quarters of its memory, or of what its control group (Linux) or its
// limit on address space leaves it, whichever is less. [byte]
std::uint64_t machineMemoryBudget();

// What the process holds now: its resident set. 0 where the system does not tell. [byte]
std::uint64_t heldMemory();

// What is left of Context::maxMemory. [byte]
std::uint64_t memoryLeft(const Context& context);

// Done, or failed where what is held now and what is needed in addition are more than Context::maxMemory:
// "STAGE needs about N MiB for WHAT; M MiB are in use and the budget is B MiB: REMEDY, or raise --max-memory".
// bytes: estimates within a factor of two; not finite counts as too much.
Status reserveMemory(Context& context, std::string_view stage, double bytes, std::string_view what,
                     std::string_view remedy);

// The same for what will be held in all at a later time, when less may be held than now; notes no figure.
Status expectMemory(const Context& context, std::string_view stage, double bytes, std::string_view what,
                    std::string_view remedy);

}  // namespace relume
