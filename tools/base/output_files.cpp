// SPDX-License-Identifier: MIT
// See output_files.h.
#include "tools/base/output_files.h"

#include "formats/chunks.h"
#include "formats/file_io.h"

#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

namespace relume {
namespace {

namespace fs = std::filesystem;

std::string quoted(const fs::path& path) { return "\"" + path.string() + "\""; }

// A file by what it is, not by one of its names.
struct Identity {
  std::optional<std::pair<dev_t, ino_t>> node;  // nothing: no such file yet
  fs::path name;                                // links followed

  bool operator==(const Identity& other) const {
    return node && other.node ? *node == *other.node : !node && !other.node && name == other.name;
  }
};

Identity identify(const fs::path& path) {
  Identity identity;
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) identity.node.emplace(status.st_dev, status.st_ino);
  const Result<fs::path> target = followLinks(path);
  std::error_code failed;
  identity.name = fs::weakly_canonical(fs::absolute(target ? *target : path, failed), failed);
  return identity;
}

// As much of a file's beginning as its kind shows in. io: it cannot be read.
Result<std::string> beginning(const fs::path& path, std::size_t bytes) {
  std::string text(bytes, '\0');
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (file) file.read(text.data(), static_cast<std::streamsize>(bytes));
  if (!file && !file.eof())
    return Error{ErrorCode::io, quoted(path) + ": exists and cannot be read: " +
                                    std::generic_category().message(errno != 0 ? errno : EIO)};
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return text;
}

// Whether a whole file is what makeDepfile() (tools/cli/depfile.h) writes: one rule, "target: \" and a file a line, and
// one without a recipe for each of these files, but for those with a "=". A Makefile may begin in the same way.
bool isDepfile(std::string_view text) {
  const auto nextLine = [&text] {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    return line;
  };
  constexpr std::string_view kMore = " \\";
  std::string rules;
  std::string_view line = nextLine();
  if (!line.ends_with(": \\") || line.find_first_of(" \t#") == 0) return false;
  while (line.ends_with(kMore)) {
    line = nextLine();
    if (!line.starts_with("  ")) return false;
    const std::string_view file = line.substr(2, line.size() - 2 - (line.ends_with(kMore) ? kMore.size() : 0));
    if (file.empty() || file.find_first_of(" \t") == 0) return false;
    if (file.find('=') == std::string_view::npos) rules += "\n" + std::string(file) + ":\n";
  }
  return text == rules;
}

bool hasMagic(std::string_view text, const ChunkFileType& type) {
  return text.size() >= type.magic.size() && std::memcmp(text.data(), type.magic.data(), type.magic.size()) == 0;
}

// Whether a file of gzip that begins like this has a bake in it.
bool hasGzippedBake(std::string_view text) {
  constexpr int kGzipWindow = 15 + 16;
  std::array<char, kBakeFileType.magic.size()> inside{};
  z_stream stream{};
  if (inflateInit2(&stream, kGzipWindow) != Z_OK) return false;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(inside.data());
  stream.avail_out = static_cast<uInt>(inside.size());
  inflate(&stream, Z_SYNC_FLUSH);
  inflateEnd(&stream);
  return hasMagic({inside.data(), inside.size() - stream.avail_out}, kBakeFileType);
}

bool isKind(std::string_view text, FileKind kind) {
  using namespace std::string_view_literals;
  switch (kind) {
    case FileKind::bake:
      return hasMagic(text, kBakeFileType);
    case FileKind::plan:
      return hasMagic(text, kPlanFileType);
    case FileKind::shard:
      return hasMagic(text, kShardFileType);
    case FileKind::gzippedBake:
      return hasGzippedBake(text);
    case FileKind::exr:
      return text.starts_with("\x76\x2f\x31\x01"sv);
    case FileKind::png:
      return text.starts_with("\x89PNG\r\n\x1a\n"sv);
    case FileKind::bakeReport:
      return text.starts_with('{') && text.find("\"peakMemoryMiB\"") != std::string_view::npos;
    case FileKind::comparePage:
      return text.starts_with("<!doctype html>") && text.find("<title>relume compare") != std::string_view::npos;
    case FileKind::benchPage:
      return text.starts_with("# Performance\n\nWritten by `relume bench`");
    case FileKind::exportedLevel:
      // Extras of the author's may stand before it.
      return text.starts_with("glTF") && text.find("\"lightmap\":{") != std::string_view::npos &&
             text.find("\"sceneHash\":\"") != std::string_view::npos;
    case FileKind::depfile:
      return isDepfile(text);
  }
  return false;
}

const char* nameOf(FileKind kind) {
  switch (kind) {
    case FileKind::bake:
      return "a bake";
    case FileKind::plan:
      return kPlanFileType.name;
    case FileKind::shard:
      return kShardFileType.name;
    case FileKind::gzippedBake:
      return "a bake through gzip";
    case FileKind::exr:
      return "an OpenEXR image";
    case FileKind::png:
      return "a PNG image";
    case FileKind::bakeReport:
      return "a report of relume bake";
    case FileKind::comparePage:
      return "a page of relume compare";
    case FileKind::benchPage:
      return "a page of relume bench";
    case FileKind::exportedLevel:
      return "a level of relume export";
    case FileKind::depfile:
      return "a depfile";
  }
  return "";
}

// What the names of such files end in.
std::string_view extensionOf(FileKind kind) {
  switch (kind) {
    case FileKind::bake:
    case FileKind::plan:
    case FileKind::shard:
      return ".relume";
    case FileKind::gzippedBake:
      return ".gz";
    case FileKind::exr:
      return ".exr";
    case FileKind::png:
      return ".png";
    case FileKind::bakeReport:
      return ".json";
    case FileKind::comparePage:
      return ".html";
    case FileKind::benchPage:
      return ".md";
    case FileKind::exportedLevel:
      return ".glb";
    case FileKind::depfile:
      return ".d";
  }
  return "";
}

// A name that says another kind of file is one mistyped, or given to the wrong option.
Status checkName(const OutputFile& output) {
  constexpr std::string_view kKnown[] = {".relume", ".gz",   ".exr", ".png", ".json", ".html", ".md",
                                         ".glb",    ".gltf", ".hdr", ".jpg", ".jpeg", ".d"};
  const std::string found = lowerExtension(output.path);
  const std::string_view expected = extensionOf(output.kind);
  if (found == expected || std::find(std::begin(kKnown), std::end(kKnown), found) == std::end(kKnown)) return done();
  return Error{ErrorCode::usage, output.option + ": " + quoted(output.path) + " is to be " + nameOf(output.kind) +
                                     ", and its name ends in " + found + "; one that ends in " + std::string(expected) +
                                     " expected"};
}

// Files that are empty hold nothing that could be lost.
Status checkKind(const OutputFile& output) {
  // Of a depfile all that one can have.
  const std::size_t most = output.kind == FileKind::depfile ? 64 << 20 : 64 << 10;
  std::error_code failed;
  const std::uintmax_t size = fs::file_size(output.path, failed);
  if (failed || size == 0) return done();
  const Result<std::string> text = beginning(output.path, std::min<std::uintmax_t>(size, most));
  if (!text) return Error{text.error().code, output.option + ": " + text.error().message};
  if (isKind(*text, output.kind)) return done();
  return Error{ErrorCode::usage, output.option + ": " + quoted(output.path) + " exists and is not " +
                                     nameOf(output.kind) + "; choose another name, or --force to write over it"};
}

// A file that this user may not write is one that somebody keeps as it is, although a rename would replace it: version
// control takes the permission from files that are locked or not checked out. Root may write those that nobody may.
Status checkPermission(const OutputFile& output) {
  struct stat status {};
  if (::stat(output.path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return done();
  const bool isNobodys = (status.st_mode & (S_IWUSR | S_IWGRP | S_IWOTH)) == 0;
  if (!isNobodys && (::access(output.path.c_str(), W_OK) == 0 || errno != EACCES)) return done();
  return Error{ErrorCode::usage, output.option + ": " + quoted(output.path) +
                                     " exists and is read-only, as version control leaves files that are locked or "
                                     "not checked out; make it writable, or --force to write over it"};
}

// `relume ... -o a > a`: the shell has opened the file for what is printed. `-o -`: other programs print to it.
Status checkStandardStreams(const OutputFile& output) {
  if (output.path == "-")
    return Error{ErrorCode::usage, output.option +
                                       ": a file's name expected, for files are written as a whole and not to the "
                                       "standard output; found \"-\" (a file of that name is \"./-\")"};
  struct stat mine {
  }, stream{};
  if (::stat(output.path.c_str(), &mine) != 0) return done();
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO}) {
    if (::fstat(fd, &stream) != 0 || stream.st_dev != mine.st_dev || stream.st_ino != mine.st_ino) continue;
    return Error{ErrorCode::io, output.option + ": " + quoted(output.path) + " is where this command's " +
                                    (fd == STDOUT_FILENO ? "standard output" : "messages") +
                                    " goes; a file's name expected, for files are written as a whole"};
  }
  return done();
}

}  // namespace

void CommandFiles::read(std::string what, fs::path path) {
  if (!path.empty()) inputs.push_back({std::move(what), std::move(path)});
}

void CommandFiles::read(const std::string& what, const std::vector<fs::path>& paths) {
  for (const fs::path& path : paths) read(what, path);
}

void CommandFiles::write(std::string option, fs::path path, FileKind kind) {
  if (!path.empty()) outputs.push_back({std::move(option), std::move(path), kind});
}

Status checkApart(const CommandFiles& files) {
  std::vector<Identity> inputs, outputs;
  for (const InputFile& input : files.inputs) inputs.push_back(identify(input.path));
  for (const OutputFile& output : files.outputs) outputs.push_back(identify(output.path));
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const OutputFile& output = files.outputs[i];
    if (const auto same = std::find(inputs.begin(), inputs.end(), outputs[i]); same != inputs.end()) {
      const InputFile& input = files.inputs[static_cast<std::size_t>(same - inputs.begin())];
      return Error{ErrorCode::usage, output.option + ": " + quoted(output.path) + " is " + input.what +
                                         (output.path == input.path ? "" : ", " + quoted(input.path) + ",") +
                                         " and would be written over; choose another name"};
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (!(outputs[k] == outputs[i])) continue;
      const OutputFile& other = files.outputs[k];
      return Error{ErrorCode::usage, output.option + ": " + quoted(output.path) + " is what " + other.option +
                                         " writes" + (output.path == other.path ? "" : ", " + quoted(other.path)) +
                                         "; choose another name"};
    }
  }
  return done();
}

namespace {

// Whether this is what a command makes, and leaves alone where it is up to date.
bool isLeftWhereMade(FileKind kind) {
  return kind == FileKind::bake || kind == FileKind::plan || kind == FileKind::shard;
}

// checkPlace: whether an output can be written where it is asked for, before anything is said of its name and kind.
Status checkEach(const CommandFiles& files, bool mayBeMade,
                 const std::function<Status(const OutputFile&)>& checkPlace) {
  if (const Status status = checkApart(files); !status) return status;
  for (const OutputFile& output : files.outputs) {
    if (const Status status = checkStandardStreams(output); !status) return status;
    if (const Status status = checkPlace(output); !status) return status;
    if (const Status status = checkName(output); !status) return status;
    if (files.force) continue;
    if (const Status status = checkKind(output); !status) return status;
    if (mayBeMade && isLeftWhereMade(output.kind)) continue;
    if (const Status status = checkPermission(output); !status) return status;
  }
  return done();
}

}  // namespace

Status checkKinds(const CommandFiles& files) {
  return checkEach(files, true, [](const OutputFile& /*output*/) { return done(); });
}

Status checkOutputs(const CommandFiles& files, Context& context) {
  bool warned = false;
  return checkEach(files, false, [&](const OutputFile& output) {
    bool locks = true;
    const Status status = checkWritable(output.path, &locks);
    if (status && !locks && !std::exchange(warned, true))
      context.message(Severity::warning, "the file system of " + quoted(output.path) +
                                             " has no locks (flock): what killed runs leave beside it is removed "
                                             "after a day only");
    return status;
  });
}

FileKind imageKind(const fs::path& path) { return lowerExtension(path) == ".exr" ? FileKind::exr : FileKind::png; }

}  // namespace relume
