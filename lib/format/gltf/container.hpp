// What is checked before tinygltf sees a byte: it trusts chunk lengths, opens files that a uri names,
// recurses without bound, and spends kilobytes on an empty object.
#ifndef TWEEND_GLTF_CONTAINER_HPP
#define TWEEND_GLTF_CONTAINER_HPP

#include "tweend/format.h"

namespace gltf {

// A glTF file taken apart; a view of the bytes.
struct Container {
  bool binary;
  const char *json;
  size_t json_size;
  const uint8_t *bin; // nullptr when there is no BIN chunk
  size_t bin_size;
};

// Finds the chunks. Throws Refusal on lying lengths.
Container open_container(const uint8_t *bytes, size_t size);

// Checks that the JSON text is well-formed, of bounded depth, number of values and cost in memory, that
// no unknown extension is required, that every buffer is inside the file, every buffer view inside its buffer
// and every image's view exists. Throws Refusal.
void check_json(const Container &container, const tw_read_limits &limits);

} // namespace gltf

#endif
