// SPDX-License-Identifier: MIT
// What a command reads and what it writes, and what it must not write over: its inputs, its other outputs, and files
// that are something else than what it makes. Asked before any work, and again once a scene has named its files.
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"

#include <filesystem>
#include <string>
#include <vector>

namespace relume {

// What a file is, by its first bytes; a depfile by all of them.
enum class FileKind {
  bake,           // the header's magic
  plan,           // the same
  shard,          // the same
  gzippedBake,    // the header's magic, once it is inflated
  exr,            // the magic
  png,            // the magic
  bakeReport,     // JSON of `relume bake --report`: its key "peakMemoryMiB"
  comparePage,    // HTML of `relume compare --html`: its title
  benchPage,      // Markdown of `relume bench --markdown`: its heading
  exportedLevel,  // a .glb that names the bake it belongs to (bake/export/export_level.h)
  depfile,        // rules of Make as makeDepfile() writes them, without a recipe
};

struct OutputFile {
  std::string option;  // "-o"
  std::filesystem::path path;
  FileKind kind = FileKind::bake;
};

struct InputFile {
  std::string what;  // "the scene"
  std::filesystem::path path;
};

// Paths that are empty are left out.
struct CommandFiles {
  std::vector<InputFile> inputs;
  std::vector<OutputFile> outputs;
  bool force = false;  // outputs may replace files of any kind, and read-only ones; never an input or one another

  void read(std::string what, std::filesystem::path path);
  void read(const std::string& what, const std::vector<std::filesystem::path>& paths);
  void write(std::string option, std::filesystem::path path, FileKind kind);
};

// Before any work: the files apart, each output writable and free, empty or of its own kind.
// usage: an output that is an input or another output (links followed, by device and inode; by name where nothing is
// there yet), "-", one whose name ends as files of another kind do (x.png for a bake; names that end in nothing or in
// what nobody knows say nothing), or without `force` a file of another kind or one that this user may not write; io: a
// folder, a device, a pipe, this process's standard output, a place that cannot be written, a file there that cannot be
// read. A file system without locks is told once, as a warning.
Status checkOutputs(const CommandFiles& files, Context& context);

// All of that but whether the places can be written, and whether bakes, plans and shards there are read-only, for a
// command that may find that there is nothing to write; it calls checkOutputs() before it begins.
Status checkKinds(const CommandFiles& files);

// The first half alone, for inputs that became known late.
Status checkApart(const CommandFiles& files);

// The kind of an image by its name's extension: exr, or png.
FileKind imageKind(const std::filesystem::path& path);

}  // namespace relume
