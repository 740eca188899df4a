// The chunks of a GLB file (glTF 2.0, section 4.4), or a JSON file as it is.
#include "gltf/container.hpp"

#include <cstring>

#include "gltf/refusal.hpp"

namespace gltf {

namespace {

constexpr uint32_t chunk_json = 0x4E4F534A, chunk_bin = 0x004E4942;
constexpr size_t header_size = 12, chunk_header_size = 8;

// tinygltf takes sizes as unsigned int and image sizes as int.
constexpr uint64_t size_max = INT32_MAX;

uint32_t read_u32(const uint8_t *at) {
  return static_cast<uint32_t>(at[0]) | static_cast<uint32_t>(at[1]) << 8 |
         static_cast<uint32_t>(at[2]) << 16 | static_cast<uint32_t>(at[3]) << 24;
}

[[noreturn]] void refuse_container(const std::string &detail) {
  refuse(TW_SYNTAX, "", detail);
}

struct Chunk {
  uint32_t type;
  const uint8_t *data;
  uint64_t size, end; // end: offset in the file
};

Chunk read_chunk(const uint8_t *bytes, uint64_t length, uint64_t offset) {
  if (length - offset < chunk_header_size) refuse_container("the GLB ends inside a chunk header");
  Chunk chunk = {read_u32(bytes + offset + 4), bytes + offset + chunk_header_size, read_u32(bytes + offset),
                 0};
  if (chunk.size > length - offset - chunk_header_size)
    refuse_container(text("a GLB chunk of ", chunk.size, " bytes goes past the end of the file"));
  if (chunk.size % 4 != 0) refuse_container("the length of a GLB chunk is not a multiple of 4");
  chunk.end = offset + chunk_header_size + chunk.size;
  return chunk;
}

Container open_binary(const uint8_t *bytes, size_t size) {
  if (size < header_size + chunk_header_size) refuse_container("the GLB is too short for its headers");
  uint32_t version = read_u32(bytes + 4), length = read_u32(bytes + 8);
  if (version != 2) refuse(TW_UNSUPPORTED, "", "GLB version ", version, ": only version 2 can be read");
  if (length != size) refuse_container(text("the GLB says that it has ", length, " bytes, and has ", size));
  Chunk json = read_chunk(bytes, length, header_size);
  if (json.type != chunk_json) refuse_container("the first GLB chunk is not JSON");
  Container container = {true, reinterpret_cast<const char *>(json.data), json.size, nullptr, 0};
  if (json.end == length) return container;
  Chunk bin = read_chunk(bytes, length, json.end);
  if (bin.type != chunk_bin) refuse_container("the second GLB chunk is not BIN");
  container.bin = bin.size ? bin.data : nullptr;
  container.bin_size = bin.size;
  // Chunks of other types may follow; a reader ignores them, but they too must fit.
  for (uint64_t at = bin.end; at < length;) at = read_chunk(bytes, length, at).end;
  return container;
}

} // namespace

Container open_container(const uint8_t *bytes, size_t size) {
  if (size > size_max) refuse(TW_LIMIT, "", "glTF files over 2 GiB are not read");
  if (size >= 4 && std::memcmp(bytes, "glTF", 4) == 0) return open_binary(bytes, size);
  return {false, reinterpret_cast<const char *>(bytes), size, nullptr, 0};
}

} // namespace gltf
