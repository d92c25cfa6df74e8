// SPDX-License-Identifier: MIT
// The links of a row, kLanes at a time, whatever the way of storing them (formats/links.h): their nodes' radiosity and,
// unpacked, transfers and cones.
#pragma once

#include "runtime/cpu/light_caches_job.h"
#include "runtime/cpu/vectors.h"

namespace relume::cpu {
namespace {

// Words 1 (f, cos alpha) and 2 (direction) of kLanes links of three words each.
inline void loadLinks(const std::uint32_t* link, Ints& packed, Ints& direction) {
  const Ints a = load<Ints>(link), b = load<Ints>(link + kLanes), c = load<Ints>(link + 2 * kLanes);
#if RELUME_LANES == 16
  // Positions 3 i + 1 and 3 i + 2 of a, b, c in a row; the lanes from c come in a second step.
  const Ints p = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0);
  packed = __builtin_shufflevector(p, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30);
  const Ints d = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0);
  direction = __builtin_shufflevector(d, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31);
#elif RELUME_LANES == 8
  const Ints p = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 0, 0, 0);
  packed = __builtin_shufflevector(p, c, 0, 1, 2, 3, 4, 8, 11, 14);
  const Ints d = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 0, 0, 0);
  direction = __builtin_shufflevector(d, c, 0, 1, 2, 3, 4, 9, 12, 15);
#else
  const Ints p = __builtin_shufflevector(a, b, 1, 4, 7, 0);
  packed = __builtin_shufflevector(p, c, 0, 1, 2, 6);
  const Ints d = __builtin_shufflevector(a, b, 2, 5, 0, 0);
  direction = __builtin_shufflevector(d, c, 0, 1, 4, 7);
#endif
}

// Y, Co, Cg of the nodes of kLanes links.
__attribute__((always_inline)) inline void loadNodes(const std::uint32_t* node, Ints links, Floats& y, Floats& co, Floats& cg) {
  Floats r, g, b;
  unpackColors(gather(node, links), r, g, b);
  toYCoCg(r, g, b, y, co, cg);
}

// The links from `at` on of one group: their nodes, transfers f, and directions with cosines c of the cones. Lanes past the
// `count` that are left name node 0 and carry nothing. One struct a way of storing them (formats/links.h).
struct PlainLinks {
  const std::uint32_t* link;
  std::uint32_t tail[3 * kLanes];

  PlainLinks(const LightCachesJob& job, std::uint32_t, std::size_t at, int count) : link(job.cone + 3 * at) {
    if (count >= kLanes) return;
    __builtin_memset(tail, 0, sizeof tail);
    __builtin_memcpy(tail, link, sizeof(std::uint32_t) * 3 * static_cast<std::size_t>(count));
    link = tail;
  }
  Ints nodes() const {
    Ints v;
    for (int i = 0; i < kLanes; ++i) v[i] = static_cast<std::int32_t>(link[3 * i]);
    return v;
  }
  __attribute__((always_inline)) void unpack(Floats& f, Floats& c, Floats& x, Floats& y, Floats& z) const {
    Ints packed, bits;
    loadLinks(link, packed, bits);
    f = halfToFloat(packed);
    c = halfToFloat(packed >> 16);
    unpackDirections<16>(bits, x, y, z);
  }
};

struct Heads {
  std::uint32_t head[kLanes];

  __attribute__((always_inline)) Heads(const LightCachesJob& job, std::size_t at, int count) {
    if (count >= kLanes) {
      __builtin_memcpy(head, job.head + at, sizeof head);
    } else {
      __builtin_memset(head, 0, sizeof head);
      __builtin_memcpy(head, job.head + at, sizeof(std::uint32_t) * static_cast<std::size_t>(count));
    }
  }
  Ints nodes() const { return load<Ints>(head) & 0xFFFFF; }
  Floats transfer() const { return halfToFloat((load<Ints>(head) >> 18) & 0x3FFC); }
};

template <class Word, int kUvBits, int kConeBits>
struct CompactLinks : Heads {
  Word shape[kLanes];

  __attribute__((always_inline)) CompactLinks(const LightCachesJob& job, std::uint32_t, std::size_t at, int count) : Heads(job, at, count) {
    const Word* from = reinterpret_cast<const Word*>(job.shape) + at;
    if (count >= kLanes) {
      __builtin_memcpy(shape, from, sizeof shape);
    } else {
      __builtin_memset(shape, 0, sizeof shape);
      __builtin_memcpy(shape, from, sizeof(Word) * static_cast<std::size_t>(count));
    }
  }
  __attribute__((always_inline)) void unpack(Floats& f, Floats& c, Floats& x, Floats& y, Floats& z) const {
    typedef Word Words __attribute__((vector_size(sizeof(Word) * RELUME_LANES)));
    const Ints bits = __builtin_convertvector(load<Words>(shape), Ints);
    f = transfer();
    const Floats q = toFloats((bits >> (2 * kUvBits)) & ((1 << kConeBits) - 1));
    constexpr float kMost = static_cast<float>((1 << kConeBits) - 1);
    c = 1.0f - q * q * (2.0f / (kMost * kMost));
    unpackDirections<kUvBits>(bits, x, y, z);
  }
};
using Oct8Links = CompactLinks<std::uint32_t, 12, 8>;
using Oct6Links = CompactLinks<std::uint16_t, 6, 4>;

// oct6 links that LinkSet has packed again.
struct RepackedLinks {
  Ints word{}, transfer, node;

  __attribute__((always_inline)) RepackedLinks(const LightCachesJob& job, std::uint32_t cache, std::size_t at, int count) {
    typedef std::uint8_t Bytes __attribute__((vector_size(RELUME_LANES)));
    Bytes bytes{};
    if (count >= kLanes) {
      word = load<Ints>(job.word + at);
      bytes = load<Bytes>(job.transfer + at);
    } else {
      __builtin_memcpy(&word, job.word + at, sizeof(std::uint32_t) * static_cast<std::size_t>(count));
      __builtin_memcpy(&bytes, job.transfer + at, static_cast<std::size_t>(count));
    }
    transfer = __builtin_convertvector(bytes, Ints);
    // A step further for each place passed; lanes past the row's end name some node of the last step, and carry nothing.
    Ints lane;
    for (int i = 0; i < kLanes; ++i) lane[i] = i;
    const Ints place = lane + static_cast<std::int32_t>(at - job.rowBegin[cache]);
    node = word & 0xFFFF;
    const std::uint16_t* step = job.nodeStep + std::size_t{job.nodeSteps} * cache;
    for (std::uint32_t k = 0; k < job.nodeSteps; ++k) node -= (place >= static_cast<std::int32_t>(step[k])) << 16;
    if (count < kLanes) node &= lane < count;
  }
  Ints nodes() const { return node; }
  __attribute__((always_inline)) void unpack(Floats& f, Floats& c, Floats& x, Floats& y, Floats& z) const {
    f = halfToFloat(transfer << 6);
    const Floats q = toFloats((word >> 28) & 15);
    c = 1.0f - q * q * (2.0f / 225.0f);
    unpackDirections<6>(word >> 16, x, y, z);
  }
};

}  // namespace
}  // namespace relume::cpu
