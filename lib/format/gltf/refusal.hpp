// How the reading side says no: an exception that stays inside lib/format/gltf and becomes a tw_error at
// its C surface.
#ifndef TWEEND_GLTF_REFUSAL_HPP
#define TWEEND_GLTF_REFUSAL_HPP

#include "tweend/base.h"

#include <sstream>
#include <string>

namespace gltf {

struct Refusal {
  tw_status status;
  std::string pointer; // RFC 6901, into the glTF document; "" where there is no place
  std::string detail;
};

// The parts one after the other, as text.
template <typename... Parts> std::string text(const Parts &...parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

// A member's name as a part of a pointer (RFC 6901).
inline std::string pointer_part(const std::string &name) {
  std::string part;
  for (char c : name) part += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return part;
}

template <typename... Parts>
[[noreturn]] void refuse(tw_status status, std::string pointer, const Parts &...parts) {
  throw Refusal{status, std::move(pointer), text(parts...)};
}

} // namespace gltf

#endif
