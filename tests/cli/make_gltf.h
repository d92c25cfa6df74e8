// SPDX-License-Identifier: MIT
// Writes tiny glTF files for tests: a room of quads with a camera, self-contained (data URI), with holes to break.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace relume {

inline std::string base64(const std::vector<unsigned char>& bytes) {
  static const char* kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 3; ++k) v = v << 8 | (i + k < bytes.size() ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kAlphabet[v >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

// Positions and indices of a closed box seen from inside, [0, size] each.
struct BoxRoom {
  std::vector<std::array<float, 3>> position;
  std::vector<std::uint16_t> index;
};

inline BoxRoom makeBoxRoom(float size) {
  BoxRoom room;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const auto first = static_cast<std::uint16_t>(room.position.size());
      for (int corner = 0; corner < 4; ++corner) {
        std::array<float, 3> p{};
        p[axis] = side ? size : 0.0f;
        p[(axis + 1) % 3] = (corner == 1 || corner == 2) ? size : 0.0f;
        p[(axis + 2) % 3] = corner >= 2 ? size : 0.0f;
        room.position.push_back(p);
      }
      // Fronts look inward.
      const std::array<std::uint16_t, 6> order =
          side ? std::array<std::uint16_t, 6>{0, 2, 1, 0, 3, 2} : std::array<std::uint16_t, 6>{0, 1, 2, 0, 2, 3};
      for (const std::uint16_t i : order) room.index.push_back(static_cast<std::uint16_t>(first + i));
    }
  }
  return room;
}

struct GltfParts {
  BoxRoom room = makeBoxRoom(4.0f);
  std::string nodeExtras;  // e.g. "\"extras\":{\"relume\":{\"bake\":\"ignore\"}},"
  std::string extraTop;    // e.g. "\"extensionsRequired\":[\"X\"],"
  std::string material = "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.7,0.6,0.5,1]}}";
  long indexCount = -1;  // claimed by the accessor; -1 = the truth
  long byteLength = -1;  // claimed by the buffer view of the indices; -1 = the truth
};

inline std::string makeGltf(const GltfParts& parts) {
  std::vector<unsigned char> bytes(parts.room.position.size() * 12 + parts.room.index.size() * 2);
  const std::size_t split = parts.room.position.size() * 12;
  if (split > 0) std::memcpy(bytes.data(), parts.room.position.data(), split);
  if (bytes.size() > split) std::memcpy(bytes.data() + split, parts.room.index.data(), bytes.size() - split);
  const auto text = [](auto v) { return std::to_string(v); };
  const std::string count = text(parts.indexCount >= 0 ? parts.indexCount : static_cast<long>(parts.room.index.size()));
  const std::string length = text(parts.byteLength >= 0 ? parts.byteLength : static_cast<long>(bytes.size() - split));
  return "{\"asset\":{\"version\":\"2.0\"}," + parts.extraTop +
         "\"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"name\":\"Room\"," + parts.nodeExtras +
         "\"mesh\":0},{\"name\":\"Eye\",\"camera\":0,\"translation\":[2,2,3.5]}],"
         "\"cameras\":[{\"name\":\"cam\",\"type\":\"perspective\",\"perspective\":{\"yfov\":1,\"znear\":0.1}}],"
         "\"materials\":[" +
         parts.material +
         "],"
         "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1,\"material\":0}]}],"
         "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":" +
         text(parts.room.position.size()) +
         ",\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[4,4,4]},{\"bufferView\":1,\"componentType\":5123,\"count\":" +
         count +
         ",\"type\":\"SCALAR\"}],\"bufferViews\":[{\"buffer\":0,\"byteOffset\":0,\"byteLength\":" + text(split) +
         "},{\"buffer\":0,\"byteOffset\":" + text(split) + ",\"byteLength\":" + length +
         "}],\"buffers\":[{\"byteLength\":" + text(bytes.size()) + ",\"uri\":\"data:application/octet-stream;base64," +
         base64(bytes) + "\"}]}";
}

}  // namespace relume
