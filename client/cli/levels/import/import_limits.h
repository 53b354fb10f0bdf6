// Limits of the importers. A file that exceeds a limit is refused with an error that names the limit (exceeds() in
// import_error.h). Exceptions are the limits on parts, part names, notes, texts and listed entries: beyond them, the
// result is merged or truncated as their comments say. Constants only.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::cli {

// Limits of input files. kMaxImportFileBytes limits the total size of a file and all files that it refers to.
inline constexpr uint64_t kMaxImportFileBytes = uint64_t{4} << 30;
inline constexpr size_t kMaxReferencedFiles = 256;
inline constexpr size_t kMaxReferenceBytes = 1024;                 // length of a reference that is no `data:` URI
inline constexpr size_t kMaxDataUriBytes = size_t{256} << 20;      // total length of the `data:` URIs of a file
inline constexpr size_t kMaxGltfJsonBytes = 2 * kMaxDataUriBytes;  // the JSON part of a glTF or GLB file
inline constexpr size_t kMaxGltfDepth = 64;                        // nesting of objects and lists in the JSON part
inline constexpr size_t kMaxSceneNodes = size_t{1} << 20;          // nodes of a scene
inline constexpr size_t kMaxSceneDepth = 256;                      // nesting of nodes
inline constexpr size_t kMaxSceneMeshes = size_t{1} << 20;         // meshes of a scene
inline constexpr size_t kMaxSceneMeshUses = size_t{1} << 20;       // uses of meshes by nodes

// Limits of the imported level.
inline constexpr size_t kMaxImportTriangles = size_t{1} << 27;
// Maximum number of vertices. Formats without shared vertices store three vertices for each triangle.
inline constexpr size_t kMaxImportVertices = 3 * kMaxImportTriangles;
static_assert(kMaxImportVertices <= UINT32_MAX, "a vertex number must fit an index");

// Maximum number of parts of a mesh. After this many parts, all further triangles belong to the last part.
inline constexpr size_t kMaxImportParts = 4096;
// Maximum length of a part's name in bytes; a longer name is truncated.
inline constexpr size_t kMaxPartNameBytes = 128;
// Maximum absolute value of a coordinate, equal to the server's limit for frames and coordinates.
inline constexpr double kMaxImportCoordinate = 1e9;
// Maximum number of notes and maximum length of a text (a note, an error, a name) that a child process returns; longer
// texts are truncated.
inline constexpr size_t kMaxImportNotes = 64;
inline constexpr size_t kMaxImportTextBytes = 8192;

// Limits of time and memory of the child process that reads a file. The memory limit is kImportMemoryBase +
// kImportMemoryFactor * file size, at most kMaxImportMemory. It depends on the size of the file, so that a small file
// cannot take all memory of the machine.
inline constexpr uint32_t kMaxImportSeconds = 300;
inline constexpr uint32_t kMaxImportCpuSeconds = 300;
inline constexpr uint64_t kImportMemoryBase = uint64_t{2} << 30;
inline constexpr uint64_t kImportMemoryFactor = 64;
inline constexpr uint64_t kMaxImportMemory = uint64_t{32} << 30;

// Limits of Quake 3 levels. The maximum size in bytes is thirty times the largest level that the Quake 3 compiler
// writes.
inline constexpr size_t kMaxBspBytes = size_t{256} << 20;
inline constexpr size_t kMaxBspTriangles = size_t{1} << 24;
inline constexpr int kMaxPatchSubdivisions = 64;

// Limits of archives.
inline constexpr int64_t kMaxArchiveEntries = int64_t{1} << 16;
inline constexpr size_t kMaxEntryNameBytes = 1024;
// Maximum ratio of a level's unpacked size to its packed size, for levels of more than kMinCheckedBytes unpacked bytes.
// Levels of games reach a ratio of about 10; bytes that are all equal reach about 1000.
inline constexpr uint64_t kMaxArchiveRatio = 200;
inline constexpr size_t kMinCheckedBytes = size_t{1} << 20;
// Maximum number of archive entries that a message lists, and maximum total length of their names in bytes.
inline constexpr size_t kMaxListedEntries = 64;
inline constexpr size_t kMaxListedBytes = 4096;
static_assert(kMaxBspTriangles <= kMaxImportTriangles);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_
