// SPDX-License-Identifier: MIT
// RELUME_WIDE_CLONES: compile a function for wider registers as well, one of which is chosen when the program starts.
// Contraction is off in all of the baker, so that all of them give the same bits.
#pragma once

#if defined(__x86_64__) && defined(__ELF__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__clang__)
#define RELUME_WIDE_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define RELUME_WIDE_CLONES
#endif
