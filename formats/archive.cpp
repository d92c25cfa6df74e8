// SPDX-License-Identifier: MIT
// See archive.h. Numbers are little endian and packed; a string or list is its size as u64, then its elements; each
// class is preceded, the first time it appears in a chunk, by its version as u32.
#include "formats/archive.h"

#include "formats/memory.h"

#include <cereal/cereal.hpp>
#include <cereal/types/string.hpp>

#include <bit>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

namespace relume {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little endian and used in place");

// Thrown for a class version of another writer, so that it can be told from damage.
struct UnknownVersion : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class MemoryOutput : public cereal::OutputArchive<MemoryOutput, cereal::AllowEmptyClassElision> {
 public:
  MemoryOutput() : OutputArchive(this) {}
  void append(const void* data, std::size_t size) {
    const auto* first = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), first, first + size);
  }
  std::vector<std::byte> bytes;
};

class MemoryInput : public cereal::InputArchive<MemoryInput, cereal::AllowEmptyClassElision> {
 public:
  explicit MemoryInput(std::span<const std::byte> bytes) : InputArchive(this), left_(bytes) {}
  void take(void* data, std::size_t size) {
    if (size > left_.size())
      throw cereal::Exception("ends early: " + std::to_string(size) + " bytes wanted, " + std::to_string(left_.size()) +
                              " left");
    if (size > 0) std::memcpy(data, left_.data(), size);
    left_ = left_.subspan(size);
  }
  // Refuse a list that cannot fit: each element takes at least `elementBytes`.
  void checkCount(std::uint64_t count, std::size_t elementBytes) const {
    if (count > left_.size() / elementBytes)
      throw cereal::Exception("claims " + std::to_string(count) + " elements of at least " +
                              std::to_string(elementBytes) + " bytes, " + std::to_string(left_.size()) +
                              " bytes are left");
  }
  std::size_t left() const { return left_.size(); }

 private:
  std::span<const std::byte> left_;
};

// How cereal moves numbers, raw bytes and sizes with these archives; found by argument-dependent lookup.
template <class T>
requires std::is_arithmetic_v<T>
void CEREAL_SAVE_FUNCTION_NAME(MemoryOutput& archive, const T& value) { archive.append(&value, sizeof(value)); }
template <class T>
requires std::is_arithmetic_v<T>
void CEREAL_LOAD_FUNCTION_NAME(MemoryInput& archive, T& value) { archive.take(&value, sizeof(value)); }
template <class T>
void CEREAL_SAVE_FUNCTION_NAME(MemoryOutput& archive, const cereal::BinaryData<T>& data) {
  archive.append(data.data, static_cast<std::size_t>(data.size));
}
template <class T>
void CEREAL_LOAD_FUNCTION_NAME(MemoryInput& archive, cereal::BinaryData<T>& data) {
  archive.take(data.data, static_cast<std::size_t>(data.size));
}
template <class T>
void CEREAL_SAVE_FUNCTION_NAME(MemoryOutput& archive, const cereal::SizeTag<T>& tag) {
  archive(static_cast<std::uint64_t>(tag.size));
}
template <class T>
void CEREAL_LOAD_FUNCTION_NAME(MemoryInput& archive, cereal::SizeTag<T>& tag) {
  std::uint64_t size = 0;
  archive(size);
  archive.checkCount(size, 1);
  tag.size = static_cast<std::size_t>(size);
}
template <class T>
void CEREAL_SAVE_FUNCTION_NAME(MemoryOutput& archive, const cereal::NameValuePair<T>& pair) {
  archive(pair.value);
}
template <class T>
void CEREAL_LOAD_FUNCTION_NAME(MemoryInput& archive, cereal::NameValuePair<T>& pair) {
  archive(pair.value);
}

constexpr std::uint32_t kClassVersion = 1;

void checkVersion(std::uint32_t version) {
  if (version != kClassVersion)
    throw UnknownVersion("class version " + std::to_string(version) + ", this program reads " +
                         std::to_string(kClassVersion));
}

// A list with a version of its own, so that cereal's loader for vectors, which resizes before it reads, is not used.
struct InstanceList {
  std::pmr::vector<BakedInstance> elements;
};
struct MaterialList {
  std::pmr::vector<DrivableMaterial> elements;
};

}  // namespace

// The fields, in the order of the file.
template <class Archive>
void serialize(Archive& archive, BakeScalars& s, std::uint32_t version) {
  checkVersion(version);
  archive(s.surfelAreaEach);
  archive(s.gridResolution.x, s.gridResolution.y, s.gridResolution.z);
  archive(s.gridOriginWorld.x, s.gridOriginWorld.y, s.gridOriginWorld.z);
  archive(s.gridSpacing.x, s.gridSpacing.y, s.gridSpacing.z);
  archive(s.lightmapWidth, s.lightmapHeight, s.linkKind, s.linkBands);
}

template <class Archive>
void serialize(Archive& archive, Provenance& p, std::uint32_t version) {
  checkVersion(version);
  archive(p.toolVersion, p.algorithmVersion, p.optionsJson, p.sceneHash, p.seed, p.rayTracer, p.lumaBands,
          p.chromaBands, p.viewHash, p.cameraHash);
}

namespace {

// The number of a list's elements, which take at least `minBytes` each; a list that is read gets that many.
template <class Archive, class List>
void serializeCount(Archive& archive, List& list, std::size_t minBytes) {
  std::uint64_t count = list.elements.size();
  archive(count);
  if constexpr (std::is_same_v<Archive, MemoryInput>) {
    archive.checkCount(count, minBytes);
    list.elements.resize(static_cast<std::size_t>(count));
  }
}

template <class Archive>
void serialize(Archive& archive, InstanceList& list, std::uint32_t version) {
  checkVersion(version);
  serializeCount(archive, list, 9 * sizeof(std::uint64_t));  // three sizes, five hashes and two numbers of 4
  for (BakedInstance& i : list.elements)
    archive(i.node, i.mesh, i.material, i.contentHash, i.transformHash, i.geometryHash, i.materialHash, i.topologyHash,
            i.firstShape, i.shapeCount);
}

template <class Archive>
void serialize(Archive& archive, MaterialList& list, std::uint32_t version) {
  checkVersion(version);
  serializeCount(archive, list, sizeof(std::uint64_t) + 3 * sizeof(std::uint32_t));
  constexpr std::uint32_t kMarked = 1, kTextured = 2, kClampU = 4, kClampV = 8;
  for (DrivableMaterial& m : list.elements) {
    std::uint32_t flags =
        (m.marked ? kMarked : 0) | (m.textured ? kTextured : 0) | (m.clampU ? kClampU : 0) | (m.clampV ? kClampV : 0);
    archive(m.name, m.firstEntry, m.entryCount, flags);
    if constexpr (std::is_same_v<Archive, MemoryInput>) {
      if (flags > 15) throw cereal::Exception("flags " + std::to_string(flags) + ", expected at most 15");
      m.marked = (flags & kMarked) != 0;
      m.textured = (flags & kTextured) != 0;
      m.clampU = (flags & kClampU) != 0;
      m.clampV = (flags & kClampV) != 0;
    }
  }
}

template <class T>
Result<std::vector<std::byte>> save(T value) {
  try {
    MemoryOutput archive;
    archive(value);
    return std::move(archive.bytes);
  } catch (const std::bad_alloc& e) {
    return outOfMemory(e);
  } catch (const std::exception& e) {
    return Error{ErrorCode::failed, std::string("cannot serialise: ") + e.what()};
  }
}

template <class T>
Status load(std::span<const std::byte> bytes, T& value) {
  try {
    MemoryInput archive(bytes);
    archive(value);
    if (archive.left() > 0)
      return Error{ErrorCode::invalidFile, std::to_string(archive.left()) + " bytes are left over at the end"};
    return done();
  } catch (const UnknownVersion& e) {
    return Error{ErrorCode::unsupported, e.what()};
  } catch (const std::bad_alloc& e) {
    return outOfMemory(e);
  } catch (const std::exception& e) {  // cereal::Exception, std::length_error
    return Error{ErrorCode::invalidFile, e.what()};
  }
}

}  // namespace
}  // namespace relume

CEREAL_CLASS_VERSION(relume::BakeScalars, relume::kClassVersion)
CEREAL_CLASS_VERSION(relume::Provenance, relume::kClassVersion)
CEREAL_CLASS_VERSION(relume::InstanceList, relume::kClassVersion)
CEREAL_CLASS_VERSION(relume::MaterialList, relume::kClassVersion)

namespace relume {

Result<std::vector<std::byte>> saveArchive(const BakeScalars& value) { return save(value); }
Result<std::vector<std::byte>> saveArchive(std::span<const BakedInstance> value) {
  return save(InstanceList{{value.begin(), value.end(), std::pmr::new_delete_resource()}});
}
Result<std::vector<std::byte>> saveArchive(std::span<const DrivableMaterial> value) {
  return save(MaterialList{{value.begin(), value.end(), std::pmr::new_delete_resource()}});
}
Result<std::vector<std::byte>> saveArchive(const Provenance& value) { return save(value); }

namespace {

template <class List, class T>
Status loadList(std::span<const std::byte> bytes, Array<T>& value, std::pmr::memory_resource* memory) {
  try {
    // The array's owner, in one block with its reference count. Moving a vector keeps its resource.
    const auto list =
        std::allocate_shared<List>(std::pmr::polymorphic_allocator<List>(memory), List{std::pmr::vector<T>(memory)});
    Status status = load(bytes, *list);
    if (status) value = Array<T>(list, list->elements);
    return status;
  } catch (const std::bad_alloc& e) {
    return outOfMemory(e);
  }
}

}  // namespace

Status loadArchive(std::span<const std::byte> bytes, BakeScalars& value) { return load(bytes, value); }
Status loadArchive(std::span<const std::byte> bytes, Provenance& value) { return load(bytes, value); }
Status loadArchive(std::span<const std::byte> bytes, Array<BakedInstance>& value, std::pmr::memory_resource* memory) {
  return loadList<InstanceList>(bytes, value, memory);
}
Status loadArchive(std::span<const std::byte> bytes, Array<DrivableMaterial>& value,
                   std::pmr::memory_resource* memory) {
  return loadList<MaterialList>(bytes, value, memory);
}

}  // namespace relume
